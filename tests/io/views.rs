//! GLB, depth images and sets of views: made by hand, and real ones.

use crate::program;
use std::path::Path;

use image::{ImageBuffer, Luma};
use nalgebra::{Quaternion, UnitQuaternion};
use scan2params::base::{Point3, Vector3};
use scan2params::intake::rim::of_scan;
use scan2params::io::{
    Fault, Format, Intrinsics, ReadError, ReadOptions, Turntable, files_of, is_views_folder,
    read_scan, read_scan_bytes, read_scan_with, read_views,
};
use scan2params::scan::{LengthUnit, ScanOptions, WarpToward, boundary_from_scan};
use serde_json::{Value, json};

fn fail(bytes: &[u8], extension: &str) -> ReadError {
    match read_scan_bytes(bytes, extension) {
        Ok(read) => panic!("read as {read:?}"),
        Err(error) => error,
    }
}

/// A GLB of this JSON and data.
fn glb(document: &Value, data: &[u8]) -> Vec<u8> {
    let mut json = serde_json::to_vec(document).unwrap();
    json.resize(json.len().next_multiple_of(4), b' ');
    let mut data = data.to_vec();
    data.resize(data.len().next_multiple_of(4), 0);
    let mut chunks = Vec::new();
    for (kind, chunk) in [(&b"JSON"[..], &json), (b"BIN\0", &data)] {
        chunks.extend((chunk.len() as u32).to_le_bytes());
        chunks.extend(kind);
        chunks.extend(chunk);
    }
    let mut file = b"glTF".to_vec();
    file.extend(2_u32.to_le_bytes());
    file.extend((12 + chunks.len() as u32).to_le_bytes());
    file.extend(chunks);
    file
}

fn floats(values: &[f32]) -> Vec<u8> {
    values.iter().flat_map(|v| v.to_le_bytes()).collect()
}

/// A square of four points: positions at byte 0, six indices at byte 48, colours at 60.
fn square_data() -> Vec<u8> {
    let mut data = floats(&[0., 0., 0., 1., 0., 0.25, 1., 1., 0., 0., 1., 0.]);
    data.extend([0_u16, 1, 2, 0, 2, 3].iter().flat_map(|i| i.to_le_bytes()));
    data.extend([255, 0, 0, 255, 0, 255, 0, 255, 0, 0, 255, 255, 9, 9, 9, 255]);
    data
}

fn square() -> Value {
    json!({
        "asset": { "version": "2.0" },
        "scene": 0,
        "scenes": [{ "nodes": [0] }],
        "nodes": [{ "mesh": 0 }],
        "meshes": [{ "primitives": [{ "attributes": { "POSITION": 0, "COLOR_0": 2 }, "indices": 1, "material": 0 }] }],
        "materials": [{}],
        "accessors": [
            { "bufferView": 0, "componentType": 5126, "count": 4, "type": "VEC3", "min": [0, 0, 0], "max": [1, 1, 0.25] },
            { "bufferView": 1, "componentType": 5123, "count": 6, "type": "SCALAR" },
            { "bufferView": 2, "componentType": 5121, "normalized": true, "count": 4, "type": "VEC4" }
        ],
        "bufferViews": [
            { "buffer": 0, "byteLength": 48 },
            { "buffer": 0, "byteOffset": 48, "byteLength": 12 },
            { "buffer": 0, "byteOffset": 60, "byteLength": 16 }
        ],
        "buffers": [{ "byteLength": 76 }]
    })
}

/// `square()` with the value at `pointer` replaced.
fn square_with(pointer: &str, value: Value) -> Value {
    let mut document = square();
    if let Some(place) = document.pointer_mut(pointer) {
        *place = value;
    } else {
        let (parent, key) = pointer.rsplit_once('/').unwrap();
        let parent = document.pointer_mut(parent).unwrap().as_object_mut().unwrap();
        parent.insert(key.to_owned(), value);
    }
    document
}

