//! The specimen's total energy: elastic, gravity, plate, self-contact, friction in the cloth,
//! guide.
//!
//! In: vertex positions (simulation frame, m). Out: energy \[J\], gradient \[N\],
//! Hessian \[N/m\] on the grid's fixed pattern plus the blocks of self-contact
//! that fall outside it.

use std::sync::Arc;

use nalgebra::Matrix3;

use crate::base::Vector3;
use crate::fabric::Fabric;
use crate::numeric::sparse::BlockPattern;
use crate::sim::energy::Energy;
use crate::sim::energy::asymmetry::AsymmetryEnergy;
use crate::sim::energy::bending::{Bending, PlateRigidity};
use crate::sim::energy::cells::MembraneEnergy;
use crate::sim::energy::curl::CurlEnergy;
use crate::sim::energy::hysteresis::HysteresisEnergy;
use crate::sim::energy::loads::{DraughtLoad, Weight};
use crate::sim::energy::plate::PlateContact;
use crate::sim::energy::softening::SofteningEnergy;
use crate::sim::experiment::Experiment;
use crate::sim::grid::Grid;
use crate::sim::guide::Guide;
use crate::sim::hessian_form::HessianForm;
use crate::sim::numerics::Numerics;
use crate::sim::self_contact::{Block, SelfContact, SelfContactParams};
use crate::sim::uneven::{add_weight, bending_factor, draught_n};

/// A block of the Hessian outside the grid's pattern.
#[derive(Clone, Copy, Debug)]
pub struct OutsideBlock {
    /// Vertex of its rows, larger than `column`.
    pub row: u32,
    /// Vertex of its columns.
    pub column: u32,
    /// The block \[N/m\]; its transpose stands at the mirrored place.
    pub block: Matrix3<f64>,
}

/// The Hessian of the energy: values on the grid's pattern, and the blocks of self-contact
/// outside it.
#[derive(Clone, Debug, Default)]
pub struct Tangent {
    /// Values on the grid's pattern, lower triangle \[N/m\].
    pub values: Vec<f64>,
    /// Blocks outside the pattern, each standing for itself and its transpose.
    pub outside: Vec<OutsideBlock>,
}

/// The energy of a specimen of one fabric in one experiment, and the state of its contacts.
#[derive(Clone)]
pub struct Model {
    /// The grid of the specimen.
    pub grid: Arc<Grid>,
    /// Stretch and shear.
    pub membrane: MembraneEnergy,
    /// The mass that each vertex carries, and the direction of gravity.
    pub weight: Weight,
    /// Contact with the plate, with the grips of its friction.
    pub plate: PlateContact,
    /// Contact of the sheet with itself, with the pairs that may touch.
    pub self_contact: SelfContact,
    /// Friction inside the cloth against bending, with its state; none where that is off.
    pub hysteresis: Option<HysteresisEnergy>,
    /// Springs that guide the sheet to a branch, or tie it there; none by default.
    pub guide: Guide,
    /// The vertices that stay where they are: those in a clamp, and those outside a disc.
    pub held: Vec<usize>,
    numerics: Numerics,
    density_kg_m2: f64,
    bending: Bending,
    curl: Option<CurlEnergy>,
    softening: Option<SofteningEnergy>,
    asymmetry: Option<AsymmetryEnergy>,
    draught: DraughtLoad,
    constant: Vec<f64>,
    blocks: Vec<Block>,
}

impl Model {
    /// The model of `fabric` on `grid` in `experiment` under the default numerics; see
    /// [`Self::with_numerics`].
    #[must_use]
    pub fn new(
        grid: &Arc<Grid>,
        fabric: &Fabric,
        experiment: &Experiment,
        self_gap_cells: f64,
    ) -> Self {
        Self::with_numerics(grid, fabric, experiment, self_gap_cells, Numerics::default())
    }

