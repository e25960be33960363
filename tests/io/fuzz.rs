//! Damaged files: whatever bytes are flipped, cut or put in, a reader returns,
//! and what it returns is no larger than the bytes allow.

use rand::RngExt as _;
use scan2params::base::seed;
use scan2params::geom::Cloud;
use scan2params::io::{
    Intrinsics, ReadError, boundary_csv, density_csv, intrinsics, read_scan_bytes,
    read_views_bytes, write_ply,
};

/// Small valid files, by extension.
fn seeds() -> Vec<(&'static str, Vec<u8>)> {
    let ascii = "ply\nformat ascii 1.0\ncomment c\nelement camera 1\nproperty float f\nelement vertex 4\n\
                 property float x\nproperty float y\nproperty float z\nproperty uchar red\n\
                 property uchar green\nproperty uchar blue\nproperty list uchar int tags\n\
                 element face 2\nproperty list uchar int vertex_indices\nend_header\n5\n\
                 0 0 0 1 2 3 0\n1 0 0 4 5 6 1 7\n1 1 0 7 8 9 0\n0 1 0 1 1 1 2 3\n4\n3 0 1 2\n4 0 1 2 3\n";
    let pcd = "# .PCD v0.7\nVERSION 0.7\nFIELDS x y z rgb\nSIZE 4 4 4 4\nTYPE F F F U\nCOUNT 1 1 1 1\n\
               WIDTH 2\nHEIGHT 1\nVIEWPOINT 0 0 0 1 0 0 0\nPOINTS 2\nDATA ";
    let packed =
        [&[33, 0, 0, 0, 32, 0, 0, 0, 15][..], &[1; 16], &[12], &[2; 13], &[32, 0]].concat();
    let stl = [&[b's'; 80][..], &1_u32.to_le_bytes(), &[65; 50]].concat();
    let cloud = read_scan_bytes(ascii.as_bytes(), "ply").unwrap().0;
    let folder = tempfile::tempdir().unwrap();
    write_ply(folder.path().join("a.ply"), &cloud, 1.0).unwrap();
    let little = std::fs::read(folder.path().join("a.ply")).unwrap();
    let big = big_endian(&cloud);
    vec![
        ("ply", ascii.into()),
        ("ply", little),
        ("ply", big),
        ("obj", b"v 0 0 0\nv 1 0 0 1 0 0\nv 0 1 0\nvn 0 0 1\nf 1/1/1 2//1 -1\nf 1 2 3\n".into()),
        ("pcd", format!("{pcd}ascii\n1 2 3 4\n5 6 nan 7\n").into()),
        ("pcd", [format!("{pcd}binary\n").as_bytes(), &[63; 32]].concat()),
        ("pcd", [format!("{pcd}binary_compressed\n").as_bytes(), &packed].concat()),
        ("xyz", b"x y z\n1 2 3 255 0 0\n4 5 6 1 1 1\n".into()),
        ("glb", glb()),
        ("png", depth_png()),
        ("stl", stl),
        ("e57", of_fixture("two_scans.e57")),
        ("laz", of_fixture("chunked.laz")),
        ("laz", of_fixture("layered.laz")),
        ("las", of_fixture("plain.las")),
        ("stl", b"solid\nfacet\nvertex 0 0 0\nvertex 1 0 0\nvertex 0 1 0\nendfacet\n".into()),
    ]
}

/// A small file of another program (`fixtures/README.md`).
fn of_fixture(name: &str) -> Vec<u8> {
    let folder = std::path::Path::new(env!("CARGO_MANIFEST_DIR")).join("fixtures/formats");
    std::fs::read(folder.join(name)).unwrap()
}

/// The cloud as binary PLY of the other byte order, in double precision.
fn big_endian(cloud: &Cloud) -> Vec<u8> {
    let mut bytes = format!(
        "ply\nformat binary_big_endian 1.0\nelement vertex {}\nproperty double x\n\
         property double y\nproperty double z\nproperty uchar red\nproperty uchar green\n\
         property uchar blue\nelement face {}\nproperty list uchar uint vertex_indices\n\
         end_header\n",
        cloud.points.len(),
        cloud.triangles.len()
    )
    .into_bytes();
    for (point, color) in cloud.points.iter().zip(&cloud.colors) {
        point.iter().for_each(|c| bytes.extend(c.to_be_bytes()));
        bytes.extend(color);
    }
    for triangle in &cloud.triangles {
        bytes.push(3);
        triangle.iter().for_each(|v| bytes.extend(v.to_be_bytes()));
    }
    bytes
}

