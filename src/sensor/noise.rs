//! From a clean image to a measured one: edges, flying pixels, drop-out, noise,
//! outliers, holes, steps, and the camera's estimated pose.
//!
//! Axial noise is white, or smooth over pixels (`correlated`). What is lost of edges and
//! surfaces is in `lost`, the poses' errors in `passes`.

use rand::RngExt as _;
use rand_distr::{Distribution as _, StandardNormal};
use rayon::prelude::*;

use super::lost::Lost;
use super::passes::Motion;
use super::render::{Clean, EIGHT_NEIGHBOURS, Sample};
use super::{CameraPose, DepthImage, Profile, correlated};
use crate::base::{Isometry3, Vector3, seed};

/// Adds the errors of `profile` to the clean image of view number `view`; `motion` is its pass's.
pub(super) fn measure(
    clean: Clean,
    pose: &CameraPose,
    motion: &Motion,
    profile: &Profile,
    run_seed: u64,
    view: u64,
) -> DepthImage {
    let camera = clean.camera;
    let shifted = shift_edges(clean, profile);
    let mut rng = seed::rng(run_seed, "sensor-view", view);
    let holes = Holes::draw(profile, &mut rng);
    let pose_believed = motion.moved(&believed(pose, profile, &mut rng));
    let lost = Lost::draw(&shifted, profile, run_seed, view);
    let smooth = correlated::field(profile, &camera, run_seed, view);
    let measure_row = |row: usize| {
        let item = view * camera.height as u64 + row as u64;
        let mut rng = seed::rng(run_seed, "sensor-depth", item);
        let (shifted, holes, lost, smooth) = (&shifted, &holes, &lost, &smooth);
        (0..camera.width)
            .map(|column| {
                let index = row * camera.width + column;
                let sample = shifted.samples[index]
                    .filter(|s| !holes.contain(column, row) && !lost.has(&camera, index, s));
                let normal = smooth.as_ref().map(|field| field[index]);
                let depth = sample
                    .and_then(|s| measure_pixel(shifted, (index, s), normal, profile, &mut rng));
                (depth.unwrap_or(f64::NAN), sample.map_or([0; 3], |s| s.color))
            })
            .collect::<Vec<_>>()
    };
    let (depth_m, colors) = (0..camera.height).into_par_iter().flat_map_iter(measure_row).unzip();
    let camera = motion.believed(camera);
    DepthImage { camera, pose_true: *pose, pose_believed, depth_m, colors }
}

/// The measured depth of one pixel, if any; `smooth` is its axial noise of unit variance where
/// that is not white.
fn measure_pixel(
    image: &Clean,
    (index, sample): (usize, Sample),
    smooth: Option<f64>,
    profile: &Profile,
    rng: &mut seed::Rng,
) -> Option<f64> {
    let [begin, end] = profile.grazing_rad;
    let grazing = (sample.incidence_rad - begin) / (end - begin).max(f64::MIN_POSITIVE);
    if grazing > 0.0 && rng.random::<f64>() < grazing {
        return None;
    }
    let mut depth_m = sample.depth_m;
    if let Some(other_m) = across_an_edge(image, index, sample.depth_m, profile.edge_step_m)
        && rng.random::<f64>() < profile.flying_fraction
    {
        depth_m += rng.random::<f64>() * (other_m - depth_m);
    }
    if rng.random::<f64>() < profile.outlier_fraction {
        depth_m += rng.random_range(-1.0..=1.0) * profile.outlier_reach_m;
    }
    let normal = smooth.unwrap_or_else(|| StandardNormal.sample(rng));
    depth_m += normal * profile.axial_sigma_m(sample.depth_m, sample.incidence_rad);
    let stepped = step_depth(depth_m, profile);
    (stepped > 0.0).then_some(stepped)
}

