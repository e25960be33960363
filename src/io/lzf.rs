//! LZF decompression (Lehmann's liblzf), as PCD's `binary_compressed` uses it.
//!
//! A control byte c < 32 is followed by c + 1 literal bytes; else c >> 5 (7:
//! plus the next byte) + 2 bytes are copied from (c & 31) << 8 | next + 1 back.

/// The most bytes that a compressed byte can stand for: 3 bytes give 264.
pub(super) const MOST_PER_BYTE: usize = 88;

/// Unpacks `packed` into exactly `length` bytes; `None` if it does not fit.
pub(super) fn unpack(packed: &[u8], length: usize) -> Option<Vec<u8>> {
    if length > packed.len().checked_mul(MOST_PER_BYTE)? {
        return None;
    }
    let mut out = Vec::with_capacity(length);
    let mut rest = packed;
    while let [control, tail @ ..] = rest {
        let control = usize::from(*control);
        rest = tail;
        if control < 32 {
            let (literal, tail) = rest.split_at_checked(control + 1)?;
            out.extend_from_slice(literal);
            rest = tail;
        } else {
            let mut run = control >> 5;
            if run == 7 {
                run += usize::from(take(&mut rest)?);
            }
            let back = ((control & 31) << 8 | usize::from(take(&mut rest)?)) + 1;
            let start = out.len().checked_sub(back)?;
            for i in start..start + run + 2 {
                out.push(out[i]);
            }
        }
        if out.len() > length {
            return None;
        }
    }
    (out.len() == length).then_some(out)
}

fn take(bytes: &mut &[u8]) -> Option<u8> {
    let (first, rest) = bytes.split_first()?;
    *bytes = rest;
    Some(*first)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn literals_and_overlapping_copies_unpack() {
        // "ab" literal, then 6 bytes from 2 back: abababab.
        assert_eq!(unpack(&[1, b'a', b'b', 4 << 5, 1], 8).as_deref(), Some(&b"abababab"[..]));
        // The long form: 7 + 1 + 2 = 10 bytes from 1 back.
        assert_eq!(unpack(&[0, b'x', 7 << 5, 1, 0], 11).as_deref(), Some(&b"xxxxxxxxxxx"[..]));
    }

    #[test]
    fn damaged_streams_are_refused() {
        assert_eq!(unpack(&[1, b'a'], 2), None, "literals missing");
        assert_eq!(unpack(&[32, 5], 3), None, "a copy from before the start");
        assert_eq!(unpack(&[0, b'x'], usize::MAX), None, "an absurd length");
        assert_eq!(unpack(&[0, b'x'], 2), None, "too short");
        assert_eq!(unpack(&[1, b'x', b'y'], 1), None, "too long");
    }
}
