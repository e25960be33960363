//! A depth camera's intrinsics, from the files that sensors' programs write.
//!
//! | file | read from it |
//! |---|---|
//! | JSON of Open3D | `width`, `height`, `intrinsic_matrix` (by columns; also in `intrinsic`) |
//! | JSON with `fx`, `fy`, `cx`, `cy` | these (`ppx`, `ppy` too), if there size and distortion |
//! | YAML of ROS `camera_info` | `image_width`, `camera_matrix` or `K`, a distortion |
//! | text of nine numbers | a 3 x 3 matrix, row by row |
//!
//! The size is `width` and `height`. The distortion is `model` and `coeffs` (RealSense), or `k1`,
//! `k2`, `p1`, `p2`, `k3` (Polycam and others), or in ROS's YAML `distortion_model` with
//! `distortion_coefficients` or `D`.
//!
//! Pixels: the centre of the first pixel has the coordinates (0, 0), x right, y down.
//! Distortion: none, or Brown and Conrady's five coefficients k1, k2, p1, p2, k3
//! (`plumb_bob`, `brown_conrady`); any other model is refused unless its coefficients
//! are all 0, and fisheye models even then: theirs is no pinhole at 0 either.

use std::path::Path;

use serde::Serialize;
use serde_json::Value;

use super::bytes::{regular_file, text_bytes};
use super::error::shown;
use super::tokens::{number, words};
use super::{At, Fault, ReadError, distortion};

/// More bytes than this, and the file is no camera's.
const MOST_BYTES: usize = 1 << 20;

/// How far from its pixel a ray may land when it is distorted again \[pixels\]; fixed
/// points that are found land within 1e-6.
const LARGEST_RAY_ERROR_PX: f64 = 0.05;

/// A pinhole with distortion.
#[derive(Clone, Copy, Debug, PartialEq, Serialize)]
#[cfg_attr(test, derive(schemars::JsonSchema))]
pub struct Intrinsics {
    /// Columns and rows of the image they hold for \[pixels\]; `None` for any.
    pub size_px: Option<[usize; 2]>,
    /// Focal lengths in x and y \[pixels\].
    pub focal_px: [f64; 2],
    /// Principal point, x and y \[pixels\].
    pub centre_px: [f64; 2],
    /// k1, k2, p1, p2, k3 of Brown and Conrady \[-\]; zeros for none.
    pub distortion: [f64; 5],
}

impl Intrinsics {
    /// Without distortion, for an image of any size.
    ///
    /// # Errors
    /// What is wrong: focal lengths that are not positive, numbers that are not finite.
    pub fn pinhole(focal_px: [f64; 2], centre_px: [f64; 2]) -> Result<Self, String> {
        let all = Self { size_px: None, focal_px, centre_px, distortion: [0.0; 5] };
        all.fault().map_or(Ok(all), Err)
    }

    fn fault(&self) -> Option<String> {
        let [fx, fy] = self.focal_px;
        let finite = self.focal_px.iter().chain(&self.centre_px).chain(&self.distortion);
        if !(fx > 0.0 && fy > 0.0) {
            Some(format!("focal lengths are {fx} and {fy} pixels; they must be positive"))
        } else if !finite.into_iter().all(|v| v.is_finite()) {
            Some("an intrinsic is not a finite number".to_owned())
        } else if self.size_px.is_some_and(|[w, h]| w == 0 || h == 0) {
            Some("the image has no pixels".to_owned())
        } else {
            None
        }
    }

