//! How probable what was measured is, given which effects the cloth and the bench have.
//!
//! In: the least squares of each drape around a fit ([`Around`]), with the moves of every effect.
//! Out: [`Evidence`], the logarithm of the marginal likelihood over sizes of the discrepancy.
//! Integrated out are the stiffnesses and the effects' sizes, each drape's pose, and a small part
//! of every effect that is particular to each scan (Laplace's method: the least squares are
//! quadratic around the fit).
//!
//! The discrepancy is what no parameter makes: cells, minima beside the scan's, noise that is
//! correlated over a stretch. Its standard deviation is a share of the one that the fit takes for
//! the distances, the same for all drapes, and unknown. Of drapes of the model it follows from the
//! scans' noise ([`Discrepancy::usual`]), or from how far two pictures of one drape differ
//! ([`Discrepancy::of_pictures`]); where something else is there, it is larger.
//!
//! Where it fails: an effect that is so large that its moves are not linear has to be fitted first.

use nalgebra::{Cholesky, DMatrix, DVector, Dyn};

use super::effect::{Acts, Effect, FIELDS, Layers, Number, PATTERNS};
use super::smooth::smoothness_of;
use crate::fabric::STIFFNESSES;
use crate::inverse::{Part, Pull};
use crate::sim::sensitivity::Parameter;

/// A drape's part of the least squares around a fit.
#[derive(Clone, Debug)]
pub(super) struct DrapeAround {
    /// Its sums over stiffnesses, numbers and pose, and the priors of its pose.
    pub part: Part,
    /// Whether it is seen in a picture alone.
    pub is_picture: bool,
}

/// The least squares around a fit.
#[derive(Clone, Debug)]
pub(super) struct Around {
    /// The numbers whose moves are known; they come after the stiffnesses.
    pub numbers: Vec<&'static Number>,
    /// The drapes.
    pub drapes: Vec<DrapeAround>,
    /// The specimen of each, from 0 on.
    pub specimens: Vec<usize>,
    /// Precision of stiffnesses and numbers before anything is measured.
    pub precision: DMatrix<f64>,
    /// How far each is below what is expected.
    pub off: DVector<f64>,
    /// How far each may still change.
    pub room: Vec<[f64; 2]>,
}

/// Sizes of the discrepancy that are looked at, as shares of the distances' standard deviations.
const SHARES: [f64; 16] =
    [0.06, 0.08, 0.1, 0.125, 0.16, 0.2, 0.25, 0.32, 0.4, 0.5, 0.65, 0.8, 1.0, 1.3, 1.8, 2.5];

/// The prior of the discrepancy's share: median, and standard deviation of its logarithm.
#[derive(Clone, Copy, Debug)]
pub(super) struct Discrepancy {
    median: f64,
    ln_sigma: f64,
}

impl Discrepancy {
    /// Of drapes of the model: what the scans' stated noise \[m\] holds beyond its floor, and a
    /// little for cells and minima.
    pub fn usual(noise_m: f64, model_m: f64) -> Self {
        Self { median: expected_m(noise_m, MINIMA_M) / noise_m.hypot(model_m), ln_sigma: 0.3 }
    }

    /// The same where rims have no sheets: a drape that its edge alone ties rests in one of more
    /// minima.
    pub fn of_rims(noise_m: f64, model_m: f64) -> Self {
        Self { median: expected_m(noise_m, RIM_MINIMA_M) / noise_m.hypot(model_m), ln_sigma: 0.6 }
    }

    /// Of outlines in pictures whose captures of one drape lie so far apart \[m\], where the
    /// distances' standard deviation is `sigma_m`. Captures that are farther apart than any that
    /// were measured are no captures of one drape.
    pub fn of_pictures(apart_m: Option<f64>, sigma_m: f64) -> Self {
        let apart_m = apart_m.unwrap_or(CAPTURES_M).min(CAPTURES_M);
        Self { median: OF_CAPTURES * apart_m / sigma_m, ln_sigma: 0.4 }
    }

