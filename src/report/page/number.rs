//! Numbers as a reader of a page has them: significant digits, thin spaces between thousands, a
//! true minus.

/// Thin space that no line breaks at.
const THIN: char = '\u{202f}';
/// Significant digits of stiffnesses.
const DIGITS: i32 = 4;
/// Least and largest value that is written without a power of ten.
const PLAIN: [f64; 2] = [1e-3, 1e7];

/// Four significant digits; very small and very large values with a power of ten.
#[must_use]
pub fn significant(value: f64) -> String {
    if value == 0.0 {
        return "0".to_owned();
    }
    if !value.is_finite() {
        return "\u{2013}".to_owned();
    }
    let power = value.abs().log10().floor() as i32;
    if !(PLAIN[0]..PLAIN[1]).contains(&value.abs()) {
        let mantissa = fixed(value / 10f64.powi(power), (DIGITS - 1) as usize);
        return format!("{mantissa}{THIN}\u{d7}{THIN}10{}", raised(power));
    }
    let decimals = DIGITS - 1 - power;
    if decimals >= 0 {
        return fixed(value, decimals as usize);
    }
    let step = 10f64.powi(-decimals);
    fixed((value / step).round() * step, 0)
}

/// So many decimals.
#[must_use]
pub fn fixed(value: f64, decimals: usize) -> String {
    if !value.is_finite() {
        return "\u{2013}".to_owned();
    }
    let text = format!("{:.decimals$}", value.abs());
    // what rounds to nothing has no sign
    let nothing = text.chars().all(|c| c == '0' || c == '.');
    let sign = if value < 0.0 && !nothing { "\u{2212}" } else { "" };
    let (whole, rest) = text.split_once('.').map_or((text.as_str(), None), |(a, b)| (a, Some(b)));
    let mut out = sign.to_owned() + &grouped(whole);
    if let Some(rest) = rest {
        out = out + "." + rest;
    }
    out
}

/// Digits with thin spaces between thousands, from five digits on.
fn grouped(digits: &str) -> String {
    if digits.len() < 5 {
        return digits.to_owned();
    }
    let mut out = String::new();
    for (k, digit) in digits.chars().enumerate() {
        if k > 0 && (digits.len() - k).is_multiple_of(3) {
            out.push(THIN);
        }
        out.push(digit);
    }
    out
}

/// A share as per cent.
#[must_use]
pub fn percent(share: f64, decimals: usize) -> String {
    format!("{}{THIN}%", fixed(100.0 * share, decimals))
}

/// A count with thin spaces.
#[must_use]
pub fn count(value: usize) -> String {
    grouped(&value.to_string())
}

/// A count with its noun, which takes an s where there is not one of it.
#[must_use]
pub fn counted(value: usize, noun: &str) -> String {
    format!("{} {noun}{}", count(value), if value == 1 { "" } else { "s" })
}

/// An exponent in raised digits.
#[must_use]
pub fn raised(power: i32) -> String {
    const DIGITS: [char; 10] = [
        '\u{2070}', '\u{b9}', '\u{b2}', '\u{b3}', '\u{2074}', '\u{2075}', '\u{2076}', '\u{2077}',
        '\u{2078}', '\u{2079}',
    ];
    let of = |c: char| c.to_digit(10).map_or('\u{207b}', |d| DIGITS[d as usize]);
    power.to_string().chars().map(of).collect()
}

/// A sentence out of a text that begins in the middle of one: a capital letter first, a full stop
/// last.
#[must_use]
pub fn sentence(text: &str) -> String {
    let mut letters = text.chars();
    let first: String = letters.next().map(|c| c.to_uppercase().collect()).unwrap_or_default();
    // a name of a file or of a parameter keeps its small letter
    let named =
        text.split_whitespace().next().is_some_and(|word| word.contains(['_', '.', '/', '-']));
    let begun = if named { text.to_owned() } else { first + letters.as_str() };
    if begun.ends_with(['.', '!', '?']) { begun } else { begun + "." }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn digits_spaces_signs_and_powers() {
        assert_eq!(significant(144_303.3), "144\u{202f}300");
        assert_eq!(significant(1376.18), "1376");
        assert_eq!(significant(45.784), "45.78");
        assert_eq!(significant(0.014_034), "0.01403");
        assert_eq!(significant(1.376e-6), "1.376\u{202f}\u{d7}\u{202f}10\u{207b}\u{2076}");
        assert_eq!(significant(-2.5e9), "\u{2212}2.500\u{202f}\u{d7}\u{202f}10\u{2079}");
        assert_eq!((significant(0.0), significant(f64::NAN)), ("0".into(), "\u{2013}".into()));
        assert_eq!(fixed(-0.04, 1), "0.0");
        assert_eq!(fixed(-1234.56, 1), "\u{2212}1234.6");
        assert_eq!(fixed(12_345.0, 0), "12\u{202f}345");
        assert_eq!(percent(0.996, 1), "99.6\u{202f}%");
        assert_eq!((counted(1, "drape"), counted(0, "file")), ("1 drape".into(), "0 files".into()));
        assert_eq!(count(1_234_567), "1\u{202f}234\u{202f}567");
    }

    #[test]
    fn a_text_becomes_a_sentence_and_a_name_stays() {
        assert_eq!(sentence("the rim is hidden"), "The rim is hidden.");
        assert_eq!(sentence("bending_weft is at its end"), "bending_weft is at its end.");
        assert_eq!(sentence("Done!"), "Done!");
        assert_eq!(sentence(""), ".");
    }
}