    /// For an image of `size_px`: scaled from the size that they hold for.
    ///
    /// # Errors
    /// Text for a message, when the two sizes have different shapes, or the distortion
    /// cannot be undone.
    pub(super) fn at_size(&self, size_px: [usize; 2]) -> Result<Self, String> {
        let Some(own) = self.size_px else {
            self.check_centre(size_px)?;
            self.check_distortion(size_px)?;
            return Ok(*self);
        };
        let [sx, sy] = [0, 1].map(|axis| size_px[axis] as f64 / own[axis] as f64);
        if (sx / sy - 1.0).abs() > 0.01 {
            return Err(format!(
                "the image has {} x {} pixels, the intrinsics are for {} x {}: not the same camera; \
                 give those of the depth image",
                size_px[0], size_px[1], own[0], own[1]
            ));
        }
        let centre = |axis: usize, s: f64| (self.centre_px[axis] + 0.5) * s - 0.5;
        let scaled = Self {
            size_px: Some(size_px),
            focal_px: [self.focal_px[0] * sx, self.focal_px[1] * sy],
            centre_px: [centre(0, sx), centre(1, sy)],
            distortion: self.distortion,
        };
        scaled.check_centre(size_px)?;
        scaled.check_distortion(size_px)?;
        Ok(scaled)
    }

    /// Refuses a principal point that cannot be of an image of this size.
    fn check_centre(&self, size_px: [usize; 2]) -> Result<(), String> {
        /// A principal point nearer to the border than this share of the image is of another image.
        const BORDER: f64 = 0.05;
        /// So far from the middle, by the same share along both axes, is that of another
        /// resolution.
        const OFF_MIDDLE: f64 = 0.12;
        const SAME: f64 = 0.02;
        let [x, y] = [0, 1].map(|axis| (self.centre_px[axis] + 0.5) / size_px[axis] as f64);
        let outside = [x, y].iter().any(|share| !(BORDER..=1.0 - BORDER).contains(share));
        let scaled = (x - y).abs() < SAME && (x - 0.5).abs() > OFF_MIDDLE;
        if !outside && !scaled {
            return Ok(());
        }
        let [width, height] = size_px;
        let [cx, cy] = self.centre_px;
        let what = if scaled {
            let [own_x, own_y] = [2.0 * cx + 1.0, 2.0 * cy + 1.0];
            format!("the intrinsics seem to be of an image of about {own_x:.0} x {own_y:.0}")
        } else {
            "the intrinsics are of another image".to_owned()
        };
        Err(format!(
            "the principal point ({cx:.1}, {cy:.1}) is not that of an image of {width} x {height} pixels: {what}; \
             give those of the depth image, or add their width and height"
        ))
    }

    /// The ray of a pixel: x and y where z is 1, distortion undone.
    #[must_use]
    pub fn ray(&self, column: f64, row: f64) -> [f64; 2] {
        let seen = [
            (column - self.centre_px[0]) / self.focal_px[0],
            (row - self.centre_px[1]) / self.focal_px[1],
        ];
        if self.distortion == [0.0; 5] { seen } else { self.undistorted(seen) }
    }

    /// Solves seen = distorted(x, y) by the fixed point of Brown and Conrady's model;
    /// 20 rounds leave less than 1e-9 at the distortions of depth cameras.
    fn undistorted(&self, seen: [f64; 2]) -> [f64; 2] {
        let mut ray = seen;
        for _ in 0..20 {
            let (radial, [dx, dy]) = self.distortion_at(ray);
            ray = [(seen[0] - dx) / radial, (seen[1] - dy) / radial];
        }
        ray
    }

    /// Radial factor and tangential shift of a ray.
    fn distortion_at(&self, [x, y]: [f64; 2]) -> (f64, [f64; 2]) {
        let [k1, k2, p1, p2, k3] = self.distortion;
        let r2 = x * x + y * y;
        let radial = 1.0 + r2 * (k1 + r2 * (k2 + r2 * k3));
        let dx = 2.0 * p1 * x * y + p2 * (r2 + 2.0 * x * x);
        let dy = p1 * (r2 + 2.0 * y * y) + 2.0 * p2 * x * y;
        (radial, [dx, dy])
    }

