//! Masses, bending and loads of a drape whose parts are unlike
//! ([`Uneven`](crate::sim::experiment::Uneven)).
//!
//! In: a grid and an experiment. Out: at each vertex the mass that a hem or a field of weight adds
//! \[kg\], the factor of the plate energy of `energy/bending.rs`, the horizontal load of a draught
//! \[N\]. Borders of a hem and of a draught rise over one mean cell.
//!
//! The factor is that of the linear plate energy alone: natural curvature, softening, asymmetry and
//! friction in the cloth act as on even cloth.

use crate::base::Vector3;
use crate::sim::experiment::Experiment;
use crate::sim::grid::Grid;

/// Adds what a hem and the field of weight weigh to the mass of each vertex of even cloth \[kg\].
pub(super) fn add_weight(grid: &Grid, experiment: &Experiment, mass_kg: &mut [f64]) {
    let weight = experiment.uneven.weight;
    if !weight.is_off() {
        for (v, mass) in mass_kg.iter_mut().enumerate() {
            let [warp, weft] = fractions(grid, experiment, v);
            *mass *= 1.0 + weight.at(warp, weft);
        }
    }
    let hem = experiment.uneven.hem;
    if hem.added_kg_m2 == 0.0 {
        return;
    }
    let last_m = experiment.specimen.reach_m(hem.toward_rad);
    let added_kg = hem.added_kg_m2 * grid.cell_area_m2();
    for (v, mass) in mass_kg.iter_mut().enumerate() {
        let from_last_m = last_m - along_m(&grid.flat(v), hem.toward_rad);
        *mass += added_kg * grid.share(v) * risen(hem.width_m - from_last_m, grid.spacing_m);
    }
}

/// Factor of the plate energy at a vertex: 1 on even cloth.
pub(super) fn bending_factor(grid: &Grid, experiment: &Experiment, vertex: usize) -> f64 {
    let (seam, gradient) = (experiment.uneven.seam, experiment.uneven.gradient);
    let mut factor = 1.0;
    if !experiment.uneven.ln_bending.is_off() {
        let [warp, weft] = fractions(grid, experiment, vertex);
        factor *= experiment.uneven.ln_bending.at(warp, weft).exp();
    }
    if seam.added != 0.0 {
        let off_m = along_m(&grid.flat(vertex), seam.toward_rad) - seam.offset_m;
        factor *= 1.0 + seam.added * (1.0 - off_m.abs() / seam.width_m).max(0.0);
    }
    if gradient.ln_factor != 0.0 {
        let last_m = experiment.specimen.reach_m(gradient.toward_rad);
        let along_m = along_m(&grid.flat(vertex), gradient.toward_rad);
        factor *= (gradient.ln_factor * along_m / last_m).exp();
    }
    factor
}

/// Where a vertex lies on the flat specimen, as fractions of its sides along warp and weft.
fn fractions(grid: &Grid, experiment: &Experiment, vertex: usize) -> [f64; 2] {
    let (specimen, flat) = (&experiment.specimen, grid.flat(vertex));
    [flat.x / specimen.warp_m + 0.5, flat.z / specimen.weft_m + 0.5]
}

/// The load of a draught on each vertex \[N\]; empty where there is none.
pub(super) fn draught_n(grid: &Grid, experiment: &Experiment) -> Vec<Vector3> {
    let draught = experiment.uneven.draught;
    if draught.pressure_pa == 0.0 {
        return Vec::new();
    }
    let (sin, cos) = draught.toward_rad.sin_cos();
    let cell_n = Vector3::new(cos, 0.0, sin) * (draught.pressure_pa * grid.cell_area_m2());
    let load = |v: usize| {
        let place = experiment.specimen.place(grid.flat(v));
        let windward = risen(-along_m(&place, draught.toward_rad), grid.spacing_m);
        let out_m = place.x.hypot(place.z) - experiment.plate.radius_m;
        cell_n * (grid.share(v) * windward * risen(out_m, grid.spacing_m))
    };
    (0..grid.vertices()).map(load).collect()
}

/// Distance of a place in the plan from the origin along a bearing \[m\].
fn along_m(place: &Vector3, toward_rad: f64) -> f64 {
    let (sin, cos) = toward_rad.sin_cos();
    place.x * cos + place.z * sin
}

