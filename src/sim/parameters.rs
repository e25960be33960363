//! The numbers of an experiment, a row each: what a check, a way between two experiments, a
//! sensitivity and a flag need to know of it.
//!
//! In: nothing but the fields of [`Experiment`] and of the fabric. Out: [`ROWS`], and the
//! [`Parameter`]s that drapes have sensitivities to.

mod parameter;

pub use parameter::Parameter;

use std::slice::from_mut;

use super::experiment::{
    CURL_NODES, CurvatureComponent, Experiment, ExperimentError, ExperimentFault, Outline,
};
use crate::fabric::{STIFFNESSES, TABLE_2};

/// A unit in which numbers are given.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Unit {
    /// Its name; empty for a number without one.
    pub name: &'static str,
    /// Its size in SI.
    pub in_si: f64,
    /// How many of it one SI unit is.
    pub of_si: f64,
    /// The name of the SI unit.
    pub si_name: &'static str,
    /// A change small enough for a difference of the gradient and large enough for its digits, SI.
    step: f64,
}

const RADIAN_DEG: f64 = 180.0 / std::f64::consts::PI;
const DEGREE_RAD: f64 = std::f64::consts::PI / 180.0;

impl Unit {
    const fn new(name: &'static str, sizes: [f64; 2], si_name: &'static str, step: f64) -> Self {
        Self { name, in_si: sizes[0], of_si: sizes[1], si_name, step }
    }

    /// Of a number without a unit.
    pub const NONE: Self = Self::new("", [1.0, 1.0], "", 1e-3);
    /// Of lengths.
    pub const MM: Self = Self::new("mm", [1e-3, 1e3], "m", 1e-7);
    /// Of angles.
    pub const DEGREE: Self = Self::new("deg", [DEGREE_RAD, RADIAN_DEG], "rad", 1e-5);
    /// Of curvatures.
    pub const PER_M: Self = Self::new("1/m", [1.0, 1.0], "1/m", 0.1);
    /// Of moments per width.
    pub const MN: Self = Self::new("mN", [1e-3, 1e3], "N", 1e-7);
    /// Of areal densities.
    pub const G_M2: Self = Self::new("g/m^2", [1e-3, 1e3], "kg/m^2", 1e-3);
    /// Of pressures.
    pub const PA: Self = Self::new("Pa", [1.0, 1.0], "Pa", 1e-3);
    /// Of softening, in which a moment is linear.
    const SOFTENING: Self = Self { step: 1e-6, ..Self::MM };
}

/// Numbers of an experiment that are known under one name: one, or those of a field.
type Numbers = fn(&mut Experiment) -> &mut [f64];

/// Of a width or a place: whether an experiment has the effect that it belongs to.
#[derive(Clone, Copy)]
struct Meant {
    is_on: fn(&Experiment) -> bool,
    /// Whether on the way to an experiment without the effect it stays what it is.
    stays: bool,
}

/// What is known of a number of an experiment.
#[derive(Clone, Copy)]
pub struct Row {
    /// Its name in messages.
    pub key: &'static str,
    /// The unit of its limits, and of its flag.
    pub unit: Unit,
    /// Least and largest value that can be simulated, in that unit.
    pub limits: [f64; 2],
    numbers: Numbers,
    meant: Option<Meant>,
    /// What sensitivities are to it, and its name among them.
    parameter: Option<(Parameter, &'static str)>,
}

const fn row(key: &'static str, unit: Unit, limits: [f64; 2], numbers: Numbers) -> Row {
    Row { key, unit, limits, numbers, meant: None, parameter: None }
}

impl Row {
    const fn parameter(self, parameter: Parameter, name: &'static str) -> Self {
        Self { parameter: Some((parameter, name)), ..self }
    }

    /// Without meaning where its effect is off: then that of the other experiment counts.
    const fn meant_where(self, is_on: fn(&Experiment) -> bool) -> Self {
        Self { meant: Some(Meant { is_on, stays: false }), ..self }
    }

    /// The same, and the other experiment's too where it is off there.
    const fn meant_where_either(self, is_on: fn(&Experiment) -> bool) -> Self {
        Self { meant: Some(Meant { is_on, stays: true }), ..self }
    }

    /// The row of this name.
    #[must_use]
    pub fn named(key: &str) -> Option<&'static Self> {
        ROWS.iter().find(|row| row.key == key)
    }

