//! How far the sensor has shifted the free edge: erosion, or spreading.
//!
//! The specimen's size tells it, up to what the cloth has stretched and what a smooth sheet cuts
//! short in sharp folds. Of what the cloth is too wide, the sensor is held for the share that its
//! own spread has in all of these. In: widths of the cloth from edge to edge. Out: the shift.
//!
//! Tried: the shift against the lengths of the registered sheet, which the fit knows together with
//! the cloth's stretch. The two are hardly told apart, and a sheet in sharp folds is pressed
//! together: it was 0.2 (stiff cloth) to 0.8 mm off, where the width is 0.1 to 0.5.

use super::rim::Width;
use super::tuning::ShiftTuning;

/// By how much the free edge lies farther out than the cloth ends, all round, as far as the sensor
/// is held for it.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct EdgeShift {
    /// Outward shift, which was taken out of the rim \[m\].
    pub by_m: f64,
    /// Its standard deviation \[m\].
    pub sigma_m: f64,
    /// Standard deviation of what the sensor shifts edges by, before a scan is looked at \[m\].
    pub sensor_m: f64,
}

impl EdgeShift {
    /// The sensor's part in the widths of a cloth of this side \[m\] and weight over stretch
    /// stiffness \[1/m\]. A sheet on noise that is smooth over several points is rough and too
    /// wide.
    pub(super) fn of(
        widths: &[Option<Width>; 2],
        side_m: f64,
        stretch_per_m: f64,
        noise_m: f64,
        tuning: &ShiftTuning,
    ) -> Self {
        let sensor_m = tuning.sensor_m + tuning.sensor_per_noise * noise_m;
        let seen: Vec<&Width> = widths.iter().flatten().collect();
        if seen.is_empty() {
            return Self { by_m: 0.0, sigma_m: sensor_m, sensor_m };
        }
        let mean = |of: fn(&Width) -> f64| {
            seen.iter().map(|width| of(width)).sum::<f64>() / seen.len() as f64
        };
        let shift_m = 0.5 * (mean(|width| width.length_m) - side_m);
        let bent_per_m = mean(|width| width.bent_per_m);
        let per_bent_m2 = tuning.folds_m2 + tuning.stretched_m3 * stretch_per_m;
        let rough_m = tuning.rough_per_noise * (noise_m - tuning.smooth_noise_m).max(0.0);
        let model = (tuning.least_m + per_bent_m2 * bent_per_m + rough_m).powi(2);
        let sensor = sensor_m.powi(2);
        let share = sensor / (sensor + model);
        Self { by_m: share * shift_m, sigma_m: (share * model).sqrt(), sensor_m }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_sensor_is_held_for_less_of_a_width_that_folds_stretch_and_noise_may_have_made() {
        let tuning = crate::scan::tuning::Tuning::default().shift;
        let shift = |bent_per_m, stretch_per_m, noise_m| {
            let width = Some(Width { length_m: 0.302, bent_per_m });
            EdgeShift::of(&[width, None], 0.3, stretch_per_m, noise_m, &tuning)
        };
        let good = shift(200.0, 0.02, 0.15e-3);
        assert!(good.by_m > 0.7e-3 && good.by_m < 1e-3 && good.sigma_m < 0.2e-3, "{good:?}");
        for less in
            [shift(1200.0, 0.02, 0.15e-3), shift(1200.0, 0.3, 0.15e-3), shift(200.0, 0.02, 2e-3)]
        {
            assert!(less.by_m < 0.8 * good.by_m && less.sigma_m > 1.3 * good.sigma_m, "{less:?}");
        }
        let unseen = EdgeShift::of(&[None; 2], 0.3, 0.02, 0.15e-3, &tuning);
        assert_eq!((unseen.by_m, unseen.sigma_m), (0.0, unseen.sensor_m));
    }
}