/// Two nodes with one mesh of four quantised points.
fn glb() -> Vec<u8> {
    let json = br#"{"nodes":[{"mesh":0,"scale":[2,2,2],"children":[1]},{"mesh":0}],"meshes":[{"primitives":[{"attributes":{"POSITION":0,"COLOR_0":0},"indices":1,"mode":5}]}],"accessors":[{"bufferView":0,"componentType":5122,"normalized":true,"count":4,"type":"VEC3"},{"bufferView":1,"componentType":5121,"count":4,"type":"SCALAR"}],"bufferViews":[{"buffer":0,"byteLength":32,"byteStride":8},{"buffer":0,"byteOffset":32,"byteLength":4}],"buffers":[{"byteLength":36}]}  "#;
    let data: Vec<u8> = (0..32).chain([0, 1, 2, 3]).collect();
    let chunks = [
        &(json.len() as u32).to_le_bytes()[..],
        b"JSON",
        json,
        &36_u32.to_le_bytes(),
        b"BIN\0",
        &data,
    ];
    let chunks = chunks.concat();
    [&b"glTF"[..], &2_u32.to_le_bytes(), &(12 + chunks.len() as u32).to_le_bytes(), &chunks]
        .concat()
}

fn depth_png() -> Vec<u8> {
    let values = (0..48).map(|i| 500 + 7 * i).collect();
    let image = image::ImageBuffer::<image::Luma<u16>, Vec<u16>>::from_raw(8, 6, values).unwrap();
    let mut bytes = std::io::Cursor::new(Vec::new());
    image.write_to(&mut bytes, image::ImageFormat::Png).unwrap();
    bytes.into_inner()
}

fn damage(bytes: &mut Vec<u8>, rng: &mut seed::Rng) {
    const TOKENS: [&[u8]; 8] =
        [b"4294967295", b"-1", b"nan", b"1e400", b"\xff\xff\xff\xff", b"\0\0\0\0", b"\r\n", b" "];
    for _ in 0..rng.random_range(1..=4) {
        if bytes.is_empty() {
            return;
        }
        let at = rng.random_range(0..bytes.len());
        match rng.random_range(0..6) {
            0 => bytes[at] ^= 1 << rng.random_range(0..8),
            1 => bytes[at] = rng.random(),
            2 => bytes.truncate(at),
            3 => {
                let token = TOKENS[rng.random_range(0..TOKENS.len())];
                bytes.splice(at..at, token.iter().copied());
            }
            4 => {
                let end = (at + rng.random_range(1..=16)).min(bytes.len());
                let piece = bytes[at..end].to_vec();
                bytes.splice(at..at, piece);
            }
            _ => {
                let end = (at + rng.random_range(1..=16)).min(bytes.len());
                bytes.drain(at..end);
            }
        }
    }
}

#[test]
fn damaged_files_neither_panic_nor_grow() {
    const CASES: u64 = 4_000;
    let (mut read, mut refused) = (0, 0);
    for (kind, (extension, seed_bytes)) in seeds().into_iter().enumerate() {
        for case in 0..CASES {
            let mut rng = seed::rng(1, "io-fuzz", case * 100 + kind as u64);
            let mut bytes = seed_bytes.clone();
            damage(&mut bytes, &mut rng);
            match read_scan_bytes(&bytes, extension) {
                Ok((cloud, notes)) => {
                    read += 1;
                    // LZF stands for up to 88 bytes a byte, deflate for 1032 with two to a
                    // pixel; a point takes one at least. LAZ is held to 64 points a byte, and an
                    // E57 point takes a bit.
                    let most = if extension == "png" { 520 } else { 88 };
                    assert!(notes.points_in_file <= most * bytes.len(), "kind {kind} case {case}");
                    assert!(cloud.triangles.len() <= bytes.len(), "kind {kind} case {case}");
                    let n = cloud.points.len() as u32;
                    assert!(n > 0 && cloud.points.iter().all(|p| p.iter().all(|c| c.is_finite())));
                    assert!(cloud.triangles.iter().flatten().all(|&v| v < n));
                    assert!(cloud.colors.is_empty() || cloud.colors.len() == cloud.points.len());
                }
                Err(error) => {
                    refused += 1;
                    assert!(error.to_string().len() < 500, "{error}");
                }
            }
        }
    }
    assert!(read > 1_000 && refused > 1_000, "{read} read, {refused} refused");
}

