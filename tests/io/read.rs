//! Each trap that a sensor's exporter lays, in a file made by hand.

use scan2params::base::boundary::POINTS;
use scan2params::base::{Boundary, BoundaryPoint, Point3};
use scan2params::geom::{Cloud, Mesh};
use scan2params::io::{
    Fault, Format, Place, ReadError, boundary_csv, read_scan, read_scan_bytes, write_obj, write_ply,
};

fn read(text: impl AsRef<[u8]>, extension: &str) -> Cloud {
    match read_scan_bytes(text.as_ref(), extension) {
        Ok((cloud, _)) => cloud,
        Err(error) => panic!("{error}"),
    }
}

fn fail(text: impl AsRef<[u8]>, extension: &str) -> ReadError {
    match read_scan_bytes(text.as_ref(), extension) {
        Ok(read) => panic!("read as {read:?}"),
        Err(error) => error,
    }
}

fn points(list: &[[f64; 3]]) -> Vec<Point3> {
    list.iter().map(|p| Point3::from(*p)).collect()
}

const CORNERS: [[f64; 3]; 4] = [[0., 0., 0.], [1., 0., 0.5], [1., 1., 0.], [0., 1., -2.]];

/// A binary PLY with a camera element, a list before x, colours and a quad.
fn binary_ply(big: bool, faces_first: bool) -> Vec<u8> {
    let order = |mut bytes: Vec<u8>| {
        if big {
            bytes.reverse();
        }
        bytes
    };
    let vertex = "element vertex 4\nproperty list uchar short tags\nproperty double x\n\
                  property float y\nproperty float z\nproperty uchar red\nproperty uchar green\n\
                  property uchar blue\n";
    let face = "element face 1\nproperty uchar flags\nproperty list uchar int vertex_index\n";
    let (first, second) = if faces_first { (face, vertex) } else { (vertex, face) };
    let endian = if big { "big" } else { "little" };
    let mut file = format!(
        "ply\nformat binary_{endian}_endian 1.0\nelement camera 1\nproperty float fx\n\
         {first}{second}end_header\n"
    )
    .into_bytes();
    let mut vertices = Vec::new();
    for (i, [x, y, z]) in CORNERS.into_iter().enumerate() {
        vertices.push(i as u8);
        for tag in 0..i {
            vertices.extend(order((tag as i16).to_le_bytes().into()));
        }
        vertices.extend(order(x.to_le_bytes().into()));
        vertices.extend(order((y as f32).to_le_bytes().into()));
        vertices.extend(order((z as f32).to_le_bytes().into()));
        vertices.extend([10 * i as u8, 20, 255]);
    }
    let mut faces = vec![7, 4];
    for corner in 0..4_i32 {
        faces.extend(order(corner.to_le_bytes().into()));
    }
    file.extend(order(500_f32.to_le_bytes().into()));
    let (first, second) = if faces_first { (faces, vertices) } else { (vertices, faces) };
    file.extend(first);
    file.extend(second);
    file
}

#[test]
fn ply_binary_of_both_orders_with_lists_and_unknown_elements() {
    for (big, faces_first) in [(false, false), (true, false), (false, true), (true, true)] {
        let (cloud, notes) = read_scan_bytes(&binary_ply(big, faces_first), "ply").unwrap();
        assert_eq!(cloud.points, points(&CORNERS), "{big} {faces_first}");
        assert_eq!(cloud.colors[3], [30, 20, 255]);
        assert_eq!(cloud.triangles, [[0, 1, 2], [0, 2, 3]]);
        assert_eq!(notes.format, Some(Format::Ply));
        assert!(notes.ignored.contains(&"camera".to_owned()));
    }
}

#[test]
fn ply_ascii_tokens_cross_lines() {
    let text = "ply\nformat ascii 1.0\nelement vertex 2\nproperty float x\nproperty float y\n\
                property float z\nproperty uchar r\nproperty uchar g\nproperty uchar b\n\
                element face 1\nproperty list uchar int vertex_indices\nend_header\n\
                1 2 3\n255 0 7\n4 5\n6 1 2 3\n2 0 1";
    let cloud = read(text, "ply");
    assert_eq!(cloud.points, points(&[[1., 2., 3.], [4., 5., 6.]]));
    assert_eq!(cloud.colors, [[255, 0, 7], [1, 2, 3]]);
    assert!(cloud.triangles.is_empty(), "a face with two corners is no triangle");
}

