//! E57, LAS and LAZ: round trips through the crates' writers, files that other programs have
//! written, damage that checksums do not tell, counts beyond the file, and the rim of a scan in
//! each.

use std::f64::consts::{FRAC_1_SQRT_2, PI};
use std::io::{Cursor, Write as _};
use std::path::{Path, PathBuf};

use ::e57::{
    E57Writer, Quaternion, RawValues, Record, RecordDataType, RecordName, RecordValue, Transform,
    Translation,
};
use ::laz::{LasZipCompressor, LazVlr, LazVlrBuilder};
use rand::RngExt as _;
use scan2params::base::{Point3, seed};
use scan2params::geom::Cloud;
use scan2params::io::{
    Fault, Format, ReadError, ReadOptions, read_scan, read_scan_bytes, read_scan_with,
};
use scan2params::scan::{ScanOptions, WarpToward, boundary_from_scan};

/// Easting, northing and height of a place in a map's projection [m].
const PLACE: [f64; 3] = [691_234.5, 5_336_789.25, 519.0];
/// Pages of an E57 file, and what of one is not its checksum.
const PAGE: usize = 1024;
const PAGE_DATA: usize = PAGE - 4;

fn fixture(name: &str) -> PathBuf {
    Path::new(env!("CARGO_MANIFEST_DIR")).join("fixtures").join(name)
}

fn read(bytes: &[u8], extension: &str) -> Cloud {
    read_scan_bytes(bytes, extension).unwrap_or_else(|error| panic!("{error}")).0
}

fn fail(bytes: &[u8], extension: &str) -> ReadError {
    match read_scan_bytes(bytes, extension) {
        Ok((cloud, _)) => panic!("read as {} points", cloud.points.len()),
        Err(error) => error,
    }
}

/// Point `i` of the files of other programs; the origin of the formula is `fixtures/README.md`.
fn known_point(i: u64) -> [f64; 3] {
    let [x, y, z] = [i, 7 * i % 31, i * i % 97].map(|n| n as f64);
    [0.001 * x, 0.002 * y, -0.0005 * z]
}

fn known_color(i: u64) -> [u8; 3] {
    [(i % 256) as u8, (3 * i % 256) as u8, (255 - i % 256) as u8]
}

/// The greatest difference of a coordinate.
fn apart(points: &[Point3], expected: &[[f64; 3]]) -> f64 {
    assert_eq!(points.len(), expected.len());
    let pairs = points.iter().zip(expected);
    pairs.flat_map(|(p, e)| (0..3).map(move |k| (p[k] - e[k]).abs())).fold(0.0, f64::max)
}

fn moved(p: [f64; 3]) -> [f64; 3] {
    [0, 1, 2].map(|k| p[k] + PLACE[k])
}

// E57 ------------------------------------------------------------------------------------

/// A scan to write.
struct Scan {
    prototype: Vec<Record>,
    pose: Option<Transform>,
    rows: Vec<RawValues>,
}

fn e57_file(scans: &[Scan]) -> Vec<u8> {
    let mut bytes = Vec::new();
    let mut file = E57Writer::new(Cursor::new(&mut bytes), "file").unwrap();
    for scan in scans {
        let mut writer = file.add_pointcloud("scan", scan.prototype.clone()).unwrap();
        writer.set_transform(scan.pose.clone());
        scan.rows.iter().for_each(|row| writer.add_point(row.clone()).unwrap());
        writer.finalize().unwrap();
    }
    file.finalize().unwrap();
    drop(file);
    bytes
}

fn cartesian() -> Vec<Record> {
    vec![Record::CARTESIAN_X_F64, Record::CARTESIAN_Y_F64, Record::CARTESIAN_Z_F64]
}

fn doubles(p: [f64; 3]) -> RawValues {
    p.map(RecordValue::Double).into()
}

fn integers<const N: usize>(values: [i64; N]) -> RawValues {
    values.map(RecordValue::Integer).into()
}

fn pose(rotation: [f64; 4], shift: [f64; 3]) -> Option<Transform> {
    let ([w, x, y, z], [a, b, c]) = (rotation, shift);
    let rotation = Quaternion { w, x, y, z };
    Some(Transform { rotation, translation: Translation { x: a, y: b, z: c } })
}

