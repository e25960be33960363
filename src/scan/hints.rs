//! What a caller says of the scene: the part of it that counts, which way is up, and where
//! the plate is.
//!
//! In: the options, whose places are in the file's frame and unit, and that unit. Out: the
//! points that stay, and whether a disc may be the plate. The scan's frame is the file's in
//! metres, so that a place of the file times its unit is one of the scan.
//!
//! A crop leaves what lies inside of it. Of a mesh that is a triangle with all of its corners
//! inside: one that reaches out of the crop is cut off whole.

use super::options::{Crop, PLATE_WITHIN_M, ScanOptions, UP_WITHIN_DEG};
use super::unit::LengthUnit;
use crate::base::{Point3, Vector3};

/// The hints on the plate, in metres and the scan's frame.
#[derive(Clone, Copy, Debug)]
pub(super) struct Hints {
    up: Option<Vector3>,
    plate_near: Option<Point3>,
}

impl Hints {
    /// What the options say of a scan in this unit.
    pub fn of(options: &ScanOptions, unit: LengthUnit) -> Self {
        Self { up: options.up.map(Vector3::from), plate_near: plate_near(options, unit) }
    }

    /// Whether a disc with this centre \[m\] and this normal, scan's frame, may be the plate.
    pub fn allow(&self, centre: &Point3, up: &Vector3) -> bool {
        let is_near = |place: Point3| (centre - place).norm() <= PLATE_WITHIN_M;
        let is_up = |given: Vector3| up.angle(&given).to_degrees() <= UP_WITHIN_DEG;
        self.plate_near.is_none_or(is_near) && self.up.is_none_or(is_up)
    }
}

/// The place of the plate as it is given \[m\].
fn plate_near(options: &ScanOptions, unit: LengthUnit) -> Option<Point3> {
    options.plate_near.map(|place| Point3::from(place) * unit.metres())
}

/// A part of space.
#[derive(Clone, Copy, Debug)]
pub(super) enum Region {
    /// A box along the axes.
    Box { low: Point3, high: Point3 },
    /// A ball.
    Sphere { centre: Point3, radius: f64 },
    /// All that lies within a radius of an axis, whose direction has length 1.
    Cylinder { centre: Point3, up: Vector3, radius: f64 },
}

impl Region {
    /// The box to which a file is cropped, in its unit.
    pub fn of_file(options: &ScanOptions) -> Option<Self> {
        let Some(Crop::Box { low, high }) = options.crop else { return None };
        Some(Self::Box { low: low.into(), high: high.into() })
    }

    /// The sphere in which the plate is looked for \[m\], if its place and a radius are given.
    pub fn to_search(options: &ScanOptions, unit: LengthUnit) -> Option<Self> {
        let radius = radius_m(options)?;
        Some(Self::Sphere { centre: plate_near(options, unit)?, radius })
    }

    /// What counts once a plate is found with this centre and up \[m\], if a radius is given: a
    /// sphere about it where a place was given, a cylinder about its axis otherwise.
    pub fn about(centre: &Point3, up: &Vector3, options: &ScanOptions) -> Option<Self> {
        let (centre, up, radius) = (*centre, *up, radius_m(options)?);
        let sphere = Self::Sphere { centre, radius };
        Some(options.plate_near.map_or(Self::Cylinder { centre, up, radius }, |_| sphere))
    }

    /// Whether a point lies in it; one that is not finite lies nowhere.
    pub fn contains(&self, p: &Point3) -> bool {
        match self {
            Self::Box { low, high } => (0..3).all(|k| (low[k]..=high[k]).contains(&p[k])),
            Self::Sphere { centre, radius } => (p - centre).norm_squared() <= radius * radius,
            Self::Cylinder { centre, up, radius } => {
                let away = p - centre;
                (away - up * away.dot(up)).norm_squared() <= radius * radius
            }
        }
    }
}