#[test]
fn ply_header_as_exporters_write_it() {
    let text = "ply\r\n format   ascii\t1.0 \r\n\r\ncomment caf\u{e9}\r\nobj_info x = 3\r\n\
                element  vertex\t1\r\nproperty float32 x\r\nproperty double y\r\nproperty int16 z\r\n\
                property float scalar_C2M[<0.1]\r\nproperty float y\r\nproperty list uint8 int32 a b\r\n\
                end_header \r\n1 2 3 4 5 0\r\n";
    assert_eq!(read(text, "ply").points, points(&[[1., 2., 3.]]));
    let macintosh = text.replace("\r\n", "\r");
    assert_eq!(read(macintosh, "ply").points, points(&[[1., 2., 3.]]));
    let mut latin = text.as_bytes().to_vec();
    let at = latin.windows(2).position(|w| w == "\u{e9}".as_bytes()).unwrap();
    latin[at] = 0xe9;
    latin[at + 1] = b' ';
    assert_eq!(read(latin, "ply").points, points(&[[1., 2., 3.]]));
    // Data that starts with a newline byte follows a header with carriage returns.
    let mut binary =
        b"ply\r\nformat binary_little_endian 1.0\r\nelement vertex 1\r\nproperty uchar x\r\n\
        property uchar y\r\nproperty uchar z\r\nend_header\r\n"
            .to_vec();
    binary.extend([10, 13, 10]);
    assert_eq!(read(binary, "ply").points, points(&[[10., 13., 10.]]));
}

#[test]
fn ply_float_colors_count_to_one() {
    let text = "ply\nformat ascii 1.0\nelement vertex 1\nproperty float x\nproperty float y\n\
                property float z\nproperty float red\nproperty float green\nproperty float blue\n\
                end_header\n0 0 1 1.0 0.5 0\n";
    assert_eq!(read(text, "ply").colors, [[255, 128, 0]]);
}

fn ascii_ply(rows: &str, vertices: usize, faces: usize) -> String {
    format!(
        "ply\nformat ascii 1.0\nelement vertex {vertices}\nproperty float x\nproperty float y\n\
         property float z\nelement face {faces}\nproperty list uchar int vertex_indices\nend_header\n{rows}"
    )
}

#[test]
fn invalid_points_are_dropped_with_their_triangles_and_the_rest_is_renumbered() {
    let rows = "nan 0 0\n0 0 0\n1 0 0\n-nan(ind) 1 2\n1 1 0\n0 1 0\n1e38 0 0\n0 inf 1\n\
                4 1 2 4 5\n3 0 1 2\n3 1 1 2\n";
    let (cloud, notes) = read_scan_bytes(ascii_ply(rows, 8, 3).as_bytes(), "ply").unwrap();
    assert_eq!(cloud.points, points(&[[0., 0., 0.], [1., 0., 0.], [1., 1., 0.], [0., 1., 0.]]));
    assert_eq!(cloud.triangles, [[0, 1, 2], [0, 2, 3]]);
    let counts = (notes.points_in_file, notes.dropped_non_finite, notes.dropped_triangles);
    assert_eq!(counts, (8, 4, 1));
    assert_eq!(notes.degenerate_triangles, 1);
    let all = fail(ascii_ply("nan 0 0\n0 nan 0\n", 2, 0), "ply");
    assert!(matches!(all.fault, Fault::NoFinitePoints { count: 2 }), "{all}");
}

#[test]
fn counts_beyond_the_file_are_refused_before_any_allocation() {
    let header = |count: &str, format: &str| {
        format!(
            "ply\nformat {format} 1.0\nelement vertex {count}\nproperty float x\nproperty float y\n\
             property float z\nend_header\n0 0 0\n"
        )
    };
    for format in ["ascii", "binary_little_endian", "binary_big_endian"] {
        for count in ["4000000000", "18446744073709551615"] {
            let error = fail(header(count, format), "ply");
            assert!(matches!(error.fault, Fault::Count { .. }), "{error}");
        }
        let error = fail(header("99999999999999999999999", format), "ply");
        assert_eq!(error.place, Place::Line(3), "{error}");
    }
    let list = "ply\nformat ascii 1.0\nelement vertex 1\nproperty list uint int t\nproperty float x\n\
                property float y\nproperty float z\nend_header\n4000000000 0 0 0\n";
    let error = fail(list, "ply");
    assert!(error.to_string().contains("4000000000"), "{error}");
    assert_eq!(error.place, Place::Line(9));
    // An element without properties takes no bytes and no time.
    let hollow = "ply\nformat ascii 1.0\nelement ghost 18446744073709551615\nelement vertex 1\n\
                  property float x\nproperty float y\nproperty float z\nend_header\n1 2 3\n";
    assert_eq!(read(hollow, "ply").points.len(), 1);
    let pcd = "VERSION .7\nFIELDS x y z\nSIZE 4 4 4\nTYPE F F F\nCOUNT 1 1 1\nWIDTH 4000000000\n\
               HEIGHT 1\nPOINTS 4000000000\nDATA ";
    for data in [
        "ascii\n0 0 0\n",
        "binary\n0123456789ab",
        "binary_compressed\n\x04\0\0\0\x7f\x7f\x7f\x7f0000",
    ] {
        let error = fail(format!("{pcd}{data}"), "pcd");
        assert!(matches!(error.fault, Fault::Count { .. } | Fault::Layout(_)), "{error}");
    }
    let mut stl = vec![0_u8; 84];
    stl[80..84].copy_from_slice(&u32::MAX.to_le_bytes());
    assert!(matches!(fail(stl, "stl").fault, Fault::Count { .. }));
}