    /// The median.
    pub fn median(self) -> f64 {
        self.median
    }

    /// Of any size.
    pub fn of_any_size(self) -> Self {
        Self { ln_sigma: 1.0, ..self }
    }

    /// Where something is there that the model does not have.
    pub fn with_more(self) -> Self {
        Self { median: MORE * self.median, ln_sigma: 0.5 }
    }
}

/// What a scan's stated noise has at least, of which drapes leave nothing \[m\]; the part of the
/// rest that they leave, and what cells and minima leave \[m\]. Set on the drapes without effects
/// of seeds 50 (handheld, misfits of 0.10 to 0.20) and 51 (phone, 0.53) of sealed cases.
const NOISE_FLOOR_M: f64 = 0.147e-3;
const NOISE: f64 = 1.08;
const MINIMA_M: f64 = 0.05e-3;
/// The same of rims without sheets: the true fabric of a test, tied by its rim and released, rests
/// 0.26 mm off (`sim/drop.rs`).
const RIM_MINIMA_M: f64 = 0.26e-3;

/// Distance that drapes of the model leave from scans of such noise \[m\].
fn expected_m(noise_m: f64, minima_m: f64) -> f64 {
    let beyond_m = (noise_m.powi(2) - NOISE_FLOOR_M.powi(2)).max(0.0).sqrt();
    (NOISE * beyond_m).hypot(minima_m)
}

/// Distance of two captures of one drape where nothing is known \[m\], and the part of it that a
/// drape of the model leaves: 0.5 mm of drawn pictures, 0.8 to 2 mm of photographs.
const CAPTURES_M: f64 = 1.4e-3;
const OF_CAPTURES: f64 = 0.75;
/// How many times the usual is left where something else is there.
const MORE: f64 = 3.0;

/// Logarithms of the probability of what was measured, for each of [`SHARES`].
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) struct Evidence([f64; SHARES.len()]);

impl Evidence {
    /// Which of [`SHARES`] is likeliest.
    fn likeliest(&self) -> usize {
        (0..SHARES.len()).max_by(|&a, &b| self.0[a].total_cmp(&self.0[b])).unwrap_or(0)
    }

    /// The logarithm with the discrepancy's size integrated out.
    pub fn ln(&self, prior: Discrepancy) -> f64 {
        let Discrepancy { median, ln_sigma } = prior;
        let ln_prior = SHARES.map(|share| -0.5 * ((share / median).ln() / ln_sigma).powi(2));
        let both: Vec<f64> = self.0.iter().zip(ln_prior).map(|(ln, prior)| ln + prior).collect();
        ln_sum(&both) - ln_sum(&ln_prior)
    }

    /// The mean of several alternatives.
    pub fn mean(all: &[Self]) -> Self {
        let at = |k: usize| {
            let own: Vec<f64> = all.iter().map(|evidence| evidence.0[k]).collect();
            ln_sum(&own) - (all.len() as f64).ln()
        };
        Self(std::array::from_fn(at))
    }
}

/// The logarithm of a sum of exponentials.
pub(super) fn ln_sum(all: &[f64]) -> f64 {
    let most = all.iter().copied().fold(f64::NEG_INFINITY, f64::max);
    if most.is_finite() {
        most + all.iter().map(|ln| (ln - most).exp()).sum::<f64>().ln()
    } else {
        most
    }
}

/// `exp(ln - (c - 2 b x + x A x) / 2)` over changes of stiffnesses and numbers, one for each of
/// [`SHARES`].
pub(super) struct Forms(Vec<Form>);

