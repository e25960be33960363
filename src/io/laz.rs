//! The points of a LAZ file, unpacked chunk by chunk.
//!
//! The crate `laz` decodes what LASzip has written (items of versions 1 to 4: all point
//! formats). It takes a file at its word: it allocates what a layer or a table says it is
//! long, and reads past the end of a table where the coder's first value is larger
//! than its range. So each chunk is held against the file before it is decoded, the table of
//! chunks is not read (they follow one another), and what a byte may stand for is bounded.
//!
//! Fails where a chunk is damaged or ends before its points, and on chunks of varying
//! length that are not in layers, whose ends only that table knows (nothing known writes them).

use std::io::{Cursor, ErrorKind};

use ::laz::record::{
    LayeredPointRecordDecompressor, RecordDecompressor, SequentialPointRecordDecompressor,
};
use ::laz::{LazItem, LazItemType, LazVlr};

use super::las_header::{Header, layout};
use super::{At, Fault};

/// A point in LAZ takes an eighth of a bit at least: a scan takes bytes, but a thousand equal
/// points one.
const MOST_POINTS_PER_BYTE: u128 = 64;
/// Bytes before the first chunk: where the table of chunks stands.
const TABLE_OFFSET: usize = 8;
/// The bytes that start a coder.
const CODER_START: usize = 4;

/// How the points are cut.
enum Chunks {
    /// All in one.
    One,
    /// So many each, one after another.
    Sequential(u64),
    /// In layers; so many each, or as many as each says.
    Layered(Option<u64>),
}

/// Unpacks each point and hands it on.
pub(super) fn unpack(bytes: &[u8], header: &Header, mut each: impl FnMut(&[u8])) -> Result<(), At> {
    let (items, chunks) = packing(bytes, header)?;
    let needs = u128::from(header.points).div_ceil(MOST_POINTS_PER_BYTE);
    header.check(needs, bytes.len() - header.payload)?;
    let first = if matches!(chunks, Chunks::One) { 0 } else { TABLE_OFFSET };
    let (mut at, mut done) = (header.payload + first, 0);
    let mut record = vec![0; header.record];
    while done < header.points {
        let left = header.points - done;
        let start = bytes.get(at..).unwrap_or_default();
        let (size, length) = match chunks {
            Chunks::One => (left, start.len()),
            Chunks::Sequential(size) => (size.min(left), start.len()),
            Chunks::Layered(size) => {
                let (said, length) = layers(start, header.record, &items, at)?;
                (size.unwrap_or(said).min(left), length)
            }
        };
        let mut read = 0;
        let mut decoded = |record: &[u8]| {
            read += 1;
            each(record);
        };
        let used = if matches!(chunks, Chunks::Layered(_)) {
            let mut layered = LayeredPointRecordDecompressor::new(Cursor::new(&start[..length]));
            decode(&mut layered, &items, size, &mut record, &mut decoded).map(|()| length)
        } else {
            check_coder(start.get(header.record..).unwrap_or_default(), at + header.record)?;
            let mut sequential = SequentialPointRecordDecompressor::new(Cursor::new(start));
            decode(&mut sequential, &items, size, &mut record, &mut decoded)
                .map(|()| sequential.get().position() as usize)
        };
        at += used.map_err(|error| broken(&error, at, done + read, header.points))?;
        done += size;
    }
    Ok(())
}

/// What the file says of its packing: the parts of a point, which make up the whole of it, and the
/// chunks.
fn packing(bytes: &[u8], header: &Header) -> Result<(Vec<LazItem>, Chunks), At> {
    let damaged = |text: &str| layout(header.payload, format!("the LAZ file {text}"));
    let vlr = header
        .vlr(bytes, LazVlr::USER_ID.as_bytes(), LazVlr::RECORD_ID)
        .ok_or_else(|| damaged("does not say how it is compressed (no LASzip record)"))?;
    let compressor = vlr.first_chunk().map(|b| u16::from_le_bytes(*b));
    let vlr = LazVlr::from_buffer(vlr)
        .map_err(|error| damaged(&format!("has a LASzip record that cannot be read ({error})")))?;
    let items = vlr.items();
    let layered = |item: &LazItem| match (item.item_type(), item.version()) {
        (
            LazItemType::Point10
            | LazItemType::GpsTime
            | LazItemType::RGB12
            | LazItemType::WavePacket13
            | LazItemType::Byte(_),
            1 | 2,
        ) => Some(false),
        (
            LazItemType::Point14
            | LazItemType::RGB14
            | LazItemType::RGBNIR14
            | LazItemType::WavePacket14
            | LazItemType::Byte14(_),
            3 | 4,
        ) => Some(true),
        _ => None,
    };
    let kind = items.first().and_then(layered);
    let alike = kind.is_some() && items.iter().all(|item| layered(item) == kind);
    let whole: usize = items.iter().map(size_of_item).sum();
    let starts = matches!(
        items.first().map(LazItem::item_type),
        Some(LazItemType::Point10 | LazItemType::Point14)
    );
    if !alike || !starts || whole != header.record || items.iter().any(|i| size_of_item(i) == 0) {
        let text = "names parts of a point that are not those of its points";
        return Err(damaged(text));
    }
    let size = (!vlr.uses_variable_size_chunks()).then(|| u64::from(vlr.chunk_size()));
    let chunks = match (compressor, kind, size) {
        (Some(1), Some(false), _) => Chunks::One,
        (Some(2), Some(false), Some(size)) => Chunks::Sequential(size),
        (Some(2), Some(false), None) => {
            return Err(damaged("has chunks of varying length without layers"));
        }
        (Some(3), Some(true), size) => Chunks::Layered(size),
        _ => return Err(damaged("is compressed in a way that is not known")),
    };
    Ok((items.clone(), chunks))
}