#[test]
fn cut_off_files_say_where() {
    let error = fail(ascii_ply("0 0 0\n1 1 1\n0 0 1\n0 0 1\n0 0 1\n0 1000000000000", 6, 0), "ply");
    assert!(matches!(error.fault, Fault::Truncated { number: 6, count: 6, .. }), "{error}");
    let whole = binary_ply(false, false);
    for length in 0..whole.len() {
        let error = fail(&whole[..length], "ply");
        assert!(!error.to_string().is_empty());
    }
}

#[test]
fn a_face_outside_the_vertices_is_named() {
    let error = fail(ascii_ply("0 0 0\n1 0 0\n0 1 0\n3 0 1 2\n3 0 1 9\n", 3, 2), "ply");
    assert!(matches!(error.fault, Fault::FaceIndex { face: 2, index: 9, vertices: 3 }), "{error}");
    let error = fail(ascii_ply("0 0 0\n1 0 0\n0 1 0\n3 0 -1 2\n", 3, 1), "ply");
    assert!(matches!(error.fault, Fault::FaceIndex { face: 1, index: -1, .. }), "{error}");
    for corner in ["5", "0", "-4"] {
        let error = fail(format!("v 0 0 0\nv 1 0 0\nv 0 1 0\nf 1 2 {corner}\n"), "obj");
        let index: i64 = corner.parse().unwrap();
        assert!(
            matches!(error.fault, Fault::FaceIndex { face: 1, index: i, .. } if i == index),
            "{error}"
        );
    }
}

#[test]
fn words_in_place_of_numbers_are_named_with_their_line() {
    let error = fail(ascii_ply("0 0 0\n1,5 0 0\n0 0 0 0 0 0\n", 3, 0), "ply");
    assert_eq!(error.place, Place::Line(11));
    assert!(error.to_string().contains("`1,5`"), "{error}");
    let error = fail("v 0 0 0\nv 1 x 0\n", "obj");
    assert_eq!(error.place, Place::Line(2));
    let error = fail("v 0 0\n", "obj");
    assert_eq!(error.place, Place::Line(1));
}

#[test]
fn ply_without_positions_says_what_it_has() {
    let text = "ply\nformat ascii 1.0\nelement vertex 1\nproperty float u\nproperty float v\n\
                end_header\n0 0\n";
    assert!(fail(text, "ply").to_string().contains("u, v"));
    let text = "ply\nformat ascii 1.0\nelement points 0\nend_header\n";
    assert!(fail(text, "ply").to_string().contains("points"));
    assert!(matches!(fail(ascii_ply("", 0, 0), "ply").fault, Fault::NoPoints));
}

#[test]
fn obj_without_faces_keeps_its_points_and_their_colors() {
    let cloud = read("# scan\nv 1 2 3 0.5 1 0\nv 4 5 6 0 0 1\n", "obj");
    assert_eq!(cloud.points, points(&[[1., 2., 3.], [4., 5., 6.]]));
    assert_eq!(cloud.colors, [[128, 255, 0], [0, 0, 255]]);
    assert_eq!(read("v 1 2 3 128 255 0\nv 4 5 6 1 0 1\n", "obj").colors[0], [128, 255, 0]);
    assert!(read("v 1 2 3 1.0\nv 4 5 6 1.0\n", "obj").colors.is_empty(), "a weight is no colour");
    assert!(matches!(fail("# nothing\n", "obj").fault, Fault::NoPoints));
}

