//! Sheets on paper: one page where it is large enough, else tiles that overlap.
//!
//! Each page has a ruler to check the print with. Neighbouring tiles show the same crosses in the
//! strip that they share; one is cut along the dashed line and laid on the other, cross on cross.

use super::pdf::{Page, Placed};
use super::sheet::{Item, Pen, Sheet};

/// A size of paper.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Paper {
    /// Name in file names.
    pub name: &'static str,
    /// Width and height \[mm\].
    pub size_mm: [f64; 2],
}

/// The sizes that templates are written for.
pub const PAPERS: [Paper; 4] = [
    Paper { name: "A2", size_mm: [420.0, 594.0] },
    Paper { name: "A3", size_mm: [297.0, 420.0] },
    Paper { name: "A4", size_mm: [210.0, 297.0] },
    Paper { name: "Letter", size_mm: [215.9, 279.4] },
];

/// What printers leave white on each side \[mm\].
const MARGIN_MM: f64 = 10.0;
/// Width of the strip that neighbouring tiles share \[mm\].
pub const OVERLAP_MM: f64 = 10.0;
/// Height of the foot with ruler and title \[mm\].
const FOOT_MM: f64 = 18.0;

/// Columns and rows of tiles that a sheet takes on a paper.
#[must_use]
pub fn grid(sheet: &Sheet, paper: Paper) -> [usize; 2] {
    let shown = shown_mm(paper);
    [0, 1].map(|k| {
        ((sheet.size_mm[k] - OVERLAP_MM) / (shown[k] - OVERLAP_MM)).ceil().max(1.0) as usize
    })
}

/// What shows of a sheet on one page \[mm\].
fn shown_mm(paper: Paper) -> [f64; 2] {
    let [width, height] = paper.size_mm;
    [width - 2.0 * MARGIN_MM, height - 2.0 * MARGIN_MM - FOOT_MM]
}

/// The pages of a sheet, row by row.
#[must_use]
pub fn pages(sheet: &Sheet, paper: Paper) -> Vec<Page> {
    let ([columns, rows], shown) = (grid(sheet, paper), shown_mm(paper));
    let items = with_crosses(sheet, [columns, rows], shown);
    let tiles = (0..rows).flat_map(|row| (0..columns).map(move |column| [column, row]));
    tiles
        .map(|at| {
            let step = [0, 1].map(|k| at[k] as f64 * (shown[k] - OVERLAP_MM));
            let left = [0, 1].map(|k| (sheet.size_mm[k] - step[k]).min(shown[k]));
            let drawing = Placed {
                items: items.clone(),
                at_mm: step.map(|v| MARGIN_MM - v),
                clip_mm: Some([MARGIN_MM, MARGIN_MM, left[0], left[1]]),
            };
            let around = Placed {
                items: around(sheet, at, [columns, rows], shown),
                at_mm: [MARGIN_MM; 2],
                clip_mm: None,
            };
            Page { size_mm: paper.size_mm, parts: vec![drawing, around] }
        })
        .collect()
}

/// The sheet's items with a cross at both ends and in the middle of each shared strip.
fn with_crosses(sheet: &Sheet, grid: [usize; 2], shown: [f64; 2]) -> Vec<Item> {
    let mut marked = Sheet { items: sheet.items.clone(), ..sheet.clone() };
    let strips = |k: usize| -> Vec<f64> {
        let step = shown[k] - OVERLAP_MM;
        (1..grid[k]).map(|n| n as f64 * step + 0.5 * OVERLAP_MM).collect()
    };
    let [width, height] = sheet.size_mm;
    let mut places = Vec::new();
    for x in strips(0) {
        places.extend([0.08, 0.3, 0.7, 0.92].map(|share| [x, share * height]));
    }
    for y in strips(1) {
        places.extend([0.08, 0.3, 0.7, 0.92].map(|share| [share * width, y]));
    }
    for place in places {
        marked.cross(place, 4.0, Pen::CUT);
        marked.circle(place, 2.0, Pen::CUT);
    }
    marked.items
}

/// What stands around a tile: its border, the line to cut along, ruler and title.
fn around(sheet: &Sheet, at: [usize; 2], grid: [usize; 2], shown: [f64; 2]) -> Vec<Item> {
    let mut foot = Sheet::new("foot", "", shown);
    let [width, height] = shown;
    // Of two that share a strip, the left and the upper one keep it: the other is cut.
    if at[0] > 0 {
        foot.line(&[[0.5 * OVERLAP_MM, 0.0], [0.5 * OVERLAP_MM, height]], Pen::DASHED);
    }
    if at[1] > 0 {
        foot.line(&[[0.0, 0.5 * OVERLAP_MM], [width, 0.5 * OVERLAP_MM]], Pen::DASHED);
    }
    foot.ruler([0.0, height + 6.0]);
    let many = grid[0] * grid[1] > 1;
    let place = if many {
        let [column, row] = at.map(|k| k + 1);
        format!(
            ": row {row} of {}, column {column} of {}; cut along dashes at the left and at the top, lay cross on cross",
            grid[1], grid[0]
        )
    } else {
        String::new()
    };
    foot.text([0.0, height + 16.5], 2.6, format!("{}{place}", sheet.title));
    foot.items
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn tiles_cover_the_sheet_and_no_more_than_they_must() {
        let sheet = Sheet::new("s", "", [340.0, 352.0]);
        let grids = PAPERS.map(|paper| grid(&sheet, paper));
        assert_eq!(grids, [[1, 1], [2, 1], [2, 2], [2, 2]]);
        for (paper, [columns, rows]) in PAPERS.into_iter().zip(grids) {
            let pages = pages(&sheet, paper);
            assert_eq!(pages.len(), columns * rows);
            // Every place of the sheet shows on a page, inside what is printed.
            for k in 0..=100 {
                let at = [340.0, 352.0].map(|v| v * f64::from(k) / 100.0);
                let shows = |page: &Page| {
                    let [x, y, w, h] = page.parts[0].clip_mm.unwrap();
                    let [px, py] = [0, 1].map(|k| page.parts[0].at_mm[k] + at[k]);
                    px >= x && px <= x + w + 1e-9 && py >= y && py <= y + h + 1e-9
                };
                assert!(pages.iter().any(shows), "{} {at:?}", paper.name);
            }
        }
    }
}