/// 0 to 1 as a distance crosses zero, over one cell.
fn risen(distance_m: f64, cell_m: f64) -> f64 {
    (distance_m / cell_m + 0.5).clamp(0.0, 1.0)
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::base::frame::GRAVITY_M_S2;
    use crate::fabric::Fabric;
    use crate::sim::experiment::{
        AsymmetricBending, Curl, Draught, EdgeCurl, Hem, LineCurl, Seam, StiffnessGradient,
    };
    use crate::sim::model::Model;
    use crate::sim::{Drop, SimOptions, Stop, drape};

    fn cusick(change: impl FnOnce(&mut Experiment)) -> Experiment {
        let mut experiment = Experiment::standard_cusick();
        change(&mut experiment);
        experiment
    }

    fn model_of(fabric: &Fabric, experiment: &Experiment) -> Model {
        Model::new(&Grid::of(&experiment.specimen, 31), fabric, experiment, 0.2)
    }

    /// A flat bowl with waves that have no symmetry.
    fn bent(grid: &Grid) -> Vec<Vector3> {
        let at = |v: usize| {
            let p = grid.flat(v);
            let wave = 0.5e-3 * (40.0 * p.x + 17.0 * p.z).sin() + 0.3e-3 * (60.0 * p.z).cos();
            Vector3::new(p.x, wave - 0.1 * p.norm_squared(), p.z)
        };
        (0..grid.vertices()).map(at).collect()
    }

    #[test]
    fn a_hem_all_over_is_a_denser_cloth() {
        let fabric = Fabric::mean_knit();
        let hem = Hem { added_kg_m2: 0.1, width_m: 0.4, toward_rad: 0.3 };
        let hemmed = model_of(&fabric, &cusick(|e| e.uneven.hem = hem));
        let denser = Fabric { density_kg_m2: fabric.density_kg_m2 + 0.1, ..fabric };
        let denser = model_of(&denser, &Experiment::standard_cusick());
        for (a, b) in hemmed.weight.mass_kg.iter().zip(&denser.weight.mass_kg) {
            assert!((a - b).abs() < 1e-15, "{a:e} {b:e}");
        }
    }

    #[test]
    fn fields_all_over_are_another_cloth_and_at_one_node_act_there() {
        let fabric = Fabric::mean_knit();
        let of = |e: &dyn Fn(&mut Experiment)| model_of(&fabric, &cusick(e));
        let even = model_of(&fabric, &Experiment::standard_cusick());
        let x = bent(&even.grid);
        let weights: f64 =
            x.iter().zip(&even.weight.mass_kg).map(|(p, m)| m * GRAVITY_M_S2 * p.y).sum();
        let heavier = of(&|e| e.uneven.weight.nodes = [[0.25; 5]; 5]);
        let more = heavier.body_energy_j(&x) - even.body_energy_j(&x);
        assert!((more / weights - 0.25).abs() < 1e-9, "{more:e} {weights:e}");
        let stiffer = of(&|e| e.uneven.ln_bending.nodes = [[0.4; 5]; 5]);
        let bent_more = stiffer.body_energy_j(&x) - even.body_energy_j(&x);
        let twice = [fabric.bending_weft_nm, fabric.bending_warp_nm, fabric.bending_bias_nm];
        let [bending_weft_nm, bending_warp_nm, bending_bias_nm] = twice.map(|b| 2.0 * b);
        let doubled = Fabric { bending_weft_nm, bending_warp_nm, bending_bias_nm, ..fabric };
        let bending = model_of(&doubled, &Experiment::standard_cusick()).body_energy_j(&x)
            - even.body_energy_j(&x);
        assert!((bent_more / bending / 0.4_f64.exp_m1() - 1.0).abs() < 1e-9, "{bent_more:e}");
        // one node: nothing beyond its neighbours
        let spot = of(&|e| e.uneven.weight.nodes[3][1] = 0.5);
        for (v, (own, plain)) in spot.weight.mass_kg.iter().zip(&even.weight.mass_kg).enumerate() {
            let p = even.grid.flat(v);
            let near = (p.x - 0.075).abs() < 0.075 - 1e-9 && (p.z + 0.075).abs() < 0.075 - 1e-9;
            assert!((own > plain) == (near && *plain > 0.0), "{p}");
        }
    }

    #[test]
    fn a_hem_weighs_its_area_times_its_density() {
        let (fabric, radius, width) = (Fabric::mean_knit(), 0.15_f64, 0.02_f64);
        let plain = model_of(&fabric, &Experiment::standard_cusick());
        let whole: f64 = plain.weight.mass_kg.iter().sum();
        let half_angle = ((radius - width) / radius).acos();
        let area = radius * radius * (half_angle - half_angle.sin() * half_angle.cos());
        for toward_rad in [0.0, 0.9, -2.5] {
            let hem = Hem { added_kg_m2: 0.2, width_m: width, toward_rad };
            let hemmed = model_of(&fabric, &cusick(|e| e.uneven.hem = hem));
            let added = hemmed.weight.mass_kg.iter().sum::<f64>() - whole;
            // cells of 10 mm, half the hem's width: observed 2.2 to 2.9 % off
            assert!((added / (0.2 * area) - 1.0).abs() < 0.04, "{toward_rad}: {added:e}");
        }
    }

    #[test]
    fn a_draught_is_a_force_on_half_of_the_overhang_and_the_gradient_of_its_energy() {
        let draught = Draught { pressure_pa: 0.3, toward_rad: 0.8 };
        let experiment = cusick(|e| e.uneven.draught = draught);
        let (fabric, still) = (Fabric::mean_knit(), Experiment::standard_cusick());
        let (windy, still) = (model_of(&fabric, &experiment), model_of(&fabric, &still));
        let x = bent(&windy.grid);
        let gradient = |model: &Model, x: &[Vector3]| {
            let mut g = vec![Vector3::zeros(); x.len()];
            model.gradient(x, &mut g);
            g
        };
        let (g, plain) = (gradient(&windy, &x), gradient(&still, &x));
        let force: Vector3 = plain.iter().zip(&g).map(|(a, b)| a - b).sum();
        let area = 0.5 * std::f64::consts::PI * (0.15_f64.powi(2) - 0.09_f64.powi(2));
        let expected = Vector3::new(0.8_f64.cos(), 0.0, 0.8_f64.sin()) * (0.3 * area);
        // the borders rise over cells of 10 mm; observed 0.1 %
        assert!((force - expected).norm() < 0.01 * expected.norm(), "{force} {expected}");
        // a move of the whole sheet does that force's work
        let moved: Vec<_> = x.iter().map(|p| p + Vector3::new(1e-3, 0.0, 2e-3)).collect();
        let work = |x: &[Vector3]| still.body_energy_j(x) - windy.body_energy_j(x);
        let done = work(&moved) - work(&x);
        assert!((done / force.dot(&Vector3::new(1e-3, 0.0, 2e-3)) - 1.0).abs() < 1e-9, "{done:e}");
    }

    #[test]
    fn a_seam_bends_like_a_strip_that_is_stiffer_on_the_mean() {
        let fabric = Fabric::mean_knit();
        let grid = Grid::shared(61, 0.3);
        // a cylinder about a line along the warp: all of the bending is along the weft
        let x: Vec<_> = (0..grid.vertices())
            .map(|v| {
                let p = grid.flat(v);
                Vector3::new(p.x, (1.0 - (3.0 * p.z).cos()) / 3.0, (3.0 * p.z).sin() / 3.0)
            })
            .collect();
        let energy = |change: &dyn Fn(&mut Experiment)| {
            let mut experiment = Experiment::default();
            change(&mut experiment);
            let model = Model::new(&grid, &fabric, &experiment, 0.2);
            let weights = x.iter().zip(&model.weight.mass_kg).map(|(p, m)| m * GRAVITY_M_S2 * p.y);
            model.body_energy_j(&x) - weights.sum::<f64>()
        };
        let plain = energy(&|_| ());
        let stiffer = Fabric { bending_weft_nm: 2.0 * fabric.bending_weft_nm, ..fabric };
        let bending = {
            let model = Model::new(&grid, &stiffer, &Experiment::default(), 0.2);
            let weights = x.iter().zip(&model.weight.mass_kg).map(|(p, m)| m * GRAVITY_M_S2 * p.y);
            model.body_energy_j(&x) - weights.sum::<f64>() - plain
        };
        let seam = Seam { added: 6.0, width_m: 10e-3, toward_rad: 0.0, offset_m: 20e-3 };
        let seamed = energy(&|e| e.uneven.seam = seam) - plain;
        // a hat 20 mm wide on 300 mm of cloth
        assert!((seamed / bending - 6.0 * 10.0 / 300.0).abs() < 0.005, "{}", seamed / bending);
        let gradient = StiffnessGradient { ln_factor: 0.5, toward_rad: 0.0 };
        let graded = energy(&|e| e.uneven.gradient = gradient) - plain;
        // the mean of exp(s / 2) over s from -1 to 1, less 1
        let mean = 2.0 * 0.5_f64.sinh() - 1.0;
        assert!((graded / bending - mean).abs() < 0.005, "{} {mean}", graded / bending);
    }

    #[test]
    fn cloth_turned_over_has_the_energy_of_the_experiment_turned_over() {
        let fabric = Fabric::mean_knit();
        let mut curl = Curl::uniform([3.0, -2.0, 1.5]);
        curl.nodes[1][0] = [6.0, 1.0, -4.0];
        curl.edge = EdgeCurl { curvature_per_m: 20.0, width_m: 15e-3 };
        curl.line =
            LineCurl { curvature_per_m: 12.0, width_m: 12e-3, angle_rad: 0.4, offset_m: 35e-3 };
        let up = cusick(|e| {
            e.curl = curl;
            e.asymmetric_bending = AsymmetricBending { weft: 0.3, warp: -0.2 };
            e.uneven.hem = Hem { added_kg_m2: 0.1, width_m: 0.03, toward_rad: 0.6 };
            e.uneven.seam = Seam { added: 5.0, width_m: 15e-3, toward_rad: 1.0, offset_m: 0.02 };
            e.uneven.gradient = StiffnessGradient { ln_factor: 0.4, toward_rad: 2.0 };
        });
        let of = |experiment: &Experiment, turned: bool| {
            let model = model_of(&fabric, experiment);
            let (grid, n) = (&model.grid, model.grid.n);
            let x = bent(grid);
            let over = |v: usize| {
                let p = x[v / n * n + (n - 1 - v % n)];
                Vector3::new(p.x, -p.y, -p.z)
            };
            let x = if turned { (0..x.len()).map(over).collect() } else { x };
            let weights = x.iter().zip(&model.weight.mass_kg).map(|(p, m)| m * GRAVITY_M_S2 * p.y);
            let weight = weights.sum::<f64>();
            (model.body_energy_j(&x) - weight, weight)
        };
        let (elastic, weight) = of(&up, false);
        let (elastic_down, weight_down) = of(&up.face_down(), true);
        assert!((elastic_down / elastic - 1.0).abs() < 1e-9, "{elastic:e} {elastic_down:e}");
        assert!((weight_down / weight + 1.0).abs() < 1e-9, "{weight:e} {weight_down:e}");
        // and the experiment that is not turned over has not
        let (same, _) = of(&up, true);
        assert!((same / elastic - 1.0).abs() > 1e-3, "{same:e} {elastic:e}");
    }

    #[test]
    fn the_hemmed_side_hangs_deeper() {
        let fabric = Fabric::from_paper_units([3e5, 4e5, 1.5e5, 2.2e4, 3.4e4, 2.6e4, 190.0]);
        let hem = Hem { added_kg_m2: 0.4, width_m: 20e-3, toward_rad: 0.0 };
        let experiment = cusick(|e| e.uneven.hem = hem);
        let options =
            SimOptions { vertices: 41, fall_vertices: 31, experiment, ..SimOptions::default() };
        let hemmed = drape(&fabric, &Drop::canonical(), &options);
        assert_eq!(hemmed.stop, Stop::AtRest);
        let mean_height = |side: f64| {
            let points = hemmed.grid.boundary(&hemmed.positions_m);
            let within = points.positions_m().filter(|p| side * p.x > 0.8 * p.x.hypot(p.z));
            let heights: Vec<f64> = within.map(|p| p.y).collect();
            heights.iter().sum::<f64>() / heights.len() as f64
        };
        let (hem_m, other_m) = (mean_height(1.0), mean_height(-1.0));
        assert!(hem_m < other_m - 2e-3, "{hem_m} {other_m}");
    }
}