/// tobj is the oracle; it numbers the vertices anew, so corners are compared.
#[test]
fn obj_faces_agree_with_tobj() {
    let text = "mtllib none.mtl\no a\nv 0 0 0\nv 1 0 0.25\nv 1 1 0\nv 0 1 0\nv 9 9 9\nvt 0 0\nvn 0 0 1\n\
                f 1/1/1 2/1/1 3/1/1 4/1/1\ng b\nv 2 2 2\r\nf -1 1//1 3/1\nf -6 -5 -4 -3 -1\n";
    let ours = read(text, "obj");
    let options = tobj::LoadOptions { triangulate: true, ..Default::default() };
    let (models, _) =
        tobj::load_obj_buf(&mut text.as_bytes(), &options, |_| Ok(Default::default())).unwrap();
    let corner = |m: &tobj::Mesh, i: u32| {
        let at = 3 * i as usize;
        [m.positions[at], m.positions[at + 1], m.positions[at + 2]].map(f64::from)
    };
    let theirs: Vec<[f64; 3]> = models
        .iter()
        .flat_map(|model| model.mesh.indices.iter().map(|i| corner(&model.mesh, *i)))
        .collect();
    let ours_corners: Vec<[f64; 3]> =
        ours.triangles.iter().flatten().map(|i| ours.points[*i as usize].coords.into()).collect();
    assert_eq!(ours_corners, theirs);
    assert_eq!(ours.points.len(), 6, "the unused vertex stays, in its place");
    assert_eq!(ours.points[4], Point3::new(9., 9., 9.));
}

#[test]
fn pcd_in_three_encodings() {
    let head = |data: &str| {
        format!(
            "# .PCD v0.7 - Point Cloud Data file format\nVERSION 0.7\nFIELDS normal x y z rgb\n\
             SIZE 4 8 4 4 4\nTYPE F F F I F\nCOUNT 2 1 1 1 1\nWIDTH 2\nHEIGHT 1\n\
             VIEWPOINT 0 0 0 1 0 0 0\nPOINTS 2\nDATA {data}\n"
        )
    };
    let color = f32::from_bits(0x0012_34ff);
    let rows = [(1.5_f64, 2_f32, -3_i32), (f64::NAN, 0.0, 0)];
    let (mut by_row, mut by_field) = (Vec::new(), vec![Vec::new(); 5]);
    for (x, y, z) in rows {
        let cells: [&[u8]; 5] =
            [&[0; 8], &x.to_le_bytes(), &y.to_le_bytes(), &z.to_le_bytes(), &color.to_le_bytes()];
        for (cell, field) in cells.iter().zip(&mut by_field) {
            by_row.extend_from_slice(cell);
            field.extend_from_slice(cell);
        }
    }
    let plain: Vec<u8> = by_field.concat();
    // Literal runs only: LZF that any unpacker takes.
    let packed: Vec<u8> =
        plain.chunks(32).flat_map(|c| [&[c.len() as u8 - 1], c].concat()).collect();
    let sizes = [packed.len() as u32, plain.len() as u32].map(u32::to_le_bytes).concat();
    let bits = color.to_bits();
    let files = [head("ascii") + &format!("0 0 1.5 2 -3 {bits}\n0 0 nan 0 0 {color:e}\n")]
        .map(String::into_bytes)
        .into_iter()
        .chain([
            [head("binary").into_bytes(), by_row].concat(),
            [head("binary_compressed").into_bytes(), sizes, packed].concat(),
        ]);
    for file in files {
        let (cloud, notes) = read_scan_bytes(&file, "pcd").unwrap();
        assert_eq!(cloud.points, points(&[[1.5, 2., -3.]]));
        assert_eq!(cloud.colors, [[0x12, 0x34, 0xff]]);
        assert_eq!((notes.points_in_file, notes.dropped_non_finite), (2, 1));
    }
}

/// Found by damaging files: a colour without values, an axis without values before
/// one with, and columns that no point bounds.
#[test]
fn pcd_fields_without_values_are_none() {
    let head = |fields: &str, count: &str, points: usize| {
        format!(
            "VERSION .7\nFIELDS {fields}\nSIZE 4 4 4 4\nTYPE F F F F\nCOUNT {count}\n\
             WIDTH {points}\nHEIGHT 1\nPOINTS {points}\nDATA ascii\n1 2 3 4\n"
        )
    };
    let cloud = read(head("x y z rgb", "1 1 1 0", 1), "pcd");
    assert_eq!(cloud.points, points(&[[1., 2., 3.]]));
    assert!(cloud.colors.is_empty());
    assert_eq!(read(head("x x y z", "0 1 1 1", 1), "pcd").points, points(&[[1., 2., 3.]]));
    let huge = head("x y z rgb", "1048576 1048576 1048576 1048576", 0);
    assert!(matches!(fail(huge, "pcd").fault, Fault::NoPoints));
}

#[test]
fn xyz_rows_with_titles_separators_and_colors() {
    let cloud = read("2\nX;Y;Z;R;G;B\n# note\n1;2;3;255;0;1\n4;5;6;1;2;3\n", "xyz");
    assert_eq!(cloud.points, points(&[[1., 2., 3.], [4., 5., 6.]]));
    assert_eq!(cloud.colors, [[255, 0, 1], [1, 2, 3]]);
    assert_eq!(read("1 2 3 -700 9 8 7\n", "pts").colors, [[9, 8, 7]]);
    assert!(read("1,2,3,0.1,0.2,0.97\n", "csv").colors.is_empty(), "normals are no colours");
    let error = fail("1 2 3\n4 5\n", "xyz");
    assert_eq!(error.place, Place::Line(2));
}