#[test]
fn glb_positions_faces_and_colours() {
    let (cloud, notes) = read_scan_bytes(&glb(&square(), &square_data()), "glb").unwrap();
    let want = [[0., 0., 0.], [1., 0., 0.25], [1., 1., 0.], [0., 1., 0.]].map(Point3::from);
    assert_eq!(cloud.points, want);
    assert_eq!(cloud.triangles, [[0, 1, 2], [0, 2, 3]]);
    assert_eq!(cloud.colors, [[255, 0, 0], [0, 255, 0], [0, 0, 255], [9, 9, 9]]);
    assert_eq!((notes.format, notes.points_in_file), (Some(Format::Glb), 4));
}

/// The fixture's points as a GLB whose node undoes what was done to them.
#[test]
fn a_glb_of_a_scan_gives_the_rim_of_the_scan() {
    let scan =
        Path::new(env!("CARGO_MANIFEST_DIR")).join("fixtures/scans/stiff_structured-light.ply");
    let (cloud, _) = read_scan(&scan).unwrap();
    let data: Vec<u8> = floats(
        &cloud.points.iter().flat_map(|p| [p.x as f32, p.y as f32, p.z as f32]).collect::<Vec<_>>(),
    );
    let document = json!({
        "scenes": [{ "nodes": [0] }],
        "nodes": [{ "mesh": 0, "scale": [0.001, 0.001, 0.001], "translation": [0.5, 0.25, -1.0] }],
        "meshes": [{ "primitives": [{ "attributes": { "POSITION": 0 }, "mode": 0 }] }],
        "accessors": [{ "bufferView": 0, "componentType": 5126, "count": cloud.points.len(), "type": "VEC3" }],
        "bufferViews": [{ "buffer": 0, "byteLength": data.len() }],
        "buffers": [{ "byteLength": data.len() }]
    });
    let (moved, _) = read_scan_bytes(&glb(&document, &data), "glb").unwrap();
    let warp_toward = Some(WarpToward::Direction([1.0, 0.0, 0.0]));
    let options = ScanOptions { warp_toward, ..ScanOptions::default() };
    let rims = [&cloud, &moved].map(|cloud| boundary_from_scan(cloud, &options).unwrap());
    assert_eq!(rims.each_ref().map(|rim| rim.unit), [LengthUnit::Millimetre, LengthUnit::Metre]);
    // Rounding alone.
    let apart_m = rims[0].boundary.mean_distance_m(&rims[1].boundary);
    assert!(apart_m < 1e-4, "{apart_m}");
}

#[test]
fn glb_nodes_move_turn_and_scale_their_children() {
    // Half a turn about z, then 10 along x; below it a node of twice the size, and by
    // a matrix a node moved by 3 along y.
    let nodes = json!([
        { "translation": [10, 0, 0], "rotation": [0, 0, 1, 0], "children": [2, 1] },
        { "mesh": 0, "matrix": [1, 0, 0, 0, 0, 1, 0, 0, 0, 0, 1, 0, 0, 3, 0, 1] },
        { "mesh": 0, "scale": [2, 2, 2] },
        { "mesh": 0, "translation": [99, 99, 99] }
    ]);
    let document = square_with("/nodes", nodes);
    let (cloud, _) = read_scan_bytes(&glb(&document, &square_data()), "glb").unwrap();
    assert_eq!(cloud.points.len(), 8, "a node outside the scene is not shown");
    let near = |i: usize, p: [f64; 3]| assert!((cloud.points[i] - Point3::from(p)).norm() < 1e-12);
    near(1, [8.0, 0.0, 0.5]);
    near(2, [8.0, -2.0, 0.0]);
    near(4, [10.0, -3.0, 0.0]);
    near(6, [9.0, -4.0, 0.0]);
    assert_eq!(cloud.triangles[2], [4, 5, 6]);
    // Without scenes every root shows.
    let mut document = document;
    document.as_object_mut().unwrap().remove("scenes");
    document.as_object_mut().unwrap().remove("scene");
    assert_eq!(read_scan_bytes(&glb(&document, &square_data()), "glb").unwrap().0.points.len(), 12);
}