/// CRC-32C, bit by bit.
fn crc32c(bytes: &[u8]) -> u32 {
    !bytes.iter().fold(u32::MAX, |crc, &byte| {
        (0..8).fold(crc ^ u32::from(byte), |crc, _| (crc >> 1) ^ (0x82f6_3b78 * (crc & 1)))
    })
}

/// Makes the checksums of pages right.
fn seal(bytes: &mut [u8]) {
    for page in bytes.chunks_exact_mut(PAGE) {
        let crc = crc32c(&page[..PAGE_DATA]).to_be_bytes();
        page[PAGE_DATA..].copy_from_slice(&crc);
    }
}

#[test]
fn the_scans_of_an_e57_are_joined_by_their_poses() {
    let colors = [Record::COLOR_RED_U8, Record::COLOR_GREEN_U8, Record::COLOR_BLUE_U8];
    let turned = Scan {
        prototype: [
            cartesian(),
            vec![Record::CARTESIAN_INVALID_STATE, Record::INTENSITY_U16],
            colors.clone().into(),
        ]
        .concat(),
        // a quarter turn about z: x becomes y
        pose: pose([FRAC_1_SQRT_2, 0.0, 0.0, FRAC_1_SQRT_2], PLACE),
        rows: vec![
            [doubles([1.0, 2.0, 3.0]), integers([0, 500, 10, 20, 30])].concat(),
            // invalid, and a direction
            [doubles([7.0, 7.0, 7.0]), integers([2, 0, 0, 0, 0])].concat(),
            [doubles([0.0, 1.0, 0.0]), integers([1, 0, 0, 0, 0])].concat(),
            [doubles([f64::NAN, 1.0, 0.0]), integers([0, 0, 0, 0, 0])].concat(),
            [doubles([0.25, 0.0, -1.0]), integers([0, 65535, 255, 0, 1])].concat(),
        ],
    };
    let spherical = Scan {
        prototype: [
            vec![
                Record::SPHERICAL_RANGE_F64,
                Record::SPHERICAL_AZIMUTH_F64,
                Record::SPHERICAL_ELEVATION_F64,
                Record::SPHERICAL_INVALID_STATE,
            ],
            colors.into(),
        ]
        .concat(),
        pose: None,
        rows: vec![
            [doubles([2.0, PI / 2.0, 0.0]), integers([0, 1, 2, 3])].concat(),
            [doubles([2.0, 0.0, PI / 6.0]), integers([0, 4, 5, 6])].concat(),
            [doubles([9.0, 0.0, 0.0]), integers([1, 0, 0, 0])].concat(),
        ],
    };
    let (cloud, notes) = read_scan_bytes(&e57_file(&[turned, spherical]), "e57").unwrap();
    let expected = [
        moved([-2.0, 1.0, 3.0]),
        moved([0.0, 0.25, -1.0]),
        [0.0, 2.0, 0.0],
        [3_f64.sqrt(), 0.0, 1.0],
    ];
    // Half a nanometre is the step of f64 at these northings.
    assert!(apart(&cloud.points, &expected) < 2e-9, "{:?}", cloud.points);
    assert_eq!(cloud.colors, [[10, 20, 30], [255, 0, 1], [1, 2, 3], [4, 5, 6]]);
    assert_eq!(notes.format, Some(Format::E57));
    assert_eq!((notes.points_in_file, notes.dropped_non_finite), (8, 4));
    assert_eq!(notes.ignored, ["intensity"]);
}

