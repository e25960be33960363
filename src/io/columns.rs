//! Which columns of a table are coordinates and which a colour.
//!
//! In: the table's titles, or without them numbers of a sample of its rows. Out: the
//! [`Columns`] to read and, where that was a guess, in words what was taken.

/// The columns that are read.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) struct Columns {
    /// Of x, y and z.
    pub(super) position: [usize; 3],
    /// Of red, green and blue.
    pub(super) color: Option<[usize; 3]>,
}

/// What a line of titles says.
#[derive(Clone, Debug, PartialEq, Eq)]
pub(super) enum Titles {
    /// Which columns are x, y and z.
    Understood(Columns),
    /// It has a name for each column, but not for x, y and z.
    NotUnderstood,
    /// It is a remark.
    Remark,
}

/// What each name stands for, in small letters without signs and units.
const X: [&str; 21] = [
    "x",
    "xcoord",
    "xcoordinate",
    "coordx",
    "coordinatex",
    "xpos",
    "xposition",
    "posx",
    "positionx",
    "pointx",
    "pointsx",
    "points0",
    "point0",
    "px",
    "cartesianx",
    "worldx",
    "xworld",
    "vertexx",
    "coordinates0",
    "xkoordinate",
    "xwert",
];
const EAST: [&str; 9] =
    ["e", "east", "easting", "eastings", "ost", "ostwert", "rechtswert", "este", "est"];
const NORTH: [&str; 8] =
    ["n", "north", "northing", "northings", "nord", "nordwert", "hochwert", "norte"];
const UP: [&str; 14] = [
    "h",
    "height",
    "elevation",
    "elev",
    "alt",
    "altitude",
    "up",
    "u",
    "höhe",
    "hoehe",
    "hohe",
    "hauteur",
    "altura",
    "quota",
];
const RED: [&str; 10] =
    ["r", "red", "diffusered", "colorr", "colourr", "colorred", "redcolor", "rot", "rouge", "rgb0"];
const GREEN: [&str; 11] = [
    "g",
    "green",
    "diffusegreen",
    "colorg",
    "colourg",
    "colorgreen",
    "greencolor",
    "grün",
    "gruen",
    "vert",
    "rgb1",
];
const BLUE: [&str; 10] = [
    "b",
    "blue",
    "diffuseblue",
    "colorb",
    "colourb",
    "colorblue",
    "bluecolor",
    "blau",
    "bleu",
    "rgb2",
];
/// Names that stand for three columns.
const COLOR: [&str; 5] = ["rgb", "color", "colour", "colors", "farbe"];
const NORMAL: [&str; 3] = ["normal", "normals", "nxnynz"];
const UNITS: [&str; 10] =
    ["millimeters", "millimetres", "meters", "metres", "meter", "mm", "cm", "ft", "in", "m"];

impl Titles {
    /// What titles say of rows of `columns` cells.
    pub(super) fn read(titles: &[String], columns: usize) -> Self {
        let mut names: Vec<String> = Vec::with_capacity(columns);
        for title in titles {
            let name = plain(title);
            let is = |known: &[&str]| known.contains(&name.as_str());
            let three = (is(&COLOR) || is(&NORMAL)) && titles.len() < columns;
            names.extend(std::iter::repeat_n(name, if three { 3 } else { 1 }));
        }
        while names.len() > columns && names.last().is_some_and(String::is_empty) {
            names.pop();
        }
        let fits = names.len() <= columns;
        match position(&names) {
            Some(position) if fits && position.iter().all(|&at| at < columns) => {
                Self::Understood(Columns { position, color: color(&names) })
            }
            Some(_) => Self::NotUnderstood,
            None if names.len() == columns => Self::NotUnderstood,
            None => Self::Remark,
        }
    }
}

/// A text without what stands in brackets: units, which may have blanks.
pub(super) fn without_brackets(text: &str) -> String {
    let mut depth = 0_u32;
    let mut kept = String::new();
    for c in text.chars() {
        match c {
            '[' | '(' | '{' => depth += 1,
            ']' | ')' | '}' => depth = depth.saturating_sub(1),
            c if depth == 0 => kept.push(c),
            _ => {}
        }
    }
    kept
}

/// A title in small letters, without its unit, signs and brackets.
fn plain(title: &str) -> String {
    let name = without_brackets(title).to_lowercase();
    let name: String = name.chars().filter(|c| c.is_alphanumeric()).collect();
    let known = |name: &str| axis(name).is_some();
    if known(&name) {
        return name;
    }
    let short = UNITS.iter().filter_map(|unit| name.strip_suffix(unit)).find(|rest| known(rest));
    short.map_or(name.clone(), str::to_owned)
}

/// The coordinate that a name stands for, and whether it is a map's.
fn axis(name: &str) -> Option<(usize, bool)> {
    // Names of y and z are those of x with another letter, or another number.
    let like_x = |letter: char, digit: char| {
        X.contains(&name.replace(letter, "x").replace(digit, "0").as_str())
    };
    if X.contains(&name) {
        Some((0, false))
    } else if like_x('y', '1') {
        Some((1, false))
    } else if like_x('z', '2') {
        Some((2, false))
    } else if EAST.contains(&name) {
        Some((0, true))
    } else if NORTH.contains(&name) {
        Some((1, true))
    } else if UP.contains(&name) {
        Some((2, true))
    } else {
        None
    }
}