/// Rows of points on a bowl, each written by `row` of its number and coordinates.
fn bowl(row: impl Fn(usize, [f64; 3]) -> String) -> (String, Vec<Point3>) {
    let at = |k: usize| {
        let (x, y) = ((k % 20) as f64 + 0.25, (k / 20) as f64 - 10.5);
        [x, y, -(0.0625 * x * x + 0.125 * y)]
    };
    let rows = (0..400).map(|k| row(k, at(k)) + "\n").collect();
    (rows, (0..400).map(|k| Point3::from(at(k))).collect())
}

#[test]
fn xyz_titles_say_where_the_coordinates_are() {
    type Row = fn(usize, [f64; 3]) -> String;
    let cases: [(&str, Row); 9] = [
        ("y,x,z", |_, [x, y, z]| format!("{y},{x},{z}")),
        ("Y;X;Z", |_, [x, y, z]| format!("{y};{x};{z}")),
        ("z x y", |_, [x, y, z]| format!("{z} {x} {y}")),
        ("North,East,Height", |_, [x, y, z]| format!("{y},{x},{z}")),
        ("# Z [mm], Y [mm], X [mm]", |_, [x, y, z]| format!("{z},{y},{x}")),
        ("//X Z Y Intensity", |k, [x, y, z]| format!("{x} {z} {y} {k}")),
        ("id,time,z,y,x", |k, [x, y, z]| format!("{k},{}.5,{z},{y},{x}", k * k)),
        ("Nx Ny Nz X Y Z", |_, [x, y, z]| format!("0.6 0.8 0 {x} {y} {z}")),
        ("\"Points:1\",\"Points:0\",\"Points:2\"", |_, [x, y, z]| {
            format!("\"{y}\",\"{x}\",\"{z}\"")
        }),
    ];
    for (titles, row) in cases {
        let (rows, want) = bowl(row);
        let text = format!("{titles}\n{rows}");
        assert_eq!(read(&text, "txt").points, want, "{titles}");
        let old = text.replace('\n', "\r\n");
        assert_eq!(read(old, "csv").points, want, "{titles}");
    }
    let (rows, _) = bowl(|_, [x, y, z]| format!("{x},{y},{z}"));
    let error = fail(format!("lat,lon,h\n{rows}"), "csv");
    assert_eq!(error.place, Place::Line(1));
    assert!(error.to_string().contains("`lat, lon, h` do not say which"), "{error}");
    // A remark before the rows is none of their titles.
    assert_eq!(read(format!("scanned by hand, twice over\n{rows}"), "csv").points.len(), 400);
}

#[test]
fn xyz_columns_without_titles_are_known_by_what_they_hold() {
    type Row = fn(usize, [f64; 3]) -> String;
    let cases: [(&str, Row, bool); 8] = [
        ("a number first", |k, [x, y, z]| format!("{} {x} {y} {z}", k + 7), false),
        ("a colour first", |k, [x, y, z]| format!("{},9,{},{x},{y},{z}", k % 200, k % 7), true),
        ("a clock first", |k, [x, y, z]| format!("{} {x} {y} {z}", 1.7e9 + 0.25 * k as f64), false),
        ("a time first", |k, [x, y, z]| format!("{} {x} {y} {z}", 0.25 * k as f64), false),
        ("normals first", |_, [x, y, z]| format!("0.6;0;-0.8;{x};{y};{z}"), false),
        ("an intensity between", |k, [x, y, z]| format!("{x} {y} {z} -{k} 1 2 3"), true),
        ("colours that count to one", |_, [x, y, z]| format!("{x} {y} {z} 0.5 0.25 0.125"), true),
        ("normals and a colour", |k, [x, y, z]| format!("{x} {y} {z} 0 0 1 {} 2 3", k % 9), true),
    ];
    for (what, row, colored) in cases {
        let (rows, want) = bowl(row);
        let (cloud, notes) = read_scan_bytes(rows.as_bytes(), "xyz").unwrap();
        assert_eq!(cloud.points, want, "{what}");
        assert_eq!(!cloud.colors.is_empty(), colored, "{what}");
        let said = notes.taken.join(" ");
        assert!(said.contains("by what they hold"), "{what}: {said}");
    }
    assert!(read_scan_bytes(b"1 2 3\n", "xyz").unwrap().1.taken.is_empty());
}