/// The radius to which a scan is cropped \[m\].
fn radius_m(options: &ScanOptions) -> Option<f64> {
    let Some(Crop::Radius { radius_mm }) = options.crop else { return None };
    Some(radius_mm * 1e-3)
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::geom::Cloud;

    fn turned_deg(degrees: f64) -> Vector3 {
        let (sin, cos) = degrees.to_radians().sin_cos();
        Vector3::new(sin, 0.0, cos)
    }

    #[test]
    fn without_a_word_any_disc_may_be_the_plate() {
        let hints = Hints::of(&ScanOptions::default(), LengthUnit::Metre);
        assert!(hints.allow(&Point3::new(9.0, -9.0, 9.0), &-Vector3::z()));
    }

    #[test]
    fn up_holds_within_its_angle_and_its_length_does_not_count() {
        let options = ScanOptions { up: Some([0.0, 0.0, 7.0]), ..ScanOptions::default() };
        let hints = Hints::of(&options, LengthUnit::Inch);
        for (degrees, allowed) in [(0.0, true), (19.9, true), (20.1, false), (180.0, false)] {
            let up = turned_deg(degrees);
            assert_eq!(hints.allow(&Point3::origin(), &up), allowed, "{degrees}");
        }
    }

    #[test]
    fn the_plates_place_holds_within_its_distance_whatever_the_unit() {
        for unit in LengthUnit::ALL {
            let place = [0.4, -1.3, 0.9].map(|metres| metres / unit.metres());
            let options = ScanOptions { plate_near: Some(place), ..ScanOptions::default() };
            let hints = Hints::of(&options, unit);
            for (off_m, allowed) in [(0.0, true), (0.0999, true), (0.1001, false)] {
                let centre = Point3::new(0.4, -1.3 + off_m, 0.9);
                assert_eq!(hints.allow(&centre, &Vector3::x()), allowed, "{unit:?} {off_m}");
            }
        }
    }

    #[test]
    fn both_must_hold_where_both_are_said() {
        let options = ScanOptions {
            up: Some([0.0, 0.0, 1.0]),
            plate_near: Some([0.0; 3]),
            ..ScanOptions::default()
        };
        let hints = Hints::of(&options, LengthUnit::Metre);
        let (near, far) = (Point3::origin(), Point3::new(1.0, 0.0, 0.0));
        assert!(hints.allow(&near, &Vector3::z()));
        assert!(!hints.allow(&far, &Vector3::z()) && !hints.allow(&near, &Vector3::x()));
    }

    /// Ten points along each axis, 100 mm apart, the k-th with the colour k.
    fn row(axis: usize, unit: LengthUnit) -> Cloud {
        let at = |k: u8| {
            let mut p = Point3::origin();
            p[axis] = 0.1 * f64::from(k) / unit.metres();
            p
        };
        Cloud {
            points: (0..10).map(at).collect(),
            colors: (0..10).map(|k| [k; 3]).collect(),
            triangles: Vec::new(),
        }
    }

    #[test]
    fn a_box_leaves_the_points_inside_with_their_colours() {
        let low = [-1.0, -1.0, -1.0];
        for axis in 0..3 {
            let mut high = [1.0; 3];
            high[axis] = 350.0;
            let options =
                ScanOptions { crop: Some(Crop::Box { low, high }), ..ScanOptions::default() };
            let mut cloud = row(axis, LengthUnit::Millimetre);
            cloud.points[1].x = f64::NAN;
            let left = cloud.part(|p| Region::of_file(&options).unwrap().contains(p));
            assert_eq!(left.colors, [[0; 3], [2; 3], [3; 3]]);
            assert_eq!(left.points[1][axis], 200.0);
            assert_eq!(left.points.len(), 3);
        }
    }

    #[test]
    fn a_cloud_without_colours_stays_without() {
        let cloud = Cloud { colors: Vec::new(), ..row(0, LengthUnit::Metre) };
        let region = Region::Sphere { centre: Point3::origin(), radius: 0.45 };
        let left = cloud.part(|p| region.contains(p));
        assert_eq!((left.points.len(), left.colors.len()), (5, 0));
    }

    #[test]
    fn a_mesh_keeps_the_triangles_that_lie_inside_whole() {
        // A strip of eight triangles; the third and the fourth reach out over x = 0.25.
        let mut cloud = row(0, LengthUnit::Metre);
        cloud.triangles = (0..8).map(|k| [k, k + 1, k + 2]).collect();
        let high = [0.35, 1.0, 1.0];
        let left =
            cloud.part(|p| Region::Box { low: [-1.0; 3].into(), high: high.into() }.contains(p));
        assert_eq!(left.triangles, [[0, 1, 2], [1, 2, 3]]);
        assert_eq!(left.colors, [[0; 3], [1; 3], [2; 3], [3; 3]]);
        // From the other end: the numbers of the vertices begin anew.
        let low = [0.55, -1.0, -1.0];
        let left =
            cloud.part(|p| Region::Box { low: low.into(), high: [1.0; 3].into() }.contains(p));
        assert_eq!(left.triangles, [[0, 1, 2], [1, 2, 3]]);
        assert_eq!(left.colors, [[6; 3], [7; 3], [8; 3], [9; 3]]);
    }

    #[test]
    fn a_corner_of_cut_triangles_alone_goes_with_them() {
        let mut cloud = row(0, LengthUnit::Metre);
        cloud.triangles = vec![[0, 1, 2], [3, 4, 9]];
        let high = [0.45, 1.0, 1.0];
        let left =
            cloud.part(|p| Region::Box { low: [-1.0; 3].into(), high: high.into() }.contains(p));
        assert_eq!(left.triangles, [[0, 1, 2]]);
        assert_eq!(left.points.len(), 3);
    }

    #[test]
    fn a_radius_is_a_sphere_about_a_place_and_a_cylinder_about_an_axis() {
        let crop = Some(Crop::Radius { radius_mm: 300.0 });
        let options = ScanOptions { crop, ..ScanOptions::default() };
        assert!(Region::of_file(&options).is_none());
        assert!(Region::to_search(&options, LengthUnit::Metre).is_none());
        let (centre, up) = (Point3::new(1.0, 0.0, 0.0), Vector3::y());
        let cylinder = Region::about(&centre, &up, &options).unwrap();
        let [beside, beyond, below] =
            [[1.2, 0.0, 0.2], [1.25, 0.0, 0.2], [1.2, -5.0, 0.2]].map(Point3::from);
        assert!(cylinder.contains(&beside) && cylinder.contains(&below));
        assert!(!cylinder.contains(&beyond));

        let options = ScanOptions { plate_near: Some([100.0, 0.0, 0.0]), ..options };
        let about = Region::about(&centre, &up, &options).unwrap();
        let searched = Region::to_search(&options, LengthUnit::Centimetre).unwrap();
        for sphere in [about, searched] {
            assert!(sphere.contains(&beside));
            assert!(!sphere.contains(&beyond) && !sphere.contains(&below));
        }
    }

    #[test]
    fn without_a_crop_there_is_no_region() {
        let options = ScanOptions { plate_near: Some([0.0; 3]), ..ScanOptions::default() };
        assert!(Region::of_file(&options).is_none());
        assert!(Region::to_search(&options, LengthUnit::Metre).is_none());
        assert!(Region::about(&Point3::origin(), &Vector3::z(), &options).is_none());
    }

    #[test]
    fn what_cannot_be_meant_is_refused() {
        use crate::scan::HintFault;
        let base = ScanOptions::default;
        let crop = |crop| ScanOptions { crop: Some(crop), ..base() }.check_hints();
        let radius = |radius_mm| crop(Crop::Radius { radius_mm });
        assert_eq!(radius(213.0), Ok(()));
        for radius_mm in [0.3, 212.0, -300.0, f64::NAN, f64::INFINITY] {
            assert!(matches!(radius(radius_mm), Err(HintFault::CropRadius { .. })), "{radius_mm}");
        }
        let corners = |low, high| crop(Crop::Box { low, high });
        assert_eq!(corners([0.0; 3], [1.0; 3]), Ok(()));
        let flat = corners([0.0; 3], [1.0, 0.0, 1.0]);
        assert_eq!(flat, Err(HintFault::CropBox { axis: 'y', low: 0.0, high: 0.0 }));
        assert!(corners([0.0; 3], [1.0, 1.0, f64::NAN]).is_err());
        let up = |up| ScanOptions { up: Some(up), ..base() }.check_hints();
        assert_eq!(up([0.0, -3.0, 0.0]), Ok(()));
        assert_eq!(up([0.0; 3]), Err(HintFault::Up));
        assert_eq!(up([0.0, f64::NAN, 1.0]), Err(HintFault::Up));
        let near = |place| ScanOptions { plate_near: Some(place), ..base() }.check_hints();
        assert_eq!((near([0.0; 3]), near([f64::INFINITY; 3])), (Ok(()), Err(HintFault::PlateNear)));
    }
}
