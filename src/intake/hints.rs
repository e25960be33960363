//! What a user writes of the scene, as what it means: a crop, which way is up, where the plate is.
//!
//! In: the text of a flag. Out: values of [`crate::scan::ScanOptions`], whose `check_hints` says
//! whether they can be meant.

use super::rim::parse_warp_toward;
use crate::scan::{Crop, WarpToward};

/// A crop that cannot be read.
#[derive(Clone, Copy, Debug, PartialEq, Eq, thiserror::Error)]
#[error(
    "give a radius about the plate in mm, as in 300, or two opposite corners of a box in the file's frame and unit, \
     X1,Y1,Z1,X2,Y2,Z2"
)]
pub struct CropError;

/// An up that cannot be read.
#[derive(Clone, Copy, Debug, PartialEq, Eq, thiserror::Error)]
#[error(
    "give the axis of the scan's frame that points up: x, -x, y, -y, z, -z or a direction X,Y,Z"
)]
pub struct UpError;

/// A place that cannot be read.
#[derive(Clone, Copy, Debug, PartialEq, Eq, thiserror::Error)]
#[error("give the place of the plate in the file's frame and unit: X,Y,Z")]
pub struct PlaceError;

/// A crop: a radius about the plate \[mm\], or two opposite corners of a box, in any order.
///
/// # Errors
/// When it is neither.
pub fn parse_crop(text: &str) -> Result<Crop, CropError> {
    match numbers(text).as_deref() {
        Some(&[radius_mm]) => Ok(Crop::Radius { radius_mm }),
        Some(&[a, b, c, d, e, f]) => {
            let corners = [[a, b, c], [d, e, f]];
            let [low, high] = [f64::min, f64::max]
                .map(|pick| [0, 1, 2].map(|k| pick(corners[0][k], corners[1][k])));
            Ok(Crop::Box { low, high })
        }
        _ => Err(CropError),
    }
}

/// Which way is up: `x`, `-y`, ..., or three numbers.
///
/// # Errors
/// When it is no direction.
pub fn parse_up(text: &str) -> Result<[f64; 3], UpError> {
    match parse_warp_toward(text) {
        Ok(WarpToward::Direction(up)) => Ok(up),
        _ => Err(UpError),
    }
}

/// A place: three numbers.
///
/// # Errors
/// When it is none.
pub fn parse_place(text: &str) -> Result<[f64; 3], PlaceError> {
    numbers(text).and_then(|place| place.try_into().ok()).ok_or(PlaceError)
}

/// Finite numbers with commas between them.
fn numbers(text: &str) -> Option<Vec<f64>> {
    text.split(',')
        .map(|part| part.trim().parse().ok().filter(|number: &f64| number.is_finite()))
        .collect()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn radii_and_boxes() {
        assert_eq!(parse_crop("300"), Ok(Crop::Radius { radius_mm: 300.0 }));
        let corners = Crop::Box { low: [-1.0, 0.0, 2.5], high: [1.0, 4.0, 3.0] };
        assert_eq!(parse_crop("-1,0,2.5,1,4,3"), Ok(corners));
        assert_eq!(parse_crop("1, 0, 3, -1, 4, 2.5"), Ok(corners));
        for wrong in ["", "300 mm", "1,2", "0,0,0,1,1", "0,0,0,1,1,inf", "nan", "1;2;3;4;5;6"] {
            assert_eq!(parse_crop(wrong), Err(CropError), "{wrong}");
        }
    }

    #[test]
    fn axes_and_directions() {
        assert_eq!(parse_up("z"), Ok([0.0, 0.0, 1.0]));
        assert_eq!(parse_up("+y"), Ok([0.0, 1.0, 0.0]));
        assert_eq!(parse_up("-x"), Ok([-1.0, 0.0, 0.0]));
        assert_eq!(parse_up("0.1,-2,0"), Ok([0.1, -2.0, 0.0]));
        for wrong in ["", "up", "90", "0,0,0", "1,2", "--x"] {
            assert_eq!(parse_up(wrong), Err(UpError), "{wrong}");
        }
    }

    #[test]
    fn places() {
        assert_eq!(parse_place("-0.25, 1e-1,0"), Ok([-0.25, 0.1, 0.0]));
        for wrong in ["", "x", "1", "1,2", "1,2,3,4", "1,2,nan"] {
            assert_eq!(parse_place(wrong), Err(PlaceError), "{wrong}");
        }
    }
}
