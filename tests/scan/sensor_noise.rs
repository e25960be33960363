//! The noise of the virtual sensors against that of real recordings, both measured by `DepthNoise`.
//!
//! The virtual board is flat and is seen straight on, from the recording's distance, by the whole
//! profile. The recordings lie outside of the repository; where they are missing, the virtual
//! noise alone is held against the same numbers.

use std::path::{Path, PathBuf};

use scan2params::base::{Point3, Vector3};
use scan2params::geom::Mesh;
use scan2params::sensor::{CameraPose, DepthNoise, Profile, Scene, Stand, Support, scan};

/// A kind of sensor, and what was measured of it in windows of one size.
struct Measured {
    profile: &'static str,
    window_px: usize,
    depth_m: f64,
    sigma_mm: f64,
    /// At 1, 2, 4 and 8 pixels.
    autocorrelation: [f64; 4],
}

/// The figures beside the numbers of `src/sensor/profile.rs`, as this test prints them.
const MEASURED: [Measured; 3] = [
    Measured {
        profile: "phone",
        window_px: 96,
        depth_m: 0.196,
        sigma_mm: 0.28,
        autocorrelation: [0.89, 0.78, 0.60, 0.30],
    },
    Measured {
        profile: "d435",
        window_px: 48,
        depth_m: 0.45,
        sigma_mm: 1.1,
        autocorrelation: [0.85, 0.70, 0.42, 0.0],
    },
    Measured {
        profile: "handheld",
        window_px: 32,
        depth_m: 0.40,
        sigma_mm: 0.12,
        autocorrelation: [0.10, 0.0, 0.0, 0.0],
    },
];

/// How far virtual and measured noise may be apart: sigma as a share, autocorrelation.
const LIMITS: [f64; 2] = [0.15, 0.12];

fn virtual_noise(profile: &str, depth_m: f64, window_px: usize) -> DepthNoise {
    let profile = Profile::named(profile).unwrap();
    let corner = |x: f64, z: f64| Point3::new(x, 0.0, z);
    let board = Mesh {
        vertices: vec![corner(-0.4, -0.4), corner(0.4, -0.4), corner(0.4, 0.4), corner(-0.4, 0.4)],
        triangles: vec![[0, 1, 2], [0, 2, 3]],
    };
    let stand = Stand { support: Support::Nothing, floor_radius_m: 0.0, ..Stand::MODIFIED_CUSICK };
    let scene = Scene::on(board, stand);
    let eye = Point3::from(Vector3::y() * depth_m);
    let poses = vec![CameraPose::look_at(eye, Point3::origin()); 4];
    let made = scan(&scene, &poses, &profile, 11).unwrap();
    let images: Vec<&[f64]> = made.views.iter().map(|view| view.depth_m.as_slice()).collect();
    DepthNoise::of_all(&images, profile.camera.width, window_px).unwrap()
}

fn shown(what: &str, noise: &DepthNoise) {
    println!(
        "{what}: {:.3} mm at {:.3} m, autocorrelation {:.2?}, outliers {:.5}, {} windows",
        noise.sigma_m * 1e3,
        noise.depth_m,
        noise.autocorrelation,
        noise.outliers,
        noise.windows
    );
}

#[test]
fn virtual_noise_has_the_figures_that_were_measured() {
    for measured in &MEASURED {
        let noise = virtual_noise(measured.profile, measured.depth_m, measured.window_px);
        shown(measured.profile, &noise);
        let share = noise.sigma_m * 1e3 / measured.sigma_mm - 1.0;
        assert!(share.abs() < LIMITS[0], "{}: sigma {share:+.2}", measured.profile);
        for (found, want) in noise.autocorrelation.iter().zip(measured.autocorrelation) {
            assert!((found - want).abs() < LIMITS[1], "{}: {noise:?}", measured.profile);
        }
    }
}

#[test]
fn noise_of_the_older_profiles_is_white_as_their_docs_say() {
    for name in ["structured-light", "truedepth", "consumer"] {
        let noise = virtual_noise(name, 0.45, 48);
        shown(name, &noise);
        let white = noise.autocorrelation.iter().all(|c| c.abs() < 0.1);
        assert!(white, "{name}: {noise:?}");
    }
}

