//! How far off the parts of a scene lie, before and after they were brought together.

use nalgebra::{Matrix3, Rotation3};
use serde::Serialize;

use crate::evaluate::scenes::drapes::KeptDrape;
use scan2params::base::clock::process_cpu_s;
use scan2params::base::units::M_PER_MM;
use scan2params::base::{Isometry3, Point3, Vector3};
use scan2params::intake::register::{Fit, Placed, Unfit};
use scan2params::numeric::robust::median;
use scan2params::sensor::{Profile, Scene};

/// Every so many vertices of the cloth one is asked how far it moves.
const PROBE_STEP: usize = 37;
/// Figure of structured light \[m\]; of others half their noise.
const FIGURE_M: f64 = 0.2e-3;

/// What a scene is of.
pub(super) struct Drawn<'a> {
    pub(super) sensor: Profile,
    pub(super) drape: &'a KeptDrape,
    pub(super) scene: Scene,
    pub(super) seed: u64,
}

/// Parts that were brought together.
pub(super) struct Brought {
    pub(super) begun: Vec<Isometry3>,
    pub(super) settled: Vec<(Placed, Option<Unfit>)>,
    pub(super) noise_m: f64,
}

/// What is true of a scene.
pub(super) struct Truth<'a> {
    pub(super) sensor: &'a Profile,
    pub(super) drape: &'a KeptDrape,
    /// For each part and view the part's frame from the simulation's.
    pub(super) frames: Vec<Vec<Isometry3>>,
    /// Points of all parts.
    pub(super) points: usize,
}

impl Truth<'_> {
    /// What comes of bringing the parts together; `None` is a refusal.
    pub(super) fn record(&self, index: u64, bring: impl FnOnce() -> Option<Brought>) -> Record {
        let begun_s = process_cpu_s();
        let brought = bring();
        let processor_s = process_cpu_s().zip(begun_s).map_or(f64::NAN, |(end, begun)| end - begun);
        let [near, far] = self.sensor.usual_distance_m;
        let noise_m = self.sensor.axial_sigma_m(0.5 * (near + far), 0.6);
        let fine = self.sensor.name == "structured-light";
        let figure_m = if fine { FIGURE_M } else { 0.5 * noise_m };
        let parts = self.frames.len();
        let refused = Record {
            index,
            sensor: self.sensor.name,
            views_of_part: self.frames.first().map_or(0, Vec::len),
            parts,
            points: self.points,
            before_mm: f64::NAN,
            after_mm: f64::NAN,
            figure_mm: figure_m / M_PER_MM,
            unfit: parts,
            misfit_mm: [f64::NAN; 2],
            most_astray: f64::NAN,
            least_shared: f64::NAN,
            sigma_mm: f64::NAN,
            noise_mm: f64::NAN,
            processor_s,
        };
        let Some(Brought { begun, settled, noise_m }) = brought else { return refused };
        let used = settled.iter().map(|(view, fault)| fault.is_none().then_some(view.pose));
        let used: Vec<Option<Isometry3>> = used.collect();
        let placed = || settled.iter().map(|(view, _)| view);
        let most = |fit: fn(&Placed) -> Fit| {
            placed().map(|view| fit(view).misfit_m / M_PER_MM).fold(0.0, f64::max)
        };
        Record {
            before_mm: self.error_mm(&begun.into_iter().map(Some).collect::<Vec<_>>()),
            after_mm: self.error_mm(&used),
            unfit: used.iter().filter(|pose| pose.is_none()).count(),
            misfit_mm: [most(|view| view.before), most(|view| view.after)],
            most_astray: placed().map(|view| view.after.astray).fold(0.0, f64::max),
            least_shared: placed().map(|view| view.after.shared).fold(1.0, f64::min),
            sigma_mm: placed().map(|view| view.sigma_m / M_PER_MM).fold(0.0, f64::max),
            noise_mm: noise_m / M_PER_MM,
            ..refused
        }
    }

    /// How far the parts that are used move points of the cloth apart \[mm\].
    fn error_mm(&self, motions: &[Option<Isometry3>]) -> f64 {
        let vertices = &self.drape.mesh.vertices;
        let probes: Vec<Point3> = vertices.iter().step_by(PROBE_STEP).copied().collect();
        let used = self.frames.iter().zip(motions).filter_map(|(of, by)| Some((of, (*by)?)));
        let moved: Vec<Vec<Point3>> = used
            .map(|(frames, motion)| {
                let at = |probe: &Point3| {
                    let sum: Vector3 = frames.iter().map(|f| (motion * f * probe).coords).sum();
                    Point3::from(sum / frames.len() as f64)
                };
                probes.iter().map(at).collect()
            })
            .collect();
        apart(&probes, &moved) / M_PER_MM
    }
}

/// Root mean square distance of the parts' probes from the true ones, moved as all parts are in the
/// mean.
fn apart(probes: &[Point3], moved: &[Vec<Point3>]) -> f64 {
    let count = (probes.len() * moved.len()) as f64;
    let mean =
        |points: &mut dyn Iterator<Item = &Point3>| points.map(|p| p.coords).sum::<Vector3>();
    let from = mean(&mut probes.iter()) / probes.len() as f64;
    let to = mean(&mut moved.iter().flatten()) / count;
    let pairs = || moved.iter().flat_map(|part| probes.iter().zip(part));
    let cross: Matrix3<f64> =
        pairs().map(|(p, q)| (q.coords - to) * (p.coords - from).transpose()).sum();
    let turn = Rotation3::from_matrix(&cross);
    let off =
        |(p, q): (&Point3, &Point3)| (q.coords - to - turn * (p.coords - from)).norm_squared();
    (pairs().map(off).sum::<f64>() / count).sqrt()
}