    /// How far the ray of a pixel, distorted again, lands from it \[pixels\]: large where
    /// the distortion has no inverse.
    fn ray_error_px(&self, column: f64, row: f64) -> f64 {
        let [x, y] = self.ray(column, row);
        let (radial, [dx, dy]) = self.distortion_at([x, y]);
        let again = [
            (x * radial + dx) * self.focal_px[0] + self.centre_px[0],
            (y * radial + dy) * self.focal_px[1] + self.centre_px[1],
        ];
        (again[0] - column).hypot(again[1] - row)
    }

    /// Refuses a distortion that cannot be undone in an image of `size_px`: coefficients
    /// of another camera, unit or order.
    fn check_distortion(&self, size_px: [usize; 2]) -> Result<(), String> {
        let [right, bottom] = size_px.map(|side| side.saturating_sub(1) as f64);
        let border = [0.0, 0.25, 0.5, 0.75, 1.0].into_iter().flat_map(|part| {
            let (x, y) = (part * right, part * bottom);
            [[x, 0.0], [x, bottom], [0.0, y], [right, y]]
        });
        for [column, row] in border {
            let error = self.ray_error_px(column, row);
            if error.is_nan() || error > LARGEST_RAY_ERROR_PX {
                return Err(format!(
                    "the distortion {:?} cannot be undone at pixel ({column:.0}, {row:.0}): off by \
                     {error:.2} pixels; give the coefficients of the depth camera as k1, k2, p1, p2, \
                     k3, or undistort the images first",
                    self.distortion
                ));
            }
        }
        Ok(())
    }
}

/// Reads a camera's file.
///
/// # Errors
/// A file that cannot be read, none of the forms above, an unknown distortion.
pub fn read(path: impl AsRef<Path>) -> Result<Intrinsics, ReadError> {
    let path = path.as_ref();
    let length = std::fs::metadata(path).map_or(0, |meta| meta.len());
    let bytes = if length > MOST_BYTES as u64 { Err(too_long()) } else { regular_file(path) };
    bytes.and_then(|bytes| parse(&bytes)).map_err(|at| at.in_file(path))
}

/// Reads a camera's file from its bytes; for fuzzing.
///
/// # Errors
/// As [`read`]; the path in the error is `bytes`.
#[doc(hidden)]
pub fn read_bytes(bytes: &[u8]) -> Result<Intrinsics, ReadError> {
    parse(bytes).map_err(|at| at.in_file(Path::new("bytes")))
}

fn parse(bytes: &[u8]) -> Result<Intrinsics, At> {
    let layout = |fault: String| Fault::Layout(fault).anywhere();
    let text = text_bytes(bytes)?;
    let Ok(text) = std::str::from_utf8(&text) else {
        return Err(layout("no text; give intrinsics as JSON, YAML or nine numbers".to_owned()));
    };
    if text.len() > MOST_BYTES {
        return Err(too_long());
    }
    let found = if text.trim_start().starts_with('{') {
        of_json(text)
    } else if let Some(nine) = nine_numbers(text) {
        of_matrix(&nine, None)
    } else {
        of_yaml(text)
    };
    let found = found.map_err(layout)?;
    found.fault().map_or(Ok(found), |fault| Err(layout(fault)))
}

fn too_long() -> At {
    let fault = "too long for a camera's file; give intrinsics as JSON, YAML or nine numbers";
    Fault::Layout(fault.to_owned()).anywhere()
}