#[test]
fn glb_quantised_strided_stripped_and_shared() {
    let mut data: Vec<u8> = Vec::new();
    for [x, y, z] in [[0_i16, 0, 0], [32767, 0, 0], [0, -32768, 0], [32767, 32767, 0]] {
        data.extend([x, y, z, 77].iter().flat_map(|v| v.to_le_bytes()));
    }
    let document = json!({
        "extensionsRequired": ["KHR_mesh_quantization"],
        "nodes": [{ "mesh": 0, "scale": [2, 2, 2] }],
        "meshes": [{ "primitives": [
            { "attributes": { "POSITION": 0 }, "mode": 5 },
            { "attributes": { "POSITION": 0 }, "mode": 6 },
            { "attributes": { "POSITION": 0 }, "mode": 1 }
        ] }],
        "accessors": [{ "bufferView": 0, "componentType": 5122, "normalized": true, "count": 4, "type": "VEC3" }],
        "bufferViews": [{ "buffer": 0, "byteLength": 32, "byteStride": 8 }],
        "buffers": [{ "byteLength": 32 }]
    });
    let (cloud, _) = read_scan_bytes(&glb(&document, &data), "glb").unwrap();
    let want = [[0., 0., 0.], [2., 0., 0.], [0., -2., 0.], [2., 2., 0.]].map(Point3::from);
    assert_eq!(cloud.points, want, "one set of points for three primitives");
    assert_eq!(cloud.triangles, [[0, 1, 2], [2, 1, 3], [0, 1, 2], [0, 2, 3]]);
    assert!(cloud.colors.is_empty());
}

#[test]
fn glb_that_cannot_be_read_says_what_to_do() {
    let draco = json!([{ "attributes": { "POSITION": 0 }, "extensions": { "KHR_draco_mesh_compression": {} } }]);
    let mut no_view = square_with("/meshes/0/primitives", draco);
    no_view.pointer_mut("/accessors/0").unwrap().as_object_mut().unwrap().remove("bufferView");
    for (document, part) in [
        (square_with("/accessors/0/sparse", json!({})), "sparse"),
        (no_view, "compressed (KHR_draco"),
        (square_with("/extensionsRequired", json!(["EXT_meshopt_compression"])), "compressed"),
        (square_with("/extensionsRequired", json!(["VENDOR_shape"])), "`VENDOR_shape`"),
        (square_with("/buffers/0/uri", json!("scan.bin")), "another file"),
        (square_with("/bufferViews/0/buffer", json!(1)), "names buffer 1"),
        (square_with("/bufferViews/0/byteLength", json!(480)), "beyond the file's"),
        (square_with("/accessors/0/count", json!(4_000_000_000_u64)), "4000000000"),
        (square_with("/accessors/0/count", json!(u64::MAX)), "accessor 0"),
        (square_with("/accessors/0/byteOffset", json!(u64::MAX)), "accessor 0"),
        (square_with("/accessors/0/type", json!("VEC2")), "VEC2"),
        (square_with("/accessors/0/componentType", json!(1)), "component type 1"),
        (square_with("/nodes/0/children", json!([0])), "two parents"),
        (square_with("/nodes/0/mesh", json!(7)), "mesh 7"),
        (square_with("/scenes/0/nodes", json!([3])), "node 3"),
        (square_with("/scenes/0/nodes", json!([])), "no points"),
        (square_with("/accessors/1/bufferView", json!(2)), "names vertex 255"),
        (json!({ "nodes": 3 }), "JSON cannot be read"),
    ] {
        let error = fail(&glb(&document, &square_data()), "glb").to_string();
        assert!(error.contains(part), "{error:?} lacks {part:?}");
    }
    let many: Vec<Value> = (0..200).map(|_| json!({ "mesh": 0 })).collect();
    let mut document = square_with("/nodes", json!(many));
    *document.pointer_mut("/scenes/0/nodes").unwrap() = json!((0..200).collect::<Vec<_>>());
    let repeated = vec![json!({ "attributes": { "POSITION": 0 }, "indices": 1 }); 400];
    *document.pointer_mut("/meshes/0/primitives").unwrap() = json!(repeated);
    let error = fail(&glb(&document, &square_data()), "glb").to_string();
    assert!(error.contains("repeats"), "{error}");
    let whole = glb(&square(), &square_data());
    for length in 0..whole.len() {
        assert!(!fail(&whole[..length], "glb").to_string().is_empty());
    }
    let mut old = whole.clone();
    old[4] = 1;
    assert!(fail(&old, "glb").to_string().contains("version 1"));
    assert!(fail(&whole, "ply").to_string().contains("rename it to end in .glb"));
}

