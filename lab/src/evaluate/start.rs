//! Where a scanned drape comes to rest when it starts from the scan, for `scan2params-lab start`:
//! the branch that a released drape and a fit stand on.
//!
//! In: a prior, a sensor, seeds. Out: one [`Case`] a virtual scan of a drape by a perturbed drop:
//! the *true* fabric, started from the scanned sheet, guided by the scanned rim, and started from
//! the true sheet, each with the distance of its rim at rest from the true and from the scanned
//! one. A refused scan is a case too.

use rayon::prelude::*;

use super::case_error::CaseError;
use super::scan::{Setup, find};
use scan2params::base::clock::thread_cpu_s;
use scan2params::base::{Boundary, Point3, Surface};
use scan2params::fabric::{Fabric, Mixture};
use scan2params::numeric::robust;
use scan2params::picture::draw::{dot, line};
use scan2params::scan::{ScanError, ScannedBoundary, Tuning};
use scan2params::sim::experiment::bending_length_m;
use scan2params::sim::self_contact::count_intersections;
use scan2params::sim::{Drape, Drop, DropStart, SimOptions, Stop, drape};

/// The starts that are compared.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Start {
    /// From the scanned sheet.
    ScannedSheet,
    /// Guided by the scanned rim, after a fall.
    ScannedRim,
    /// From the sheet of the true drape.
    TrueSheet,
}

impl Start {
    /// All of them, in the order of a case's rows.
    pub const ALL: [Self; 3] = [Self::ScannedSheet, Self::ScannedRim, Self::TrueSheet];

    /// As tables name it.
    #[must_use]
    pub fn name(self) -> &'static str {
        match self {
            Self::ScannedSheet => "scanned sheet",
            Self::ScannedRim => "scanned rim",
            Self::TrueSheet => "true sheet",
        }
    }
}

/// The result of one start.
#[derive(Clone, Debug)]
pub struct Rest {
    /// The drape at its end.
    pub drape: Drape,
    /// Mean distance of its rim from the true one \[m\].
    pub from_true_m: f64,
    /// Mean distance of its rim from the scanned one \[m\].
    pub from_scan_m: f64,
    /// Processor time \[s\]; NaN where the system does not tell it.
    pub cpu_s: f64,
}

/// A scan that was answered.
#[derive(Clone, Debug)]
pub struct Led {
    /// The scan.
    pub scanned: ScannedBoundary,
    /// Mean distance of the scanned rim from the true one \[m\].
    pub rim_error_m: f64,
    /// Mean distance of the places of the scanned sheet from the true ones \[m\].
    pub sheet_error_m: f64,
    /// Pairs of triangles of the scanned sheet that cross.
    pub crossings: usize,
    /// The ends of the three starts, in the order of [`Start::ALL`].
    pub rests: [Rest; 3],
}

/// One scan of one drape.
#[derive(Debug)]
pub struct Case {
    /// Name of the prior.
    pub prior: String,
    /// Its place in the run.
    pub index: u64,
    /// Bending length of the true fabric \[m\].
    pub bending_length_m: f64,
    /// The true drape.
    pub drape: Drape,
    /// What came of its scan, or why it was refused.
    pub answer: Result<Led, ScanError>,
}

/// Fabrics of priors, each draped, scanned and started again.
#[derive(Debug)]
pub struct Series {
    /// Where the fabrics are from; taken in turn.
    pub priors: Vec<Mixture>,
    /// How they are scanned.
    pub setup: Setup,
    /// Seed of fabrics, drops and scans.
    pub seed: u64,
    /// Which fabrics of each prior.
    pub fabrics: std::ops::Range<u64>,
}