/// Reads intrinsics from a JSON value of either form.
///
/// # Errors
/// Text for a message.
pub(super) fn of_value(value: &Value) -> Result<Intrinsics, String> {
    let whole = value;
    let value = whole.get("intrinsic").unwrap_or(whole);
    let field = |key: &str| value.get(key).and_then(Value::as_f64);
    let size_px = match (field("width"), field("height")) {
        (Some(w), Some(h)) => Some([pixels(w)?, pixels(h)?]),
        _ => None,
    };
    // Beside the matrix, or around it.
    let distortion = match distortion::of_json(value)? {
        [0.0, 0.0, 0.0, 0.0, 0.0] => distortion::of_json(whole)?,
        found => found,
    };
    let found = if let Some(matrix) = value.get("intrinsic_matrix") {
        let cells = matrix.as_array().map(Vec::as_slice).unwrap_or_default();
        // Nine numbers in a row, or three rows of three.
        let flat: Vec<&Value> = cells
            .iter()
            .flat_map(|cell| cell.as_array().map_or(std::slice::from_ref(cell), Vec::as_slice))
            .collect();
        let nine: Vec<f64> = flat.iter().filter_map(|cell| cell.as_f64()).collect();
        of_matrix(&nine, size_px)?
    } else {
        let either = |keys: [&str; 2]| keys.into_iter().find_map(field);
        let (Some(fx), Some(fy), Some(cx), Some(cy)) =
            (field("fx"), field("fy"), either(["cx", "ppx"]), either(["cy", "ppy"]))
        else {
            return Err(
                "neither `intrinsic_matrix` nor `fx`, `fy`, `cx`, `cy`; give the intrinsics \
                        of the depth camera"
                    .to_owned(),
            );
        };
        let [focal_px, centre_px] = [[fx, fy], [cx, cy]];
        Intrinsics { size_px, focal_px, centre_px, distortion: [0.0; 5] }
    };
    let found = Intrinsics { distortion, ..found };
    found.fault().map_or(Ok(found), Err)
}

fn of_json(text: &str) -> Result<Intrinsics, String> {
    let value: Value = serde_json::from_str(text).map_err(|e| format!("not JSON ({e})"))?;
    of_value(&value)
}

fn pixels(value: f64) -> Result<usize, String> {
    if (1.0..=65_535.0).contains(&value) && value.fract() == 0.0 {
        return Ok(value as usize);
    }
    Err(format!("an image side of {value} pixels; give 1 to 65535"))
}

fn nine_numbers(text: &str) -> Option<[f64; 9]> {
    let numbers: Option<Vec<f64>> = words(text.as_bytes()).take(10).map(number).collect();
    numbers?.try_into().ok()
}

/// A 3 x 3 matrix row by row, or column by column (Open3D): only one of both has
/// its last row or column right.
fn of_matrix(nine: &[f64], size_px: Option<[usize; 2]>) -> Result<Intrinsics, String> {
    let (focal_px, centre_px, skew) = match *nine {
        [fx, skew, cx, 0.0, fy, cy, 0.0, 0.0, 1.0] | [fx, 0.0, 0.0, skew, fy, 0.0, cx, cy, 1.0] => {
            ([fx, fy], [cx, cy], skew)
        }
        _ => {
            return Err(format!(
                "the intrinsic matrix is {nine:?}; it must be fx 0 cx, 0 fy cy, 0 0 1, by rows or \
                 by columns"
            ));
        }
    };
    if skew != 0.0 {
        return Err(format!("the intrinsic matrix has a skew of {skew}; rectify the images first"));
    }
    Ok(Intrinsics { size_px, focal_px, centre_px, distortion: [0.0; 5] })
}

/// ROS `camera_info`, as camera_calibration saves it and `topic echo` prints it.
fn of_yaml(text: &str) -> Result<Intrinsics, String> {
    let entries = yaml_entries(text);
    let value = |paths: &[&str]| {
        entries.iter().find(|(path, text)| paths.contains(&path.as_str()) && !text.is_empty())
    };
    let numbers = |paths: &[&str]| -> Option<Vec<f64>> {
        let (_, text) = value(paths)?;
        let parts = text.split([',', '[', ']', ' ', '\n']).filter(|part| !part.is_empty());
        parts.map(|part| number(part.as_bytes())).collect()
    };
    let side = |paths: &[&str]| numbers(paths).and_then(|v| v.first().copied());
    let size_px = match (side(&["image_width", "width"]), side(&["image_height", "height"])) {
        (Some(w), Some(h)) => Some([pixels(w)?, pixels(h)?]),
        _ => None,
    };
    let Some(matrix) = numbers(&["camera_matrix.data", "camera_matrix", "K", "k"]) else {
        let head = shown(text.trim().as_bytes());
        return Err(format!(
            "no intrinsics found in `{head}`; give Open3D's JSON, ROS camera_info YAML with \
             `camera_matrix` or `K`, or nine numbers"
        ));
    };
    let mut found = of_matrix(&matrix, size_px)?;
    let distortion =
        numbers(&["distortion_coefficients.data", "distortion_coefficients", "D", "d"]);
    let model = value(&["distortion_model"]).map_or("", |(_, text)| text.as_str());
    found.distortion = distortion::brown_conrady(model, &distortion.unwrap_or_default())?;
    Ok(found)
}