#[test]
fn e57_colours_follow_their_range_and_scaled_integers_their_scale() {
    let scaled = |name| {
        let data_type =
            RecordDataType::ScaledInteger { min: -5000, max: 70_000, scale: 1e-4, offset: 2.0 };
        Record { name, data_type }
    };
    let axes = [RecordName::CartesianX, RecordName::CartesianY, RecordName::CartesianZ];
    let with_colors = |channel: RecordDataType, values: [RecordValue; 3]| {
        let names = [RecordName::ColorRed, RecordName::ColorGreen, RecordName::ColorBlue];
        let channels = names.map(|name| Record { name, data_type: channel.clone() });
        let whole = [-5000, 0, 70_000].map(RecordValue::ScaledInteger);
        let prototype = [axes.clone().map(scaled).to_vec(), channels.into()].concat();
        Scan { prototype, pose: None, rows: vec![[whole, values].concat()] }
    };
    let wide = with_colors(
        RecordDataType::Integer { min: 0, max: 65_535 },
        [0, 32_896, 65_535].map(RecordValue::Integer),
    );
    let unit = with_colors(RecordDataType::UNIT_F32, [0.0, 0.5, 1.0].map(RecordValue::Single));
    // No limits at all: 0 to 1 is meant.
    let open = with_colors(RecordDataType::F32, [0.0, 0.5, 1.0].map(RecordValue::Single));
    let plain = Scan { prototype: cartesian(), pose: None, rows: vec![doubles([1.0, 0.0, 0.0])] };
    let cloud = read(&e57_file(&[wide, unit, open]), "e57");
    assert_eq!(cloud.colors, [[0, 128, 255]; 3]);
    assert!(apart(&cloud.points, &[[1.5, 2.0, 9.0]; 3]) < 1e-12, "{:?}", cloud.points);
    let wide = with_colors(RecordDataType::U8, [1, 2, 3].map(RecordValue::Integer));
    let mixed = read(&e57_file(&[wide, plain]), "e57");
    assert!(mixed.colors.is_empty() && mixed.points.len() == 2, "one scan has no colours");
}

/// A file of one scan, of more than one packet.
fn long_e57(points: u64) -> Vec<u8> {
    let rows = (0..points).map(|i| doubles(known_point(i))).collect();
    e57_file(&[Scan { prototype: cartesian(), pose: None, rows }])
}

#[test]
fn an_e57_that_cannot_be_read_says_what_to_do() {
    let says = |bytes: &[u8], part: &str| {
        let text = fail(bytes, "e57").to_string();
        assert!(text.contains(part), "{text} lacks {part}");
        assert!(text.contains("bytes.e57") && text.len() < 500, "{text}");
    };
    let whole = long_e57(5000);
    assert_eq!(read(&whole, "e57").points.len(), 5000);
    for length in (0..whole.len()).step_by(97) {
        let error = fail(&whole[..length], "e57");
        assert!(length == 0 || error.to_string().contains("again"), "{error}");
    }
    says(&whole[..whole.len() - PAGE], "cut off");
    let mut damaged = whole.clone();
    damaged[2000] ^= 1;
    says(&damaged, "checksum");
    says(&e57_file(&[]), "no points");
    // Beyond the file: refused before anything is allocated.
    let many = with_text(&whole, "recordCount=\"5000\"", "recordCount=\"1e12\"");
    says(&many, "recordCount");
    says(&e57_file(&[Scan { prototype: cartesian(), pose: None, rows: vec![] }]), "no points");
    let more = with_text(&whole, "recordCount=\"5000\"", "recordCount=\"9999\"");
    assert!(matches!(fail(&more, "e57").fault, Fault::Count { count: 9999, .. }));
    // A pose that is no rotation.
    let rows = vec![doubles([1.0, 2.0, 3.0])];
    let zero = pose([0.0; 4], [0.0; 3]);
    says(&e57_file(&[Scan { prototype: cartesian(), pose: zero, rows }]), "pose of scan 1");
    // Only directions: the crate writes none, so the names are changed.
    let none = with_text(&whole, "<cartesianX ", "<cartesianW ");
    says(&with_text(&none, "</cartesianX>", "</cartesianW>"), "no coordinates, but cartesianW");
}

/// 10^12 points in each format; of constants too, which take no bytes.
#[test]
fn counts_of_10_to_the_12_are_refused() {
    let count = |count: u64| format!("recordCount=\"{count}\"");
    let mut many = with_text(&long_e57(300), &count(300), &count(1_000_000_000_000));
    let error = fail(&many, "e57");
    assert!(matches!(error.fault, Fault::Count { count: 1_000_000_000_000, .. }), "{error}");
    // All columns constant: nothing of the file bounds them.
    for axis in ["X", "Y", "Z"] {
        let float = format!("<cartesian{axis} type=\"Float\"");
        let constant = format!("<cartesian{axis} type=\"Integer\" minimum=\"3\" maximum=\"3\"");
        many = with_text(&many, &float, &constant);
    }
    let error = fail(&many, "e57").to_string();
    assert!(error.contains("points without values"), "{error}");
    for (format, packed) in [(0, false), (2, true), (7, true)] {
        let mut bytes = las_file(format, 4, 300, packed.then_some(Some(100)));
        bytes[247..255].copy_from_slice(&1_000_000_000_000_u64.to_le_bytes());
        let error = fail(&bytes, "las");
        assert!(matches!(error.fault, Fault::Count { count: 1_000_000_000_000, .. }), "{error}");
    }
}