impl Series {
    /// Runs all cases on all cores and returns them in order, those of one prior after another;
    /// `tell` hears of each as it ends.
    ///
    /// # Errors
    /// The first case that cannot be made.
    pub fn run(&self, tell: impl Fn(&Case)) -> Result<Vec<Case>, CaseError> {
        let (send, receive) = std::sync::mpsc::channel();
        let all: Vec<(usize, u64)> = self
            .fabrics
            .clone()
            .flat_map(|f| (0..self.priors.len()).map(move |p| (p, f)))
            .collect();
        let mut cases: Vec<(usize, Case)> = std::thread::scope(|scope| {
            scope.spawn(move || {
                all.into_par_iter().with_max_len(1).for_each_with(send, |send, (p, index)| {
                    // Nobody listens any more once a case has failed.
                    let case = case(&self.priors[p], &self.setup, self.seed, index);
                    let _ = send.send(case.map(|case| (p, case)));
                });
            });
            receive
                .into_iter()
                .map(|case| case.inspect(|(_, case)| tell(case)))
                .collect::<Result<_, _>>()
        })?;
        cases.sort_by_key(|(p, case)| (*p, case.index));
        Ok(cases.into_iter().map(|(_, case)| case).collect())
    }
}

/// Drapes and scans fabric `index` of a prior, told where the warp points, and starts its true
/// fabric again.
///
/// # Errors
/// When the prior gives no fabric, or the drape makes no scene.
pub fn case(prior: &Mixture, setup: &Setup, seed: u64, index: u64) -> Result<Case, CaseError> {
    let fabric = prior.sample(seed, index)?;
    let options = SimOptions::default();
    let truth = drape(&fabric, &Drop { start: DropStart::Perturbed(seed ^ index) }, &options);
    let made = setup.scan(&truth.mesh(), seed ^ index)?;
    let answer =
        find(&made, &Tuning::default()).map(|scanned| led(scanned, &fabric, &truth, &options));
    Ok(Case {
        prior: prior.name().to_owned(),
        index,
        bending_length_m: bending_length_m(&fabric),
        drape: truth,
        answer,
    })
}

fn led(scanned: ScannedBoundary, fabric: &Fabric, truth: &Drape, options: &SimOptions) -> Led {
    // a drape that rotated as it fell lies turned, and no scan can tell
    let turned = truth.boundary.turned_onto(&scanned.boundary);
    let rests = Start::ALL.map(|start| {
        let (start, rim) = match start {
            Start::ScannedSheet => (DropStart::Surface(Box::new(scanned.surface.clone())), &turned),
            Start::ScannedRim => (DropStart::Guided(Box::new(scanned.boundary.clone())), &turned),
            Start::TrueSheet => (DropStart::Surface(Box::new(sheet_of(truth))), &truth.boundary),
        };
        rest(start, fabric, rim, &scanned.boundary, options)
    });
    let places = scanned.surface.points().iter().map(|p| p.position_m.coords);
    let x: Vec<_> = places.collect();
    let off = x.iter().zip(truth.mesh().vertices).map(|(p, q)| (p - q.coords).norm());
    Led {
        rim_error_m: scanned.boundary.mean_distance_m(&turned),
        sheet_error_m: off.sum::<f64>() / x.len() as f64,
        crossings: count_intersections(&truth.grid.triangles(), &x),
        scanned,
        rests,
    }
}

/// A simulated sheet as a start.
#[must_use]
pub fn sheet_of(drape: &Drape) -> Surface {
    Surface::exact(drape.mesh().vertices)
        .unwrap_or_else(|_| unreachable!("a square grid of vertices"))
}

fn rest(
    start: DropStart,
    fabric: &Fabric,
    truth: &Boundary,
    scanned: &Boundary,
    options: &SimOptions,
) -> Rest {
    let before = thread_cpu_s();
    let drape = drape(fabric, &Drop { start }, options);
    let cpu_s = before.zip(thread_cpu_s()).map_or(f64::NAN, |(before, after)| after - before);
    Rest {
        from_true_m: truth.mean_distance_m(&drape.boundary),
        from_scan_m: scanned.mean_distance_m(&drape.boundary),
        cpu_s,
        drape,
    }
}

/// Ends of the classes of bending length \[m\]: cells of 5 mm do not resolve the folds of the
/// first.
pub const CLASSES_M: [f64; 4] = [0.0, 5e-3, 12e-3, f64::INFINITY];

