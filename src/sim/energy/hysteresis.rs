//! Bending hysteresis: dry friction inside the cloth that resists a change of its curvature.
//!
//! Kawabata's bending test (KES) finds a loop: the moment per width while loading lies above that
//! while unloading by 2HB \[N\]. Here that is an elastic-plastic element in addition to the plate
//! energy of `bending.rs`, one for the curvature along the weft and one for that along the warp,
//!
//! `M = B k + HB f(k - k_a)`, `f(u) = u/s (2 - |u|/s)` up to |u| = s, and +-1 beyond  \[N\]
//!
//! k_a is the element's anchor, its state: while the curvature is within s (the slip curvature) of
//! it the cloth grips and its moment rises from nothing to HB; beyond, it slips. Where the cloth
//! comes to rest the anchors of what slipped follow, at the distance s
//! ([`HysteresisEnergy::renew`]). So a strip bent from its anchor has the moment `B k + HB` from s
//! on, as the friction model of KES has it, and a loop from k1 to k2 and back has the area 2HB (k2
//! - k1 - 2 s): its corners are rounded.
//!
//! **Anchors are renewed at rest alone**, once a step of a continuation and at the end of a drop,
//! as plasticity is integrated; not with the plate's grips, in every step of the solver. A fall and
//! a descent overshoot, and cloth that remembered it would stay where only the solver had been.
//! Within one step each place counts as bent one way, from its anchor to where it comes to rest; a
//! drop is one step, since cloth that is let down slowly bends one way.
//!
//! f is the potential of the plate's friction (`plate.rs`; Li et al. 2020, "Incremental potential
//! contact", eq. 22): its tangent is 2 HB / s at the anchor and falls evenly to nothing where the
//! cloth slips, so that energy and Hessian have no jump there, and moving an anchor changes no
//! force. s regularises: without it flat cloth would have a force at no curvature, and no tangent.
//! The price: cloth that slipped and turns round has hardly any grip at first, until it is s back.
//! The default of 10 /m (0.1 /cm) is of the order over which measured loops turn round.
//!
//! Curvatures are `x_ab . n` (`signed.rs`), which a rigid motion keeps: cloth may fall and swing
//! with its anchors. No element is needed on the twist: a sheet that slips all over and is bent
//! about any one line has k_uu = k cos^2, k_vv = k sin^2 and so HB cos^2 + HB sin^2 = HB, for any
//! line.
//!
//! A new specimen's anchors are its natural curvature, unloaded, on every grid of a drop. So a
//! sheet that is laid where a scan has it counts as bent from flat on one way too.
//!
//! Fails: as `signed.rs` does. While cloth grips (not slips) bending about a 45 degree line meets
//! half of the stiffness 2 HB / s that bending about a yarn meets. Rate and time do not count:
//! nothing relaxes.

use super::Energy;
use super::curl;
use super::plate::{slip_drop, slip_potential, slip_slope};
use super::signed::Signed;
use super::softening::{combine, components};
use crate::base::Vector3;
use crate::sim::experiment::Experiment;
use crate::sim::grid::Grid;
use crate::sim::hessian_form::HessianForm;

/// One curvature at one place.
#[derive(Clone, Debug)]
struct Element {
    place: Signed,
    vertex: u32,
    /// 0 for the curvature along the weft, 1 for that along the warp.
    component: u8,
    /// Friction moment per width, times the area \[N m^2\].
    friction: f64,
}

/// The elements of a specimen, with their anchors.
#[derive(Clone, Debug)]
pub struct HysteresisEnergy {
    elements: Vec<Element>,
    /// Curvature along weft and warp at each vertex that friction is tied to \[1/m\].
    anchors_per_m: Vec<[f64; 2]>,
    slip_per_m: f64,
}