    /// Its numbers in an experiment, SI.
    pub fn numbers<'a>(&self, experiment: &'a mut Experiment) -> &'a mut [f64] {
        (self.numbers)(experiment)
    }

    /// Whether its off value is the least that it can have.
    fn is_one_sided(&self) -> bool {
        self.numbers(&mut Experiment::default())[0] * self.unit.of_si == self.limits[0]
    }
}

const fn is_hem(e: &Experiment) -> bool {
    e.uneven.hem.added_kg_m2 != 0.0
}

const fn is_seam(e: &Experiment) -> bool {
    e.uneven.seam.added != 0.0
}

const TURN: [f64; 2] = [-360.0, 360.0];
const PLACE: [f64; 2] = [-500.0, 500.0];
const WIDTH: [f64; 2] = [0.5, 100.0];
const CURVATURE: [f64; 2] = [-500.0, 500.0];

/// The numbers of an experiment with their limits. Not here: the specimen's outline, and up to
/// which curvature softening was measured.
pub const ROWS: [Row; 46] = {
    use Parameter as P;
    use Unit as U;
    [
        row("curl.edge", U::PER_M, CURVATURE, |e| from_mut(&mut e.curl.edge.curvature_per_m))
            .parameter(P::EdgeCurl, "curl_edge"),
        row("curl.edge_width", U::MM, WIDTH, |e| from_mut(&mut e.curl.edge.width_m))
            .meant_where(|e| e.curl.edge.curvature_per_m != 0.0),
        row("curl.line", U::PER_M, CURVATURE, |e| from_mut(&mut e.curl.line.curvature_per_m))
            .parameter(P::LineCurl, "curl_line"),
        row("curl.line_width", U::MM, WIDTH, |e| from_mut(&mut e.curl.line.width_m))
            .meant_where(|e| e.curl.line.curvature_per_m != 0.0),
        row("curl.line_angle", U::DEGREE, TURN, |e| from_mut(&mut e.curl.line.angle_rad))
            .meant_where(|e| e.curl.line.curvature_per_m != 0.0),
        row("curl.line_offset", U::MM, PLACE, |e| from_mut(&mut e.curl.line.offset_m))
            .meant_where(|e| e.curl.line.curvature_per_m != 0.0),
        row("curl.cross_line", U::PER_M, CURVATURE, |e| {
            from_mut(&mut e.curl.cross_line.curvature_per_m)
        })
        .parameter(P::CrossLineCurl, "curl_cross_line"),
        row("curl.cross_line_width", U::MM, WIDTH, |e| from_mut(&mut e.curl.cross_line.width_m))
            .meant_where(|e| e.curl.cross_line.curvature_per_m != 0.0),
        row("curl.cross_line_angle", U::DEGREE, TURN, |e| {
            from_mut(&mut e.curl.cross_line.angle_rad)
        })
        .meant_where(|e| e.curl.cross_line.curvature_per_m != 0.0),
        row("curl.cross_line_offset", U::MM, PLACE, |e| from_mut(&mut e.curl.cross_line.offset_m))
            .meant_where(|e| e.curl.cross_line.curvature_per_m != 0.0),
        row("softening.weft", U::SOFTENING, [0.0, 100.0], |e| from_mut(&mut e.softening.weft_m))
            .parameter(P::SofteningWeft, "softening_weft"),
        row("softening.warp", U::SOFTENING, [0.0, 100.0], |e| from_mut(&mut e.softening.warp_m))
            .parameter(P::SofteningWarp, "softening_warp"),
        row("softening.bias", U::SOFTENING, [0.0, 100.0], |e| from_mut(&mut e.softening.bias_m))
            .parameter(P::SofteningBias, "softening_bias"),
        row("asymmetric_bending.weft", U::NONE, [-0.8, 0.8], |e| {
            from_mut(&mut e.asymmetric_bending.weft)
        })
        .parameter(P::AsymmetryWeft, "asymmetry_weft"),
        row("asymmetric_bending.warp", U::NONE, [-0.8, 0.8], |e| {
            from_mut(&mut e.asymmetric_bending.warp)
        })
        .parameter(P::AsymmetryWarp, "asymmetry_warp"),
        row("hysteresis.weft", U::MN, [0.0, 20.0], |e| from_mut(&mut e.hysteresis.weft_n))
            .parameter(P::HysteresisWeft, "hysteresis_weft"),
        row("hysteresis.warp", U::MN, [0.0, 20.0], |e| from_mut(&mut e.hysteresis.warp_n))
            .parameter(P::HysteresisWarp, "hysteresis_warp"),
        row("hysteresis.slip", U::PER_M, [1.0, 100.0], |e| from_mut(&mut e.hysteresis.slip_per_m))
            .meant_where(|e| !e.hysteresis.is_off()),
        row("tilt.down_x", U::DEGREE, [-60.0, 60.0], |e| from_mut(&mut e.tilt.down_x_rad))
            .parameter(P::TiltX, "tilt_down_x"),
        row("tilt.down_z", U::DEGREE, [-60.0, 60.0], |e| from_mut(&mut e.tilt.down_z_rad))
            .parameter(P::TiltZ, "tilt_down_z"),
        row("specimen.offset_x", U::MM, [-100.0, 100.0], |e| from_mut(&mut e.specimen.offset_m[0]))
            .parameter(P::OffsetX, "offset_x"),
        row("specimen.offset_z", U::MM, [-100.0, 100.0], |e| from_mut(&mut e.specimen.offset_m[1]))
            .parameter(P::OffsetZ, "offset_z"),
        row("specimen.rotation", U::DEGREE, TURN, |e| from_mut(&mut e.specimen.rotation_rad))
            .parameter(P::Rotation, "rotation"),
        row("plate.radius", U::MM, [5.0, 500.0], |e| from_mut(&mut e.plate.radius_m))
            .parameter(P::PlateRadius, "plate_radius"),
        // and no more than the plate's radius
        row("plate.edge_radius", U::MM, [0.5, 500.0], |e| from_mut(&mut e.plate.edge_radius_m))
            .parameter(P::EdgeRadius, "plate_edge_radius"),
        row("plate.friction", U::NONE, [0.0, 5.0], |e| from_mut(&mut e.plate.friction))
            .parameter(P::Friction, "friction"),
        row("specimen.warp", U::MM, [20.0, 1000.0], |e| from_mut(&mut e.specimen.warp_m))
            .parameter(P::Warp, "specimen_warp"),
        row("specimen.weft", U::MM, [20.0, 1000.0], |e| from_mut(&mut e.specimen.weft_m))
            .parameter(P::Weft, "specimen_weft"),
        row("specimen.skew", U::DEGREE, [-30.0, 30.0], |e| from_mut(&mut e.specimen.skew_rad))
            .parameter(P::Skew, "specimen_skew"),
        row("plate.gap", U::MM, [0.05, 5.0], |e| from_mut(&mut e.plate.gap_m)),
        row("plate.slip", U::MM, [1e-3, 5.0], |e| from_mut(&mut e.plate.slip_m)),
        row("fold_correction", U::NONE, [0.0, 1.0], |e| from_mut(&mut e.fold_correction)),
        row("uneven.hem", U::G_M2, [0.0, 5000.0], |e| from_mut(&mut e.uneven.hem.added_kg_m2)),
        row("uneven.hem_width", U::MM, [0.5, 1000.0], |e| from_mut(&mut e.uneven.hem.width_m))
            .meant_where_either(is_hem),
        row("uneven.hem_toward", U::DEGREE, TURN, |e| from_mut(&mut e.uneven.hem.toward_rad))
            .meant_where_either(is_hem),
        row("uneven.seam", U::NONE, [0.0, 100.0], |e| from_mut(&mut e.uneven.seam.added)),
        row("uneven.seam_width", U::MM, WIDTH, |e| from_mut(&mut e.uneven.seam.width_m))
            .meant_where_either(is_seam),
        row("uneven.seam_toward", U::DEGREE, TURN, |e| from_mut(&mut e.uneven.seam.toward_rad))
            .meant_where_either(is_seam),
        row("uneven.seam_offset", U::MM, PLACE, |e| from_mut(&mut e.uneven.seam.offset_m))
            .meant_where_either(is_seam),
        row("uneven.gradient", U::NONE, [-2.0, 2.0], |e| {
            from_mut(&mut e.uneven.gradient.ln_factor)
        }),
        row("uneven.gradient_toward", U::DEGREE, TURN, |e| {
            from_mut(&mut e.uneven.gradient.toward_rad)
        })
        .meant_where_either(|e| e.uneven.gradient.ln_factor != 0.0),
        row("uneven.draught", U::PA, [0.0, 20.0], |e| from_mut(&mut e.uneven.draught.pressure_pa)),
        row("uneven.draught_toward", U::DEGREE, TURN, |e| {
            from_mut(&mut e.uneven.draught.toward_rad)
        })
        .meant_where_either(|e| e.uneven.draught.pressure_pa != 0.0),
        row("curl", U::PER_M, CURVATURE, |e| e.curl.nodes.as_flattened_mut().as_flattened_mut()),
        row("uneven.weight", U::NONE, [-0.9, 10.0], |e| e.uneven.weight.nodes.as_flattened_mut()),
        row("uneven.ln_bending", U::NONE, [-3.0, 3.0], |e| {
            e.uneven.ln_bending.nodes.as_flattened_mut()
        }),
    ]
};

