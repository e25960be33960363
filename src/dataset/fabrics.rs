//! Which fabric a sample is of.

use std::collections::BTreeMap;
use std::ops::Range;

use super::options::GenerateOptions;
use super::row::Sample;
use super::walk;
use crate::fabric::{Fabric, MixtureError};
use crate::sim::Fall;

/// The fabrics of a run's samples, in the order of its walks where it has any.
pub(super) struct Fabrics<'a> {
    options: &'a GenerateOptions,
    /// Orders of the pools that were asked for.
    orders: BTreeMap<u64, Vec<usize>>,
}

impl<'a> Fabrics<'a> {
    pub(super) fn new(options: &'a GenerateOptions) -> Self {
        Self { options, orders: BTreeMap::new() }
    }

    /// Makes [`Self::sample`] ready for some samples.
    pub(super) fn order(&mut self, samples: &Range<u64>) -> Result<(), MixtureError> {
        let GenerateOptions { walks: Some(walks), prior, seed, .. } = self.options else {
            return Ok(());
        };
        for pool in samples.start / walks.pool..samples.end.div_ceil(walks.pool) {
            if self.orders.contains_key(&pool) {
                continue;
            }
            let fabrics = (pool * walks.pool..(pool + 1) * walks.pool)
                .map(|index| prior.sample(*seed, index))
                .collect::<Result<Vec<Fabric>, _>>()?;
            let rows = usize::try_from(walks.rows).unwrap_or(usize::MAX);
            self.orders.insert(pool, walk::order(&fabrics, rows, *seed, pool));
        }
        Ok(())
    }

    /// Sample `index`, one of those that were made ready.
    pub(super) fn sample(&self, index: u64) -> Result<Sample, MixtureError> {
        let GenerateOptions { prior, seed, drops_per_fabric, canonical, walks, .. } = self.options;
        let fabric_index = match walks {
            None => index / drops_per_fabric,
            Some(walks) => {
                let (pool, place) = (index / walks.pool, (index % walks.pool) as usize);
                pool * walks.pool + self.orders[&pool][place] as u64
            }
        };
        let fabric = prior.sample(*seed, fabric_index)?;
        let fall = if *canonical { Fall::Canonical } else { Fall::Perturbed };
        Ok(Sample { index, fabric_index, fabric, run_seed: *seed, fall })
    }
}
