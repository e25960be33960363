//! E57 (ASTM E2807): every scan of the file, in the file's frame.
//!
//! The crate `e57` reads pages, checksums, XML and packets. In: a file's bytes. Out: the
//! points of all scans (`data3D`), Cartesian or else spherical ones, each turned and shifted by
//! its scan's pose; colours if every scan with points has them. Points that the file says to be
//! invalid become NaN, which is dropped, and so do directions without a range. The
//! standard's unit is the metre; found from the scene all the same, as of every file.
//!
//! Fails on checksums, on scans without coordinates, on poses that are no rotation, and on counts
//! beyond the file: the crate trusts them, and would fill the memory with points all of whose
//! values are constants.

use std::io::Cursor;

use ::e57::{
    E57Reader, PointCloud, RawValues, Record, RecordDataType, RecordName, RecordValue, Transform,
};
use nalgebra::{Quaternion, Translation3, UnitQuaternion};

use super::assemble::Raw;
use super::error::shown;
use super::{At, Fault};
use crate::base::{Isometry3, Point3};

/// Bytes of the header.
const HEADER: usize = 48;
/// How far the length of a rotation's quaternion may be from 1: what few written digits cost.
const QUATERNION_SLACK: f64 = 1e-3;

pub(super) fn read(bytes: &[u8]) -> Result<Raw, At> {
    check_header(bytes)?;
    let mut file = E57Reader::new(Cursor::new(bytes)).map_err(|error| damaged(&error))?;
    let scans = file.pointclouds();
    check_counts(&scans, bytes.len())?;
    let mut raw = Raw::default();
    let mut colored = true;
    for (scan, number) in scans.iter().zip(1..).filter(|(scan, _)| scan.records > 0) {
        let reading = Reading::new(scan, number)?;
        colored &= reading.color.is_some();
        for record in file.pointcloud_raw(scan).map_err(|error| damaged(&error))? {
            let values = record.map_err(|error| damaged(&error))?;
            raw.points.push(reading.position(&values));
            if let Some(color) = &reading.color {
                raw.colors.push(color.of(&values));
            }
        }
        for name in scan.prototype.iter().filter_map(|record| unused(&record.name)) {
            if !raw.ignored.contains(&name) {
                raw.ignored.push(name);
            }
        }
    }
    if !colored {
        raw.colors.clear();
    }
    if !file.images().is_empty() {
        raw.ignored.push("images2D".to_owned());
    }
    Ok(raw)
}

fn layout(text: impl std::fmt::Display) -> At {
    let fault = format!("{text}; export the file again, or convert it to PLY");
    Fault::Layout(fault).anywhere()
}

/// What the crate says, in one line.
fn damaged(error: &::e57::Error) -> At {
    let text: String = error.to_string().chars().take(200).collect();
    let text = text.replace(|c: char| c.is_control(), " ");
    layout(format!("the E57 file cannot be read: {text}"))
}

/// Refuses a file that is shorter than its header says, or than its XML.
fn check_header(bytes: &[u8]) -> Result<(), At> {
    if bytes.len() < HEADER {
        return Err(layout("the file ends inside its E57 header"));
    }
    let number = |at: usize| bytes[at..].first_chunk().map_or(0, |b| u64::from_le_bytes(*b));
    let (length, xml, has) = (number(16), number(32), bytes.len());
    if length.max(xml) > has as u64 {
        return Err(layout(format!(
            "the E57 header announces {} bytes, but the file has {has}: it is cut off or damaged",
            length.max(xml)
        )));
    }
    Ok(())
}

/// Bits of a value in the file; of a constant none.
fn bits(kind: &RecordDataType) -> u32 {
    match kind {
        RecordDataType::Single { .. } => 32,
        RecordDataType::Double { .. } => 64,
        RecordDataType::Integer { min, max } | RecordDataType::ScaledInteger { min, max, .. } => {
            (i128::from(*max) - i128::from(*min)).checked_ilog2().map_or(0, |log| log + 1)
        }
    }
}

