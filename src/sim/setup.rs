//! What a drape is of: a fabric in an experiment, and what lies between two of them.

use crate::fabric::Fabric;
use crate::sim::experiment::{
    AsymmetricBending, Curl, EdgeCurl, Experiment, Hysteresis, Softening, Specimen, Tilt,
};
use crate::sim::plate::Plate;

/// A fabric and the experiment that it is draped in.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Setup {
    /// The fabric.
    pub fabric: Fabric,
    /// The experiment.
    pub experiment: Experiment,
}

impl Setup {
    /// The setup at the fraction `t` of the way from this one to `other`: the fabric's seven
    /// numbers run evenly in their logarithms, the experiment's as they are. With 0 and 1 it is
    /// one of the two, to the bit.
    #[must_use]
    pub fn between(&self, other: &Self, t: f64) -> Self {
        if t <= 0.0 {
            return *self;
        }
        if t >= 1.0 {
            return *other;
        }
        let (from, to) = (self.fabric.in_si(), other.fabric.in_si());
        let fabric = std::array::from_fn(|k| from[k] * (to[k] / from[k]).powf(t));
        Self {
            fabric: Fabric::from_si(fabric),
            experiment: experiment_between(&self.experiment, &other.experiment, t),
        }
    }

    /// How far apart two fabrics are: the root mean square of the differences of the seven
    /// logarithms.
    #[must_use]
    pub fn log_distance(&self, other: &Self) -> f64 {
        let pairs = self.fabric.in_si().into_iter().zip(other.fabric.in_si());
        let squares: f64 = pairs.map(|(a, b)| (b / a).ln().powi(2)).sum();
        (squares / 7.0).sqrt()
    }
}

fn experiment_between(from: &Experiment, to: &Experiment, t: f64) -> Experiment {
    let at = |a: f64, b: f64| if a == b { a } else { a + (b - a) * t };
    let (s, p) = (from.specimen, from.plate);
    let (asymmetric, hysteresis) = (from.asymmetric_bending, from.hysteresis);
    // hysteresis that is off has a slip curvature of no meaning
    let slip_per_m =
        if hysteresis.is_off() { to.hysteresis.slip_per_m } else { hysteresis.slip_per_m };
    Experiment {
        specimen: Specimen {
            outline: to.specimen.outline,
            warp_m: at(s.warp_m, to.specimen.warp_m),
            weft_m: at(s.weft_m, to.specimen.weft_m),
            skew_rad: at(s.skew_rad, to.specimen.skew_rad),
            offset_m: [0, 1].map(|k| at(s.offset_m[k], to.specimen.offset_m[k])),
            rotation_rad: at(s.rotation_rad, to.specimen.rotation_rad),
        },
        plate: Plate {
            radius_m: at(p.radius_m, to.plate.radius_m),
            edge_radius_m: at(p.edge_radius_m, to.plate.edge_radius_m),
            gap_m: at(p.gap_m, to.plate.gap_m),
            friction: at(p.friction, to.plate.friction),
            slip_m: at(p.slip_m, to.plate.slip_m),
        },
        tilt: Tilt {
            down_x_rad: at(from.tilt.down_x_rad, to.tilt.down_x_rad),
            down_z_rad: at(from.tilt.down_z_rad, to.tilt.down_z_rad),
        },
        curl: curl_between(&from.curl, &to.curl, t),
        softening: Softening {
            weft_m: at(from.softening.weft_m, to.softening.weft_m),
            warp_m: at(from.softening.warp_m, to.softening.warp_m),
            bias_m: at(from.softening.bias_m, to.softening.bias_m),
            measured_to_per_m: to.softening.measured_to_per_m,
        },
        asymmetric_bending: AsymmetricBending {
            weft: at(asymmetric.weft, to.asymmetric_bending.weft),
            warp: at(asymmetric.warp, to.asymmetric_bending.warp),
        },
        hysteresis: Hysteresis {
            weft_n: at(hysteresis.weft_n, to.hysteresis.weft_n),
            warp_n: at(hysteresis.warp_n, to.hysteresis.warp_n),
            slip_per_m: at(slip_per_m, to.hysteresis.slip_per_m),
        },
        uneven: from.uneven.between(&to.uneven, t),
        fold_correction: at(from.fold_correction, to.fold_correction),
    }
}

fn curl_between(from: &Curl, to: &Curl, t: f64) -> Curl {
    let at = |a: f64, b: f64| if a == b { a } else { a + (b - a) * t };
    let mut nodes = from.nodes;
    let targets = to.nodes.iter().flatten().flatten();
    for (node, target) in nodes.iter_mut().flatten().flatten().zip(targets) {
        *node = at(*node, *target);
    }
    // a curl that is off has a place and a width of no meaning: those of the other
    let edge = from.edge;
    let edge_width_m = if edge.curvature_per_m == 0.0 { to.edge.width_m } else { edge.width_m };
    Curl {
        nodes,
        edge: EdgeCurl {
            curvature_per_m: at(edge.curvature_per_m, to.edge.curvature_per_m),
            width_m: at(edge_width_m, to.edge.width_m),
        },
        line: from.line.between(&to.line, t),
        cross_line: from.cross_line.between(&to.cross_line, t),
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn halfway_between_two_setups_is_the_mean_of_every_number() {
        let soft = Setup { fabric: Fabric::mean_knit(), experiment: Experiment::default() };
        let stiff = Fabric::from_si(soft.fabric.in_si().map(|v| 4.0 * v));
        let mut experiment = Experiment::default();
        experiment.plate.radius_m += 2e-3;
        experiment.tilt.down_x_rad = 0.02;
        experiment.curl.nodes[1][2][0] = 8.0;
        experiment.curl.edge.curvature_per_m = 10.0;
        experiment.specimen.offset_m = [1e-3, -2e-3];
        experiment.asymmetric_bending.warp = 0.4;
        experiment.hysteresis.weft_n = 2e-4;
        experiment.hysteresis.slip_per_m = 6.0;
        let other = Setup { fabric: stiff, experiment };
        let half = soft.between(&other, 0.5);
        for (a, b) in half.fabric.in_si().into_iter().zip(soft.fabric.in_si()) {
            assert!((a / b - 2.0).abs() < 1e-12);
        }
        let e = half.experiment;
        assert!((e.plate.radius_m - 0.051).abs() < 1e-15);
        assert!((e.tilt.down_x_rad - 0.01).abs() < 1e-15);
        assert!((e.curl.nodes[1][2][0] - 4.0).abs() < 1e-12);
        assert!((e.curl.edge.curvature_per_m - 5.0).abs() < 1e-12);
        assert_eq!(e.specimen.offset_m, [0.5e-3, -1e-3]);
        assert_eq!(e.asymmetric_bending, AsymmetricBending { warp: 0.2, ..Default::default() });
        // what is off has the slip curvature of the other
        assert_eq!(e.hysteresis, Hysteresis { weft_n: 1e-4, warp_n: 0.0, slip_per_m: 6.0 });
        assert_eq!(soft.between(&other, 0.0), soft);
        assert_eq!(soft.between(&other, 1.0), other);
        assert!((soft.log_distance(&other) - 4.0_f64.ln()).abs() < 1e-12);
    }
}
