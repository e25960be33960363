//! A 16-bit depth PNG and a pinhole: points in the camera's frame (x right, y down,
//! z forward), in metres, row by row.
//!
//! A pixel holds the depth along z in units of which there are
//! [`ReadOptions::depth_scale`] to a metre; 0 and 65535 stand for "nothing seen". A
//! depth image that was coloured for looking at (8 bits, or three channels) is
//! refused: its depths are lost.

use std::io::Cursor;

use png::{BitDepth, ColorType, Decoder, DecodingError, Limits};

use super::assemble::Raw;
use super::{At, Fault, ReadOptions};
use crate::base::Point3;
use crate::numeric::robust;

/// Deflate gives at most this many bytes for one: more pixels cannot be in the file.
const MOST_BYTES_PER_BYTE: u64 = 1040;
/// More pixels than any depth camera has; with it, a small file of one colour cannot
/// take the machine's memory.
const MOST_PIXELS: u64 = 32 << 20;
/// A pixel stays if so many of its eight neighbours lie at its depth: on a straight
/// edge there are five, at a corner three.
const FEWEST_NEIGHBOURS: usize = 3;

/// A decoded image.
struct Depth {
    size: [usize; 2],
    values: Vec<u16>,
}

pub(super) fn read(bytes: &[u8], options: &ReadOptions) -> Result<Raw, At> {
    // first: a picture that has no depths needs no camera
    let mut depth = decode(bytes)?;
    let Some(intrinsics) = &options.intrinsics else {
        return Err(Fault::NoIntrinsics.anywhere());
    };
    let layout = |fault: String| Fault::Layout(fault).anywhere();
    let camera = intrinsics.at_size(depth.size).map_err(layout)?;
    let scale = options.depth_scale;
    if !(scale.is_finite() && scale > 0.0) {
        return Err(layout(format!("a depth scale of {scale}; give units per metre, like 1000")));
    }
    let mut raw = Raw::default();
    if depth.is_swapped() {
        depth.values.iter_mut().for_each(|value| *value = value.swap_bytes());
        raw.taken.push("both bytes of each depth are exchanged: they lie smoothly so".to_owned());
    }
    let jump = options.max_jump_m.map(|metres| metres * scale);
    let [width, _] = depth.size;
    for (index, &value) in depth.values.iter().enumerate() {
        if !is_depth(value) {
            continue;
        }
        if jump.is_some_and(|jump| depth.neighbours(index, jump) < FEWEST_NEIGHBOURS) {
            raw.dropped_jumps += 1;
            continue;
        }
        let z = f64::from(value) / scale;
        let [x, y] = camera.ray((index % width) as f64, (index / width) as f64);
        raw.points.push(Point3::new(x * z, y * z, z));
    }
    Ok(raw)
}

fn is_depth(value: u16) -> bool {
    value != 0 && value != u16::MAX
}

impl Depth {
    /// Whether the depths are smooth with their bytes exchanged, and are not as they stand: the low
    /// bytes of a surface are noise.
    fn is_swapped(&self) -> bool {
        /// As they stand, neighbours differ by so many times as much.
        const ROUGHER: f64 = 20.0;
        let [width, _] = self.size;
        let typical_step = |of: fn(u16) -> u16| {
            let pairs = self.values.chunks(width.max(1)).flat_map(|row| row.windows(2));
            let seen = pairs.map(|pair| [of(pair[0]), of(pair[1])]);
            let steps = seen.filter(|pair| pair.iter().all(|v| is_depth(*v)));
            let steps: Vec<f64> = steps.map(|[a, b]| f64::from(a.abs_diff(b))).collect();
            // A flat table is smooth either way: the steeper pairs tell.
            robust::quantile(steps, 0.8)
        };
        let [as_is, swapped] = [typical_step(|v| v), typical_step(u16::swap_bytes)];
        as_is.zip(swapped).is_some_and(|(as_is, swapped)| as_is > ROUGHER * swapped.max(1.0))
    }

    /// How many of the eight neighbours lie within `jump` units of pixel `index`.
    fn neighbours(&self, index: usize, jump: f64) -> usize {
        let [width, height] = self.size;
        let (column, row) = (index % width, index / width);
        let here = f64::from(self.values[index]);
        let mut count = 0;
        for r in row.saturating_sub(1)..(row + 2).min(height) {
            for c in column.saturating_sub(1)..(column + 2).min(width) {
                let there = self.values[r * width + c];
                let near = is_depth(there) && (f64::from(there) - here).abs() <= jump;
                count += usize::from(near && (r, c) != (row, column));
            }
        }
        count
    }
}

fn decode(bytes: &[u8]) -> Result<Depth, At> {
    let fault = |error: DecodingError| {
        let fault = format!("the PNG cannot be decoded ({error}); copy or export it again");
        Fault::Layout(fault).anywhere()
    };
    let limits = Limits { bytes: 2 * MOST_PIXELS as usize + (64 << 20) };
    let decoder = Decoder::new_with_limits(Cursor::new(bytes), limits);
    let mut reader = decoder.read_info().map_err(fault)?;
    let info = reader.info();
    let (width, height) = info.size();
    let pixels = u64::from(width) * u64::from(height);
    if 2 * pixels > MOST_BYTES_PER_BYTE * bytes.len() as u64 || pixels > MOST_PIXELS {
        let fault = format!(
            "the PNG announces {width} x {height} pixels, more than its {} bytes can hold or any \
             depth camera has; copy or export it again",
            bytes.len()
        );
        return Err(Fault::Layout(fault).anywhere());
    }
    if (info.color_type, info.bit_depth) != (ColorType::Grayscale, BitDepth::Sixteen) {
        let fault = format!(
            "a PNG of {:?} with {} bits, not of 16-bit depths: a picture of the depths, in which \
             they are lost; export the raw depth as 16-bit grey",
            info.color_type, info.bit_depth as u8
        );
        return Err(Fault::Layout(fault).anywhere());
    }
    let mut samples = vec![0; 2 * pixels as usize];
    reader.next_frame(&mut samples).map_err(fault)?;
    let values = samples.as_chunks().0.iter().map(|&pair| u16::from_be_bytes(pair)).collect();
    Ok(Depth { size: [width as usize, height as usize], values })
}
