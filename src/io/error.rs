//! Errors of the readers and writers: what is wrong, where, and what to do.

use std::fmt;
use std::io;
use std::path::{Path, PathBuf};

/// A file that cannot be read as a scan.
#[derive(Debug, thiserror::Error)]
#[error("{}{place}: {fault}", path.display())]
pub struct ReadError {
    /// The file.
    pub path: PathBuf,
    /// The place in it.
    pub place: Place,
    /// What is wrong and what to do.
    pub fault: Fault,
}

impl ReadError {
    /// Whether what the file says is at fault, not the way to it.
    #[must_use]
    pub fn is_content(&self) -> bool {
        !matches!(self.fault, Fault::Missing | Fault::NotAFile | Fault::Io(_))
    }
}

/// A place in a file.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Place {
    /// The file as a whole.
    File,
    /// A line of a text, counted from 1.
    Line(usize),
    /// A byte, counted from 0.
    Byte(usize),
}

impl fmt::Display for Place {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            Self::File => Ok(()),
            Self::Line(line) => write!(f, ":{line}"),
            Self::Byte(byte) => write!(f, " at byte {byte}"),
        }
    }
}

/// What is wrong with a file; each text ends with the remedy.
#[derive(Debug, thiserror::Error)]
pub enum Fault {
    /// Nothing there.
    #[error("no such file; check the path")]
    Missing,
    /// A folder, a pipe, a device.
    #[error(
        "not a regular file; give the path of a scan file, or of a folder of views (with a \
         views.json, or with camera-intrinsics.txt, *.depth.png and *.pose.txt)"
    )]
    NotAFile,
    /// The system refused.
    #[error("cannot be read ({0}); check its permissions and the disk")]
    Io(io::Error),
    /// Zero bytes.
    #[error("the file is empty (0 bytes); export or copy it again")]
    EmptyFile,
    /// An extension that is not read, or none.
    #[error("{}", extension(.found))]
    Extension {
        /// The extension found.
        found: String,
    },
    /// A depth image without its camera.
    #[error(
        "a depth image needs its camera: give --intrinsics FILE, or --fx, --fy, --cx and --cy, and \
         --depth-scale if its unit is not 1 mm"
    )]
    NoIntrinsics,
    /// The content is something else altogether.
    #[error("the content is {what}")]
    Foreign {
        /// What it is, and the remedy.
        what: &'static str,
    },
    /// The content is of another format than the extension says.
    #[error(
        "the content is that of a {content} file; rename it to end in {content}, or give --format"
    )]
    Misnamed {
        /// The extension that the content asks for.
        content: &'static str,
    },
    /// A header or a line that does not follow the format; the text has the remedy.
    #[error("{0}")]
    Layout(String),
    /// More elements than the rest of the file can hold.
    #[error(
        "the header announces {count} x `{element}`, at least {needs} bytes, but {has} are left; \
         the file is cut off or its header is damaged: copy or export it again"
    )]
    Count {
        /// The element's name.
        element: String,
        /// The number announced.
        count: u64,
        /// The least number of bytes for that.
        needs: u128,
        /// The bytes that are left.
        has: usize,
    },
    /// The file ends inside an element.
    #[error("the file ends inside `{element}` {number} of {count}; copy or export it again")]
    Truncated {
        /// The element's name.
        element: String,
        /// Its number, counted from 1.
        number: usize,
        /// How many there should be.
        count: usize,
    },
    /// A token that is no number.
    #[error("{what}: `{token}` is not a number; write numbers like -12.5 or 3e-4")]
    Number {
        /// What was to be read.
        what: String,
        /// The token found.
        token: String,
    },
    /// A face that names a vertex that does not exist.
    #[error(
        "face {face} (counted from 1) names vertex {index}, but there are {vertices} vertices; \
         export the mesh again, or only its points"
    )]
    FaceIndex {
        /// The face, counted from 1.
        face: usize,
        /// The vertex as the file names it.
        index: i64,
        /// The number of vertices.
        vertices: usize,
    },
    /// Colours that are not those of the points.
    #[error("{colors} colours for {points} points; give one for each point, or none")]
    Colors {
        /// How many colours there are.
        colors: usize,
        /// How many points there are.
        points: usize,
    },
    /// A file without a point.
    #[error("the file holds no points; check the export's selection")]
    NoPoints,
    /// A file whose points are all invalid.
    #[error("all {count} points are NaN, infinite or absurdly large; check the sensor's export")]
    NoFinitePoints {
        /// How many points there are.
        count: usize,
    },
}

impl Fault {
    pub(super) fn anywhere(self) -> At {
        At { place: Place::File, fault: self }
    }

    pub(super) fn at_line(self, line: usize) -> At {
        At { place: Place::Line(line), fault: self }
    }

    pub(super) fn at_byte(self, byte: usize) -> At {
        At { place: Place::Byte(byte), fault: self }
    }

    pub(super) fn at(self, place: Place) -> At {
        At { place, fault: self }
    }
}

/// A fault at a place, before the file's name is known.
#[derive(Debug)]
pub(super) struct At {
    place: Place,
    pub(super) fault: Fault,
}

impl At {
    pub(super) fn opening(error: io::Error) -> Self {
        match error.kind() {
            io::ErrorKind::NotFound => Fault::Missing.anywhere(),
            _ => Fault::Io(error).anywhere(),
        }
    }

    pub(super) fn in_file(self, path: &Path) -> ReadError {
        ReadError { path: path.to_owned(), place: self.place, fault: self.fault }
    }
}

/// A piece of a file in a message: printable and at most 40 characters.
pub(super) fn shown(bytes: &[u8]) -> String {
    const MOST: usize = 40;
    let head = &bytes[..bytes.len().min(4 * MOST)];
    let text: String = String::from_utf8_lossy(head)
        .chars()
        .map(|c| if c.is_control() { '\u{fffd}' } else { c })
        .take(MOST)
        .collect();
    if bytes.len() > text.len() && text.chars().count() == MOST { text + "..." } else { text }
}

/// A file that cannot be written.
#[derive(Debug, thiserror::Error)]
#[error("{}: cannot be written ({source}); check that the folder exists, has space and may be written", path.display())]
pub struct WriteError {
    /// The file.
    pub path: PathBuf,
    /// What the system said.
    pub source: io::Error,
}

/// What is wrong with an extension.
fn extension(found: &str) -> String {
    let supported = super::SUPPORTED;
    if found.is_empty() {
        return format!("its name has no ending; name it as one of {supported}, or give --format");
    }
    let instead = super::format::export_instead(found);
    let instead = instead.map(|remedy| format!("{remedy}; ")).unwrap_or_default();
    format!("files named `.{found}` are not read; {instead}convert it to one of {supported}")
}