/// Refuses more points, of all scans together, than the file can hold.
fn check_counts(scans: &[PointCloud], has: usize) -> Result<(), At> {
    let (mut count, mut needs_bits) = (0_u64, 0_u128);
    for (scan, number) in scans.iter().zip(1..).filter(|(scan, _)| scan.records > 0) {
        let each: u32 = scan.prototype.iter().map(|record| bits(&record.data_type)).sum();
        if each == 0 {
            return Err(layout(format!("scan {number} of the E57 file has points without values")));
        }
        count = count.saturating_add(scan.records);
        needs_bits = needs_bits.saturating_add(u128::from(scan.records) * u128::from(each));
    }
    let needs = needs_bits.div_ceil(8);
    if needs > has as u128 {
        let element = "point".to_owned();
        return Err(Fault::Count { element, count, needs, has }.anywhere());
    }
    Ok(())
}

/// Where in a point's values something stands, and how it is read.
struct Column {
    index: usize,
    kind: RecordDataType,
}

impl Column {
    fn of(scan: &PointCloud, name: &RecordName) -> Option<Self> {
        let index = scan.prototype.iter().position(|record| record.name == *name)?;
        let Record { data_type, .. } = &scan.prototype[index];
        Some(Self { index, kind: data_type.clone() })
    }

    fn three(scan: &PointCloud, names: [RecordName; 3]) -> Option<[Self; 3]> {
        let [a, b, c] = names.map(|name| Self::of(scan, &name));
        Some([a?, b?, c?])
    }

    fn value(&self, values: &RawValues) -> f64 {
        values.get(self.index).and_then(|v| v.to_f64(&self.kind).ok()).unwrap_or(f64::NAN)
    }
}

/// How the points of one scan are read.
struct Reading {
    cartesian: Option<[Column; 3]>,
    cartesian_invalid: Option<Column>,
    spherical: Option<[Column; 3]>,
    spherical_invalid: Option<Column>,
    color: Option<Color>,
    file_from_scan: Isometry3,
}

impl Reading {
    fn new(scan: &PointCloud, number: usize) -> Result<Self, At> {
        use RecordName::{
            CartesianInvalidState, CartesianX, CartesianY, CartesianZ, SphericalAzimuth,
            SphericalElevation, SphericalInvalidState, SphericalRange,
        };
        let cartesian = Column::three(scan, [CartesianX, CartesianY, CartesianZ]);
        let spherical = Column::three(scan, [SphericalRange, SphericalAzimuth, SphericalElevation]);
        if cartesian.is_none() && spherical.is_none() {
            let has: Vec<String> = scan.prototype.iter().map(|r| name_of(&r.name)).collect();
            let has = shown(has.join(", ").as_bytes());
            let text = format!("scan {number} of the E57 file has no coordinates, but {has}");
            return Err(layout(text));
        }
        Ok(Self {
            cartesian,
            cartesian_invalid: Column::of(scan, &CartesianInvalidState),
            spherical,
            spherical_invalid: Column::of(scan, &SphericalInvalidState),
            color: Color::of_scan(scan),
            file_from_scan: pose(scan.transform.as_ref(), number)?,
        })
    }

    /// The position in the file's frame; NaN where the file has none.
    fn position(&self, values: &RawValues) -> Point3 {
        let three = |columns: &Option<[Column; 3]>, invalid: &Option<Column>| {
            let valid = invalid.as_ref().is_none_or(|state| state.value(values) == 0.0);
            columns.as_ref().filter(|_| valid).map(|c| c.each_ref().map(|c| c.value(values)))
        };
        let cartesian = three(&self.cartesian, &self.cartesian_invalid);
        let position = cartesian.or_else(|| {
            let [range, azimuth, elevation] = three(&self.spherical, &self.spherical_invalid)?;
            let level = range * elevation.cos();
            Some([level * azimuth.cos(), level * azimuth.sin(), range * elevation.sin()])
        });
        self.file_from_scan * Point3::from(position.unwrap_or([f64::NAN; 3]))
    }
}

