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
    /// Largest memory that the process has held by its end \[MiB\]; `None` where unknown.
    pub peak_mib: Option<f64>,
}

/// Largest memory that the process has held so far \[MiB\], where the system tells it (Linux).
#[must_use]
pub fn peak_memory_mib() -> Option<f64> {
    let text = std::fs::read_to_string("/proc/self/status").ok()?;
    let line = text.lines().find_map(|line| line.strip_prefix("VmHWM:"))?;
    Some(line.trim().split(' ').next()?.parse::<f64>().ok()? / 1024.0)
}

/// The beginning of a stage.
#[derive(Clone, Copy, Debug)]
pub struct Begun {
    cpu_s: Option<f64>,
    at: Instant,
}

impl Begun {
    /// Begins now.
    #[must_use]
    pub fn now() -> Self {
        Self { cpu_s: process_cpu_s(), at: Instant::now() }
    }

    fn ended(self, name: &'static str) -> Stage {
        let cpu_s = process_cpu_s().zip(self.cpu_s).map(|(now, before)| now - before);
        let wall_s = self.at.elapsed().as_secs_f64();
        Stage { name, cpu_s, wall_s, peak_mib: peak_memory_mib() }
    }
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
        let begun = Begun::now();
        let made = work();
        self.noted.push(begun.ended(name));
        made
    }

    /// Notes what was done since `begun` as the stage `name`; what one of that name took before is
    /// added to it.
    pub fn add(&mut self, name: &'static str, begun: Begun) {
        if self.clock == Asked::No {
            return;
        }
        let stage = begun.ended(name);
        match self.noted.iter_mut().find(|before| before.name == name) {
            Some(before) => {
                before.cpu_s = before.cpu_s.zip(stage.cpu_s).map(|(a, b)| a + b);
                before.wall_s += stage.wall_s;
                before.peak_mib = stage.peak_mib;
            }
            None => self.noted.push(stage),
        }
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
