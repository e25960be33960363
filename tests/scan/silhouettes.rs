//! The measured silhouettes against their index: outlines, drape coefficients and folds of every
//! picture. Skipped where the data is absent; the same stages run on drawn and simulated pictures
//! in the modules' own tests.

use std::collections::BTreeMap;
use std::path::Path;

use scan2params::calibrate::measures::{FoldRule, Measures};
use scan2params::calibrate::silhouette::{self, SilhouetteLimits};
use scan2params::sim::Experiment;

#[test]
fn every_measured_silhouette_has_the_drape_coefficient_and_the_folds_of_its_index() {
    let folder = concat!(env!("CARGO_MANIFEST_DIR"), "/../shared/data/cusick-silhouettes");
    let folder = Path::new(folder);
    let Ok(index) = std::fs::read_to_string(folder.join("index.csv")) else {
        eprintln!("skipped: {} is absent (see its ORIGIN.md)", folder.display());
        return;
    };
    let (limits, rule, bench) =
        (SilhouetteLimits::default(), FoldRule::default(), Experiment::standard_cusick());
    let mut by_fabric: BTreeMap<String, Vec<(f64, i64)>> = BTreeMap::new();
    let mut folds_other = 0;
    for line in index.lines().skip(1) {
        let cells: Vec<&str> = line.split(',').collect();
        let picture = silhouette::read(&folder.join(cells[0])).unwrap();
        let found = match silhouette::outline_of(&picture, 1.39e-3, &limits) {
            Ok(found) => found,
            Err(error) => panic!("{}: {error}", cells[0]),
        };
        let measures = Measures::of(&found.outline, &bench, &rule);
        let dc: f64 = cells[7].parse().unwrap();
        let folds: i64 = cells[8].parse().unwrap();
        let off = (measures.drape_coefficient - dc, measures.folds as i64 - folds);
        if off.1 != 0 || off.0.abs() > 0.5 {
            folds_other += usize::from(off.1 != 0);
            println!("{}: dc {dc} {:+.2}, folds {folds} {:+}", cells[0], off.0, off.1);
        }
        by_fabric.entry(cells[1].to_owned()).or_default().push(off);
    }
    let mut all = Vec::new();
    for (fabric, offs) in &by_fabric {
        let mean = offs.iter().map(|o| o.0).sum::<f64>() / offs.len() as f64;
        let largest = offs.iter().map(|o| o.0.abs()).fold(0.0, f64::max);
        let other = offs.iter().filter(|o| o.1 != 0).count();
        println!(
            "fabric {fabric}: {} pictures, dc {mean:+.2} on average, {largest:.2} at most, folds other in {other}",
            offs.len()
        );
        all.extend(offs);
    }
    assert_eq!(all.len(), 451);
    let largest = all.iter().map(|o: &(f64, i64)| o.0.abs()).fold(0.0, f64::max);
    // observed: 0.47 points, 6 pictures
    assert!(largest < 0.6, "{largest}");
    assert!(folds_other <= 9, "{folds_other}");
}