impl Experiment {
    /// Checks that the experiment can be simulated.
    ///
    /// # Errors
    /// All faults at once: numbers that are not finite or outside their limits, a disc that is not
    /// cut from a square, and a specimen that falls off the plate.
    pub fn check(&self) -> Result<(), ExperimentError> {
        let mut own = *self;
        let mut faults = Vec::new();
        for row in &ROWS {
            let Row { key, unit, limits: [least, mut most], .. } = *row;
            if key == "plate.edge_radius" {
                most = self.plate.radius_m * 1e3;
            }
            let values = row.numbers(&mut own).iter().map(|number| number * unit.of_si);
            let outside = values.filter(|value| !(least..=most).contains(value));
            faults.extend(outside.map(|value| ExperimentFault::Outside {
                key,
                value,
                least,
                most,
                unit: unit.name,
            }));
        }
        let (s, p) = (&self.specimen, &self.plate);
        if s.outline == Outline::Disc && (s.warp_m != s.weft_m || s.skew_rad != 0.0) {
            let (warp_mm, weft_mm) = (s.warp_m * 1e3, s.weft_m * 1e3);
            let skew_deg = s.skew_rad.to_degrees();
            faults.push(ExperimentFault::NoDisc { warp_mm, weft_mm, skew_deg });
        }
        let distance_m = s.offset_m[0].hypot(s.offset_m[1]);
        if distance_m >= p.radius_m {
            let (distance_mm, radius_mm) = (distance_m * 1e3, p.radius_m * 1e3);
            faults.push(ExperimentFault::FallsOff { distance_mm, radius_mm });
        }
        if faults.is_empty() { Ok(()) } else { Err(ExperimentError { faults }) }
    }

