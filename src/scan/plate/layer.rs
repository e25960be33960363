//! What lies uppermost: the cloth on the plate, told from the plate's underside and from
//! what stands under it.
//!
//! In: points and an upward direction. Out: which of them nothing covers. Two layers are
//! told apart where they are farther from each other than noise fills; where they are not,
//! everything counts as one.

use super::super::tuning::PlateTuning;
use super::placed::Placed;

/// A level grid over the plate, and in each cell the height of the uppermost points.
struct Tops {
    cell_m: f64,
    /// The lowest cell in either direction.
    first: [i32; 2],
    /// Cells in either direction.
    size: [i32; 2],
    /// By cell \[m\]; what no point lies in is minus infinity.
    top_m: Vec<f64>,
}

impl Tops {
    /// The uppermost height of each cell, as the median over the cell and its neighbours,
    /// so that a stray above the cloth covers nothing.
    fn new(points: &[Placed], cell_m: f64) -> Self {
        let cells = || points.iter().map(|p| cell_of(p.xz_m, cell_m));
        let bound = |pick: fn(i32, i32) -> i32, from: i32| {
            cells().fold([from; 2], |b, cell| [pick(b[0], cell[0]), pick(b[1], cell[1])])
        };
        let (first, last) = (bound(i32::min, i32::MAX), bound(i32::max, i32::MIN));
        let size = [0, 1].map(|k| (last[k].saturating_sub(first[k]).saturating_add(1)).max(0));
        let mut tops = Self { cell_m, first, size, top_m: Vec::new() };
        let mut highest = vec![f64::NEG_INFINITY; (size[0] * size[1]) as usize];
        for p in points {
            if let Some(at) = tops.index(cell_of(p.xz_m, cell_m)) {
                highest[at] = highest[at].max(p.height_m);
            }
        }
        tops.top_m = (0..highest.len())
            .map(|at| {
                let (i, j) = (at as i32 / size[1] + first[0], at as i32 % size[1] + first[1]);
                let mut beside = [0.0; 9];
                let mut count = 0;
                for cell in (-1..=1).flat_map(|a| (-1..=1).map(move |b| [i + a, j + b])) {
                    let height_m = tops.index(cell).map_or(f64::NEG_INFINITY, |at| highest[at]);
                    if height_m > f64::NEG_INFINITY {
                        beside[count] = height_m;
                        count += 1;
                    }
                }
                let beside = &mut beside[..count];
                beside.sort_unstable_by(f64::total_cmp);
                beside.get(count / 2).copied().unwrap_or(f64::NEG_INFINITY)
            })
            .collect();
        tops
    }

    fn index(&self, cell: [i32; 2]) -> Option<usize> {
        let [i, j] = [0, 1].map(|k| cell[k] - self.first[k]);
        ((0..self.size[0]).contains(&i) && (0..self.size[1]).contains(&j))
            .then(|| (i * self.size[1] + j) as usize)
    }

    /// How far `point` lies under the uppermost \[m\].
    fn depth_m(&self, point: &Placed) -> f64 {
        let top = self.index(cell_of(point.xz_m, self.cell_m)).map(|at| self.top_m[at]);
        top.map_or(0.0, |top| top - point.height_m)
    }
}

fn cell_of(xz_m: [f64; 2], cell_m: f64) -> [i32; 2] {
    xz_m.map(|c| (c / cell_m).floor() as i32)
}

/// Which points of a coarse cloud belong to its uppermost layer; `None` if all do.
pub(super) fn uppermost(
    points: &[Placed],
    radius_m: f64,
    tuning: &PlateTuning,
) -> Option<Vec<bool>> {
    let gap_m = tuning.layer_gap_radii * radius_m;
    let (low_m, high_m) = points.iter().fold((f64::INFINITY, f64::NEG_INFINITY), |b, p| {
        (b.0.min(p.height_m), b.1.max(p.height_m))
    });
    if high_m - low_m <= gap_m {
        return None;
    }
    let tops = Tops::new(points, tuning.layer_cell_radii * radius_m);
    let upper: Vec<bool> = points.iter().map(|p| tops.depth_m(p).abs() <= gap_m).collect();
    upper.contains(&false).then_some(upper)
}