/// A depth PNG of these values, row by row.
fn depth_png(width: u32, values: &[u16]) -> Vec<u8> {
    let image: ImageBuffer<Luma<u16>, Vec<u16>> =
        ImageBuffer::from_raw(width, values.len() as u32 / width, values.to_vec()).unwrap();
    let mut bytes = std::io::Cursor::new(Vec::new());
    image.write_to(&mut bytes, image::ImageFormat::Png).unwrap();
    bytes.into_inner()
}

fn camera(focal: f64, centre: [f64; 2]) -> ReadOptions {
    let intrinsics = Intrinsics::pinhole([focal; 2], centre).unwrap();
    ReadOptions { intrinsics: Some(intrinsics), ..ReadOptions::default() }
}

#[test]
fn a_depth_image_becomes_points_of_its_camera() {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("d.png");
    std::fs::write(&path, depth_png(3, &[0, 500, 65535, 2000, 400, 1000])).unwrap();
    let (cloud, notes) = read_scan_with(&path, &camera(100.0, [1.0, 0.5])).unwrap();
    let want = [[0., -0.0025, 0.5], [-0.02, 0.01, 2.], [0., 0.002, 0.4], [0.01, 0.005, 1.]];
    assert_eq!(cloud.points.len(), 4, "0 and 65535 are no depths");
    for (p, q) in cloud.points.iter().zip(want) {
        assert!((p - Point3::from(q)).norm() < 1e-12, "{p} {q:?}");
    }
    assert_eq!(notes.format, Some(Format::DepthPng));
    let tum = ReadOptions { depth_scale: 5000.0, ..camera(100.0, [1.0, 0.5]) };
    assert!((read_scan_with(&path, &tum).unwrap().0.points[0].z - 0.1).abs() < 1e-12);
    let error = read_scan(&path).unwrap_err();
    assert!(matches!(error.fault, Fault::NoIntrinsics), "{error}");
}

#[test]
fn pixels_between_two_surfaces_are_dropped_on_demand_and_edges_are_not() {
    // Left half at 500, right half at 800, one flier at 650 on the edge and one
    // alone; 8 x 6 pixels.
    let mut values: Vec<u16> = (0..48).map(|i| if i % 8 < 4 { 500 } else { 800 }).collect();
    values[2 * 8 + 3] = 650;
    values[3 * 8 + 6] = 1900;
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("d.png");
    std::fs::write(&path, depth_png(8, &values)).unwrap();
    let options = camera(100.0, [4.0, 3.0]);
    assert_eq!(read_scan_with(&path, &options).unwrap().0.points.len(), 48);
    let options = ReadOptions { max_jump_m: Some(0.02), ..options };
    let (cloud, notes) = read_scan_with(&path, &options).unwrap();
    assert_eq!((cloud.points.len(), notes.dropped_jumps), (46, 2));
}

