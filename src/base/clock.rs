//! Processor time, and where a job spends it.

use std::time::Instant;

use cpu_time::{ProcessTime, ThreadTime};

/// Processor time of this process so far, all threads together \[s\]; `None` where the
/// system does not tell it.
#[must_use]
pub fn process_cpu_s() -> Option<f64> {
    Some(ProcessTime::try_now().ok()?.as_duration().as_secs_f64())
}

/// Processor time of this thread so far \[s\]; `None` where the system does not tell it.
#[must_use]
pub fn thread_cpu_s() -> Option<f64> {
    Some(ThreadTime::try_now().ok()?.as_duration().as_secs_f64())
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

/// The stages of a job, one after another, each timed as a span.
#[derive(Debug)]
pub struct Stages {
    clock: Asked,
    noted: Vec<Stage>,
}

/// Whether anybody asked for the times.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
enum Asked {
    Yes,
    No,
}

impl Stages {
    /// Notes every span.
    #[must_use]
    pub fn start() -> Self {
        Self { clock: Asked::Yes, noted: Vec::new() }
    }

    /// Notes nothing, at no cost.
    #[must_use]
    pub fn off() -> Self {
        Self { clock: Asked::No, noted: Vec::new() }
    }

    /// Does `work` and notes what it took as the stage `name`, also if it fails.
    pub fn span<T>(&mut self, name: &'static str, work: impl FnOnce() -> T) -> T {
        if self.clock == Asked::No {
            return work();
        }
        let (cpu_before_s, before) = (process_cpu_s(), Instant::now());
        let made = work();
        let (cpu_now_s, wall_s) = (process_cpu_s(), before.elapsed().as_secs_f64());
        let cpu_s = cpu_now_s.zip(cpu_before_s).map(|(now, before)| now - before);
        self.noted.push(Stage { name, cpu_s, wall_s });
        made
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
        assert_eq!(off.span("a", || 7), 7);
        assert!(off.noted().is_empty());
        let mut stages = Stages::start();
        let sum: f64 = stages.span("roots", || (0..2_000_000).map(|k| f64::from(k).sqrt()).sum());
        stages.span("nothing", || ());
        assert!(sum > 0.0);
        let names: Vec<&str> = stages.noted().iter().map(|s| s.name).collect();
        assert_eq!(names, ["roots", "nothing"]);
        let [roots, nothing] = [0, 1].map(|k| stages.noted()[k].clone());
        assert!(roots.wall_s > nothing.wall_s);
        assert!(roots.cpu_s.unwrap() > 0.0 && nothing.cpu_s.unwrap() >= 0.0);
    }
}