/// What the pages of an E57 file hold.
fn data_of(bytes: &[u8]) -> Vec<u8> {
    bytes.chunks_exact(PAGE).flat_map(|page| &page[..PAGE_DATA]).copied().collect()
}

/// The file with another text in its XML, which stands last.
fn with_text(bytes: &[u8], from: &str, to: &str) -> Vec<u8> {
    let mut data = data_of(bytes);
    let at = data.windows(from.len()).position(|w| w == from.as_bytes()).expect("text not found");
    data.splice(at..at + from.len(), to.bytes());
    let end = data.windows(10).rposition(|w| w == b"</e57Root>").unwrap() + 10;
    data.truncate(end);
    let offset = u64::from_le_bytes(*bytes[24..].first_chunk().unwrap()) as usize;
    let length = end - (offset - offset / PAGE * 4);
    data.resize(end.next_multiple_of(PAGE_DATA), 0);
    let pages = data.len() / PAGE_DATA;
    data[16..24].copy_from_slice(&((pages * PAGE) as u64).to_le_bytes());
    data[32..40].copy_from_slice(&(length as u64).to_le_bytes());
    let mut file: Vec<u8> =
        data.chunks_exact(PAGE_DATA).flat_map(|page| [page, &[0; 4]].concat()).collect();
    seal(&mut file);
    file
}

/// Damage under checksums that are right, which `io_fuzz` does not get past.
#[test]
fn a_damaged_e57_with_good_checksums_neither_panics_nor_grows() {
    const CASES: u64 = 3000;
    let seeds = [long_e57(40), std::fs::read(fixture("formats/two_scans.e57")).unwrap()];
    let (mut read, mut refused) = (0, 0);
    for case in 0..CASES {
        let mut rng = seed::rng(3, "io-fuzz-e57", case);
        let mut bytes = seeds[usize::from(case % 8 == 0)].clone();
        for _ in 0..rng.random_range(1..=4) {
            // As often in the XML, which stands last, as anywhere.
            let from = if rng.random() { bytes.len().saturating_sub(3 * PAGE) } else { 0 };
            let at = rng.random_range(from..bytes.len());
            bytes[at] = match rng.random_range(0..4) {
                0 => bytes[at] ^ (1 << rng.random_range(0..8)),
                1 => b"0123456789"[rng.random_range(0..10)],
                2 => 0xff,
                _ => rng.random(),
            };
        }
        seal(&mut bytes);
        match read_scan_bytes(&bytes, "e57") {
            Ok((cloud, notes)) => {
                read += 1;
                assert!(notes.points_in_file <= 8 * bytes.len(), "case {case}");
                assert!(cloud.points.iter().all(|p| p.iter().all(|c| c.is_finite())));
            }
            Err(error) => {
                refused += 1;
                assert!(error.to_string().len() < 500, "{error}");
            }
        }
    }
    assert!(read > CASES / 10 && refused > CASES / 10, "{read} read, {refused} refused");
}

// LAS and LAZ ------------------------------------------------------------------------------

/// Bytes of a point of each format, and where its colour begins.
const RECORDS: [(usize, Option<usize>); 11] = [
    (20, None),
    (28, None),
    (26, Some(20)),
    (34, Some(28)),
    (57, None),
    (63, Some(28)),
    (30, None),
    (36, Some(30)),
    (38, Some(30)),
    (59, None),
    (67, Some(30)),
];
const SCALE: f64 = 1e-4;