    /// The model of `fabric` on `grid` in `experiment`, with nothing in contact yet. Without
    /// natural curvature it is at rest when flat and weightless. Self-contact begins where layers
    /// are `self_gap_cells` mean cells apart.
    #[must_use]
    pub fn with_numerics(
        grid: &Arc<Grid>,
        fabric: &Fabric,
        experiment: &Experiment,
        self_gap_cells: f64,
        numerics: Numerics,
    ) -> Self {
        let rest: Vec<_> = (0..grid.vertices()).map(|v| grid.flat(v)).collect();
        let gap_m = self_gap_cells * grid.spacing_m;
        let mut params = SelfContactParams { gap_m, ..SelfContactParams::default() };
        if numerics.contact_by_weight {
            params.stiffness_n_m *= fabric.density_kg_m2 / CONTACT_DENSITY_KG_M2;
        }
        let self_contact = SelfContact::new(&grid.triangles(), &rest, params);
        let plate = PlateContact::new(grid, experiment.plate, fabric.density_kg_m2);
        Self::with_contact(grid, fabric, experiment, numerics, plate, self_contact)
    }

    /// The model of another fabric, experiment or cut on the same cells, with the contacts and the
    /// bending that this one remembers and the springs that hold it: the sheet has not moved.
    #[must_use]
    pub fn changed(&self, grid: &Arc<Grid>, fabric: &Fabric, experiment: &Experiment) -> Self {
        let ratio = grid.cell_area_m2() / self.grid.cell_area_m2();
        let plate = self.plate.changed(experiment.plate, fabric.density_kg_m2, ratio);
        let mut self_contact = self.self_contact.clone();
        if self.numerics.contact_by_weight {
            self_contact.scale_stiffness(fabric.density_kg_m2 / self.density_kg_m2);
        }
        let numerics = self.numerics;
        let mut changed =
            Self::with_contact(grid, fabric, experiment, numerics, plate, self_contact);
        if let (Some(new), Some(old)) = (&mut changed.hysteresis, &self.hysteresis) {
            new.take_anchors(old);
        }
        changed.guide.clone_from(&self.guide);
        changed.guide.stiffness_n_m *= fabric.density_kg_m2 / self.density_kg_m2;
        changed
    }

    fn with_contact(
        grid: &Arc<Grid>,
        fabric: &Fabric,
        experiment: &Experiment,
        numerics: Numerics,
        plate: PlateContact,
        self_contact: SelfContact,
    ) -> Self {
        let cell_kg = fabric.density_kg_m2 * grid.spacing_m * grid.spacing_m * grid.frame.area();
        let mut mass_kg: Vec<f64> = (0..grid.vertices()).map(|v| cell_kg * grid.share(v)).collect();
        add_weight(grid, experiment, &mut mass_kg);
        let rigidity = PlateRigidity::new(fabric);
        let mut model = Self {
            weight: Weight { mass_kg, up: experiment.tilt.up() },
            plate,
            self_contact,
            guide: Guide::default(),
            held: grid.outside(),
            draught: DraughtLoad { load_n: draught_n(grid, experiment) },
            numerics,
            density_kg_m2: fabric.density_kg_m2,
            membrane: MembraneEnergy::new(grid, fabric, numerics.twist_hold),
            curl: CurlEnergy::new(grid, &rigidity, &experiment.curl),
            softening: SofteningEnergy::new(grid, fabric, &rigidity, experiment),
            asymmetry: AsymmetryEnergy::new(grid, fabric, experiment),
            hysteresis: HysteresisEnergy::new(grid, experiment),
            bending: Bending::scaled(grid, &rigidity, |v| bending_factor(grid, experiment, v)),
            constant: Vec::new(),
            blocks: Vec::new(),
            grid: Arc::clone(grid),
        };
        let mut constant = vec![0.0; grid.analysis.pattern().nonzeros()];
        for energy in model.energies().into_iter().flatten() {
            energy.add_constant_hessian(grid, &mut constant);
        }
        model.constant = constant;
        model
    }