impl HysteresisEnergy {
    /// The elements of a specimen that has not been bent; `None` if the experiment's hysteresis is
    /// off.
    #[must_use]
    pub fn new(grid: &Grid, experiment: &Experiment) -> Option<Self> {
        let hysteresis = &experiment.hysteresis;
        if hysteresis.is_off() {
            return None;
        }
        let [weft, warp, _] = components(grid);
        let unit = grid.spacing_m.powi(-2);
        let around = grid.cells_around();
        let mut elements = Vec::new();
        let sides = [(0, weft, hysteresis.weft_n), (1, warp, hysteresis.warp_n)];
        for (v, around) in around.iter().enumerate() {
            for (component, parts, friction_n) in sides {
                if let Some(mut a) = combine(grid, v, parts, around).filter(|_| friction_n != 0.0) {
                    a.iter_mut().for_each(|(_, weight)| *weight *= unit);
                    let friction = friction_n * grid.cell_area_m2() * grid.share(v);
                    let place = Signed::at_vertex(grid, &a, v);
                    elements.push(Element { place, vertex: v as u32, component, friction });
                }
            }
        }
        let natural = |v: usize| curl::natural_at(grid, &experiment.curl, v);
        let anchors_per_m = (0..grid.vertices()).map(natural).collect();
        Some(Self { elements, anchors_per_m, slip_per_m: hysteresis.slip_per_m })
    }

    /// Takes the anchors of the elements of the same cells.
    pub fn take_anchors(&mut self, other: &Self) {
        self.anchors_per_m.clone_from(&other.anchors_per_m);
    }

    /// Takes the positions `x`, at rest, as the start of the next step: the anchors of elements
    /// that slip follow. No force changes.
    pub fn renew(&mut self, x: &[Vector3]) {
        for element in &self.elements {
            let now = element.place.at(x).part;
            let anchor = element.anchor_mut(&mut self.anchors_per_m);
            let u = now - *anchor;
            if u.abs() > self.slip_per_m {
                *anchor = now - self.slip_per_m.copysign(u);
            }
        }
    }
}

impl Energy for HysteresisEnergy {
    /// With the anchors as they are: what friction stores in the cloth's grip and what it has taken
    /// since the last renewal.
    fn energy_j(&self, _: &Grid, x: &[Vector3]) -> f64 {
        let of = |element: &Element| {
            let u = element.place.at(x).part - element.anchor(&self.anchors_per_m);
            element.friction * slip_potential(u.abs(), self.slip_per_m)
        };
        self.elements.iter().map(of).sum()
    }

    fn add_gradient(&self, _: &Grid, x: &[Vector3], gradient: &mut [Vector3]) {
        for element in &self.elements {
            let at = element.place.at(x);
            let u = at.part - element.anchor(&self.anchors_per_m);
            let slope = element.friction * slip_slope(u.abs(), self.slip_per_m) * u;
            element.place.add_gradient(&at, slope, gradient);
        }
    }

    /// The projected form leaves out the curvature of the sheet's normal.
    fn add_hessian(&self, grid: &Grid, x: &[Vector3], form: HessianForm, values: &mut [f64]) {
        let pattern = grid.analysis.pattern();
        for element in &self.elements {
            let at = element.place.at(x);
            let u = at.part - element.anchor(&self.anchors_per_m);
            let secant = slip_slope(u.abs(), self.slip_per_m);
            let tangent = (secant + slip_drop(u.abs(), self.slip_per_m)).max(0.0);
            let slope = match form {
                HessianForm::Exact => element.friction * secant * u,
                HessianForm::Projected => 0.0,
            };
            element.place.add_hessian(&at, [slope, element.friction * tangent], pattern, values);
        }
    }
}

impl Element {
    fn anchor(&self, anchors_per_m: &[[f64; 2]]) -> f64 {
        anchors_per_m[self.vertex as usize][usize::from(self.component)]
    }