/// Keys (`outer.inner`, two levels) and their text, for the little YAML that ROS
/// writes: `key: value`, flow lists over several lines, block lists of numbers.
fn yaml_entries(text: &str) -> Vec<(String, String)> {
    let mut entries: Vec<(String, String)> = Vec::new();
    let mut outer = String::new();
    let mut documents = 0;
    for line in text.lines() {
        let line = line.split(" #").next().unwrap_or_default();
        let trimmed = line.trim();
        if trimmed == "---" {
            documents += 1;
            if documents > 1 || !entries.is_empty() {
                break;
            }
        } else if trimmed.is_empty() || trimmed.starts_with(['#', '%']) {
        } else if let Some(item) = trimmed.strip_prefix("- ") {
            if let Some((_, value)) = entries.last_mut() {
                *value += &format!(" {item}");
            }
        } else if let Some((key, value)) = trimmed.split_once(':') {
            let nested = line.starts_with([' ', '\t']);
            let path = if nested { format!("{outer}.{key}") } else { key.to_owned() };
            if !nested {
                key.clone_into(&mut outer);
            }
            entries.push((path, value.trim().to_owned()));
        } else if let Some((_, value)) = entries.last_mut() {
            *value += &format!(" {trimmed}");
        }
    }
    entries
}

#[cfg(test)]
mod tests {
    use super::*;

    fn want(size_px: Option<[usize; 2]>) -> Intrinsics {
        let [focal_px, centre_px] = [[585.0, 586.5], [320.0, 240.0]];
        Intrinsics { size_px, focal_px, centre_px, distortion: [0.0; 5] }
    }

    fn fault(text: &str) -> String {
        read_bytes(text.as_bytes()).unwrap_err().to_string()
    }