    /// The energies, in the order in which gradient and Hessian add them; none in the place of one
    /// that is off.
    fn energies(&self) -> [Option<&dyn Energy>; 11] {
        fn listed<E: Energy>(energy: &Option<E>) -> Option<&dyn Energy> {
            energy.as_ref().map(|energy| energy as &dyn Energy)
        }
        [
            Some(&self.membrane),
            Some(&self.bending),
            listed(&self.curl),
            listed(&self.softening),
            listed(&self.asymmetry),
            listed(&self.hysteresis),
            Some(&self.weight),
            Some(&self.draught),
            Some(&self.plate),
            Some(&self.self_contact),
            Some(&self.guide),
        ]
    }

    /// Takes the sheet's rest at `x` as what the cloth remembers of its bending; no force changes.
    pub fn remember(&mut self, x: &[Vector3]) {
        if let Some(hysteresis) = &mut self.hysteresis {
            hysteresis.renew(x);
        }
    }

    /// Whether the cloth remembers its bending, so that its Hessian changes with
    /// [`Self::remember`].
    pub fn remembers(&self) -> bool {
        self.hysteresis.is_some()
    }

    /// Elastic and gravitational energy at the positions `x` \[J\], zero for the flat sheet at
    /// y = 0; less the work of a draught from the origin on.
    #[must_use]
    pub fn body_energy_j(&self, x: &[Vector3]) -> f64 {
        self.energies_j(x)[0]
    }

    /// Total energy at the positions `x` \[J\].
    #[must_use]
    pub fn energy_j(&self, x: &[Vector3]) -> f64 {
        self.energies_j(x)[1]
    }

    /// Energy of the body and of all \[J\]. The sums keep this order, which is not the list's:
    /// another would change the last bits of drapes with effects.
    fn energies_j(&self, x: &[Vector3]) -> [f64; 2] {
        let value = |energy: Option<&dyn Energy>| energy.map_or(0.0, |e| e.energy_j(&self.grid, x));
        let [
            membrane,
            bending,
            curl,
            softening,
            asymmetry,
            hysteresis,
            weight,
            draught,
            plate,
            self_contact,
            guide,
        ] = self.energies().map(value);
        let body = membrane + bending + weight + (curl + softening + asymmetry) + draught;
        [body, plate + body + self_contact + hysteresis + guide]
    }

    /// Largest fraction of the step `dx` from `x` on which the sheet passes neither through
    /// itself nor into the plate; self-contact must have been updated for it.
    #[must_use]
    pub fn max_step(&self, x: &[Vector3], dx: &[Vector3]) -> f64 {
        // from the last on: self-contact's limit shortens the plate's search
        let energies = self.energies().into_iter().flatten().rev();
        energies.fold(1.0, |limit, energy| energy.max_step(&self.grid, x, dx, limit))
    }

    /// Writes the gradient of the total energy at the positions `x` \[N\]: minus the net force on
    /// each vertex, zero for those that are held.
    pub fn gradient(&self, x: &[Vector3], gradient: &mut [Vector3]) {
        gradient.fill(Vector3::zeros());
        for energy in self.energies().into_iter().flatten() {
            energy.add_gradient(&self.grid, x, gradient);
        }
        for &v in &self.held {
            gradient[v] = Vector3::zeros();
        }
    }

    /// Writes the Hessian of the total energy at the positions `x` \[N/m\], exact or with a
    /// positive semidefinite substitute for each part.
    pub fn hessian(&mut self, x: &[Vector3], form: HessianForm, tangent: &mut Tangent) {
        let pattern = self.grid.analysis.pattern();
        tangent.values.clear();
        tangent.values.extend_from_slice(&self.constant);
        tangent.outside.clear();
        for energy in self.energies().into_iter().flatten() {
            energy.add_hessian(&self.grid, x, form, &mut tangent.values);
        }
        for &v in &self.held {
            pattern.add_diagonal(&mut tangent.values, v, &(Matrix3::identity() * HELD_N_M));
        }
        self.blocks.clear();
        self.self_contact.blocks(x, form, &mut self.blocks);
        for block in &self.blocks {
            add_contact_block(pattern, block, tangent);
        }
    }
}

/// Areal density at which self-contact by weight has its default stiffness: that of the mean knit
/// \[kg/m^2\].
const CONTACT_DENSITY_KG_M2: f64 = 0.214;
/// Stiffness that holds a vertex \[N/m\]. A solve then moves it by its neighbours'
/// moves times their stiffness over this: 1e-12 of them.
const HELD_N_M: f64 = 1e14;