/// The recordings, if they are here.
fn recordings() -> Option<PathBuf> {
    let folder = Path::new(env!("CARGO_MANIFEST_DIR")).join("../shared/data/real-sensors");
    folder.is_dir().then_some(folder)
}

/// The depths of a 16-bit image with so many units to a metre, NaN where nothing is; its width.
fn image(path: &Path, scale: f64) -> (Vec<f64>, usize) {
    let image = image::open(path).unwrap().into_luma16();
    let depth = |value: &u16| if *value == 0 { f64::NAN } else { f64::from(*value) / scale };
    (image.as_raw().iter().map(depth).collect(), image.width() as usize)
}

/// The 16-bit images of a folder.
fn images(folder: &Path, scale: f64) -> Vec<(Vec<f64>, usize)> {
    let entries = std::fs::read_dir(folder).unwrap().map(|entry| entry.unwrap().path());
    let mut paths: Vec<PathBuf> =
        entries.filter(|path| path.extension().is_some_and(|e| e == "png")).collect();
    paths.sort();
    paths.iter().map(|path| image(path, scale)).collect()
}

/// The depths of a numpy array of 4-byte floats, 516 wide.
fn array(path: &Path) -> (Vec<f64>, usize) {
    let bytes = std::fs::read(path).unwrap();
    let header = 10 + usize::from(u16::from_le_bytes([bytes[8], bytes[9]]));
    let depth = |b: &[u8]| f64::from(f32::from_le_bytes([b[0], b[1], b[2], b[3]]));
    let depths = bytes[header..].chunks_exact(4).map(depth);
    (depths.map(|d| if d > 0.0 { d } else { f64::NAN }).collect(), 516)
}

fn noise_of(images: &[(Vec<f64>, usize)], window_px: usize) -> DepthNoise {
    let depths: Vec<&[f64]> = images.iter().map(|(depths, _)| depths.as_slice()).collect();
    DepthNoise::of_all(&depths, images[0].1, window_px).unwrap()
}

/// Sigma within a share, autocorrelation within a difference.
fn assert_alike(what: &str, found: &DepthNoise, real: &DepthNoise, limits: [f64; 2]) {
    shown(&format!("{what}, virtual"), found);
    shown(&format!("{what}, recorded"), real);
    let share = found.sigma_m / real.sigma_m - 1.0;
    assert!(share.abs() < limits[0], "{what}: sigma {share:+.2}");
    for (found, real) in found.autocorrelation.iter().zip(real.autocorrelation) {
        assert!((found - real).abs() < limits[1], "{what}: {found:.2} against {real:.2}");
    }
}

#[test]
fn virtual_noise_is_that_of_the_recordings() {
    let Some(folder) = recordings() else {
        println!("skipped: no ../shared/data/real-sensors");
        return;
    };
    // Three devices differ among each other by up to 0.1 in autocorrelation.
    let boards = folder.join("truedepth-board/DepthEvalDataset");
    for device in std::fs::read_dir(&boards).unwrap() {
        let device = device.unwrap();
        let name = device.file_name().into_string().unwrap();
        let all = images(&device.path(), 1e4);
        for (window_px, limits) in [(48, [0.15, 0.14]), (96, LIMITS)] {
            let real = noise_of(&all, window_px);
            let own = virtual_noise("phone", real.depth_m, window_px);
            assert_alike(&format!("{name}, {window_px} px"), &own, &real, limits);
        }
    }
    // The table carries objects, and windows of 48 pixels hold their curved sides.
    let real = noise_of(&[image(&folder.join("d435-table/depth.png"), 1e3)], 24);
    let own = virtual_noise("d435", real.depth_m, 24);
    assert_alike("D435, 24 px", &own, &real, [0.22, 0.12]);
    // A bin of objects at 0.8 m, so that its sigma is another; it is white all the same.
    let real = noise_of(&[array(&folder.join("phoxi/phoxi_clutter_0.npy"))], 16);
    let own = virtual_noise("handheld", 0.4, 16);
    assert_alike("structured light, 16 px", &own, &real, [0.6, 0.1]);
}