/// The bytes that a part takes when it is unpacked, not what the file states.
fn size_of_item(item: &LazItem) -> usize {
    match item.item_type() {
        LazItemType::Byte(size) | LazItemType::Byte14(size) => usize::from(size),
        LazItemType::Point10 => 20,
        LazItemType::GpsTime | LazItemType::RGBNIR14 => 8,
        LazItemType::RGB12 | LazItemType::RGB14 => 6,
        LazItemType::WavePacket13 | LazItemType::WavePacket14 => 29,
        LazItemType::Point14 => 30,
    }
}

/// The layers into which a part is cut.
fn layers_of_item(item: &LazItem) -> usize {
    match item.item_type() {
        LazItemType::Point14 => 9,
        LazItemType::RGBNIR14 => 2,
        LazItemType::Byte14(size) => usize::from(size),
        _ => 1,
    }
}

/// The points of a layered chunk, as it says, and its bytes, all of which are there.
fn layers(chunk: &[u8], record: usize, items: &[LazItem], at: usize) -> Result<(u64, usize), At> {
    let number = |k: usize| chunk.get(record + 4 * k..).and_then(|b| b.first_chunk());
    let number = |k: usize| number(k).map(|b| u32::from_le_bytes(*b) as usize);
    let cut = || layout(at, "the file ends inside a compressed chunk: it is cut off or damaged");
    let layers: usize = items.iter().map(layers_of_item).sum();
    let points = number(0).filter(|&n| n > 0).ok_or_else(cut)?;
    let mut end = record + 4 * (layers + 1);
    for layer in 1..=layers {
        let size = number(layer).ok_or_else(cut)?;
        let next = end.checked_add(size).filter(|&next| next <= chunk.len()).ok_or_else(cut)?;
        if size > 0 {
            check_coder(&chunk[end..next], at + end)?;
        }
        end = next;
    }
    Ok((points as u64, end))
}

/// Refuses a coder that starts outside its range, which no encoder does.
fn check_coder(start: &[u8], at: usize) -> Result<(), At> {
    match start.first_chunk::<CODER_START>() {
        Some([0xff, 0xff, 0xff, 0xff]) => Err(layout(at, "the compressed points are damaged")),
        _ => Ok(()),
    }
}

/// Decodes the points of one chunk.
fn decode<R>(
    decoder: &mut dyn RecordDecompressor<R>,
    items: &Vec<LazItem>,
    points: u64,
    record: &mut [u8],
    each: &mut dyn FnMut(&[u8]),
) -> Result<(), ::laz::LasZipError> {
    decoder.set_fields_from(items)?;
    for _ in 0..points {
        decoder.decompress_next(record)?;
        each(record);
    }
    Ok(())
}

/// What is wrong with a chunk at `at` of which point `done` (from 0) could not be decoded.
fn broken(error: &::laz::LasZipError, at: usize, done: u64, points: u64) -> At {
    match error {
        ::laz::LasZipError::IoError(io) if io.kind() == ErrorKind::UnexpectedEof => {
            let count = usize::try_from(points).unwrap_or(usize::MAX);
            let number = usize::try_from(done).unwrap_or(usize::MAX).saturating_add(1);
            Fault::Truncated { element: "point".to_owned(), number, count }.at_byte(at)
        }
        error => layout(at, format!("the compressed points are damaged ({error})")),
    }
}