/// Many ends of one start.
#[derive(Clone, Copy, Debug)]
pub struct Summary {
    /// Ends.
    pub count: usize,
    /// Those at rest.
    pub at_rest: usize,
    /// Those whose number of folds is the true one.
    pub folds: usize,
    /// Median, 95th percentile and largest distance of the rim from the true one \[m\].
    pub from_true_m: [f64; 3],
    /// The same from the scanned rim \[m\].
    pub from_scan_m: [f64; 3],
    /// Median and 95th percentile of the processor time \[s\].
    pub cpu_s: [f64; 2],
    /// Intersections, all together.
    pub intersections: usize,
}

impl Summary {
    /// Of this start in the answered ones of these cases; `None` if none was answered.
    #[must_use]
    pub fn of<'a>(cases: impl Iterator<Item = &'a Case>, start: Start) -> Option<Self> {
        let at = Start::ALL.iter().position(|other| *other == start)?;
        let ends: Vec<(&Case, &Rest)> = cases
            .filter_map(|case| case.answer.as_ref().ok().map(|led| (case, &led.rests[at])))
            .collect();
        let shares = |of: fn(&Rest) -> f64, shares: &[f64]| -> Option<Vec<f64>> {
            let values: Vec<f64> = ends.iter().map(|(_, rest)| of(rest)).collect();
            shares.iter().map(|share| robust::quantile(values.clone(), *share)).collect()
        };
        let three =
            |of| Some([0, 1, 2].map(|k| shares(of, &[0.5, 0.95, 1.0]).map_or(0.0, |v| v[k])));
        let cpu_s = shares(|rest| rest.cpu_s, &[0.5, 0.95])?;
        Some(Self {
            count: ends.len(),
            at_rest: ends.iter().filter(|(_, rest)| rest.drape.stop == Stop::AtRest).count(),
            folds: ends.iter().filter(|(case, rest)| rest.drape.nodes == case.drape.nodes).count(),
            from_true_m: three(|rest| rest.from_true_m)?,
            from_scan_m: three(|rest| rest.from_scan_m)?,
            cpu_s: [cpu_s[0], cpu_s[1]],
            intersections: ends.iter().map(|(_, rest)| rest.drape.intersections).sum(),
        })
    }
}

/// Draws the true rim (blue), that at rest from the scanned sheet (red) and that guided by the
/// scanned rim (grey) over the cloth's scanned points, from above and from two sides; where the
/// first two differ by more than 1 mm they are joined (green).
#[must_use]
pub fn picture(truth: &Drape, led: &Led) -> image::RgbImage {
    const PANE: u32 = 900;
    const PIXELS_PER_M: f64 = 3600.0;
    let mut image = image::RgbImage::from_pixel(3 * PANE, PANE, image::Rgb([255; 3]));
    let views: [fn(&Point3) -> [f64; 2]; 3] =
        [|p| [p.x, p.z], |p| [p.x, -p.y - 0.075], |p| [p.z, -p.y - 0.075]];
    let [sheet, rim, _] = &led.rests;
    for (pane, view) in views.into_iter().enumerate() {
        let place = |p: &Point3| {
            let [x, y] = view(p).map(|c| c * PIXELS_PER_M + f64::from(PANE) / 2.0);
            [(x + f64::from(pane as u32 * PANE)) as f32, y as f32]
        };
        for p in &led.scanned.evidence.cloth {
            dot(&mut image, place(p), 0.6, image::Rgb([215; 3]));
        }
        let rows =
            [(&rim.drape, [140, 140, 140]), (truth, [20, 60, 220]), (&sheet.drape, [220, 0, 0])];
        for (drape, color) in rows {
            for p in drape.boundary.positions_m() {
                dot(&mut image, place(&p), 2.2, image::Rgb(color));
            }
        }
        for (p, q) in sheet.drape.boundary.positions_m().zip(truth.boundary.positions_m()) {
            if (p - q).norm() > 1e-3 {
                line(&mut image, place(&p), place(&q), image::Rgb([0, 160, 0]));
            }
        }
    }
    image
}