/// The tables and descriptions beside scans: whatever is damaged, a reader returns.
#[test]
fn damaged_tables_neither_panic_nor_lie() {
    const CASES: u64 = 5_000;
    let yaml = "width: 640\nheight: 480\ndistortion_model: plumb_bob\nD: [0.1, 0, 0, 0, 0]\nK: [585, 0,\n 320, 0, 585, 240, 0, 0, 1]\n";
    let json = r#"{"width":640,"height":480,"intrinsic_matrix":[585,0,0,0,585,0,320,240,1]}"#;
    let views = r#"{"schema":"scan2params/views/1","intrinsics":{"fx":585,"fy":585,"cx":320,"cy":240},"views":[{"file":"a.png","world_from_camera":[1,0,0,0,0,1,0,0,0,0,1,0,0,0,0,1]}]}"#;
    let table = "file,density_g_m2,warp_toward\n\"a, b.ply\",214.5,+x\nc.ply,180,\n";
    type Reader = fn(&[u8]) -> Result<(), ReadError>;
    let boundary = boundary_text();
    let readers: [(&str, Reader); 5] = [
        (yaml, |bytes| intrinsics::read_bytes(bytes).map(check_camera)),
        (json, |bytes| intrinsics::read_bytes(bytes).map(check_camera)),
        (views, |bytes| read_views_bytes(bytes).map(|files| assert!(files >= 2))),
        (&boundary, |bytes| {
            let rim = boundary_csv::read_bytes(bytes)?;
            assert!(rim.positions_m().all(|p| p.iter().all(|c| c.is_finite())));
            Ok(())
        }),
        (table, |bytes| {
            let rows = density_csv::read_bytes(bytes)?;
            assert!(!rows.is_empty() && rows.iter().all(|row| row.density_g_m2.is_finite()));
            Ok(())
        }),
    ];
    for (kind, (text, read)) in readers.iter().enumerate() {
        read(text.as_bytes()).unwrap();
        for case in 0..CASES {
            let mut rng = seed::rng(2, "io-fuzz", case * 100 + kind as u64);
            let mut bytes = text.as_bytes().to_vec();
            damage(&mut bytes, &mut rng);
            if let Err(error) = read(&bytes) {
                assert!(error.to_string().len() < 700, "{error}");
            }
        }
    }
}

fn boundary_text() -> String {
    let rows = (0..244).map(|k| format!("{k},{},{}.5,-20,3e1,0.25,1\n", k / 61, k));
    format!("{}\n{}", boundary_csv::HEADER, rows.collect::<String>())
}

fn check_camera(camera: Intrinsics) {
    assert!(camera.focal_px.iter().all(|f| *f > 0.0 && f.is_finite()));
}

#[test]
fn the_undamaged_seeds_read() {
    let read = |(extension, bytes): (&str, Vec<u8>)| {
        read_scan_bytes(&bytes, extension).unwrap_or_else(|e| panic!("{extension}: {e}")).0
    };
    let clouds: Vec<Cloud> = seeds().into_iter().map(read).collect();
    // the first three are one cloud in the three encodings of PLY
    assert_eq!(clouds[0].triangles.len(), 3);
    for other in &clouds[1..3] {
        assert_eq!(other.points, clouds[0].points);
        assert_eq!((&other.colors, &other.triangles), (&clouds[0].colors, &clouds[0].triangles));
    }
}