impl Around {
    /// The drapes' forms, poses and what is particular to each scan integrated out; `None` where
    /// they have no solution.
    pub fn forms(&self) -> Option<Forms> {
        let own = self.own();
        let of = |share: f64| -> Option<Form> {
            let drapes = self.drapes.iter().map(|drape| {
                let (Part { sums, own: pose }, is_picture) = (&drape.part, drape.is_picture);
                let part = if is_picture { INDEPENDENT_OF_OUTLINE } else { INDEPENDENT };
                let weight = part / share.powi(2);
                let form = Form {
                    a: &sums.normal * weight,
                    b: &sums.right * weight,
                    c: sums.cost * weight,
                    ln: -part * sums.independent * share.ln(),
                };
                form.without_pose(pose)?.with_own(&own)
            });
            let drapes: Vec<Form> = drapes.collect::<Option<_>>()?;
            let mut specimens: Vec<Option<Form>> = vec![None; drapes.len()];
            for (form, &specimen) in drapes.into_iter().zip(&self.specimens) {
                let own = specimens[specimen].take();
                specimens[specimen] = Some(match own {
                    Some(sum) => sum.plus(form),
                    None => form,
                });
            }
            let specimens: Vec<Form> =
                specimens.into_iter().flatten().map(Form::of_specimen).collect::<Option<_>>()?;
            specimens.into_iter().reduce(Form::plus)
        };
        SHARES.into_iter().map(of).collect::<Option<_>>().map(Forms)
    }