/// The depths [mm] of a fixture from straight above, 640 x 480 pixels of [`above`].
fn depths_from_above(name: &str) -> Vec<u16> {
    let scans = Path::new(env!("CARGO_MANIFEST_DIR")).join("fixtures/scans");
    let (cloud, _) = read_scan(scans.join(format!("{name}.ply"))).unwrap();
    let truth = std::fs::read(scans.join(format!("{name}.truth.json"))).unwrap();
    let truth: Value = serde_json::from_slice(&truth).unwrap();
    let numbers = |key: &str| -> Vec<f64> { serde_json::from_value(truth[key].clone()).unwrap() };
    let q = numbers("simulation_from_scanner_rotation_ijkw");
    let turn = UnitQuaternion::from_quaternion(Quaternion::new(q[3], q[0], q[1], q[2]));
    let shift = Vector3::from_column_slice(&numbers("simulation_from_scanner_translation_m"));
    let unit_m = truth["unit_m"].as_f64().unwrap();
    let mut depths = vec![0_u16; 640 * 480];
    for point in &cloud.points {
        let p = turn * (point.coords * unit_m) + shift;
        let z = 0.6 - p.y;
        let [column, row] = [319.5 + 500.0 * p.x / z, 239.5 + 500.0 * p.z / z].map(f64::round);
        if (0.0..640.0).contains(&column) && (0.0..480.0).contains(&row) {
            let pixel = &mut depths[row as usize * 640 + column as usize];
            let depth = (z * 1e3).round() as u16;
            *pixel = if *pixel == 0 { depth } else { depth.min(*pixel) };
        }
    }
    depths
}

fn above() -> ReadOptions {
    camera(500.0, [319.5, 239.5])
}

#[test]
fn depths_of_a_wrong_scale_or_with_exchanged_bytes_are_known() {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("d.png");
    let depths = depths_from_above("stiff_structured-light");
    std::fs::write(&path, depth_png(640, &depths)).unwrap();
    let (cloud, notes) = read_scan_with(&path, &above()).unwrap();
    assert!(notes.taken.is_empty(), "{:?}", notes.taken);
    for wrong in [100.0, 10_000.0] {
        let read = ReadOptions { depth_scale: wrong, ..above() };
        let said = of_scan(&path, &read, &ScanOptions::default()).unwrap_err().to_string();
        assert!(said.contains("give --depth-scale 1000"), "{said}");
    }
    let swapped: Vec<u16> = depths.iter().map(|d| d.swap_bytes()).collect();
    std::fs::write(&path, depth_png(640, &swapped)).unwrap();
    let (again, notes) = read_scan_with(&path, &above()).unwrap();
    assert_eq!(again.points, cloud.points);
    assert!(notes.taken[0].contains("bytes"), "{:?}", notes.taken);
}

#[test]
fn a_principal_point_of_another_image_is_named() {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("d.png");
    std::fs::write(&path, depth_png(64, &[500; 64 * 48])).unwrap();
    for (centre, named) in [
        ([31.5, 23.5], false),
        ([27.0, 26.0], false),
        ([63.5, 47.5], true),
        ([15.5, 11.5], true),
        ([640.0, 24.0], true),
    ] {
        let read = read_scan_with(&path, &camera(50.0, centre));
        assert_eq!(read.is_err(), named, "{centre:?}");
        if let Err(error) = read {
            assert!(error.to_string().contains("principal point"), "{error}");
        }
    }
}

#[test]
fn pictures_and_bombs_are_no_depth_images() {
    let mut bytes = std::io::Cursor::new(Vec::new());
    image::RgbImage::new(4, 4).write_to(&mut bytes, image::ImageFormat::Png).unwrap();
    assert!(fail(&bytes.into_inner(), "png").to_string().contains("export the raw depth"));
    let mut bytes = std::io::Cursor::new(Vec::new());
    image::GrayImage::new(4, 4).write_to(&mut bytes, image::ImageFormat::Png).unwrap();
    let picture = bytes.into_inner();
    assert!(fail(&picture, "png").to_string().contains("with 8 bits"));
    // nobody is asked for the camera of a picture that has no depths
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("photo.png");
    std::fs::write(&path, picture).unwrap();
    assert!(read_scan(&path).unwrap_err().to_string().contains("with 8 bits"));
    let whole = depth_png(8, &[500; 64]);
    for length in 0..whole.len() - 12 {
        fail(&whole[..length], "png");
    }
    // A header that announces 65535 x 65535 pixels, with its checksum.
    let mut bomb = whole;
    bomb[16..24].copy_from_slice(&[0, 0, 0xff, 0xff, 0, 0, 0xff, 0xff]);
    let crc = crc32(&bomb[12..29]);
    bomb[29..33].copy_from_slice(&crc.to_be_bytes());
    let error = fail(&bomb, "png").to_string();
    assert!(error.contains("65535 x 65535") || error.contains("limit"), "{error}");
}