/// A point of the known ones; every fiftieth is withheld.
fn record(format: u8, i: u64) -> Vec<u8> {
    let (length, color) = RECORDS[usize::from(format)];
    // What is not read differs from point to point.
    let mut record: Vec<u8> = (0..length as u64).map(|k| (k * 31 + i * (k % 3)) as u8).collect();
    for (k, c) in known_point(i).into_iter().enumerate() {
        let whole = (c / SCALE).round() as i32;
        record[4 * k..4 * k + 4].copy_from_slice(&whole.to_le_bytes());
    }
    let gone = u8::from(i % 50 == 13);
    record[15] = gone << if format < 6 { 7 } else { 2 };
    if let Some(at) = color {
        for (k, c) in known_color(i).into_iter().enumerate() {
            record[at + 2 * k..at + 2 * k + 2].copy_from_slice(&(u16::from(c) * 257).to_le_bytes());
        }
    }
    record
}

/// A header of LAS 1.`minor`, with room for the wider one.
fn las_header(format: u8, minor: u8, points: u64, offset: [f64; 3], vlr: &[u8]) -> Vec<u8> {
    let mut header = vec![0; 375];
    header[..4].copy_from_slice(b"LASF");
    header[24..26].copy_from_slice(&[1, minor]);
    header[94..96].copy_from_slice(&375_u16.to_le_bytes());
    let vlrs = if vlr.is_empty() { 0 } else { 54 + vlr.len() };
    header[96..100].copy_from_slice(&(375 + vlrs as u32).to_le_bytes());
    header[100..104].copy_from_slice(&u32::from(vlrs > 0).to_le_bytes());
    header[104] = format | if vlrs > 0 { 0x80 } else { 0 };
    let length = RECORDS[usize::from(format)].0 as u16;
    header[105..107].copy_from_slice(&length.to_le_bytes());
    header[107..111].copy_from_slice(&(points as u32).to_le_bytes());
    for k in 0..3 {
        header[131 + 8 * k..139 + 8 * k].copy_from_slice(&SCALE.to_le_bytes());
        header[155 + 8 * k..163 + 8 * k].copy_from_slice(&offset[k].to_le_bytes());
    }
    header[247..255].copy_from_slice(&points.to_le_bytes());
    if vlrs > 0 {
        let mut head = vec![0; 54];
        head[2..2 + LazVlr::USER_ID.len()].copy_from_slice(LazVlr::USER_ID.as_bytes());
        head[18..20].copy_from_slice(&LazVlr::RECORD_ID.to_le_bytes());
        head[20..22].copy_from_slice(&(vlr.len() as u16).to_le_bytes());
        header.extend(head);
        header.extend(vlr);
    }
    header
}

/// A file of the known points in the map's projection. `chunk`: compressed, in chunks of so many
/// points, or of varying length.
fn las_file(format: u8, minor: u8, points: u64, chunk: Option<Option<u32>>) -> Vec<u8> {
    let records = (0..points).map(|i| record(format, i)).collect();
    las_of(format, minor, records, PLACE, chunk)
}

fn las_of(
    format: u8,
    minor: u8,
    records: Vec<Vec<u8>>,
    offset: [f64; 3],
    chunk: Option<Option<u32>>,
) -> Vec<u8> {
    let points = records.len() as u64;
    let Some(chunk) = chunk else {
        return [las_header(format, minor, points, offset, &[]), records.concat()].concat();
    };
    let vlr = LazVlrBuilder::default().with_point_format(format, 0).unwrap();
    let vlr = match chunk {
        Some(size) => vlr.with_fixed_chunk_size(size),
        None => vlr.with_variable_chunk_size(),
    };
    let vlr = vlr.build();
    let mut said = Vec::new();
    vlr.write_to(&mut said).unwrap();
    let mut bytes = Cursor::new(Vec::new());
    bytes.write_all(&las_header(format, minor, points, offset, &said)).unwrap();
    let mut packer = LasZipCompressor::new(bytes, vlr).unwrap();
    for (record, i) in records.iter().zip(1..) {
        packer.compress_one(record).unwrap();
        if chunk.is_none() && i % 70 == 0 {
            packer.finish_current_chunk().unwrap();
        }
    }
    packer.done().unwrap();
    packer.into_inner().into_inner()
}