    /// The experiment at the fraction `t` of the way from this one to `other`: every number runs
    /// evenly. Outline and what softening was measured up to are the other's.
    #[must_use]
    pub fn between(&self, other: &Self, t: f64) -> Self {
        let at = |a: f64, b: f64| if a == b { a } else { a + (b - a) * t };
        let (mut from, mut to, mut between) = (*self, *other, *other);
        for row in &ROWS {
            let is_on = |e: &Self| row.meant.is_none_or(|meant| (meant.is_on)(e));
            let (starts, ends) = (is_on(self), is_on(other));
            let stays = !ends && row.meant.is_some_and(|meant| meant.stays);
            let ends = row.numbers(&mut to).iter();
            let both = row.numbers(&mut from).iter().zip(ends);
            for (number, (&a, &b)) in row.numbers(&mut between).iter_mut().zip(both) {
                *number = match (stays, starts) {
                    (true, _) => a,
                    (false, true) => at(a, b),
                    (false, false) => b,
                };
            }
        }
        between
    }
}

impl Parameter {
    /// All parameters but the single nodes of fields, the pull of a hold and the place of ties: the
    /// fabric's, natural curvatures, and those of [`ROWS`].
    pub const ALL: [Self; 31] = {
        let mut all = [Self::Density; 31];
        let mut k = 0;
        while k < STIFFNESSES {
            all[k] = Self::STIFFNESSES[k];
            k += 1;
        }
        all[7] = Self::Curl(CurvatureComponent::Weft);
        all[8] = Self::Curl(CurvatureComponent::Warp);
        all[9] = Self::Curl(CurvatureComponent::Twist);
        let (mut next, mut k) = (10, 0);
        while k < ROWS.len() {
            if let Some((parameter, _)) = ROWS[k].parameter {
                all[next] = parameter;
                next += 1;
            }
            k += 1;
        }
        all
    };