/// The columns of x, y and z, each named once; plain names go before those of a map.
fn position(names: &[String]) -> Option<[usize; 3]> {
    let named = |wanted: usize, of_map: bool| {
        let mut at = names
            .iter()
            .enumerate()
            .filter(|(_, name)| axis(name) == Some((wanted, of_map)))
            .map(|(at, _)| at);
        let first = at.next()?;
        // Two of a name do not say which is meant.
        at.next().is_none().then_some(first)
    };
    let level = |of_map: bool| Some([named(0, of_map)?, named(1, of_map)?]);
    let up = |of_map: bool| named(2, of_map).or_else(|| named(2, !of_map));
    [false, true].into_iter().find_map(|of_map| {
        let [x, y] = level(of_map)?;
        Some([x, y, up(of_map)?])
    })
}

/// The columns of a colour.
fn color(names: &[String]) -> Option<[usize; 3]> {
    let rgb = names.iter().position(|name| COLOR.contains(&name.as_str()));
    if let Some(at) = rgb.filter(|&at| names.get(at + 2).is_some_and(|name| *name == names[at])) {
        return Some([at, at + 1, at + 2]);
    }
    let named = |known: &[&str]| names.iter().position(|name| known.contains(&name.as_str()));
    Some([named(&RED)?, named(&GREEN)?, named(&BLUE)?])
}

/// What is known of a column from a sample of rows.
struct Content {
    numeric: bool,
    whole: bool,
    low: f64,
    high: f64,
    /// Never falls.
    rises: bool,
    /// Grows with the rows' numbers as a straight line does.
    straight: bool,
}

impl Content {
    /// Of a column; `rows` are the numbers of the sampled rows within the file.
    fn of(values: &[f64], rows: &[usize]) -> Self {
        let finite: Vec<f64> = values.iter().copied().filter(|v| v.is_finite()).collect();
        let fold = |pick: fn(f64, f64) -> f64, from| finite.iter().copied().fold(from, pick);
        let whole = finite.iter().all(|v| v.fract() == 0.0);
        Self {
            numeric: 2 * finite.len() >= values.len() && !finite.is_empty(),
            whole,
            low: fold(f64::min, f64::INFINITY),
            high: fold(f64::max, f64::NEG_INFINITY),
            straight: is_straight(values, rows),
            rises: values.windows(2).all(|v| v[1] >= v[0]),
        }
    }

    fn extent(&self) -> f64 {
        self.high - self.low
    }

    fn is_byte(&self) -> bool {
        self.numeric && self.whole && self.low >= 0.0 && self.high <= 255.0
    }

    fn is_share(&self) -> bool {
        self.numeric && self.low >= 0.0 && self.high <= 1.0
    }
}

/// Rows whose content is looked at.
pub(super) const SAMPLE_ROWS: usize = 4096;
/// A time is known from its distance from zero in units of its extent: clocks count from 1970.
const CLOCK: f64 = 1e3;
/// Coordinates of a scene have extents within this factor of one another.
const ALIKE: f64 = 100.0;

impl Columns {
    /// By what they hold. `sample` has the numbers of some rows, column by column, NaN for what is
    /// none; `rows` are their numbers within the file. `None` when fewer than three columns may be
    /// coordinates.
    pub(super) fn by_content(sample: &[Vec<f64>], rows: &[usize]) -> Option<Self> {
        let content: Vec<Content> = sample.iter().map(|v| Content::of(v, rows)).collect();
        let mut free: Vec<bool> = content.iter().map(|c| c.numeric).collect();
        let left = |free: &[bool]| free.iter().filter(|f| **f).count();
        let few = rows.len() < 8;
        if !few {
            // Directions of length 1 are normals.
            for at in 0..sample.len().saturating_sub(2) {
                if left(&free) >= 6
                    && free[at..at + 3].iter().all(|f| *f)
                    && are_units(&sample[at..at + 3])
                {
                    free[at..at + 3].fill(false);
                }
            }
            for (at, c) in content.iter().enumerate() {
                let clock = c.rises && c.extent() > 0.0 && c.low.abs() > CLOCK * c.extent();
                let larger = |other: &Content| c.extent() > ALIKE * other.extent();
                let long = c.rises
                    && content.iter().skip(at + 1).take(3).filter(|o| larger(o)).count() == 3;
                if (c.straight || clock || long) && left(&free) > 3 {
                    free[at] = false;
                }
            }
            let fractions = |at: usize| {
                content.get(at..at + 3).is_some_and(|three| {
                    three.iter().all(|c| c.numeric && !c.whole) && alike(three)
                })
            };
            let leading =
                content.iter().zip(&free).take_while(|(c, free)| c.whole || !**free).count();
            if (1..=3).contains(&leading)
                && fractions(leading)
                && free[leading..leading + 3].iter().all(|f| *f)
            {
                free[..leading].fill(false);
            }
        }
        let first = (0..free.len()).find(|&at| free.get(at..at + 3) == Some(&[true; 3]))?;
        let position = [first, first + 1, first + 2];
        let is_color = |at: usize, fits: fn(&Content) -> bool| {
            let three = content.get(at..at + 3)?;
            let apart = at + 3 <= first || at >= first + 3;
            let same = three.iter().all(fits);
            (apart && same).then_some([at, at + 1, at + 2])
        };
        let after = first + 3;
        let bytes =
            (after..after + 4).chain(0..first).find_map(|at| is_color(at, Content::is_byte));
        let shares = || {
            is_color(after, Content::is_share)
                .filter(|at| !few && !are_units(&sample[at[0]..=at[2]]))
        };
        let color = bytes.or_else(shares);
        Some(Self { position, color })
    }