/// Adds the 12 x 12 block of a contact pair: what couples its two elements on the pattern if
/// all of it falls there, else outside. Half of it on the pattern could leave a matrix that is
/// not positive definite from a block that is.
fn add_contact_block(pattern: &BlockPattern, block: &Block, tangent: &mut Tangent) {
    let slot = |a: usize, b: usize| {
        let (r, c) =
            (block.vertices[a].max(block.vertices[b]), block.vertices[a].min(block.vertices[b]));
        pattern.slot(r as usize, c as usize)
    };
    let first = block.first;
    let inside = (first..4).all(|a| (0..first).all(|b| slot(a, b).is_some()));
    for a in 0..4 {
        for b in 0..=a {
            let part: Matrix3<f64> = block.hessian.fixed_view::<3, 3>(3 * a, 3 * b).into_owned();
            let (r, c) = (block.vertices[a] as usize, block.vertices[b] as usize);
            if a == b {
                pattern.add_diagonal(&mut tangent.values, r, &part);
                continue;
            }
            let (r, c, part) = if r > c { (r, c, part) } else { (c, r, part.transpose()) };
            let one_element = (a < first) == (b < first);
            match slot(a, b).filter(|_| inside || one_element) {
                Some(slot) => BlockPattern::add_block(&mut tangent.values, slot, &part),
                None => {
                    let (row, column) = (r as u32, c as u32);
                    tangent.outside.push(OutsideBlock { row, column, block: part });
                }
            }
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::numeric::sparse::Factor;
    use crate::sim::self_contact::Hessian12;

    #[test]
    fn a_pair_half_on_the_pattern_leaves_a_positive_matrix() {
        let grid = Grid::shared(11, 0.1);
        let pattern = grid.analysis.pattern();
        let at = |i: u32, j: u32| i * 11 + j;
        // two edges two cells apart: of what couples them, some falls on the pattern
        let vertices = [at(4, 4), at(4, 5), at(6, 4), at(6, 5)];
        let coupled = |a: usize, b: usize| {
            pattern
                .slot(vertices[a].max(vertices[b]) as usize, vertices[a].min(vertices[b]) as usize)
        };
        assert!(coupled(0, 2).is_some() && coupled(0, 3).is_none(), "the case is no longer one");
        let weights = [0.5, 0.5, -0.5, -0.5];
        let hessian = Hessian12::from_fn(|r, c| {
            let normal = f64::from(u8::from(r % 3 == 1 && c % 3 == 1));
            1e3 * weights[r / 3] * weights[c / 3] * normal
        });
        let mut tangent = Tangent { values: vec![0.0; pattern.nonzeros()], outside: Vec::new() };
        for v in 0..grid.vertices() {
            pattern.add_diagonal(&mut tangent.values, v, &(Matrix3::identity() * 1e-3));
        }
        add_contact_block(pattern, &Block { vertices, first: 2, hessian }, &mut tangent);
        assert!(Factor::<f64>::new(&grid.analysis).factorize(&tangent.values));
        // and nothing is lost: with the blocks outside it is the pair's whole Hessian
        let x: Vec<_> =
            (0..grid.vertices()).map(|v| Vector3::new(0.0, (v as f64).cos(), 0.0)).collect();
        let mut product = vec![Vector3::zeros(); x.len()];
        pattern.multiply(&tangent.values, &x, &mut product);
        for OutsideBlock { row, column, block } in &tangent.outside {
            product[*row as usize] += block * x[*column as usize];
            product[*column as usize] += block.transpose() * x[*row as usize];
        }
        let along: f64 = vertices.iter().zip(weights).map(|(&v, w)| w * x[v as usize].y).sum();
        for (&v, w) in vertices.iter().zip(weights) {
            let expected = 1e-3 * x[v as usize].y + 1e3 * w * along;
            assert!((product[v as usize].y - expected).abs() < 1e-9);
        }
    }
}
