//! The texture coordinates of an OBJ: where each vertex of a sheet lies on the flat cloth.
//!
//! In: the bytes of an OBJ whose faces name them (`f v/vt` or `f v/vt/vn`). Out: a pair a vertex,
//! in the file's order. A vertex with two places is a seam, which a sheet does not have.

use std::path::Path;

use super::bytes::regular_file;
use super::obj::joined;
use super::tokens::{lines, number_for, words};
use super::{At, Fault, Place, ReadError};

/// Two places of one vertex that are nearer than this are one: the digits that exporters leave.
const SAME: f64 = 1e-5;

/// The texture coordinates of the vertices of an OBJ, in the file's order; `None` if no face has
/// any. Vertices that no face uses have none.
///
/// # Errors
/// When the file cannot be read, a number is none, or a vertex has two places; the line is named.
pub fn read_obj_texture(
    path: impl AsRef<Path>,
) -> Result<Option<Vec<Option<[f64; 2]>>>, ReadError> {
    let path = path.as_ref();
    regular_file(path).and_then(|bytes| of_bytes(&bytes)).map_err(|at| at.in_file(path))
}

/// A corner of a face that names a texture coordinate: its line, and the numbers of vertex and
/// coordinate, from 0.
type Corner = (usize, i64, i64);

fn of_bytes(bytes: &[u8]) -> Result<Option<Vec<Option<[f64; 2]>>>, At> {
    let mut vertices = 0;
    let mut coordinates: Vec<[f64; 2]> = Vec::new();
    let mut corners: Vec<Corner> = Vec::new();
    let joined = joined(bytes);
    for (line, text) in lines(joined.as_deref().unwrap_or(bytes)) {
        let mut words = words(text);
        match words.next() {
            Some(b"v") => vertices += 1,
            Some(b"vt") => {
                let mut pair = [0.0; 2];
                for value in &mut pair {
                    let number = coordinates.len() + 1;
                    let what = || format!("texture coordinate {number}");
                    let word = words.next().unwrap_or_default();
                    *value = number_for(word, Place::Line(line), what)?;
                }
                coordinates.push(pair);
            }
            Some(b"f") => {
                let named = words.filter_map(|word| corner(word, [vertices, coordinates.len()]));
                corners.extend(named.map(|[vertex, place]| (line, vertex, place)));
            }
            _ => {}
        }
    }
    (!corners.is_empty()).then(|| of_vertices(vertices, &coordinates, &corners)).transpose()
}

/// The numbers of vertex and texture coordinate of a corner, from 0, of which there are as many so
/// far; `None` if it names no coordinate.
fn corner(word: &[u8], counts: [usize; 2]) -> Option<[i64; 2]> {
    let mut parts = word
        .split(|&b| b == b'/')
        .map(|part| std::str::from_utf8(part).ok().and_then(|text| text.parse::<i64>().ok()));
    let (Some(Some(vertex)), Some(Some(place))) = (parts.next(), parts.next()) else {
        return None;
    };
    // negative ones count back from here
    let absolute = |k: i64, count: usize| if k < 0 { k + count as i64 } else { k - 1 };
    Some([absolute(vertex, counts[0]), absolute(place, counts[1])])
}

/// The texture coordinates that corners give to so many vertices.
fn of_vertices(
    vertices: usize,
    coordinates: &[[f64; 2]],
    corners: &[Corner],
) -> Result<Vec<Option<[f64; 2]>>, At> {
    let mut of_vertex: Vec<Option<[f64; 2]>> = vec![None; vertices];
    for &(line, vertex, at) in corners {
        let index = |k: i64| usize::try_from(k).unwrap_or(usize::MAX);
        let (Some(place), Some(slot)) =
            (coordinates.get(index(at)), of_vertex.get_mut(index(vertex)))
        else {
            let fault = format!(
                "a corner {}/{} of {vertices} vertices and {} texture coordinates; export the file \
                 again",
                vertex + 1,
                at + 1,
                coordinates.len()
            );
            return Err(Fault::Layout(fault).at_line(line));
        };
        match slot {
            Some(known) if (0..2).any(|c| (known[c] - place[c]).abs() > SAME) => {
                let fault = format!(
                    "vertex {} has two texture coordinates, ({}, {}) and ({}, {}); a sheet has no \
                     seam: unwrap it as one piece",
                    vertex + 1,
                    known[0],
                    known[1],
                    place[0],
                    place[1]
                );
                return Err(Fault::Layout(fault).at_line(line));
            }
            _ => *slot = Some(*place),
        }
    }
    Ok(of_vertex)
}

#[cfg(test)]
mod tests {
    use super::*;

    fn read(text: &str) -> Result<Option<Vec<Option<[f64; 2]>>>, String> {
        of_bytes(text.as_bytes()).map_err(|at| at.in_file(Path::new("a.obj")).to_string())
    }

    #[test]
    fn places_are_those_of_the_faces_and_seams_are_refused_with_their_line() {
        let head = "v 0 0 0\nv 1 0 0\nv 0 1 0\nv 9 9 9\nvt 0 0\nvt 1 0\nvt 0.25 1\n";
        let found = read(&format!("{head}f 1/1 2/2 3/3\n")).unwrap().unwrap();
        assert_eq!(found, [Some([0.0, 0.0]), Some([1.0, 0.0]), Some([0.25, 1.0]), None]);
        assert_eq!(read(&format!("{head}f -4/-3/7 -3/-2 -2/-1\n")).unwrap().unwrap(), found);
        assert_eq!(read(&format!("{head}f 1 2 3\nf 1//2 2//1 3//1\n")), Ok(None));
        let seam = read(&format!("{head}f 1/1 2/2 3/3\nf 1/2 2/2 3/3\n")).unwrap_err();
        assert!(seam.contains("vertex 1 has two") && seam.contains(":9: "), "{seam}");
        let beyond = read(&format!("{head}f 1/1 2/2 3/4\n")).unwrap_err();
        assert!(beyond.contains("3/4 of 4 vertices and 3"), "{beyond}");
        let none = read("v 0 0 0\nvt 0 a\nf 1/1 1/1 1/1\n").unwrap_err();
        assert!(none.contains("texture coordinate 1"), "{none}");
    }
}