#[test]
fn xyz_numbers_with_decimal_commas_and_wide_characters() {
    let comma = |v: f64| format!("{v:.8}").replace('.', ",");
    for separator in [";", " ", "\t", ", ", ","] {
        let (rows, want) = bowl(|_, p| p.map(comma).join(separator));
        let text = format!("y,x,z\n{rows}").replace("y,x,z", &["y", "x", "z"].join(separator));
        let (cloud, notes) = read_scan_bytes(text.as_bytes(), "csv").unwrap();
        let want: Vec<Point3> = want.iter().map(|p| Point3::new(p.y, p.x, p.z)).collect();
        assert_eq!(cloud.points, want, "{separator:?}");
        assert!(notes.taken.iter().any(|t| t.contains("decimal commas")), "{:?}", notes.taken);
    }
    let (rows, want) = bowl(|_, [x, y, z]| format!("v {x} {y} {z}"));
    let utf16 =
        |text: &str| -> Vec<u8> { text.encode_utf16().flat_map(u16::to_le_bytes).collect() };
    assert_eq!(read(utf16(&rows), "obj").points, want);
    assert_eq!(read(utf16(&rows.replace("v ", "")), "txt").points, want);
    let thousands = fail("1.234,5;2;3\n1.234,5;2;3\n", "csv");
    assert!(thousands.to_string().contains("thousands"), "{thousands}");
}

#[test]
fn ply_triangle_strips_are_triangles_that_face_one_way() {
    let text = "ply\nformat ascii 1.0\nelement vertex 6\nproperty float x\nproperty float y\n\
                property float z\nelement tristrips 1\nproperty list int int vertex_indices\nend_header\n\
                0 0 0\n1 0 0\n0 1 0\n1 1 0\n5 5 5\n6 5 5\n9 0 1 2 3 -1 3 4 5 -1\n";
    assert_eq!(read(text, "ply").triangles, [[0, 1, 2], [2, 1, 3], [3, 4, 5]]);
    assert!(matches!(fail(text.replace("4 5 -1", "4 9 -1"), "ply").fault, Fault::FaceIndex { .. }));
}

#[test]
fn ply_header_lines_that_end_in_newline_and_return() {
    let header = "ply\n\rformat binary_little_endian 1.0\n\relement vertex 1\n\rproperty uchar x\n\r\
                  property uchar y\n\rproperty uchar z\n\rend_header\n\r";
    let bytes = [header.as_bytes(), &[13, 10, 7]].concat();
    assert_eq!(read(bytes, "ply").points, points(&[[13., 10., 7.]]));
}

#[test]
fn obj_lines_go_on_after_a_backslash() {
    let text = "v 0 0 0\nv 1 \\\n 0 0\nv 0 1 \\\r\n 0\nf 1 \\\n2 3\n";
    let cloud = read(text, "obj");
    assert_eq!((cloud.points.len(), cloud.triangles), (3, vec![[0, 1, 2]]));
    let wrong = fail("v 0 0 \\\n0\nv 1 1 x\n", "obj");
    assert_eq!(wrong.place, Place::Line(3), "{wrong}");
}

#[test]
fn obj_cut_off_inside_its_faces_is_named() {
    let vertices: String = (0..300).map(|k| format!("v {} {} 0\n", k % 20, k / 20)).collect();
    let faces: Vec<String> = (1..280).map(|k| format!("f {k} {} {}", k + 1, k + 20)).collect();
    let whole = vertices.clone() + &faces.join("\n");
    assert_eq!(read(&whole, "obj").triangles.len(), 279, "the last line needs no end");
    for cut in [vertices.clone() + &faces[..140].join("\n"), whole[..whole.len() - 4].to_owned()] {
        let error = fail(&cut, "obj");
        assert!(error.to_string().contains("ends inside its faces"), "{error}");
    }
}

#[test]
fn stl_in_capitals_is_stl() {
    let text = "SOLID A\r\nFACET NORMAL 0 0 1\r\nOUTER LOOP\r\nVERTEX 0 0 0\r\nVERTEX 1 0 0\r\n\
                VERTEX 0 1 0\r\nENDLOOP\r\nENDFACET\r\nENDSOLID A\r\n";
    assert_eq!(read(text, "stl").triangles, [[0, 1, 2]]);
}

#[test]
fn stl_corners_are_shared() {
    let ascii = "solid s\nfacet normal 0 0 1\nouter loop\nvertex 0 0 0\nvertex 1 0 0\nvertex 1 1 0\n\
                 endloop\nendfacet\nfacet normal 0 0 1\nouter loop\nvertex 0 0 0\nvertex 1 1 0\n\
                 vertex 0 1 -2\nendloop\nendfacet\nendsolid\n";
    let mut binary = vec![b's'; 80];
    binary.extend(2_u32.to_le_bytes());
    for corners in [[0., 0., 0., 1., 0., 0., 1., 1., 0.], [0., 0., 0., 1., 1., 0., 0., 1., -2_f32]]
    {
        binary.extend([0; 12]);
        binary.extend(corners.iter().flat_map(|c| c.to_le_bytes()));
        binary.extend([0; 2]);
    }
    for cloud in [read(ascii, "stl"), read(binary, "stl")] {
        assert_eq!(cloud.points.len(), 4);
        assert_eq!(cloud.triangles, [[0, 1, 2], [0, 2, 3]]);
    }
}