fn crc32(bytes: &[u8]) -> u32 {
    let step = |crc: u32| if crc & 1 == 1 { (crc >> 1) ^ 0xedb8_8320 } else { crc >> 1 };
    !bytes.iter().fold(!0, |crc, &byte| (0..8).fold(crc ^ u32::from(byte), |c, _| step(c)))
}

/// A folder with two views of one point (0.1, 0.2, 1.3): by a depth image from the
/// origin, and by a PLY in millimetres from a camera at (0, 0, 2) that looks back.
fn two_views(folder: &Path, list: impl FnOnce(&mut Value)) {
    let mut values = vec![0; 64];
    values[4 * 8 + 3] = 1300;
    std::fs::write(folder.join("a.png"), depth_png(8, &values)).unwrap();
    let ply = "ply\nformat ascii 1.0\nelement vertex 1\nproperty float x\nproperty float y\n\
               property float z\nend_header\n-100 200 700\n";
    std::fs::write(folder.join("b.ply"), ply).unwrap();
    // Pixel (3, 4) looks along (0.1, 0.2, 1.3) / 1.3.
    let [cx, cy] = [3.0 - 10.0 * 0.1 / 1.3, 4.0 - 10.0 * 0.2 / 1.3];
    let mut document = json!({
        "schema": "scan2params/views/1",
        "intrinsics": { "width": 8, "height": 8, "fx": 10, "fy": 10, "cx": cx, "cy": cy },
        "views": [
            { "file": "a.png", "world_from_camera": [[1, 0, 0, 0], [0, 1, 0, 0], [0, 0, 1, 0], [0, 0, 0, 1]] },
            { "file": "b.ply", "unit": "mm",
              "world_from_camera": [-1, 0, 0, 0, 0, 1, 0, 0, 0, 0, -1, 2, 0, 0, 0, 1] }
        ]
    });
    list(&mut document);
    std::fs::write(folder.join("views.json"), document.to_string()).unwrap();
}

#[test]
fn views_lie_in_the_folder_of_their_list() {
    let folder = tempfile::tempdir().unwrap();
    let set = folder.path().join("set");
    std::fs::create_dir_all(set.join("sub")).unwrap();
    two_views(&set, |_| {});
    // Readable files beside the set, which the list has no business with.
    std::fs::copy(set.join("b.ply"), folder.path().join("secret.ply")).unwrap();
    let camera = r#"{"fx":10,"fy":10,"cx":3,"cy":4}"#;
    std::fs::write(folder.path().join("camera.json"), camera).unwrap();
    std::fs::write(set.join("sub/camera.json"), camera).unwrap();
    std::fs::copy(set.join("b.ply"), set.join("sub/b.ply")).unwrap();
    let read = |pointer: &str, name: &str| {
        two_views(&set, |list| *list.pointer_mut(pointer).unwrap() = name.into());
        read_scan(&set).map(|(cloud, _)| cloud.points.len()).map_err(|e| e.to_string())
    };
    let whole = folder.path().join("secret.ply").display().to_string();
    for name in [whole.as_str(), "../secret.ply", "sub/../../secret.ply", "sub/../b.ply", "/b.ply"]
    {
        let said = read("/views/1/file", name).unwrap_err();
        assert!(said.contains("leads out of the list's folder"), "{name}: {said}");
        assert!(said.contains("views.json") && said.contains("put the file next to"), "{said}");
    }
    let said = read("/intrinsics", "../camera.json").unwrap_err();
    assert!(said.contains("leads out of the list's folder"), "{said}");
    assert_eq!(read("/views/1/file", "sub/b.ply"), Ok(2));
    assert_eq!(read("/views/1/file", "./b.ply"), Ok(2));
    assert_eq!(read("/intrinsics", "sub/camera.json"), Ok(2));
    assert!(read("/views/1/file", "sub/none.ply").unwrap_err().contains("no such file"));
    #[cfg(unix)]
    {
        use std::os::unix::fs::symlink;
        symlink("../secret.ply", set.join("link.ply")).unwrap();
        symlink("b.ply", set.join("own.ply")).unwrap();
        symlink("..", set.join("up")).unwrap();
        for name in ["link.ply", "up/secret.ply"] {
            let said = read("/views/1/file", name).unwrap_err();
            assert!(said.contains("a link that leads out"), "{name}: {said}");
        }
        assert_eq!(read("/views/1/file", "own.ply"), Ok(2));
        // The list's own folder may be reached by a link.
        symlink("set", folder.path().join("alias")).unwrap();
        two_views(&set, |_| {});
        assert_eq!(read_scan(folder.path().join("alias")).unwrap().0.points.len(), 2);
    }
}

