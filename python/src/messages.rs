//! The library's messages in the terms of Python.

/// What the library says of the program's flags, and what to say of the arguments here; the first
/// that fits counts.
const PHRASES: [(&str, &str); 15] = [
    (", or give --rescale ", ", or divide all lengths by "),
    ("give the scan with --rescale", "divide the lengths of the scan instead"),
    (
        "--intrinsics FILE, or --fx, --fy, --cx and --cy, and --depth-scale",
        "intrinsics, and depth_scale",
    ),
    (", or give --format", ""),
    ("(without --quick)", "(without quick=True)"),
    ("(--with SECOND)", "(with_scans)"),
    ("--plate-near X,Y,Z, --up AXIS or --crop", "plate_near, up, or crop_radius_m"),
    ("--crop", "crop_radius_m or crop_box"),
    ("--specimen-size", "specimen_side_m"),
    ("--plate-radius", "plate_radius_m"),
    ("--density", "density_kg_m2"),
    ("--with", "with_scans"),
    ("--quick", "quick=True"),
    ("`estimate --out`", "`Estimate.write`"),
    ("--out", "out"),
];

/// A message of the library without the program's flags.
pub(crate) fn in_python(text: &str) -> String {
    let text = PHRASES.iter().fold(text.to_owned(), |text, (flag, own)| text.replace(flag, own));
    // the others are named alike
    let mut parts = text.split("--");
    let mut out = parts.next().unwrap_or_default().to_owned();
    for part in parts {
        let end = part.find(|c: char| !(c.is_ascii_lowercase() || c == '-')).unwrap_or(part.len());
        let (name, rest) = part.split_at(end);
        if name.starts_with(|c: char| c.is_ascii_lowercase()) {
            out += &name.replace('-', "_");
        } else {
            out = out + "--" + name;
        }
        out += rest;
    }
    out
}

/// JSON whose texts, by this key, are messages of the library.
pub(crate) fn texts_in_python(value: &mut serde_json::Value, key: &str) {
    match value {
        serde_json::Value::Array(entries) => {
            entries.iter_mut().for_each(|entry| texts_in_python(entry, key));
        }
        serde_json::Value::Object(entries) => {
            for (name, entry) in entries {
                match entry {
                    serde_json::Value::String(text) if name == key => *text = in_python(text),
                    entry => texts_in_python(entry, key),
                }
            }
        }
        _ => {}
    }
}