/// Depth rounded to the sensor's step of disparity, then to the stored unit.
fn step_depth(depth_m: f64, profile: &Profile) -> f64 {
    let round =
        |value: f64, step: f64| if step > 0.0 { (value / step).round() * step } else { value };
    let by_disparity = if profile.disparity_step_per_m > 0.0 {
        round(depth_m.recip(), profile.disparity_step_per_m).recip()
    } else {
        depth_m
    };
    round(by_disparity, profile.depth_unit_m)
}

/// The depth of the neighbour that is furthest from `depth_m`, if a depth edge
/// lies between.
fn across_an_edge(image: &Clean, index: usize, depth_m: f64, edge_step_m: f64) -> Option<f64> {
    let depths = EIGHT_NEIGHBOURS.iter().filter_map(|&o| image.beside(index, o)??.depth_m.into());
    depths
        .max_by(|a: &f64, b: &f64| (a - depth_m).abs().total_cmp(&(b - depth_m).abs()))
        .filter(|other: &f64| (other - depth_m).abs() > edge_step_m)
}

/// Lets the nearer surface's edge recede (a pixel is lost) or spread (a pixel of
/// what is behind takes the nearer depth), a pixel at a time.
fn shift_edges(mut image: Clean, profile: &Profile) -> Clean {
    for _ in 0..profile.edge_erosion_px.unsigned_abs() {
        let shifted = (0..image.samples.len()).into_par_iter().map(|index| {
            let here = image.samples[index];
            let beside = EIGHT_NEIGHBOURS.iter().filter_map(|&o| image.beside(index, o));
            if profile.edge_erosion_px > 0 {
                recede(here, beside, profile.edge_step_m)
            } else {
                spread(here, beside, profile.edge_step_m)
            }
        });
        image.samples = shifted.collect();
    }
    image
}

/// Nothing, if a neighbour is behind by more than `step_m` or empty.
fn recede(
    here: Option<Sample>,
    mut beside: impl Iterator<Item = Option<Sample>>,
    step_m: f64,
) -> Option<Sample> {
    let behind = |other: Option<Sample>, depth_m: f64| {
        other.is_none_or(|other| other.depth_m > depth_m + step_m)
    };
    here.filter(|here| !beside.any(|other| behind(other, here.depth_m)))
}

/// The nearest neighbour, if it is in front by more than `step_m` or nothing is here.
fn spread(
    here: Option<Sample>,
    beside: impl Iterator<Item = Option<Sample>>,
    step_m: f64,
) -> Option<Sample> {
    let front = beside.flatten().min_by(|a, b| a.depth_m.total_cmp(&b.depth_m));
    let here_m = here.map_or(f64::INFINITY, |here| here.depth_m);
    front.filter(|front| front.depth_m + step_m < here_m).or(here)
}

/// Round patches where nothing is measured.
struct Holes(Vec<([f64; 2], f64)>);

impl Holes {
    fn draw(profile: &Profile, rng: &mut seed::Rng) -> Self {
        let [least, most] = profile.hole_radius_px;
        let size = [profile.camera.width, profile.camera.height];
        let hole = |_| {
            let center = size.map(|side| rng.random::<f64>() * side as f64);
            (center, least + rng.random::<f64>() * (most - least))
        };
        Self((0..profile.holes_per_view).map(hole).collect())
    }

    fn contain(&self, column: usize, row: usize) -> bool {
        let (x, y) = (column as f64, row as f64);
        self.0.iter().any(|([cx, cy], radius)| (x - cx).hypot(y - cy) < *radius)
    }
}

/// The pose with the error of the fusing program's registration.
fn believed(pose: &CameraPose, profile: &Profile, rng: &mut seed::Rng) -> CameraPose {
    let mut draw =
        |sigma: f64| Vector3::from_fn(|_, _| -> f64 { StandardNormal.sample(rng) }) * sigma;
    let error = Isometry3::new(draw(profile.pose_shift_m), draw(profile.pose_turn_rad));
    CameraPose { simulation_from_camera: error * pose.simulation_from_camera }
}