#[test]
fn las_and_laz_of_every_point_format() {
    let expected: Vec<u64> = (0..1000).filter(|i| i % 50 != 13).collect();
    let at: Vec<[f64; 3]> = expected.iter().map(|&i| moved(known_point(i))).collect();
    let colors: Vec<[u8; 3]> = expected.iter().map(|&i| known_color(i)).collect();
    for format in 0..=10 {
        // In chunks that end before, with and after the file, and of varying length where there are
        // layers.
        let mut chunks = vec![None, Some(Some(300)), Some(Some(1000)), Some(Some(50_000))];
        chunks.extend((format >= 6).then_some(Some(None)));
        for chunk in chunks {
            let bytes = las_file(format, 4, 1000, chunk);
            let (cloud, notes) = read_scan_bytes(&bytes, "laz")
                .unwrap_or_else(|error| panic!("{format} {chunk:?}: {error}"));
            // Half a nanometre is the step of f64 at these northings.
            assert!(apart(&cloud.points, &at) < 2e-9, "{format} {chunk:?}");
            let colored = RECORDS[usize::from(format)].1.is_some();
            assert_eq!(cloud.colors, if colored { colors.clone() } else { vec![] });
            let counts = (notes.points_in_file, notes.dropped_non_finite);
            assert_eq!((counts, notes.format), ((1000, 20), Some(Format::Las)));
            assert!(notes.ignored.iter().any(|name| name == "intensity"));
        }
    }
    // Of LAS 1.0, whose bit is part of the class; of 8 bits to a colour.
    let mut eight: Vec<Vec<u8>> = (0..100).map(|i| record(2, i)).collect();
    for record in &mut eight {
        record[20..26].copy_from_slice(&[7, 0, 8, 0, 255, 0]);
    }
    let cloud = read(&las_of(2, 0, eight, PLACE, None), "las");
    assert_eq!(cloud.colors, vec![[7, 8, 255]; 100]);
    // Sequential chunks of varying length would need the table of chunks.
    let error = fail(&las_file(2, 2, 300, Some(None)), "laz");
    assert!(error.to_string().contains("varying length"), "{error}");
}

#[test]
fn a_las_that_cannot_be_read_says_where() {
    for (format, chunk) in [(3, None), (3, Some(Some(100))), (7, Some(Some(100)))] {
        let whole = las_file(format, 4, 300, chunk);
        let points = whole.len() - 8;
        for length in (0..points).step_by(13) {
            let result = read_scan_bytes(&whole[..length], "las");
            // The table of chunks, which stands last, is not read.
            let table = chunk.is_some() && result.is_ok() && length + 40 > points;
            assert!(result.is_err() || table, "{format} {chunk:?} of {length} bytes");
            if let Err(error) = result {
                assert!(length == 0 || error.to_string().contains("again"), "{error}");
            }
        }
    }
    let whole = las_file(2, 2, 300, None);
    let changed = |at: usize, to: &[u8]| {
        let mut bytes = whole.clone();
        bytes[at..at + to.len()].copy_from_slice(to);
        fail(&bytes, "las").to_string()
    };
    for (at, to, part) in [
        (24, &[2][..], "version 2.2"),
        (104, &[11], "format 11"),
        (105, &[25, 0], "they take 26"),
        (94, &[1, 0], "a header of 1 bytes"),
        (131, &[0; 8], "scale [0.0"),
        // compressed, as it says, but not how
        (104, &[0x82], "LASzip"),
    ] {
        let text = changed(at, to);
        assert!(text.contains(part) && text.contains("at byte"), "{text} lacks {part}");
    }
    // A coder that starts outside of its range: what would read past a table's end.
    let mut bytes = las_file(2, 2, 300, Some(Some(300)));
    let coder = 375
        + 54
        + LazVlrBuilder::default()
            .with_point_format(2, 0)
            .map(|vlr| {
                let mut said = Vec::new();
                vlr.build().write_to(&mut said).unwrap();
                said.len()
            })
            .unwrap()
        + 8
        + 26;
    bytes[coder..coder + 64].fill(0xff);
    assert!(fail(&bytes, "las").to_string().contains("damaged"));
}

// Files that other programs have written ------------------------------------------------------

