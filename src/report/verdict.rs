//! A verdict in words: the first lines of the table, and a line of a picture's legend.

use std::fmt::Write as _;

use crate::job::Verdict;
use crate::job::verdict::{Ground, Level};

/// The verdict as the first lines of a table: the level, then each ground with its remedy,
/// worst first.
#[must_use]
pub fn lines(verdict: &Verdict) -> String {
    let mut out = format!("verdict          {}\n", heading(verdict));
    for ground in &verdict.grounds {
        // Writing to a string cannot fail.
        let _ = writeln!(out, "  {:<14} {}: {}", word(ground), ground.code.name(), ground.text);
    }
    out
}

/// The verdict in one line: the level and the codes of its grounds, cut to `most` characters.
#[must_use]
pub fn one_line(verdict: &Verdict, most: usize) -> String {
    let mut codes: Vec<&str> = Vec::new();
    for ground in verdict.grounds.iter().filter(|ground| ground.level > Level::Reliable) {
        if !codes.contains(&ground.code.name()) {
            codes.push(ground.code.name());
        }
    }
    let mut line = format!("verdict: {}", heading(verdict));
    for (k, code) in codes.iter().enumerate() {
        let more = if k == 0 { ": " } else { ", " };
        let left = codes.len() - k;
        if line.len() + more.len() + code.len() + 12 > most {
            let _ = write!(line, "{more}{left} more");
            break;
        }
        line += more;
        line += code;
    }
    line
}

/// The level, and whether what was scanned is not the experiment.
fn heading(verdict: &Verdict) -> String {
    let words = verdict.level.words();
    if verdict.not_the_experiment {
        format!("{words} (not the experiment)")
    } else {
        words.to_owned()
    }
}

/// What a ground makes of the result, in a word; one that changes nothing is a note.
fn word(ground: &Ground) -> &'static str {
    match ground.level {
        Level::Reliable => "note",
        worse => worse.words(),
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::job::verdict::Code;

    fn ground(code: Code, level: Level) -> Ground {
        Ground::new(code, level, (2.0, 1.0, "mm"), "2 mm, limit 1; mend it".to_owned())
    }

    #[test]
    fn the_level_comes_first_and_each_ground_has_its_line() {
        assert_eq!(lines(&Verdict::of(vec![])), "verdict          reliable\n");
        let note = ground(Code::OrientationAmbiguous, Level::Reliable);
        let worse = ground(Code::PlateRadius, Level::Doubtful);
        let text = lines(&Verdict::of(vec![note, worse]));
        let lines: Vec<&str> = text.lines().collect();
        assert_eq!(lines[0], "verdict          doubtful");
        assert_eq!(lines[1], "  doubtful       plate_radius: 2 mm, limit 1; mend it");
        assert_eq!(lines[2], "  note           orientation_ambiguous: 2 mm, limit 1; mend it");
    }

    #[test]
    fn one_line_names_each_ground_once_and_says_how_many_are_cut_off() {
        let note = ground(Code::OrientationAmbiguous, Level::Reliable);
        assert_eq!(one_line(&Verdict::of(vec![note.clone()]), 70), "verdict: reliable");
        let many = vec![
            note,
            ground(Code::OutOfRange, Level::Doubtful),
            ground(Code::OutOfRange, Level::Doubtful),
            ground(Code::NovelRim, Level::Doubtful),
            ground(Code::PlateRadius, Level::Doubtful).not_the_experiment(),
        ];
        let verdict = Verdict::of(many);
        assert_eq!(
            one_line(&verdict, 200),
            "verdict: do not use (not the experiment): plate_radius, out_of_range, novel_rim"
        );
        let cut = one_line(&verdict, 70);
        assert_eq!(cut, "verdict: do not use (not the experiment): plate_radius, 2 more");
        assert!(cut.len() <= 70);
    }
}
