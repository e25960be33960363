//! The header of a PLY file: cleaned here, parsed by `ply-rs-bw`.

use std::collections::HashSet;
use std::io::Cursor;

use ply_rs_bw::parser::{Parser, Reader};
use ply_rs_bw::ply::{DefaultElement, Header};

use super::error::shown;
use super::{At, Fault};

/// The header, and where the payload starts.
pub(super) fn read_header(bytes: &[u8]) -> Result<(Header, usize), At> {
    let (text, payload) = clean_header(bytes)?;
    let parser = Parser::<DefaultElement>::new();
    let header = parser.read_header(&mut Reader::new(Cursor::new(text.as_bytes())));
    let header = header.map_err(|error| {
        let line = error.line().unwrap_or(1);
        let content = text.lines().nth(line - 1).unwrap_or_default();
        Fault::Layout(format!(
            "the PLY header cannot be read here: `{}`; export the file again as binary PLY 1.0",
            shown(content.as_bytes()),
        ))
        .at_line(line)
    })?;
    Ok((header, payload))
}

/// The header in the one spelling that the parser takes, line for line, and the
/// payload's position.
///
/// Blank lines, comments and `obj_info` become empty comments; runs of blanks
/// become one; a property name that is outside the grammar or was used before
/// gets a name that no reader asks for.
fn clean_header(bytes: &[u8]) -> Result<(String, usize), At> {
    if !bytes.starts_with(b"ply") || bytes.get(3).is_some_and(|b| !b.is_ascii_whitespace()) {
        let fault = "a PLY file starts with a line `ply`; this one is damaged or of another format: export it again";
        return Err(Fault::Layout(fault.to_owned()).at_line(1));
    }
    let first_end = bytes.iter().position(|b| matches!(b, b'\n' | b'\r'));
    let Some(first_end) = first_end else {
        return Err(no_end());
    };
    // A lone carriage return ends lines (old Macintosh) only if the first one does.
    let end = if bytes[first_end..].starts_with(b"\r") && bytes.get(first_end + 1) != Some(&b'\n') {
        b'\r'
    } else {
        b'\n'
    };
    let is_line_feed_first = bytes[first_end..].starts_with(b"\n\r");
    let mut text = String::new();
    let mut names = HashSet::new();
    let mut elements = HashSet::new();
    let mut position = 0;
    for (index, line) in bytes.split_inclusive(|&b| b == end).enumerate() {
        position += line.len();
        let line = String::from_utf8_lossy(line);
        let words: Vec<&str> = line.split_whitespace().collect();
        let number = index + 1;
        match words.as_slice() {
            ["end_header", ..] => {
                // Where a carriage return stands after each newline, one does after the last.
                let after = is_line_feed_first && bytes.get(position) == Some(&b'\r');
                return Ok((text + "end_header\n", position + usize::from(after)));
            }
            [] | ["comment" | "obj_info", ..] => text.push_str("comment"),
            ["element", name, rest @ ..] => {
                names.clear();
                if !elements.insert((*name).to_owned()) {
                    let fault =
                        format!("element `{name}` is declared twice; export the file again");
                    return Err(Fault::Layout(fault).at_line(number));
                }
                let name = name_for(name, number, true);
                text.push_str(&format!("element {name} {}", rest.join(" ")));
            }
            ["property", kind, ..] => {
                // A name may hold blanks.
                let (kind, name) =
                    words.split_at(words.len().min(if *kind == "list" { 4 } else { 2 }));
                let name = name.join(" ");
                let fresh = names.insert(name.clone());
                let name = name_for(&name, number, fresh);
                text.push_str(&format!("{} {name}", kind.join(" ")));
            }
            words => text.push_str(&words.join(" ")),
        }
        text.push('\n');
    }
    Err(no_end())
}

fn no_end() -> At {
    let fault = "the PLY header has no `end_header` line; the file is cut off: copy it again";
    Fault::Layout(fault.to_owned()).anywhere()
}

/// The name itself if the grammar takes it and it is `fresh`.
fn name_for(name: &str, line: usize, fresh: bool) -> String {
    let fits = name.starts_with(|c: char| c.is_ascii_alphabetic() || c == '_')
        && name.chars().all(|c| c.is_ascii_alphanumeric() || c == '_' || c == '-');
    if fits && fresh { name.to_owned() } else { format!("unnamed_of_line_{line}") }
}