#[test]
fn what_is_no_scan_is_refused_with_the_remedy() {
    let says = |error: ReadError, part: &str| {
        assert!(error.to_string().contains(part), "{error} lacks {part}");
    };
    says(fail("x", "dae"), ".ply, .obj, .pcd");
    says(fail("", "ply"), "0 bytes");
    says(fail("ply\nformat ascii 1.0\n", "obj"), "rename it to end in .ply");
    says(fail("PK\x03\x04", "ply"), "zip");
    says(fail("ply\nformat ascii 1.0\nelement vertex 1\n", "ply"), "end_header");
    says(fail("plyformat\n", "ply"), "bytes.ply:1");
    let folder = tempfile::tempdir().unwrap();
    says(read_scan(folder.path().join("none.ply")).unwrap_err(), "no such file");
    let pretender = folder.path().join("folder.ply");
    std::fs::create_dir(&pretender).unwrap();
    says(read_scan(pretender).unwrap_err(), "not a regular file");
}

#[test]
fn what_is_written_reads_back() {
    let folder = tempfile::tempdir().unwrap();
    let cloud = Cloud {
        points: points(&CORNERS),
        colors: vec![[1, 2, 3]; 4],
        triangles: vec![[0, 1, 2], [0, 2, 3]],
    };
    let path = folder.path().join("a.ply");
    write_ply(&path, &cloud, 1.0).unwrap();
    assert_eq!(read_scan(&path).unwrap().0, cloud);
    write_ply(&path, &cloud, 1000.0).unwrap();
    assert_eq!(read_scan(&path).unwrap().0.points[3], Point3::new(0., 1000., -2000.));

    let mesh = Mesh { vertices: points(&CORNERS), triangles: vec![[0, 1, 2]] };
    let path = folder.path().join("a.obj");
    write_obj(&path, &mesh).unwrap();
    let (read, _) = read_scan(&path).unwrap();
    assert_eq!(read.triangles, mesh.triangles);
    assert!(read.points.iter().zip(&mesh.vertices).all(|(a, b)| (a / 1e3 - b).norm() < 1e-9));
    let left: Vec<_> = std::fs::read_dir(folder.path()).unwrap().collect();
    assert_eq!(left.len(), 2, "no .part files are left");

    let error = write_obj(folder.path().join("no/such/a.obj"), &mesh).unwrap_err();
    assert!(error.to_string().contains("folder"), "{error}");
}

fn wavy_boundary() -> Boundary {
    let point = |i: usize| BoundaryPoint {
        position_m: Point3::new(0.15 * (i as f64).sin(), -0.1, 0.15 * (i as f64).cos()),
        sigma_m: 1e-4 * i as f64,
        observed: !i.is_multiple_of(3),
    };
    Boundary::new((0..POINTS).map(point).collect()).unwrap()
}

#[test]
fn a_boundary_reads_back_to_a_tenth_of_a_micrometre() {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("b.csv");
    boundary_csv::write(&path, &wavy_boundary()).unwrap();
    let read = boundary_csv::read(&path).unwrap();
    assert!(read.mean_distance_m(&wavy_boundary()) < 1e-7);
    for (a, b) in read.points().iter().zip(wavy_boundary().points()) {
        assert!((a.sigma_m - b.sigma_m).abs() < 1e-7 && a.observed == b.observed);
    }
    let text = std::fs::read_to_string(&path).unwrap();
    assert!(text.starts_with("index,side,x_mm,y_mm,z_mm,sigma_mm,observed\n0,0,"));
    assert_eq!(text.lines().count(), POINTS + 1);
}

