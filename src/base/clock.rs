//! Processor time, and where a job spends it.

use std::time::Instant;

/// Processor time of this process so far, all threads together \[s\]; `None` where the
/// system does not tell it.
#[must_use]
pub fn process_cpu_s() -> Option<f64> {
    of_clock(Clock::Process)
}

/// Processor time of this thread so far \[s\]; `None` where the system does not tell it.
#[must_use]
pub fn thread_cpu_s() -> Option<f64> {
    of_clock(Clock::Thread)
}

enum Clock {
    Process,
    Thread,
}

#[cfg(unix)]
fn of_clock(clock: Clock) -> Option<f64> {
    use rustix::time::{ClockId, clock_gettime};
    let time = clock_gettime(match clock {
        Clock::Process => ClockId::ProcessCPUTime,
        Clock::Thread => ClockId::ThreadCPUTime,
    });
    Some(time.tv_sec as f64 + time.tv_nsec as f64 * 1e-9)
}

#[cfg(not(unix))]
fn of_clock(_: Clock) -> Option<f64> {
    None
}

/// One stage of a job.
#[derive(Clone, Debug, PartialEq)]
pub struct Stage {
    /// What was done.
    pub name: &'static str,
    /// Processor time of the whole process meanwhile \[s\]; `None` where unknown.
    pub cpu_s: Option<f64>,
    /// Time on the wall \[s\].
    pub wall_s: f64,
}

/// The stages of a job, one after another. A job notes each stage at its end.
#[derive(Debug)]
pub struct Stages {
    /// Since the last note; `None` if nobody asked.
    since: Option<(Option<f64>, Instant)>,
    noted: Vec<Stage>,
}

impl Stages {
    /// Notes stages from now on.
    #[must_use]
    pub fn start() -> Self {
        Self { since: Some((process_cpu_s(), Instant::now())), noted: Vec::new() }
    }

    /// Notes nothing, at no cost.
    #[must_use]
    pub fn off() -> Self {
        Self { since: None, noted: Vec::new() }
    }

    /// What was done since the last note (or the start) was `name`.
    pub fn done(&mut self, name: &'static str) {
        let Some((cpu_before_s, before)) = self.since else { return };
        let now = (process_cpu_s(), Instant::now());
        let cpu_s = now.0.zip(cpu_before_s).map(|(now, before)| now - before);
        let wall_s = (now.1 - before).as_secs_f64();
        self.since = Some(now);
        self.noted.push(Stage { name, cpu_s, wall_s });
    }

    /// The stages so far, in order.
    #[must_use]
    pub fn noted(&self) -> &[Stage] {
        &self.noted
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn stages_come_in_order_and_only_if_asked_for() {
        let mut off = Stages::off();
        off.done("a");
        assert!(off.noted().is_empty());
        let mut stages = Stages::start();
        let sum: f64 = (0..2_000_000).map(|k| f64::from(k).sqrt()).sum();
        stages.done("roots");
        stages.done("nothing");
        assert!(sum > 0.0);
        let names: Vec<&str> = stages.noted().iter().map(|s| s.name).collect();
        assert_eq!(names, ["roots", "nothing"]);
        let [roots, nothing] = [0, 1].map(|k| stages.noted()[k].clone());
        assert!(roots.wall_s > nothing.wall_s);
        if cfg!(unix) {
            assert!(roots.cpu_s.unwrap() > 0.0 && nothing.cpu_s.unwrap() >= 0.0);
        }
    }
}