    /// The evidence where the stiffnesses and some numbers are unknown, those of the bench are
    /// nearly what they are said to be, and all others are nothing.
    pub fn evidence(&self, forms: &Forms, unknown: &[&'static Number]) -> Option<Evidence> {
        let (of, precision) = self.unknowns(unknown);
        self.with_precision(&forms.0, &of, &precision)
    }

    /// The unknowns where some numbers are, and the precision of all.
    fn unknowns(&self, unknown: &[&'static Number]) -> (Vec<usize>, DMatrix<f64>) {
        let mut precision = self.precision.clone();
        let mut all = unknown.to_vec();
        for (k, &number) in self.numbers.iter().enumerate() {
            if let (Some(sigma), false) = (number.bench_sigma(), unknown.contains(&number)) {
                let at = STIFFNESSES + k;
                precision[(at, at)] = (number.sigma / sigma).powi(2);
                all.push(number);
            }
        }
        (self.indices(&all), precision)
    }

    /// The evidence of something that is not on the list, given some numbers: of smooth fields on
    /// the cloth, as [`Self::fields`] has them, since any effect acts at some places of the cloth;
    /// of pictures of patterns of the outline too.
    pub fn of_something_else(&self, forms: &Forms, given: &[&'static Number]) -> Option<Evidence> {
        let patterns = if self.has_pictures() { &PATTERNS[..] } else { &[] };
        let of_pattern = |pattern: &'static Effect| {
            let numbers: Vec<&'static Number> =
                given.iter().copied().chain(pattern.numbers).collect();
            self.evidence(forms, &numbers)
        };
        let mut all: Vec<Evidence> = patterns.iter().filter_map(of_pattern).collect();
        for (field, layers) in self.fields() {
            let smooth = smoothness_of(layers);
            all.extend(smooth.filter_map(|s| self.of_field(forms, given, field, &s)));
        }
        (!all.is_empty()).then(|| Evidence::mean(&all))
    }

    /// The evidence of a field so smooth beside some numbers.
    pub fn of_field(
        &self,
        Forms(forms): &Forms,
        given: &[&'static Number],
        field: &'static Effect,
        smooth: &DMatrix<f64>,
    ) -> Option<Evidence> {
        let (of, precision) = self.with_field(given, field, smooth);
        self.with_precision(forms, &of, &precision)
    }

    /// The most probable numbers at the nodes of such a field, and their standard errors.
    pub fn at_nodes(
        &self,
        forms: &Forms,
        given: &[&'static Number],
        field: &'static Effect,
        smooth: &DMatrix<f64>,
    ) -> Option<[Vec<f64>; 2]> {
        let form = &forms.0[self.of_field(forms, given, field, smooth)?.likeliest()];
        let (of, precision) = self.with_field(given, field, smooth);
        let prior = precision.select_rows(&of).select_columns(&of);
        let pull = &prior * self.off.select_rows(&of);
        let whole = form.a.select_rows(&of).select_columns(&of) + prior;
        let covariance = whole.cholesky()?.inverse();
        let change = &covariance * (form.b.select_rows(&of) + pull);
        let nodes = self.indices(&field.numbers.iter().collect::<Vec<_>>());
        let own = (0..of.len()).filter(|&k| nodes[STIFFNESSES..].contains(&of[k]));
        let (values, errors) = own.map(|k| (change[k], covariance[(k, k)].sqrt())).unzip();
        Some([values, errors])
    }

    /// The unknowns where a field and some numbers are, and the precision of all with the field so
    /// smooth.
    fn with_field(
        &self,
        given: &[&'static Number],
        field: &'static Effect,
        smooth: &DMatrix<f64>,
    ) -> (Vec<usize>, DMatrix<f64>) {
        let with = given.iter().copied().chain(field.numbers);
        let (of, mut precision) = self.unknowns(&with.collect::<Vec<_>>());
        let nodes = self.indices(&field.numbers.iter().collect::<Vec<_>>());
        for (a, &row) in nodes[STIFFNESSES..].iter().enumerate() {
            for (b, &column) in nodes[STIFFNESSES..].iter().enumerate() {
                precision[(row, column)] = smooth[(a, b)];
            }
        }
        (of, precision)
    }

    /// The fields that are asked for: of pictures of curvature alone. Outlines have been seen to
    /// ask for cloth of negative weight.
    pub fn fields(&self) -> &'static [(Effect, Layers)] {
        if self.has_pictures() { &FIELDS[..1] } else { &FIELDS }
    }

    fn has_pictures(&self) -> bool {
        self.drapes.iter().any(|drape| drape.is_picture)
    }

    /// Whether a number moves any drape.
    pub fn moves(&self, number: &'static Number) -> bool {
        let at = self.numbers.iter().position(|own| *own == number);
        at.is_some_and(|at| {
            let at = STIFFNESSES + at;
            self.drapes.iter().any(|drape| drape.part.sums.normal[(at, at)] > 0.0)
        })
    }

    fn with_precision(
        &self,
        forms: &[Form],
        of: &[usize],
        precision: &DMatrix<f64>,
    ) -> Option<Evidence> {
        let mut ln = [0.0; SHARES.len()];
        for (ln, form) in ln.iter_mut().zip(forms) {
            *ln = self.ln_of(form, of, precision)?;
        }
        Some(Evidence(ln))
    }

    /// The logarithm of a form's integral over some unknowns; a number that would leave what is
    /// tried of it stays at the end.
    fn ln_of(&self, form: &Form, of: &[usize], precision: &DMatrix<f64>) -> Option<f64> {
        let mut of = of.to_vec();
        loop {
            let prior = precision.select_rows(&of).select_columns(&of);
            let off = self.off.select_rows(&of);
            let pull = &prior * &off;
            let factor = (form.a.select_rows(&of).select_columns(&of) + &prior).cholesky()?;
            let b = form.b.select_rows(&of) + &pull;
            let change = factor.solve(&b);
            let leaves =
                |(&at, &by): (&usize, &f64)| by < self.room[at][0] || by > self.room[at][1];
            let inside: Vec<usize> = of
                .iter()
                .zip(&change)
                .filter(|both| !leaves((both.0, both.1)))
                .map(|(at, _)| *at)
                .collect();
            if inside.len() == of.len() {
                let volume = half_ln_det(&prior.cholesky()?) - half_ln_det(&factor);
                return Some(form.ln - 0.5 * (form.c + off.dot(&pull) - b.dot(&change)) + volume);
            }
            of = inside;
        }
    }

    /// The stiffnesses and some numbers among all unknowns.
    fn indices(&self, unknown: &[&'static Number]) -> Vec<usize> {
        let is_asked = |k: &usize| unknown.contains(&self.numbers[*k]);
        let numbers = (0..self.numbers.len()).filter(is_asked).map(|k| STIFFNESSES + k);
        (0..STIFFNESSES).chain(numbers).collect()
    }

    /// The changes that are particular to each scan, and their standard deviations: by so much a
    /// bench is not what it is said to be, a scan not what was there, cells not the cloth.
    fn own(&self) -> Vec<(usize, f64)> {
        let number = |(k, number): (usize, &&'static Number)| {
            let sigma = match number.acts {
                Acts::Sheet(&[Parameter::Warp, Parameter::Weft]) => SIZE_OF_EACH_SCAN,
                Acts::Node(_) | Acts::Outline(_) | Acts::Edge => return None,
                _ => OF_EACH_SCAN,
            };
            Some((STIFFNESSES + k, sigma))
        };
        let stiffnesses = (0..STIFFNESSES).map(|k| (k, STIFFNESS_OF_EACH_SCAN));
        stiffnesses.chain(self.numbers.iter().enumerate().filter_map(number)).collect()
    }
}

#[derive(Clone, Debug)]
struct Form {
    a: DMatrix<f64>,
    b: DVector<f64>,
    c: f64,
    ln: f64,
}

impl Form {
    /// The same with the pose, the last unknowns, integrated out over its prior.
    fn without_pose(self, pose: &[Pull]) -> Option<Self> {
        let common = self.b.len() - pose.len();
        let kept: Vec<usize> = (0..common).collect();
        let free: Vec<usize> = (0..pose.len()).filter(|&m| pose[m].is_free()).collect();
        let at: Vec<usize> = free.iter().map(|m| common + m).collect();
        let mut inner = self.a.select_rows(&at).select_columns(&at);
        let mut pulled = self.b.select_rows(&at);
        let coupled = self.a.select_rows(&at).select_columns(&kept);
        let (a, b) = (self.a.select_rows(&kept).select_columns(&kept), self.b.select_rows(&kept));
        let mut own = Self { a, b, ..self };
        for (k, &m) in free.iter().enumerate() {
            let Pull { precision, right, cost } = pose[m];
            inner[(k, k)] += precision;
            pulled[k] += right;
            own.c += cost;
            own.ln += 0.5 * precision.ln();
        }
        own.without(inner, &coupled, &pulled)
    }

    /// The same with further changes of some unknowns, of such standard deviations, integrated out.
    fn with_own(mut self, own: &[(usize, f64)]) -> Option<Self> {
        let at: Vec<usize> = own.iter().map(|(at, _)| *at).collect();
        let coupled = self.a.select_rows(&at);
        let mut inner = coupled.select_columns(&at);
        for (k, (_, sigma)) in own.iter().enumerate() {
            inner[(k, k)] += sigma.powi(-2);
            self.ln -= sigma.ln();
        }
        let pulled = self.b.select_rows(&at);
        self.without(inner, &coupled, &pulled)
    }

    /// The same with a factor of the specimen's own on the three bending stiffnesses integrated
    /// out.
    fn of_specimen(mut self) -> Option<Self> {
        let is_bending = |k: usize| if (3..STIFFNESSES).contains(&k) { 1.0 } else { 0.0 };
        let stiffer = DVector::from_fn(self.b.len(), |k, _| is_bending(k));
        let coupled = (&self.a * &stiffer).transpose();
        let whole = (&coupled * &stiffer)[0] + SPECIMENS_DIFFER.powi(-2);
        self.ln -= SPECIMENS_DIFFER.ln();
        let pulled = DVector::from_element(1, stiffer.dot(&self.b));
        let coupled = DMatrix::from_row_slice(1, coupled.len(), coupled.as_slice());
        self.without(DMatrix::from_element(1, 1, whole), &coupled, &pulled)
    }

    /// The integral over unknowns of such a matrix, coupled to the others and pulled so.
    fn without(
        mut self,
        inner: DMatrix<f64>,
        coupled: &DMatrix<f64>,
        pulled: &DVector<f64>,
    ) -> Option<Self> {
        let factor = inner.cholesky()?;
        let along = factor.solve(pulled);
        self.a -= coupled.tr_mul(&factor.solve(coupled));
        self.b -= coupled.tr_mul(&along);
        self.c -= pulled.dot(&along);
        self.ln -= half_ln_det(&factor);
        Some(self)
    }

    fn plus(mut self, other: Self) -> Self {
        self.a += &other.a;
        self.b += &other.b;
        self.c += other.c;
        self.ln += other.ln;
        self
    }
}

fn half_ln_det(factor: &Cholesky<f64, Dyn>) -> f64 {
    factor.l_dirty().diagonal().iter().map(|along| along.ln()).sum()
}

/// Part of the points that the fit takes as independent which are so of the discrepancy.
const INDEPENDENT: f64 = 0.1;
/// The same of outlines in pictures. What fits leave of the measured fabrics' outlines is not alike
/// in neighbouring sectors of 15 degrees, some 32 mm.
const INDEPENDENT_OF_OUTLINE: f64 = 0.7;
/// Standard deviation of the logarithm by which the bending of specimens of one cloth differs: the
/// 3 to 4 points by which drape coefficients of one face scatter over the specimens of the measured
/// fabrics.
const SPECIMENS_DIFFER: f64 = 0.15;
/// Part of what may be expected of each effect that is particular to each scan.
const OF_EACH_SCAN: f64 = 0.03;
/// The same of the specimen's size, and of the logarithm of a stiffness.
const SIZE_OF_EACH_SCAN: f64 = 0.1;
const STIFFNESS_OF_EACH_SCAN: f64 = 0.01;

#[cfg(test)]
mod tests {
    use super::*;
    use crate::calibrate::effect::Effect;
    use crate::calibrate::pose::POSE;
    use crate::inverse::Sums;

    const ROWS: usize = 600;
    const USUAL: Discrepancy = Discrepancy { median: 0.2, ln_sigma: 0.4 };

    fn numbers(name: &str) -> Vec<&'static Number> {
        Effect::named(name).unwrap().numbers.iter().collect()
    }

    /// Something between -1 and 1 that looks drawn.
    fn drawn(row: usize, column: usize) -> f64 {
        (12.9898 * row as f64 + 78.233 * column as f64 + 0.3 * (row * column) as f64).sin()
    }

    /// Distances of one drape and their moves, and the least squares around them.
    fn made(off_m: impl Fn(&DMatrix<f64>) -> DVector<f64>) -> (DMatrix<f64>, DVector<f64>, Around) {
        let numbers: Vec<_> = [numbers("tilt"), numbers("friction")].concat();
        let shared = STIFFNESSES + numbers.len();
        let columns = DMatrix::from_fn(ROWS, shared + POSE, drawn);
        let off_m = off_m(&columns);
        let sums = Sums {
            normal: columns.tr_mul(&columns),
            right: columns.tr_mul(&off_m),
            cost: off_m.norm_squared(),
            independent: ROWS as f64,
        };
        let pull = |m| if m < 3 { Pull::gaussian(4.0 + m as f64, 0.1) } else { Pull::fixed(0.0) };
        let part = Part { sums, own: (0..POSE).map(pull).collect() };
        let around =
            Around {
                numbers,
                drapes: vec![DrapeAround { part, is_picture: false }],
                specimens: vec![0],
                precision: DMatrix::from_fn(shared, shared, |a, b| {
                    if a == b { 1.0 + a as f64 } else { 0.0 }
                }),
                off: DVector::from_fn(shared, |k, _| 0.05 * k as f64),
                room: vec![[f64::NEG_INFINITY, f64::INFINITY]; shared],
            };
        (columns, off_m, around)
    }

    /// The logarithm of the normal density of all distances, with everything that is unknown in
    /// their covariance.
    fn density(
        columns: &DMatrix<f64>,
        off_m: &DVector<f64>,
        around: &Around,
        share: f64,
        unknown: &[&'static Number],
    ) -> f64 {
        let shared = around.off.len();
        let mut covariance = DMatrix::identity(ROWS, ROWS) * (share.powi(2) / INDEPENDENT);
        let mut mean = DVector::zeros(ROWS);
        let stiffer = columns.columns(3, STIFFNESSES - 3).column_sum() * SPECIMENS_DIFFER;
        covariance += &stiffer * stiffer.transpose();
        let mut add = |column: usize, variance: f64, at: f64| {
            let own = columns.column(column);
            covariance += own * own.transpose() * variance;
            mean += own * at;
        };
        around.own().into_iter().for_each(|(k, sigma)| add(k, sigma.powi(2), 0.0));
        let (of, precision) = around.unknowns(unknown);
        of.iter().for_each(|&k| add(k, 1.0 / precision[(k, k)], around.off[k]));
        (0..3).for_each(|m| {
            let Pull { precision, right, .. } = around.drapes[0].part.own[m];
            add(shared + m, 1.0 / precision, right / precision);
        });
        let factor = covariance.cholesky().unwrap();
        let off = off_m - mean;
        -0.5 * off.dot(&factor.solve(&off)) - half_ln_det(&factor)
    }

    #[test]
    fn evidence_is_the_density_of_the_distances_with_all_that_is_unknown_in_their_covariance() {
        let (columns, off_m, around) =
            made(|columns| 1.5 * columns.column(8) + 0.02 * columns.column(15));
        let forms = around.forms().unwrap();
        let asked = ["tilt", "friction"].map(numbers);
        for share in [2, 7, 12] {
            let nothing = around.evidence(&forms, &[]).unwrap().0[share];
            let of = density(&columns, &off_m, &around, SHARES[share], &[]);
            for numbers in &asked {
                let gain = around.evidence(&forms, numbers).unwrap().0[share] - nothing;
                let expected = density(&columns, &off_m, &around, SHARES[share], numbers) - of;
                assert!(
                    (gain - expected).abs() < 1e-6 * (1.0 + expected.abs()),
                    "{gain} {expected}"
                );
            }
        }
        // what was put in is what gains
        let [tilt, friction] =
            asked.map(|numbers| around.evidence(&forms, &numbers).unwrap().ln(USUAL));
        assert!(friction > tilt + 3.0, "{friction} {tilt}");
    }

    #[test]
    fn a_number_that_would_leave_its_room_gains_nothing() {
        let (_, _, mut around) = made(|columns| 1.5 * columns.column(8));
        let forms = around.forms().unwrap();
        let friction = numbers("friction");
        let gain = |around: &Around| {
            let of =
                |numbers: &[&'static Number]| around.evidence(&forms, numbers).unwrap().ln(USUAL);
            of(&friction) - of(&[])
        };
        assert!(gain(&around) > 3.0);
        around.room[STIFFNESSES + 2] = [-1.0, 0.0];
        assert_eq!(gain(&around), 0.0);
    }

    #[test]
    fn a_discrepancy_that_the_model_does_not_have_speaks_for_something_else() {
        // the likeliest share of these
        let at = |likely: f64| Evidence(SHARES.map(|share| -40.0 * (share / likely).ln().powi(2)));
        assert!(at(0.18).ln(USUAL) > at(0.18).ln(USUAL.with_more()) + 1.0);
        assert!(at(0.8).ln(USUAL.with_more()) > at(0.8).ln(USUAL) + 4.0);
        // a phone's noise is usual for a phone
        let phone = Discrepancy::usual(0.34e-3, 0.5e-3);
        assert!(at(0.5).ln(phone) > at(0.5).ln(phone.with_more()) + 1.0);
        let mean = Evidence::mean(&[at(0.2), at(0.2)]);
        assert!((mean.ln(USUAL) - at(0.2).ln(USUAL)).abs() < 1e-9);
    }
}
