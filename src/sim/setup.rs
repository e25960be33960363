//! What a drape is of: a fabric in an experiment, and what lies between two of them.

use crate::fabric::Fabric;
use crate::sim::experiment::Experiment;
use crate::sim::parameters::Parameter;

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
            experiment: self.experiment.between(&other.experiment, t),
        }
    }

    /// The same with `change` added to `parameter`. The specimen's place and rotation change
    /// nothing here: they act through friction's anchors, as a hold's pull and the ties' place
    /// do through their springs.
    #[must_use]
    pub fn with(mut self, parameter: Parameter, change: f64) -> Self {
        use Parameter::{OffsetX, OffsetZ, Pull, Rotation, TiesX, TiesZ};
        if matches!(parameter, OffsetX | OffsetZ | Rotation | Pull | TiesX | TiesZ) {
            return self;
        }
        if let Some(k) = parameter.of_fabric() {
            let mut seven = self.fabric.in_si();
            seven[k] += change;
            self.fabric = Fabric::from_si(seven);
        } else if let Some(row) = parameter.row() {
            for (k, number) in row.numbers(&mut self.experiment).iter_mut().enumerate() {
                if parameter.is_number(k) {
                    *number += change;
                }
            }
        }
        self
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

#[cfg(test)]
mod tests {
    use super::*;
    use crate::sim::experiment::{AsymmetricBending, Hysteresis};

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