/// One scene.
#[derive(Clone, Debug, Serialize)]
pub struct Record {
    /// Its number.
    pub index: u64,
    /// Name of the sensor.
    pub sensor: &'static str,
    /// Views of a part: 1, or the views of a pass.
    pub views_of_part: usize,
    /// Parts that were brought together.
    pub parts: usize,
    /// Points of all.
    pub points: usize,
    /// Error of the parts before \[mm\],
    pub before_mm: f64,
    /// and after, without those that are not to be used; NaN if none is.
    pub after_mm: f64,
    /// Error that is to be reached \[mm\].
    pub figure_mm: f64,
    /// Parts that the registration says are not to be used.
    pub unfit: usize,
    /// Largest misfit of a part before and after \[mm\],
    pub misfit_mm: [f64; 2],
    /// largest share of a part's cells that are astray \[-\],
    pub most_astray: f64,
    /// least share of a part that it has in common with another,
    pub least_shared: f64,
    /// largest standard deviation of a part's place as it is stated \[mm\],
    pub sigma_mm: f64,
    /// noise of single points as it was found \[mm\].
    pub noise_mm: f64,
    /// Processor time \[s\].
    pub processor_s: f64,
}

impl Record {
    /// Heads of [`Record::row`].
    pub const COLUMNS: &str = "scene  sensor            parts  views  points  before [mm]  after [mm]         figure [mm]  misfit before, after [mm]  astray  shared  unfit  sigma  noise [mm]  CPU [s]";

    /// What came of it: `within` the figure; `named`, within it without parts that are named, or
    /// refused; `beyond` it.
    #[must_use]
    pub fn outcome(&self) -> &'static str {
        match (self.is_within(), self.unfit) {
            (true, 0) => "within",
            (true, _) => "named",
            // Most are unfit: the input is refused.
            (false, unfit) if 2 * unfit > self.parts => "named",
            (false, _) => "beyond",
        }
    }

    /// Whether the parts lie as well as they should.
    #[must_use]
    pub fn is_within(&self) -> bool {
        self.after_mm <= self.figure_mm
    }

    /// The record as a line.
    #[must_use]
    pub fn row(&self) -> String {
        let [before, after] = self.misfit_mm;
        format!(
            "{:5}  {:16}  {:5}  {:5}  {:6}k  {:10.2}  {:9.3} {:6}  {:10.3}  {:15.3} {:9.3}  {:6.3}  {:6.2}  {:5}  {:5.3}  {:9.3}  {:6.2}",
            self.index,
            self.sensor,
            self.parts,
            self.views_of_part,
            self.points / 1000,
            self.before_mm,
            self.after_mm,
            self.outcome(),
            self.figure_mm,
            before,
            after,
            self.most_astray,
            self.least_shared,
            self.unfit,
            self.sigma_mm,
            self.noise_mm,
            self.processor_s
        )
    }
}

/// The scenes of one sensor, of views or of passes.
#[derive(Clone, Debug)]
pub struct Group {
    sensor: &'static str,
    passes: bool,
    figure_mm: f64,
    scenes: usize,
    /// Scenes within the figure, named, beyond it.
    outcomes: [usize; 3],
    before_mm: f64,
    after_mm: f64,
    /// Largest error over the figure.
    worst: f64,
}

impl Group {
    /// Heads of [`Group::row`].
    pub const COLUMNS: &str = "sensor            parts   scenes  within  named  beyond  before [mm]  after [mm]  figure [mm]  worst over figure";

    /// The groups of some records, in the sensors' order.
    #[must_use]
    pub fn all(records: &[Record]) -> Vec<Self> {
        let mut kinds: Vec<(&'static str, bool)> = Vec::new();
        for record in records {
            let kind = (record.sensor, record.views_of_part > 1);
            if !kinds.contains(&kind) {
                kinds.push(kind);
            }
        }
        kinds.into_iter().map(|kind| Self::of(kind, records)).collect()
    }

    fn of((sensor, passes): (&'static str, bool), records: &[Record]) -> Self {
        let of_kind =
            |record: &&Record| record.sensor == sensor && (record.views_of_part > 1) == passes;
        let own: Vec<&Record> = records.iter().filter(of_kind).collect();
        let middle = |of: fn(&Record) -> f64| {
            let known = own.iter().map(|record| of(record)).filter(|mm| mm.is_finite());
            median(known.collect()).unwrap_or(f64::NAN)
        };
        let count = |outcome: &str| own.iter().filter(|record| record.outcome() == outcome).count();
        Self {
            sensor,
            passes,
            figure_mm: middle(|record| record.figure_mm),
            scenes: own.len(),
            outcomes: ["within", "named", "beyond"].map(count),
            before_mm: middle(|record| record.before_mm),
            after_mm: middle(|record| record.after_mm),
            worst: own.iter().map(|record| record.after_mm / record.figure_mm).fold(0.0, f64::max),
        }
    }

    /// The group as a line.
    #[must_use]
    pub fn row(&self) -> String {
        let [within, named, beyond] = self.outcomes;
        format!(
            "{:16}  {:6}  {:6}  {within:6}  {named:5}  {beyond:6}  {:11.1}  {:10.3}  {:11.3}  {:17.1}",
            self.sensor,
            if self.passes { "passes" } else { "views" },
            self.scenes,
            self.before_mm,
            self.after_mm,
            self.figure_mm,
            self.worst
        )
    }
}
