//! The header of a LAS file: what it says of the points, and its variable-length records.
//!
//! Fails where it contradicts itself or the file's length; a count of points is held
//! against the file by those who read them ([`Header::check`]).

use super::{At, Fault};

/// Bytes of the header of LAS 1.0 to 1.2, the shortest.
const LEAST_HEADER: usize = 227;
/// Bytes of the header of LAS 1.4, the first with counts of 64 bits.
const WIDE_HEADER: usize = 375;
/// Bytes before the data of a variable-length record.
const VLR_HEADER: usize = 54;

/// For each point format: its bytes, and where its colour begins.
const FORMATS: [(usize, Option<usize>); 11] = [
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

/// What the header says of the points.
pub(super) struct Header {
    /// 0 to 10.
    pub(super) format: u8,
    /// The minor version.
    pub(super) minor: u8,
    /// Bytes of a point.
    pub(super) record: usize,
    pub(super) points: u64,
    /// Bytes of a point of the format, without what the file adds.
    pub(super) least: usize,
    /// Where in a point its colour begins.
    pub(super) color: Option<usize>,
    pub(super) scale: [f64; 3],
    pub(super) offset: [f64; 3],
    /// Where the points start.
    pub(super) payload: usize,
    pub(super) packed: bool,
    /// Where the variable-length records start.
    records: usize,
    /// How many they are.
    record_count: u32,
}

pub(super) fn layout(byte: usize, text: impl std::fmt::Display) -> At {
    let fault = format!("{text}; export the file again, or convert it to PLY");
    Fault::Layout(fault).at_byte(byte)
}

/// The number of `N` bytes at `at`, which the file is known to hold.
pub(super) fn field<const N: usize>(bytes: &[u8], at: usize) -> [u8; N] {
    let mut field = [0; N];
    field.copy_from_slice(&bytes[at..at + N]);
    field
}

impl Header {
    pub(super) fn read(bytes: &[u8]) -> Result<Self, At> {
        if bytes.len() < LEAST_HEADER {
            return Err(layout(bytes.len(), "the file ends inside its LAS header"));
        }
        let u16_at = |at| u16::from_le_bytes(field(bytes, at));
        let u32_at = |at| u32::from_le_bytes(field(bytes, at));
        let triple = |at: usize| [0, 8, 16].map(|axis| f64::from_le_bytes(field(bytes, at + axis)));
        if !bytes.starts_with(b"LASF") {
            return Err(layout(0, "a LAS file starts with `LASF`; this one is damaged"));
        }
        let (major, minor) = (bytes[24], bytes[25]);
        if major != 1 || minor > 4 {
            return Err(layout(
                24,
                format!("LAS of version {major}.{minor}, known are 1.0 to 1.4"),
            ));
        }
        // LASzip sets the uppermost bit; an early one set the next too.
        let (format, packed) = (bytes[104] & 0x3f, bytes[104] & 0xc0 != 0);
        let Some(&(least, color)) = FORMATS.get(usize::from(format)) else {
            return Err(layout(104, format!("points of format {format}, known are 0 to 10")));
        };
        let record = usize::from(u16_at(105));
        if record < least {
            let text = format!("points of format {format} in {record} bytes, they take {least}");
            return Err(layout(105, text));
        }
        let records = usize::from(u16_at(94));
        let payload = u32_at(96) as usize;
        if records < LEAST_HEADER || payload < records || payload > bytes.len() {
            let text = format!(
                "a header of {records} bytes and points from byte {payload} on in a file of {} bytes",
                bytes.len()
            );
            return Err(layout(94, text));
        }
        let wide = minor == 4 && records >= WIDE_HEADER;
        let points = if wide { u64::from_le_bytes(field(bytes, 247)) } else { 0 };
        let (scale, offset) = (triple(131), triple(155));
        let usable = |s: &f64| s.is_finite() && *s != 0.0;
        if !scale.iter().all(usable) || !offset.iter().all(|o| o.is_finite()) {
            return Err(layout(131, format!("scale {scale:?} and offset {offset:?}")));
        }
        Ok(Self {
            format,
            minor,
            record,
            least,
            color,
            // The older, narrower count stands in files of 1.4 too.
            points: if points == 0 { u64::from(u32_at(107)) } else { points },
            scale,
            offset,
            payload,
            packed,
            records,
            record_count: u32_at(100),
        })
    }

    /// Refuses a count of points for which the file has too few bytes.
    pub(super) fn check(&self, needs: u128, has: usize) -> Result<(), At> {
        if needs <= has as u128 {
            return Ok(());
        }
        let element = "point".to_owned();
        Err(Fault::Count { element, count: self.points, needs, has }.at_byte(self.payload))
    }

    /// The data of the first variable-length record of this user and number.
    pub(super) fn vlr<'a>(&self, bytes: &'a [u8], user: &[u8], number: u16) -> Option<&'a [u8]> {
        let mut rest = bytes.get(self.records..self.payload)?;
        for _ in 0..self.record_count {
            let (head, tail) = rest.split_at_checked(VLR_HEADER)?;
            let (data, next) =
                tail.split_at_checked(usize::from(u16::from_le_bytes(field(head, 20))))?;
            let of_user = head[2..18].split(|&b| b == 0).next() == Some(user);
            if of_user && u16::from_le_bytes(field(head, 18)) == number {
                return Some(data);
            }
            rest = next;
        }
        None
    }
}
