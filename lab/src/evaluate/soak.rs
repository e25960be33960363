//! A soak: many fabrics, those at the edge of what is allowed among them, each draped once.
//!
//! In: a prior, how many, a seed. Out: one row a drape, and a table of how they ended. Fabrics come
//! in turn from the prior and from the corners of Table 2's box, where soft meets heavy and stiff
//! to stretch meets limp to bend.

use std::collections::BTreeMap;

use scan2params::base::clock::thread_cpu_s;
use scan2params::fabric::{Fabric, Mixture, MixtureError, PARAMETERS, TABLE_2};
use scan2params::sim::experiment::bending_length_m;
use scan2params::sim::{Drape, Drop, DropStart, SimOptions, drape};

/// Where a fabric of the soak comes from.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord)]
pub enum Source {
    /// A draw from the prior.
    Prior,
    /// A corner of Table 2's box, its bending made positive where it is not.
    Corner,
}

impl Source {
    /// The word used in tables.
    #[must_use]
    pub fn name(self) -> &'static str {
        match self {
            Self::Prior => "prior",
            Self::Corner => "corner",
        }
    }
}

/// One drape of the soak.
#[derive(Clone, Debug)]
pub struct Soaked {
    /// Its place in the run.
    pub index: u64,
    /// Where the fabric comes from.
    pub source: Source,
    /// The fabric.
    pub fabric: Fabric,
    /// How it drapes.
    pub drape: Drape,
    /// Largest net force on a vertex over the weight of a cell.
    pub residual: f64,
    /// Processor time \[s\]; NaN where the system does not tell it.
    pub cpu_s: f64,
}

impl Soaked {
    /// The names of what [`Self::row`] gives.
    pub const COLUMNS: &str = "index, source, bending_length_mm, stop, residual_of_cell_weight, \
         nodes, intersections, plate_clearance_mm, factorisations, cpu_s";

    /// As a line of a table.
    #[must_use]
    pub fn row(&self) -> String {
        let d = &self.drape;
        format!(
            "{}, {}, {:.1}, {}, {:.1e}, {}, {}, {:.3}, {}, {:.2}",
            self.index,
            self.source.name(),
            1e3 * bending_length_m(&self.fabric),
            d.stop.name(),
            self.residual,
            d.nodes,
            d.intersections,
            1e3 * d.plate_clearance_m,
            d.effort.factorisations,
            self.cpu_s
        )
    }
}

/// Fabric `index` of a soak: every eighth from the corners of the box in the order of their bits
/// (bit k of `index / 8` takes parameter k to its largest; 1,024 fabrics see all 128), the
/// others from the prior.
///
/// # Errors
/// When the prior gives no fabric inside its range.
pub fn fabric(prior: &Mixture, seed: u64, index: u64) -> Result<(Source, Fabric), MixtureError> {
    if index % 8 != 7 {
        return Ok((Source::Prior, prior.sample(seed, index)?));
    }
    let bits = index / 8;
    let corner: [f64; PARAMETERS] =
        std::array::from_fn(|k| if bits >> k & 1 == 1 { TABLE_2[k].max } else { TABLE_2[k].min });
    Ok((Source::Corner, Fabric::from_paper_units(corner).project_bending().0))
}

/// Drapes fabric `index` of a soak with its own perturbed drop.
///
/// # Errors
/// As [`fabric`].
pub fn soak(
    prior: &Mixture,
    seed: u64,
    index: u64,
    options: &SimOptions,
) -> Result<Soaked, MixtureError> {
    let (source, fabric) = fabric(prior, seed, index)?;
    let before = thread_cpu_s();
    let drape = drape(&fabric, &Drop { start: DropStart::Perturbed(seed ^ index) }, options);
    let cpu_s = before.zip(thread_cpu_s()).map_or(f64::NAN, |(before, after)| after - before);
    let cell_n = fabric.density_kg_m2
        * drape.grid.spacing_m.powi(2)
        * scan2params::base::frame::GRAVITY_M_S2;
    let residual = drape.residual_n / cell_n;
    Ok(Soaked { index, source, fabric, drape, residual, cpu_s })
}

/// How the drapes of one source ended.
#[derive(Clone, Debug, Default)]
pub struct Tally {
    /// Drapes by reason to stop.
    pub stops: BTreeMap<&'static str, usize>,
    /// Largest residual, in weights of a cell, of those at rest.
    pub worst_residual: f64,
    /// Pairs of triangles that intersect, over all drapes.
    pub intersections: usize,
    /// Least distance from the plate \[m\].
    pub least_clearance_m: f64,
    /// Drapes with a number that is not finite.
    pub diverged: usize,
    /// Processor times in rising order \[s\].
    pub cpu_s: Vec<f64>,
}

impl Tally {
    /// Of these drapes.
    #[must_use]
    pub fn of<'a>(drapes: impl IntoIterator<Item = &'a Soaked>) -> Self {
        let mut tally = Self { least_clearance_m: f64::INFINITY, ..Self::default() };
        for soaked in drapes {
            let d = &soaked.drape;
            *tally.stops.entry(d.stop.name()).or_default() += 1;
            let at_rest = d.stop == scan2params::sim::Stop::AtRest;
            if at_rest {
                tally.worst_residual = tally.worst_residual.max(soaked.residual);
            }
            tally.intersections += d.intersections;
            tally.least_clearance_m = tally.least_clearance_m.min(d.plate_clearance_m);
            let finite = d.positions_m.iter().all(|p| p.iter().all(|c| c.is_finite()));
            tally.diverged += usize::from(!finite);
            tally.cpu_s.push(soaked.cpu_s);
        }
        tally.cpu_s.sort_by(f64::total_cmp);
        tally
    }

    /// Processor time below which this share of the drapes stayed \[s\].
    #[must_use]
    pub fn cpu_at(&self, share: f64) -> f64 {
        let last = self.cpu_s.len().saturating_sub(1);
        self.cpu_s.get((last as f64 * share).round() as usize).copied().unwrap_or(f64::NAN)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn corners_are_the_box_s_and_can_be_simulated() {
        let mut seen = std::collections::BTreeSet::new();
        for index in (7..1024).step_by(8) {
            let (source, fabric) = fabric(&Mixture::knit_2020(), 1, index).unwrap();
            assert_eq!(source, Source::Corner);
            fabric.check().unwrap();
            seen.insert(fabric.to_paper_units().map(f64::to_bits));
        }
        // 2^7 corners; where both B^u and B^v are extreme the projected B^h may coincide
        assert!(seen.len() > 90, "{}", seen.len());
        assert_eq!(fabric(&Mixture::measured(), 1, 2).unwrap().0, Source::Prior);
    }

    #[test]
    fn a_tally_counts_what_it_is_given() {
        let options = SimOptions { vertices: 13, fall_vertices: 13, ..SimOptions::default() };
        let drapes: Vec<_> =
            (0..3).map(|k| soak(&Mixture::measured(), 5, k, &options).unwrap()).collect();
        let tally = Tally::of(&drapes);
        assert_eq!(tally.stops.values().sum::<usize>(), 3);
        assert_eq!(tally.diverged, 0);
        assert!(tally.cpu_at(0.0) <= tally.cpu_at(1.0));
        let mut broken = drapes[0].clone();
        broken.drape.positions_m[4].x = f64::NAN;
        assert_eq!(Tally::of([&broken]).diverged, 1);
    }
}