#[test]
fn a_boundary_corrected_by_hand_is_checked_line_by_line() {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("b.csv");
    let text = boundary_csv::to_text(&wavy_boundary());
    let with = |row: usize, cells: &str| {
        let mut lines: Vec<&str> = text.lines().collect();
        lines[row] = cells;
        std::fs::write(&path, lines.join("\r\n") + "\r\n\r\n").unwrap();
        boundary_csv::read(&path)
    };
    let kept = with(5, " 4, 0, 1.5, -2, 3e1, 0.25, true ").unwrap();
    assert!((kept.points()[4].position_m - Point3::new(1.5e-3, -2e-3, 30e-3)).norm() < 1e-15);
    for (cells, part) in [
        ("4,0,1,2,3,0", "6 cells"),
        ("4,0,1,5,2,3,0,1", "8 cells"),
        ("5,0,1,2,3,0,1", "row 4, side 0"),
        ("4,1,1,2,3,0,1", "row 4, side 0"),
        ("4,0,a,2,3,0,1", "x_mm: `a`"),
        ("4,0,1,nan,3,0,1", "y_mm: `nan`"),
        ("4,0,1,2,3,-1,1", "not negative"),
        ("4,0,1,2,3,0,yes", "1 or 0"),
    ] {
        let error = with(5, cells).unwrap_err();
        assert_eq!(error.place, Place::Line(6), "{error}");
        assert!(error.to_string().contains(part), "{error} lacks {part}");
    }
    let error = with(5, "").unwrap_err();
    assert_eq!(error.place, Place::Line(7), "the row after the missing one: {error}");
    let error = with(0, "index,x,y,z").unwrap_err();
    assert_eq!(error.place, Place::Line(1));
}

/// A million points in ascii with colours: a second in a busy test machine is
/// twice what it takes alone.
#[test]
fn a_million_ascii_points_load_within_a_second() {
    let mut text = String::from(
        "ply\nformat ascii 1.0\nelement vertex 1000000\nproperty float x\nproperty float y\n\
         property float z\nproperty uchar red\nproperty uchar green\nproperty uchar blue\nend_header\n",
    );
    for i in 0..1_000_000 {
        let x = f64::from(i) * 1e-4;
        text += &format!("{x:.6} {:.6} {:.6} {} 20 30\n", -x, 0.5 * x, i % 256);
    }
    let cloud = read(&text, "ply");
    assert_eq!(cloud.points.len(), 1_000_000);
}

/// Real sensor files that nobody here wrote.
#[test]
fn real_sensor_files_load_with_plausible_counts() {
    let folder = std::path::Path::new(env!("CARGO_MANIFEST_DIR")).join("../shared/data/scans");
    if !folder.is_dir() {
        eprintln!("skipped: {} is absent (see its ORIGIN.md)", folder.display());
        return;
    }
    let mut seen = 0;
    for entry in std::fs::read_dir(&folder).unwrap() {
        let path = entry.unwrap().path();
        if !path.is_file() {
            continue;
        }
        let (cloud, notes) = read_scan(&path).unwrap();
        let name = path.file_name().unwrap().to_string_lossy().into_owned();
        eprintln!(
            "{name}: {} points, {} triangles, {notes:?}",
            cloud.points.len(),
            cloud.triangles.len()
        );
        match name.as_str() {
            "face000.ply" => {
                assert_eq!(cloud.points.len(), 85_849);
                assert!(cloud.triangles.len() > 150_000);
            }
            "small_gicp_source.ply" => assert_eq!(cloud.points.len(), 69_792),
            _ => {
                assert_eq!(notes.points_in_file, 640 * 480, "{name}");
                assert!((20_000..=640 * 480).contains(&cloud.points.len()), "{name}");
                assert_eq!(cloud.colors.len(), cloud.points.len(), "{name}");
                let far = cloud.points.iter().filter(|p| p.coords.norm() > 20.0).count();
                assert_eq!(far, 0, "{name}: metres within a room");
            }
        }
        seen += 1;
    }
    assert!(seen >= 8, "{seen} files");
}

#[test]
fn a_file_without_an_ending_is_answered_with_the_flag_that_says_its_format() {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("scan");
    std::fs::write(&path, "0 0 0\n1 0 0\n").unwrap();
    let said = read_scan(&path).unwrap_err().to_string();
    assert!(said.contains("no ending") && said.contains("--format"), "{said}");
    let said = read_scan(folder.path().join("scan.docx")).unwrap_err().to_string();
    assert!(!said.contains("no ending"), "{said}");
}

#[test]
fn what_scanning_apps_give_away_is_answered_with_the_export_to_take() {
    let folder = tempfile::tempdir().unwrap();
    for (name, remedy) in [
        ("a.usdz", "as GLB or PLY"),
        ("a.r3d", "export the frames as PLY"),
        ("a.spz", "Gaussian splats"),
        ("a.ptx", "as E57"),
        ("a.npy", "a PNG of 16 bits"),
    ] {
        let path = folder.path().join(name);
        std::fs::write(&path, "x").unwrap();
        let said = read_scan(&path).unwrap_err().to_string();
        assert!(said.contains(remedy), "{said}");
    }
    let names = ["x", "y", "z", "f_dc_0", "opacity", "rot_0"];
    let properties: String = names.iter().map(|n| format!("property float {n}\n")).collect();
    let splats =
        format!("ply\nformat ascii 1.0\nelement vertex 1\n{properties}end_header\n1 2 3 4 5 6\n");
    assert!(fail(splats, "ply").to_string().contains("mesh mode"));
}
