//! True and found sheets next to each other, of the refined fabrics that differ most.

use image::{Rgb, RgbImage, imageops};

use super::shapes::{Reading, Shape};
use super::{Reader, Transferred};
use scan2params::fabric::Fabric;
use scan2params::picture::{draw, shaded};

/// A refined fabric in one experiment.
struct Apart<'a> {
    fabric: &'a Transferred,
    at: usize,
    shape: Shape,
    /// Mean coefficients of truth and found \[%\].
    coefficients: [f64; 2],
}

/// Pictures of the `count` refined fabrics whose mean drape coefficient is farthest from the true
/// one, first drops of the true fabric on the left and of the found one on the right; each with a
/// name for its file.
#[must_use]
pub fn worst(all: &[Transferred], count: usize) -> Vec<(String, RgbImage)> {
    let mut apart: Vec<Apart<'_>> = all.iter().flat_map(of_fabric).collect();
    let distance = |a: &Apart<'_>| (a.coefficients[1] - a.coefficients[0]).abs();
    apart.sort_by(|a, b| distance(b).total_cmp(&distance(a)));
    apart.truncate(count);
    apart.iter().map(Apart::picture).collect()
}

fn of_fabric(fabric: &Transferred) -> Vec<Apart<'_>> {
    let mean = |readings: &[Reading]| {
        readings.iter().map(|r| r.coefficient).sum::<f64>() / readings.len() as f64
    };
    let mut apart = Vec::new();
    for (at, found) in fabric.found.iter().enumerate() {
        for tried in fabric.tried.iter().filter(|_| found.reader == Reader::Refined) {
            let coefficients = [mean(&tried.truth), mean(&tried.dropped[at])];
            if coefficients.iter().all(|c| c.is_finite()) {
                apart.push(Apart { fabric, at, shape: tried.shape, coefficients });
            }
        }
    }
    apart
}

impl Apart<'_> {
    fn picture(&self) -> (String, RgbImage) {
        let Self { fabric, at, shape, coefficients } = self;
        let found = &fabric.found[*at];
        let [left, right] = [&fabric.truth, &found.fabric].map(|values| {
            let mesh = shape.mesh(&Fabric::from_si(*values), fabric.seed);
            shaded::picture(&mesh, AZIMUTH_RAD, ELEVATION_RAD)
        });
        let mut all = RgbImage::from_pixel(left.width() * 2, left.height() + TITLE, Rgb([255; 3]));
        for (k, half) in [&left, &right].into_iter().enumerate() {
            let (x, y) = (k as i64 * i64::from(left.width()), i64::from(TITLE));
            imageops::replace(&mut all, half, x, y);
            let who = ["true", "refined"][k];
            let title = format!("{who}: {:.1} % over all drops", coefficients[k]);
            draw::text(&mut all, x as i32 + 16, 10, &title, Rgb([0; 3]));
        }
        let shape = shape.name().replace(' ', "_");
        (format!("{}-{}-{}-{shape}.png", fabric.prior, fabric.index, found.sensor), all)
    }
}

/// Room for the title \[pixels\].
const TITLE: u32 = 36;
/// Whence the sheets are looked at \[rad\].
const AZIMUTH_RAD: f64 = 0.6;
const ELEVATION_RAD: f64 = 0.45;