#[test]
fn files_of_other_programs_read_as_they_were_meant() {
    let expected: Vec<u64> = (0..300).filter(|i| i % 50 != 13).collect();
    let at: Vec<[f64; 3]> = expected.iter().map(|&i| moved(known_point(i))).collect();
    let colors: Vec<[u8; 3]> = expected.iter().map(|&i| known_color(i)).collect();
    for name in ["chunked.laz", "layered.laz"] {
        let (cloud, notes) = read_scan(fixture("formats").join(name)).unwrap();
        assert!(apart(&cloud.points, &at) < 2e-9, "{name}");
        assert_eq!((cloud.colors.as_slice(), notes.dropped_non_finite), (&colors[..], 6));
    }
    let (cloud, notes) = read_scan(fixture("formats/two_scans.e57")).unwrap();
    // The first a quarter turn about z, the second off by 1, 2, 3 m, all but its first point
    // spherical.
    let second = (0..300).filter(|i| i % 50 != 7);
    let first = expected.iter().map(|&i| known_point(i)).map(|[x, y, z]| moved([-y, x, z]));
    let spherical =
        second.clone().map(known_point).map(|[x, y, z]| moved([x + 1.0, y + 2.0, z + 3.0]));
    let at: Vec<[f64; 3]> = first.chain(spherical).collect();
    assert!(apart(&cloud.points, &at) < 2e-9);
    let colors: Vec<[u8; 3]> = expected.into_iter().chain(second).map(known_color).collect();
    assert_eq!(cloud.colors, colors);
    assert_eq!((notes.points_in_file, notes.dropped_non_finite), (600, 12));
}

// The whole path -------------------------------------------------------------------------------

/// A scan in metres as E57 with a pose and as LAZ in a map's projection gives the rim of the scan.
#[test]
fn an_e57_and_a_laz_of_a_scan_give_the_rim_of_the_scan() {
    let (scan, _) = read_scan(fixture("scans/stiff_structured-light.ply")).unwrap();
    let metres: Vec<[f64; 3]> =
        scan.points.iter().map(|p| [p.x / 1e3, p.y / 1e3, p.z / 1e3]).collect();
    // The frame of the scan's station: turned by a quarter about z, so its pose turns back.
    let station = |[x, y, z]: [f64; 3]| doubles([y, -x, z]);
    let rows = metres.iter().map(|&p| station(p)).collect();
    let turn = pose([FRAC_1_SQRT_2, 0.0, 0.0, FRAC_1_SQRT_2], PLACE);
    let e57 = e57_file(&[Scan { prototype: cartesian(), pose: turn, rows }]);
    let records = metres.iter().map(|p| {
        let whole = p.map(|c| (c / SCALE).round() as i32);
        let mut record = whole.map(i32::to_le_bytes).concat();
        record.resize(RECORDS[6].0, 0);
        record
    });
    let laz = las_of(6, 4, records.collect(), PLACE, Some(Some(50_000)));
    let warp_toward = Some(WarpToward::Direction([1.0, 0.0, 0.0]));
    let options = ScanOptions { warp_toward, ..ScanOptions::default() };
    let rim = |cloud: &Cloud| boundary_from_scan(cloud, &options).unwrap().boundary;
    let own = rim(&scan);
    for (bytes, extension) in [(e57, "e57"), (laz, "laz")] {
        let cloud = read(&bytes, extension);
        assert_eq!(cloud.points.len(), scan.points.len());
        let apart_m = own.mean_distance_m(&rim(&cloud));
        eprintln!("{extension}: rims {apart_m:e} m apart");
        assert!(apart_m < 1e-4, "{extension}: {apart_m} m");
    }
}

#[test]
fn the_format_is_known_by_content_extension_and_flag() {
    let (e57, las) = (long_e57(10), las_file(0, 2, 10, None));
    for (bytes, content) in [(&e57, ".e57"), (&las, ".las")] {
        let error = fail(bytes, "ply");
        assert!(matches!(error.fault, Fault::Misnamed { content: c } if c == content), "{error}");
    }
    assert!(fail(b"ply\nformat ascii 1.0\n", "laz").to_string().contains("end in .ply"));
    assert_eq!(Format::named("LAZ"), Some(Format::Las));
    let folder = tempfile::tempdir().unwrap();
    for (bytes, format) in [(e57, Format::E57), (las, Format::Las)] {
        let path = folder.path().join("nameless.bin");
        std::fs::write(&path, bytes).unwrap();
        let options = ReadOptions { format: Some(format), ..ReadOptions::default() };
        assert!(read_scan_with(&path, &options).unwrap().0.points.len() >= 9);
    }
}