#[test]
fn views_are_joined_in_one_frame() {
    let folder = tempfile::tempdir().unwrap();
    two_views(folder.path(), |_| {});
    let list = folder.path().join("views.json");
    for path in [list.as_path(), folder.path()] {
        let (cloud, notes) = read_scan(path).unwrap();
        assert_eq!(cloud.points.len(), 2);
        for p in &cloud.points {
            assert!((p - Point3::new(0.1, 0.2, 1.3)).norm() < 1e-6, "{p}");
        }
        assert_eq!((notes.format, notes.points_in_file), (Some(Format::Views), 2));
        assert_eq!(files_of(path).unwrap().len(), 3);
    }
    assert!(is_views_folder(folder.path()));
    // The same camera in a file of its own, and a pose for a camera with y up.
    let camera = r#"{"fx":10,"fy":10,"cx":2.2307692308,"cy":2.4615384615}"#;
    std::fs::write(folder.path().join("camera.json"), camera).unwrap();
    two_views(folder.path(), |list| {
        list["intrinsics"] = json!("camera.json");
        list["camera_axes"] = json!("opengl");
        list["views"][0]["world_from_camera"] =
            json!([1, 0, 0, 0, 0, -1, 0, 0, 0, 0, -1, 0, 0, 0, 0, 1]);
    });
    let (cloud, _) = read_scan(&list).unwrap();
    assert!((cloud.points[0] - Point3::new(0.1, 0.2, 1.3)).norm() < 1e-6, "{}", cloud.points[0]);
    assert_eq!(files_of(&list).unwrap().len(), 4);
}