    #[test]
    fn every_form_gives_the_same_camera() {
        let sized = want(Some([640, 480]));
        let nine = "585 0 320 0 586.5 240 0 0 1";
        let flow = "[585, 0, 320,\n   0, 586.5, 240,\n   0., 0., 1.]";
        let block = nine.replace(' ', "\n- ");
        for (text, want) in [
            (format!(" {}\n", nine.replace(" 0 5", "\t\r\n 0\t5")), want(None)),
            (r#"{"width":640,"height":480,"intrinsic_matrix":[585,0,0,0,586.5,0,320,240,1]}"#.into(), sized),
            (r#"{"intrinsic":{"width":640,"height":480,"intrinsic_matrix":[[585,0,320],[0,586.5,240],[0,0,1]]},"extrinsic":[]}"#.into(), sized),
            (r#"{"fx":585,"fy":586.5,"cx":320,"cy":240,"t_00":1}"#.into(), want(None)),
            (r#"{"width":640,"height":480,"fx":585,"fy":586.5,"ppx":320,"ppy":240}"#.into(), sized),
            (format!("%YAML:1.0\n---\nimage_width: 640\nimage_height: 480\ncamera_name: depth\ncamera_matrix:\n  rows: 3\n  cols: 3\n  data: {flow}\ndistortion_model: plumb_bob\ndistortion_coefficients:\n  rows: 1\n  cols: 5\n  data: [0, 0, 0, 0, 0]\n"), sized),
            (format!("header: \n  seq: 1\nheight: 480\nwidth: 640\ndistortion_model: \"rational_polynomial\"\nD: [0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0]\nK: {flow}\n---\nK: [1]\n"), sized),
            (format!("height: 480\nwidth: 640\nd: []\nk:\n- {block}\nr:\n- 1.0\n"), sized),
        ] {
            assert_eq!(read_bytes(text.as_bytes()).unwrap(), want, "{text}");
        }
    }

    #[test]
    fn what_is_no_camera_is_refused() {
        for (text, part) in [
            ("", "no intrinsics found"),
            ("{}", "neither `intrinsic_matrix`"),
            ("{\"fx\":", "not JSON"),
            ("1 2 3 4 5 6 7 8 9", "the intrinsic matrix is"),
            ("585 2 320 0 585 240 0 0 1", "skew of 2"),
            ("-585 0 320 0 585 240 0 0 1", "must be positive"),
            (r#"{"width":0,"height":480,"fx":585,"fy":585,"cx":320,"cy":240}"#, "0 pixels"),
            (
                "K: [585, 0, 320, 0, 585, 240, 0, 0, 1]\ndistortion_model: equidistant\nD: [0.1, 0, 0, 0]\n",
                "`equidistant`",
            ),
            (
                "K: [585, 0, 320, 0, 585, 240, 0, 0, 1]\nD: [0.1, 0, 0, 0, 0, 0, 0, 1]\n",
                "8 coefficients",
            ),
            ("solid cube\n", "`solid cube`"),
        ] {
            let said = fault(text);
            assert!(said.contains(part), "{said:?} lacks {part:?}");
        }
    }

    #[test]
    fn distortion_of_five_coefficients_is_read_whatever_the_model_is_called() {
        let head = "K: [585, 0, 320, 0, 585, 240, 0, 0, 1]\ndistortion_model: ";
        for tail in [
            "plumb_bob\nD: [0.1, -0.2, 0.01, 0.02, 0.3]\n",
            "rational_polynomial\nD: [0.1, -0.2, 0.01, 0.02, 0.3, 0.0, 0.0, 0.0]\n",
            "plumb_bob\nd:\n- 0.1\n- -0.2\n- 0.01\n- 0.02\n- 0.3\n",
        ] {
            let camera = read_bytes(format!("{head}{tail}").as_bytes()).unwrap();
            assert_eq!(camera.distortion, [0.1, -0.2, 0.01, 0.02, 0.3], "{tail}");
        }
    }

    #[test]
    fn distortion_in_json_is_read_or_refused_and_never_dropped() {
        let json = |rest: &str| {
            let text = format!(r#"{{"fx":585,"fy":585,"ppx":320,"ppy":240{rest}}}"#);
            read_bytes(text.as_bytes()).map(|camera| camera.distortion).map_err(|e| e.to_string())
        };
        let given = [0.1, -0.2, 0.01, 0.02, 0.3];
        for rest in [
            r#","model":"Brown Conrady","coeffs":[0.1,-0.2,0.01,0.02,0.3]"#,
            r#","model":"distortion.brown_conrady","coeffs":[0.1,-0.2,0.01,0.02,0.3]"#,
            r#","coeffs":[0.1,-0.2,0.01,0.02,0.3]"#,
            r#","distortion_model":"plumb_bob","D":[0.1,-0.2,0.01,0.02,0.3,0,0,0]"#,
            r#","k1":0.1,"k2":-0.2,"p1":0.01,"p2":0.02,"k3":0.3"#,
        ] {
            assert_eq!(json(rest), Ok(given), "{rest}");
        }
        for rest in [
            "",
            r#","model":"Inverse Brown Conrady","coeffs":[0,0,0,0,0]"#,
            r#","model":4,"coeffs":[0.0,0.0,0.0,0.0,0.0]"#,
            r#","coeffs":[]"#,
            r#","distortion":null"#,
        ] {
            assert_eq!(json(rest), Ok([0.0; 5]), "{rest}");
        }
        for (rest, part) in [
            (
                r#","model":"Inverse Brown Conrady","coeffs":[0.1,0,0,0,0]"#,
                "`Inverse Brown Conrady`",
            ),
            (r#","model":2,"coeffs":[0.1,0,0,0,0]"#, "`2` with 5"),
            (r#","model":"Kannala Brandt4","coeffs":[0,0,0,0,0]"#, "`Kannala Brandt4`"),
            (r#","coeffs":[0.1,0,0,0,0,0,0,0.2]"#, "8 coefficients"),
            (r#","coeffs":[0.1]"#, "1 coefficients"),
            (r#","coeffs":"0.1 0 0 0 0""#, "`coeffs` is no list"),
            (r#","distortion":{"k1":0.1}"#, "`distortion` is no list"),
            (r#","k1":0.1,"k6":0.2"#, "8 coefficients"),
        ] {
            let said = json(rest).unwrap_err();
            assert!(said.contains(part), "{said:?} lacks {part:?}");
        }
    }

    #[test]
    fn a_distortion_without_an_inverse_is_refused() {
        let with = |distortion| Intrinsics { distortion, ..want(None) };
        // Depth cameras: a tablet's, a structured-light sensor's, none.
        for sound in [[0.12, -0.25, 1e-3, -5e-4, 0.08], [-0.28, 0.07, 0.0, 0.0, 0.0], [0.0; 5]] {
            let camera = with(sound).at_size([640, 480]).unwrap();
            let errors = [[0.0, 0.0], [639.0, 479.0], [320.0, 1.0]]
                .map(|[column, row]| camera.ray_error_px(column, row));
            assert!(errors.iter().all(|&error| error < 1e-6), "{sound:?}: {errors:?}");
        }
        // A barrel so strong that the image folds over inside the border.
        for folded in [[-3.0, 0.0, 0.0, 0.0, 0.0], [0.0, 0.0, 0.0, 0.0, -40.0]] {
            let said = with(folded).at_size([640, 480]).unwrap_err();
            assert!(said.contains("cannot be undone at pixel"), "{said}");
        }
    }

    #[test]
    fn another_size_scales_and_another_shape_is_refused() {
        let whole = want(Some([640, 480]));
        let half = whole.at_size([320, 240]).unwrap();
        // The same direction at the same place of the picture.
        let [a, b] = [whole.ray(-0.5, 479.5), half.ray(-0.5, 239.5)];
        assert!((a[0] - b[0]).abs() < 1e-12 && (a[1] - b[1]).abs() < 1e-12);
        assert!(whole.at_size([640, 360]).unwrap_err().contains("not the same camera"));
        assert_eq!(want(None).at_size([600, 500]), Ok(want(None)));
    }

    #[test]
    fn undistortion_inverts_the_model() {
        let distortion = [0.12, -0.25, 1e-3, -5e-4, 0.08];
        let camera = Intrinsics { distortion, ..want(None) };
        let [k1, k2, p1, p2, k3] = distortion;
        for (x, y) in [(0.0, 0.0), (0.3, -0.2), (-0.5, 0.4)] {
            let r2 = x * x + y * y;
            let radial = 1.0 + k1 * r2 + k2 * r2 * r2 + k3 * r2 * r2 * r2;
            let seen = [
                x * radial + 2.0 * p1 * x * y + p2 * (r2 + 2.0 * x * x),
                y * radial + p1 * (r2 + 2.0 * y * y) + 2.0 * p2 * x * y,
            ];
            let ray = camera.ray(320.0 + 585.0 * seen[0], 240.0 + 586.5 * seen[1]);
            assert!((ray[0] - x).abs() < 1e-9 && (ray[1] - y).abs() < 1e-9, "{ray:?}");
        }
    }
}