    /// The row of its numbers; none of the fabric's, the pull and the ties.
    pub(super) fn row(self) -> Option<&'static Row> {
        match self {
            Self::Curl(_) | Self::CurlNode { .. } => Row::named("curl"),
            Self::WeightNode { .. } => Row::named("uneven.weight"),
            Self::BendingNode { .. } => Row::named("uneven.ln_bending"),
            one => ROWS.iter().find(|row| row.parameter.is_some_and(|(own, _)| own == one)),
        }
    }

    /// Whether it is the number at this place of its row.
    pub(super) fn is_number(self, place: usize) -> bool {
        match self {
            Self::Curl(component) => place % 3 == component as usize,
            Self::CurlNode { warp, weft, component } => {
                place == (warp * CURL_NODES + weft) * 3 + component as usize
            }
            Self::WeightNode { warp, weft } | Self::BendingNode { warp, weft } => {
                place == warp * CURL_NODES + weft
            }
            _ => true,
        }
    }

    /// Name of the parameter, as it stands in tables.
    #[must_use]
    pub fn name(self) -> String {
        match self {
            Self::Curl(component) => format!("curl_{}", component.name()),
            Self::CurlNode { warp, weft, component } => {
                format!("curl_{}_{warp}_{weft}", component.name())
            }
            Self::WeightNode { warp, weft } => format!("weight_{warp}_{weft}"),
            Self::BendingNode { warp, weft } => format!("ln_bending_{warp}_{weft}"),
            Self::Pull => "pull".to_owned(),
            Self::TiesX => "ties_x".to_owned(),
            Self::TiesZ => "ties_z".to_owned(),
            one => {
                let own = one.row().and_then(|row| row.parameter);
                let name = own.map_or_else(
                    || one.of_fabric().map_or("", |k| TABLE_2[k].key),
                    |(_, name)| name,
                );
                name.to_owned()
            }
        }
    }

    /// The unit of its row.
    #[must_use]
    pub fn given_in(self) -> Unit {
        self.row().map_or(Unit::NONE, |row| row.unit)
    }

    /// SI unit of the parameter; empty for a number without one.
    #[must_use]
    pub fn unit(self) -> &'static str {
        match (self.of_fabric(), self.row()) {
            (Some(0..3), _) => "N/m",
            (Some(3..6), _) => "N m",
            (Some(_), _) => "kg/m^2",
            (None, row) => row.map_or("m", |row| row.unit.si_name),
        }
    }

    /// A change small enough for a difference of the gradient and large enough for its digits;
    /// `fabric` in SI, in the paper's order.
    pub(super) fn step(self, fabric: &[f64; 7]) -> f64 {
        let of_row = || self.row().map_or(Unit::MM.step, |row| row.unit.step);
        self.of_fabric().map_or_else(of_row, |k| 1e-3 * fabric[k])
    }

    /// Whether it is changed to one side alone: its off value is the least that it can have.
    pub(super) fn is_one_sided(self) -> bool {
        self.row().is_some_and(Row::is_one_sided)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn every_row_has_its_own_name_and_its_own_numbers() {
        let mut all = Experiment::default();
        for (k, row) in ROWS.iter().enumerate() {
            assert!(ROWS[..k].iter().all(|before| before.key != row.key), "{}", row.key);
            row.numbers(&mut all).fill(k as f64);
        }
        for (k, row) in ROWS.iter().enumerate() {
            assert!(row.numbers(&mut all).iter().all(|&own| own == k as f64), "{}", row.key);
        }
    }

    #[test]
    fn softening_and_hysteresis_alone_are_changed_to_one_side() {
        let one_sided = Parameter::ALL.into_iter().filter(|p| p.is_one_sided());
        let names: Vec<_> = one_sided.map(Parameter::name).collect();
        let both = ["softening_weft", "softening_warp", "softening_bias"];
        assert_eq!(names[..3], both);
        assert_eq!(names[3..], ["hysteresis_weft", "hysteresis_warp"]);
    }
}