    fn anchor_mut<'a>(&self, anchors_per_m: &'a mut [[f64; 2]]) -> &'a mut f64 {
        &mut anchors_per_m[self.vertex as usize][usize::from(self.component)]
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::sim::energy::difference::{cylinder, errors, flat_with_noise, grids};
    use crate::sim::experiment::{Curl, Hysteresis};

    fn experiment() -> Experiment {
        let hysteresis = Hysteresis { weft_n: 5e-4, warp_n: 8e-4, slip_per_m: 10.0 };
        let curl = Curl::uniform([3.0, -2.0, 1.0]);
        Experiment { hysteresis, curl, ..Experiment::default() }
    }

    #[test]
    fn gradient_and_hessian_are_difference_quotients_where_cloth_grips_and_where_it_slips() {
        for grid in grids() {
            let mut energy = HysteresisEnergy::new(&grid, &experiment()).unwrap();
            energy.renew(&flat_with_noise(&grid, 0.2));
            // less bent now: some hold while unloading, some have slipped back
            let x = flat_with_noise(&grid, 0.05);
            let slips = |e: &&Element| {
                (e.place.at(&x).part - e.anchor(&energy.anchors_per_m)).abs() > energy.slip_per_m
            };
            let slipping = energy.elements.iter().filter(slips).count();
            let all = energy.elements.len();
            assert!(slipping > 5 && slipping < all - 5, "{slipping} of {all}");
            let [gradient, hessian] = errors(&grid, &x, &energy);
            // observed floors 7e-10 and 5e-10
            assert!(gradient < 2e-7 && hessian < 3e-6, "{gradient:e} {hessian:e}");
        }
    }

    /// Work per area of friction on a sheet that is bent through these curvatures in small steps,
    /// anchors following, away from the border \[N/m\].
    fn work(experiment: &Experiment, degrees: f64, through: &[f64]) -> f64 {
        let of = |cells: usize| {
            let h = 2.5e-3;
            let grid = Grid::shared(cells + 1, h * cells as f64);
            let mut energy = HysteresisEnergy::new(&grid, experiment).unwrap();
            let mut work_j = 0.0;
            for leg in through.windows(2) {
                for step in 0..100 {
                    let at = |step: i32| {
                        let k = leg[0] + (leg[1] - leg[0]) * f64::from(step) / 100.0;
                        cylinder(&grid, degrees, k)
                    };
                    work_j +=
                        energy.energy_j(&grid, &at(step + 1)) - energy.energy_j(&grid, &at(step));
                    energy.renew(&at(step + 1));
                }
            }
            work_j / (h * h)
        };
        // the second difference in the size leaves out border and corners
        0.5 * (of(14) - 2.0 * of(13) + of(12))
    }

    #[test]
    fn a_loop_of_bending_costs_2hb_times_its_length_about_any_line() {
        let hb = 6e-4;
        let hysteresis = Hysteresis { weft_n: hb, warp_n: hb, slip_per_m: 1.0 };
        let experiment = Experiment { hysteresis, ..Experiment::default() };
        for (degrees, elements) in [(0.0, 1.0), (90.0, 1.0), (45.0, 2.0), (30.0, 2.0)] {
            // from flat to 40 /m, then twice to and fro
            let once = work(&experiment, degrees, &[0.0, 40.0]);
            let more = work(&experiment, degrees, &[0.0, 40.0, 0.0, 40.0, 0.0, 40.0]);
            // from its anchor an element misses a third of a slip curvature, at a turn two of them
            let from_flat = once / (hb * (40.0 - elements / 3.0)) - 1.0;
            let a_leg = 0.25 * (more - once) / (hb * (40.0 - 2.0 * elements)) - 1.0;
            println!("{degrees}: {from_flat:.1e} {a_leg:.1e}");
            assert!(from_flat.abs() < 4e-3 && a_leg.abs() < 4e-3, "{degrees}");
        }
    }

    #[test]
    fn renewing_moves_anchors_and_no_force_and_a_second_time_changes_nothing() {
        let grid = Grid::shared(7, 0.03);
        let mut energy = HysteresisEnergy::new(&grid, &experiment()).unwrap();
        let x = flat_with_noise(&grid, 0.08);
        let force = |energy: &HysteresisEnergy| {
            let mut g = vec![Vector3::zeros(); x.len()];
            energy.add_gradient(&grid, &x, &mut g);
            g
        };
        let before = force(&energy);
        let from = energy.anchors_per_m.clone();
        energy.renew(&x);
        assert!(energy.anchors_per_m != from);
        let after = force(&energy);
        let size = before.iter().map(Vector3::norm).fold(0.0, f64::max);
        let changed = before.iter().zip(&after).map(|(a, b)| (a - b).norm()).fold(0.0, f64::max);
        assert!(changed < 1e-12 * size, "{changed:e} of {size:e}");
        let once = energy.anchors_per_m.clone();
        energy.renew(&x);
        let moved = once.iter().zip(&energy.anchors_per_m);
        assert!(moved.map(|(a, b)| (a[0] - b[0]).abs()).fold(0.0, f64::max) < 1e-9);
        assert!(HysteresisEnergy::new(&grid, &Experiment::default()).is_none());
    }
}