/// The pose of a scan as a motion.
fn pose(transform: Option<&Transform>, number: usize) -> Result<Isometry3, At> {
    let Some(Transform { rotation: q, translation: t }) = transform else {
        return Ok(Isometry3::identity());
    };
    let quaternion = Quaternion::new(q.w, q.x, q.y, q.z);
    let rigid = (quaternion.norm() - 1.0).abs() <= QUATERNION_SLACK;
    if !rigid || ![t.x, t.y, t.z].iter().all(|shift| shift.is_finite()) {
        return Err(layout(format!("the pose of scan {number} of the E57 file is no motion")));
    }
    let turn = UnitQuaternion::from_quaternion(quaternion);
    Ok(Isometry3::from_parts(Translation3::new(t.x, t.y, t.z), turn))
}

/// How the colours of a scan are read.
struct Color {
    channels: [Column; 3],
    /// The least and the greatest value of each channel.
    range: [[f64; 2]; 3],
    invalid: Option<Column>,
}

impl Color {
    fn of_scan(scan: &PointCloud) -> Option<Self> {
        use RecordName::{ColorBlue, ColorGreen, ColorRed, IsColorInvalid};
        let channels = Column::three(scan, [ColorRed, ColorGreen, ColorBlue])?;
        let said = scan.color_limits.as_ref().map(|limits| {
            [
                [&limits.red_min, &limits.red_max],
                [&limits.green_min, &limits.green_max],
                [&limits.blue_min, &limits.blue_max],
            ]
        });
        let range = [0, 1, 2].map(|k| {
            let kind = &channels[k].kind;
            let said = said.map(|all| all[k].map(|limit| limit.as_ref().map(|v| plain(v, kind))));
            match said {
                Some([Some(least), Some(most)]) if least < most => [least, most],
                _ => range_of(kind),
            }
        });
        Some(Self { channels, range, invalid: Column::of(scan, &IsColorInvalid) })
    }

    /// The colour of a point; black where the file has none.
    fn of(&self, values: &RawValues) -> [u8; 3] {
        if self.invalid.as_ref().is_some_and(|state| state.value(values) != 0.0) {
            return [0; 3];
        }
        [0, 1, 2].map(|k| {
            let [least, most] = self.range[k];
            // What is no number becomes 0.
            ((self.channels[k].value(values) - least) / (most - least) * 255.0).round() as u8
        })
    }
}

/// A limit as a number.
fn plain(limit: &RecordValue, kind: &RecordDataType) -> f64 {
    limit.to_f64(kind).unwrap_or(f64::NAN)
}

/// The values that a type can take; of floats that do not say it, 0 to 1.
fn range_of(kind: &RecordDataType) -> [f64; 2] {
    match kind {
        RecordDataType::Integer { min, max } => [*min as f64, *max as f64],
        RecordDataType::ScaledInteger { min, max, scale, offset } => {
            [min, max].map(|&whole| whole as f64 * scale + offset)
        }
        RecordDataType::Single { min: Some(min), max: Some(max) } => {
            [f64::from(*min), f64::from(*max)]
        }
        RecordDataType::Double { min: Some(min), max: Some(max) } => [*min, *max],
        RecordDataType::Single { .. } | RecordDataType::Double { .. } => [0.0, 1.0],
    }
}

/// The name of a column that nothing is read from.
fn unused(name: &RecordName) -> Option<String> {
    use RecordName::{
        CartesianInvalidState, CartesianX, CartesianY, CartesianZ, ColorBlue, ColorGreen, ColorRed,
        IsColorInvalid, SphericalAzimuth, SphericalElevation, SphericalInvalidState,
        SphericalRange,
    };
    match name {
        CartesianX
        | CartesianY
        | CartesianZ
        | CartesianInvalidState
        | SphericalRange
        | SphericalAzimuth
        | SphericalElevation
        | SphericalInvalidState
        | ColorRed
        | ColorGreen
        | ColorBlue
        | IsColorInvalid => None,
        name => Some(name_of(name)),
    }
}

/// The name of a column as the standard has it.
fn name_of(name: &RecordName) -> String {
    if let RecordName::Unknown { name, .. } = name {
        return shown(name.as_bytes());
    }
    let name = format!("{name:?}");
    name[..1].to_ascii_lowercase() + &name[1..]
}
