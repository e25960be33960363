//! Anderson acceleration of a fixed-point iteration (Walker and Ni 2011).

/// One round: the image of a point, and by how much it differs from the point.
struct Round {
    residual: Vec<f64>,
    image: Vec<f64>,
}

/// The rounds of a fixed-point iteration so far.
#[derive(Default)]
pub struct Mixer {
    /// What changed from round to round.
    history: Vec<Round>,
    last: Option<Round>,
}

impl Mixer {
    /// Rounds that are remembered.
    const MEMORY: usize = 5;

    /// Replaces `x` by the accelerated successor; `image` is the plain one.
    pub fn step(&mut self, x: &mut [f64], image: Vec<f64>) {
        let residual: Vec<f64> = image.iter().zip(&*x).map(|(g, x)| g - x).collect();
        let dot = |a: &[f64], b: &[f64]| -> f64 { a.iter().zip(b).map(|(a, b)| a * b).sum() };
        if let Some(last) = self.last.take() {
            // A residual that grows means that the iteration's weights have changed.
            if dot(&residual, &residual) > 2.0 * dot(&last.residual, &last.residual) {
                self.history.clear();
            } else {
                let minus = |a: &[f64], b: &[f64]| a.iter().zip(b).map(|(a, b)| a - b).collect();
                self.history.push(Round {
                    residual: minus(&residual, &last.residual),
                    image: minus(&image, &last.image),
                });
                if self.history.len() > Self::MEMORY {
                    self.history.remove(0);
                }
            }
        }
        let m = self.history.len();
        let mut mixed = image.clone();
        if m > 0 {
            let gram = nalgebra::DMatrix::from_fn(m, m, |a, b| {
                dot(&self.history[a].residual, &self.history[b].residual)
            });
            let ridge = 1e-10 * gram.trace() + 1e-300;
            let right =
                nalgebra::DVector::from_fn(m, |a, _| dot(&self.history[a].residual, &residual));
            let system = gram + nalgebra::DMatrix::identity(m, m) * ridge;
            if let Some(share) = system.cholesky().map(|c| c.solve(&right)) {
                for (k, change) in self.history.iter().enumerate() {
                    mixed.iter_mut().zip(&change.image).for_each(|(x, d)| *x -= share[k] * d);
                }
            }
        }
        x.copy_from_slice(&mixed);
        self.last = Some(Round { residual, image });
    }
}