    /// In words, with columns counted from 1.
    pub(super) fn words(&self) -> String {
        let list = |at: [usize; 3]| {
            let [a, b, c] = at.map(|k| k + 1);
            format!("{a}, {b}, {c}")
        };
        let color = self.color.map(|at| format!(" and {} a colour", list(at)));
        format!("columns {} are x, y, z{}", list(self.position), color.unwrap_or_default())
    }
}

/// Whether values grow with the rows' numbers as a straight line does, to a thousandth.
fn is_straight(values: &[f64], rows: &[usize]) -> bool {
    let ends = values.first().zip(values.last()).zip(rows.first().zip(rows.last()));
    let Some(((&v0, &v1), (&r0, &r1))) = ends.filter(|((v0, v1), _)| v0 < v1) else { return false };
    let line = |row: usize| v0 + (v1 - v0) * (row - r0) as f64 / (r1 - r0) as f64;
    let off = |(v, row): (&f64, &usize)| (v - line(*row)).abs();
    values.iter().zip(rows).map(off).all(|off| off < 1e-3 * (v1 - v0))
}

/// Whether three columns are directions of length 1.
fn are_units(three: &[Vec<f64>]) -> bool {
    let [a, b, c] = three else { return false };
    let mut lengths = a.iter().zip(b).zip(c).map(|((a, b), c)| (a * a + b * b + c * c).sqrt());
    let near = |length: f64| !length.is_finite() || length == 0.0 || (length - 1.0).abs() < 0.02;
    a.iter().any(|v| *v != 0.0) && lengths.all(near)
}

/// Whether columns have extents of one size.
fn alike(three: &[Content]) -> bool {
    let extents = three.iter().map(Content::extent);
    let most = extents.clone().fold(0.0, f64::max);
    extents.fold(f64::INFINITY, f64::min) * ALIKE > most
}

#[cfg(test)]
mod tests {
    use super::*;

    fn titles(text: &str, columns: usize) -> Titles {
        let names: Vec<String> = text.split(',').map(str::to_owned).collect();
        Titles::read(&names, columns)
    }

    fn at(position: [usize; 3], color: Option<[usize; 3]>) -> Titles {
        Titles::Understood(Columns { position, color })
    }

    #[test]
    fn titles_name_the_columns_in_any_order_case_and_spelling() {
        for (text, columns, want) in [
            ("y,x,z", 3, at([1, 0, 2], None)),
            ("Z,X,Y", 3, at([1, 2, 0], None)),
            ("X[m],Y[m],Z[m]", 3, at([0, 1, 2], None)),
            ("x_mm,y_mm,z_mm", 3, at([0, 1, 2], None)),
            ("North,East,Height", 3, at([1, 0, 2], None)),
            ("E,N,H,intensity", 4, at([0, 1, 2], None)),
            ("East,North,Z", 3, at([0, 1, 2], None)),
            ("Points:2,Points:0,Points:1", 3, at([1, 2, 0], None)),
            ("PosZ,PosY,PosX", 3, at([2, 1, 0], None)),
            ("id,x coordinate,y coordinate,z coordinate", 4, at([1, 2, 3], None)),
            ("X,Y,Z,Nx,Ny,Nz,R,G,B", 9, at([0, 1, 2], Some([6, 7, 8]))),
            ("Blue,Green,Red,x,y,z", 6, at([3, 4, 5], Some([2, 1, 0]))),
            ("time,rgb,x,y,z", 7, at([4, 5, 6], Some([1, 2, 3]))),
            ("x,y,z", 6, at([0, 1, 2], None)),
            ("Ost,Nord,Höhe", 3, at([0, 1, 2], None)),
        ] {
            assert_eq!(titles(text, columns), want, "{text}");
        }
    }

    #[test]
    fn titles_that_do_not_say_it_are_known_from_remarks() {
        for text in ["a,b,c", "lon,lat,height", "x,x,z", "u,v,w", "x,y,i"] {
            assert_eq!(titles(text, 3), Titles::NotUnderstood, "{text}");
        }
        assert_eq!(titles("x,y,z,i", 3), Titles::NotUnderstood, "a name too many");
        assert_eq!(titles("Exported by a scanner", 3), Titles::Remark);
    }
}