/// Which raw points something covers: those within the plate's edge that lie under the gap
/// between the uppermost layer and the next. None where there is no such gap.
pub(super) fn covered(points: &[Placed], radius_m: f64, tuning: &PlateTuning) -> Vec<bool> {
    let tops = Tops::new(points, tuning.fine_layer_cell_radii * radius_m);
    let depth_m: Vec<f64> = points.iter().map(|p| tops.depth_m(p)).collect();
    let within = |p: &Placed, share: f64| p.radius_m() < share * radius_m;
    let bins = (tuning.layer_depth_radii * radius_m / tuning.layer_bin_m).ceil() as usize;
    let mut counts = vec![0.0; bins];
    // The edge itself is left out: there the cloth falls away.
    for (_, depth) in points.iter().zip(&depth_m).filter(|(p, _)| within(p, tuning.layer_within)) {
        let bin = (depth / tuning.layer_bin_m).max(0.0) as usize;
        if let Some(count) = counts.get_mut(bin) {
            *count += 1.0;
        }
    }
    match gap(&counts, tuning) {
        None => vec![false; points.len()],
        Some(bin) => {
            let deepest_m = bin as f64 * tuning.layer_bin_m;
            points.iter().zip(&depth_m).map(|(p, d)| within(p, 1.0) && *d > deepest_m).collect()
        }
    }
}

/// The emptiest bin between the first peak of `counts` and the next layer; `None` of one
/// layer.
fn gap(counts: &[f64], tuning: &PlateTuning) -> Option<usize> {
    let smooth: Vec<f64> = (0..counts.len())
        .map(|k| {
            let near = &counts[k.saturating_sub(1)..(k + 2).min(counts.len())];
            near.iter().sum::<f64>() / near.len() as f64
        })
        .collect();
    let fullest = smooth.iter().copied().fold(0.0, f64::max);
    let least = tuning.layer_share * fullest;
    if least < 1.0 {
        return None;
    }
    // Up to the first peak: the uppermost layer.
    let first = (0..smooth.len()).find(|&k| {
        smooth[k] > 4.0 * least && smooth.get(k + 1).is_none_or(|next| *next <= smooth[k])
    })?;
    let mut emptiest = first;
    for k in first + 1..smooth.len() {
        if smooth[k] < smooth[emptiest] {
            emptiest = k;
        }
        let peak = smooth[k].min(smooth[first]);
        // Counts scatter by their roots: what is no lower than that is no gap.
        let at_most = smooth[emptiest] + 2.0 * smooth[emptiest].max(1.0).sqrt();
        // Passes that drift against each other make layers too, but nearer ones.
        let apart = (k - first) as f64 * tuning.layer_bin_m >= tuning.layer_apart_m;
        if apart && smooth[k] > least && at_most < tuning.layer_valley * peak {
            return Some(emptiest);
        }
    }
    None
}

#[cfg(test)]
mod tests {
    use super::super::super::tuning::Tuning;
    use super::*;
    use rand_distr::{Distribution as _, Normal};

    /// An arched disc of cloth, and under it a plate's underside and a post.
    fn scene(noise_m: f64, thickness_m: f64, under: bool) -> (Vec<Placed>, usize) {
        let mut rng = crate::base::seed::rng(1, "layers", 0);
        let noise = Normal::new(0.0, noise_m).unwrap();
        let mut points = Vec::new();
        let mut disc = |height: &dyn Fn(f64) -> f64, points: &mut Vec<Placed>| {
            for k in 0..4000 {
                // An even spiral.
                let (r, t) = (0.05 * (f64::from(k) / 4000.0).sqrt(), 2.399_963 * f64::from(k));
                let height_m = height(r) + noise.sample(&mut rng);
                points.push(Placed { xz_m: [r * t.cos(), r * t.sin()], height_m });
            }
        };
        disc(&|r| 2e-3 * (1.0 - (r / 0.05).powi(2)), &mut points);
        let cloth = points.len();
        if under {
            disc(&|_| -thickness_m, &mut points);
            for k in 0..500 {
                let t = f64::from(k);
                let height_m = -thickness_m - 1e-4 * t;
                points.push(Placed { xz_m: [6e-3 * t.cos(), 6e-3 * t.sin()], height_m });
            }
        }
        (points, cloth)
    }

    #[test]
    fn the_underside_and_the_post_are_covered_and_the_cloth_is_not() {
        for (noise_m, thickness_m) in [(0.1e-3, 4e-3), (0.15e-3, 8e-3), (0.7e-3, 6e-3)] {
            let (points, cloth) = scene(noise_m, thickness_m, true);
            let covered = covered(&points, 0.05, &Tuning::default().plate);
            let wrong = covered[..cloth].iter().filter(|c| **c).count();
            let missed = covered[cloth..].iter().filter(|c| !**c).count();
            assert!(wrong < cloth / 100, "{noise_m} {thickness_m}: {wrong} of the cloth");
            assert!(missed < cloth / 50, "{noise_m} {thickness_m}: {missed} left under it");
        }
    }

    /// Up to the noise beyond which all but stiff cloth is refused; 3 mm makes gaps by chance.
    #[test]
    fn nothing_covers_a_single_layer() {
        for noise_m in [0.0, 0.1e-3, 1e-3, 2e-3] {
            let (points, _) = scene(noise_m, 0.0, false);
            assert!(
                covered(&points, 0.05, &Tuning::default().plate).iter().all(|c| !c),
                "{noise_m}"
            );
        }
    }
}