#[test]
fn lists_of_views_that_cannot_be_meant_are_refused() {
    let folder = tempfile::tempdir().unwrap();
    let list = folder.path().join("views.json");
    let refused = |change: &dyn Fn(&mut Value)| {
        two_views(folder.path(), |document| change(document));
        read_scan(&list).unwrap_err().to_string()
    };
    let pose =
        |pose: Value| move |list: &mut Value| list["views"][1]["world_from_camera"] = pose.clone();
    type Change<'a> = &'a dyn Fn(&mut Value);
    let cases: [(Change<'_>, &str); 9] = [
        (&|list| list["schema"] = json!("other"), "schema is `other`"),
        (&|list| list["views"] = json!([]), "names no views"),
        (&|list| list["veiws"] = json!([]), "`veiws`"),
        (&|list| list["views"][1]["unit"] = json!("cm"), "view 1 (`b.ply`): unit is `cm`"),
        (&|list| list["views"][1]["file"] = json!("c.ply"), "c.ply: no such file"),
        (&|list| list["intrinsics"] = json!("none.yaml"), "none.yaml: no such file"),
        (&pose(json!([1, 0, 0])), "3 numbers, not 16"),
        (&pose(json!([2, 0, 0, 0, 0, 2, 0, 0, 0, 0, 2, 0, 0, 0, 0, 1])), "no rigid motion"),
        (&pose(json!([-1, 0, 0, 0, 0, 1, 0, 0, 0, 0, 1, 0, 0, 0, 0, 1])), "mirrors"),
    ];
    for (change, part) in cases {
        let said = refused(change);
        assert!(said.contains(part), "{said:?} lacks {part:?}");
    }
    let said = refused(&|list| drop(list.as_object_mut().unwrap().remove("intrinsics")));
    assert!(said.contains("a.png: a depth image needs its camera"), "{said}");
}

#[test]
fn real_depth_frames_load_and_are_refused_as_drapes() {
    let folder = Path::new(env!("CARGO_MANIFEST_DIR")).join("../shared/data/scans/depth-frames");
    if !folder.is_dir() {
        eprintln!("skipped: {} is absent (see its ORIGIN.md)", folder.display());
        return;
    }
    let (cloud, notes) = read_scan(&folder).unwrap();
    assert_eq!(notes.format, Some(Format::Views));
    assert!((600_000..=4 * 640 * 480).contains(&cloud.points.len()), "{}", cloud.points.len());
    let run = |input: &Path, more: &[&str]| {
        let mut command = program::program();
        let run =
            command.arg(input).args(["--density", "180", "--quick"]).args(more).output().unwrap();
        assert!(run.stdout.is_empty(), "a number was given");
        (run.status.code(), String::from_utf8_lossy(&run.stderr).into_owned())
    };
    let camera = folder.join("camera-intrinsics.txt");
    let camera = camera.to_str().unwrap();
    for frame in ["150", "165"] {
        let frame = folder.join(format!("frame-000{frame}.depth.png"));
        let (code, said) = run(&frame, &["--intrinsics", camera]);
        assert_eq!(code, Some(4), "{said}");
        assert!(said.contains("refused"), "{said}");
    }
    let (code, said) = run(&folder, &[]);
    assert_eq!(code, Some(4), "{said}");
    let frame = folder.join("frame-000150.depth.png");
    assert_eq!(run(&frame, &[]).0, Some(2), "no camera given");
    let given =
        ["--fx=585", "--fy=585", "--cx=320", "--cy=240", "--depth-scale=1000", "--drop-jumps=20"];
    assert_eq!(run(&frame, &given).0, Some(4));
    assert_eq!(run(&frame, &["--fx=585", "--fy=585"]).0, Some(2));
    assert_eq!(run(&frame, &["--intrinsics", camera, "--depth-scale=0"]).0, Some(2));
}

#[test]
fn a_folder_of_frames_without_poses_is_a_turntables() {
    let folder = tempfile::tempdir().unwrap();
    let path = |name: &str| folder.path().join(name);
    std::fs::write(path("camera-intrinsics.txt"), "10 0 3.5\n0 10 3.5\n0 0 1\n").unwrap();
    for name in ["x.depth.png", "y.depth.png"] {
        std::fs::write(path(name), depth_png(8, &[1300; 64])).unwrap();
    }
    let seen = read_views(folder.path(), &ReadOptions::default()).unwrap().unwrap();
    assert_eq!(seen.turntable, Some(Turntable { step_rad: None }));
    let names: Vec<&str> = seen.views.iter().map(|view| view.name.as_str()).collect();
    assert_eq!(names, ["x.depth.png", "y.depth.png"]);
    let said = read_scan(folder.path()).unwrap_err().to_string();
    assert!(said.contains("its views have no poses"), "{said}");
    // One pose makes it a set with poses, of which the other is missing.
    std::fs::write(path("x.pose.txt"), "1 0 0 0 0 1 0 0 0 0 1 0 0 0 0 1").unwrap();
    let said = read_scan(folder.path()).unwrap_err().to_string();
    assert!(said.contains("y.pose.txt"), "{said}");
}
