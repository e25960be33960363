//! The scenes of the virtual sensor that `scan2params-lab scan` knows by name: a sensor, where
//! it stands, and what the drape lies on.
//!
//! A name is a profile with parts behind it, each after an `@`, in any order:
//! `structured-light@post@below@views8`. [`Setup::PARTS`] lists them.

use scan2params::geom::Mesh;
use scan2params::sensor::{CameraPose, Profile, Ring, Scene, SceneError, Stand, VirtualScan, scan};

/// Most views of a setup: more only take time.
const MOST_VIEWS: usize = 200;
/// Views of `@below` if their number is not given.
const VIEWS_BELOW: usize = 30;
/// Radius of the table where `@floorN` puts one \[m\].
const TABLE_RADIUS_M: f64 = 0.30;
/// How far off the scanner's axis `@off` puts the specimen, in x and z \[m\].
const OFF_M: [f64; 2] = [0.045, -0.025];

/// A sensor, where it stands, and what the drape lies on.
#[derive(Clone, Debug)]
pub struct Setup {
    /// As the command line names it.
    pub name: String,
    /// The sensor's errors.
    pub profile: Profile,
    /// Where it stands.
    pub poses: Vec<CameraPose>,
    /// What the drape lies on.
    pub stand: Stand,
    /// Whether every pixel of every view counts, unfused.
    pub as_views: bool,
}

/// A name that is no setup.
#[derive(Clone, Debug, PartialEq, thiserror::Error)]
pub enum SetupError {
    /// No such profile.
    #[error("no sensor `{0}`: give one of {known}", known = Profile::ALL.map(|p| p.name).join(", "))]
    Profile(String),
    /// A part behind an `@` that means nothing.
    #[error("`@{part}` of `{name}` is unknown: behind a sensor may stand {known}", known = Setup::PARTS)]
    Part {
        /// The whole name.
        name: String,
        /// The part.
        part: String,
    },
    /// A part that contradicts one before it.
    #[error("`@{part}` of `{name}` contradicts what stands before it: give one of the two")]
    Twice {
        /// The whole name.
        name: String,
        /// The part.
        part: String,
    },
    /// A floor that would stand before the cameras.
    #[error(
        "`{name}`: views from below the floor see none of the drape; put the floor lower than \
         {lowest_mm:.0} mm (`@floorN`) or leave out `@below`"
    )]
    Floor {
        /// The whole name.
        name: String,
        /// Depth of the lowest camera under the plate's top \[mm\].
        lowest_mm: f64,
    },
}

/// What the parts of a name say, each at most once.
#[derive(Default)]
struct Parts {
    stand: Option<Stand>,
    thickness_m: Option<f64>,
    plate_radius_m: Option<f64>,
    floor_m: Option<f64>,
    views: Option<usize>,
    /// `@top` or `@below`.
    from: Option<Sight>,
    off: Option<()>,
    as_views: Option<()>,
}

#[derive(Clone, Copy, PartialEq, Eq)]
enum Sight {
    Top,
    Below,
}

impl Setup {
    /// The parts of a name, for help and errors.
    pub const PARTS: &'static str = "\
        @top (the view from above alone), @below (views from 40, 5 and -25 degrees, 30 if not said), \
        @viewsN (N views), @views (the depth images' pixels, unfused), @post (a plate 6 mm thick on a \
        thin post, no floor), @pedestal (a column nearly as wide as the plate), @thickN (a plate of N mm), \
        @plateN (a plate of N mm radius, for a drape simulated on one), @floorN (a floor N mm below the \
        plate, 0 for none), @off (the specimen 51 mm off the scanner's axis)";

    /// The setup of this name.
    ///
    /// # Errors
    /// When the profile or a part is unknown, or parts contradict each other.
    pub fn named(name: &str) -> Result<Self, SetupError> {
        let mut words = name.split('@');
        let profile = words.next().unwrap_or_default();
        let profile =
            Profile::named(profile).ok_or_else(|| SetupError::Profile(profile.to_owned()))?;
        let mut parts = Parts::default();
        for part in words {
            let owned = || (name.to_owned(), part.to_owned());
            match parts.take(part) {
                Taken::New => {}
                Taken::Twice => {
                    let (name, part) = owned();
                    return Err(SetupError::Twice { name, part });
                }
                Taken::Unknown => {
                    let (name, part) = owned();
                    return Err(SetupError::Part { name, part });
                }
            }
        }
        if let (Some(Sight::Top), Some(views)) = (parts.from, parts.views) {
            return Err(SetupError::Twice { name: name.to_owned(), part: format!("views{views}") });
        }
        let poses = parts.poses();
        let stand = parts.stand();
        let height_m = |pose: &CameraPose| pose.simulation_from_camera.translation.vector.y;
        let lowest_m = poses.iter().map(height_m).fold(f64::INFINITY, f64::min);
        if stand.floor_radius_m > 0.0 && lowest_m < stand.floor_y_m {
            let lowest_mm = -1e3 * lowest_m;
            return Err(SetupError::Floor { name: name.to_owned(), lowest_mm });
        }
        let as_views = parts.as_views.is_some();
        Ok(Self { name: name.to_owned(), profile, poses, stand, as_views })
    }

    /// A virtual scan of `drape` \[m\].
    ///
    /// # Errors
    /// When the mesh makes no scene.
    pub fn scan(&self, drape: &Mesh, seed: u64) -> Result<VirtualScan, SceneError> {
        let scene = Scene::on(drape.clone(), self.stand);
        let mut made = scan(&scene, &self.poses, &self.profile, seed)?;
        if self.as_views {
            made.cloud = made.unfused();
        }
        Ok(made)
    }
}

enum Taken {
    New,
    Twice,
    Unknown,
}

impl Parts {
    fn take(&mut self, part: &str) -> Taken {
        fn put<T>(place: &mut Option<T>, value: T) -> Taken {
            if place.replace(value).is_some() { Taken::Twice } else { Taken::New }
        }
        // Millimetres behind a word, in these limits.
        let number = |word: &str, low: f64, high: f64| -> Option<f64> {
            let value: f64 = part.strip_prefix(word)?.parse().ok()?;
            (low..=high).contains(&value).then_some(value)
        };
        match part {
            "top" => return put(&mut self.from, Sight::Top),
            "below" => return put(&mut self.from, Sight::Below),
            "views" => return put(&mut self.as_views, ()),
            "post" => return put(&mut self.stand, Stand::POST),
            "pedestal" => return put(&mut self.stand, Stand::PEDESTAL),
            "off" => return put(&mut self.off, ()),
            _ => {}
        }
        let count = part.strip_prefix("views").and_then(|n| n.parse().ok());
        if let Some(count) = count.filter(|count| (1..=MOST_VIEWS).contains(count)) {
            return put(&mut self.views, count);
        }
        if let Some(mm) = number("thick", 0.5, 50.0) {
            return put(&mut self.thickness_m, 1e-3 * mm);
        }
        if let Some(mm) = number("plate", 10.0, 140.0) {
            return put(&mut self.plate_radius_m, 1e-3 * mm);
        }
        if let Some(mm) = number("floor", 0.0, 2000.0) {
            return put(&mut self.floor_m, 1e-3 * mm);
        }
        Taken::Unknown
    }

    fn poses(&self) -> Vec<CameraPose> {
        let mut ring = match self.from {
            Some(Sight::Top) => Ring { elevations_rad: Vec::new(), ..Ring::default() },
            Some(Sight::Below) => Ring::from_below(VIEWS_BELOW),
            None => Ring::default(),
        };
        if let Some(views) = self.views {
            ring.views = views - usize::from(ring.from_top);
        }
        if self.off.is_some() {
            [ring.target_m[0], ring.target_m[2]] = OFF_M;
        }
        ring.poses()
    }

    /// Views from below have no floor between them and the drape if none is given.
    fn stand(&self) -> Stand {
        let mut stand = self.stand.unwrap_or(Stand::MODIFIED_CUSICK);
        let without_floor = Stand { floor_y_m: -0.6, floor_radius_m: 0.0, ..stand };
        if self.from == Some(Sight::Below) || self.floor_m == Some(0.0) {
            stand = without_floor;
        }
        if let Some(depth_m) = self.floor_m.filter(|depth_m| *depth_m > 0.0) {
            stand = Stand { floor_y_m: -depth_m, floor_radius_m: TABLE_RADIUS_M, ..stand };
        }
        stand.plate_thickness_m = self.thickness_m.unwrap_or(stand.plate_thickness_m);
        stand.plate_radius_m = self.plate_radius_m.unwrap_or(stand.plate_radius_m);
        stand.pedestal_radius_m = stand.pedestal_radius_m.min(stand.plate_radius_m);
        stand
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use scan2params::sensor::default_ring;

    #[test]
    fn setups_have_names() {
        let named = |name| Setup::named(name).unwrap();
        assert_eq!(named("consumer").poses, default_ring());
        assert_eq!(named("structured-light@top").poses.len(), 1);
        assert!(named("consumer@views").as_views);
        assert!(!named("consumer").as_views);
        assert_eq!(named("consumer@views8").poses.len(), 8);
        assert_eq!(named("consumer@views8@below").poses.len(), 8);
        assert_eq!(named("truedepth@below").poses.len(), 30);
        assert_eq!(named("truedepth@post").stand, Stand::POST);
        assert_eq!(named("truedepth@thick8@post").stand.plate_thickness_m, 8e-3);
        assert_eq!(named("truedepth@floor180").stand.floor_y_m, -0.18);
        assert_eq!(named("truedepth@floor0").stand.floor_radius_m, 0.0);
        assert_eq!(named("truedepth@below@pedestal").stand.floor_radius_m, 0.0);
        let y = |pose: &CameraPose| pose.simulation_from_camera.translation.vector.y;
        assert!(named("truedepth@below").poses.iter().any(|pose| y(pose) < -0.2));
        let off = named("truedepth@off").poses[10].simulation_from_camera.translation.vector;
        assert!((off.x - OFF_M[0]).abs() < 1e-12 && (off.z - OFF_M[1]).abs() < 1e-12);
    }

    #[test]
    fn what_is_no_setup_is_refused_with_the_part_that_is_wrong() {
        let refused = |name: &str| Setup::named(name).map(|s| s.name).unwrap_err().to_string();
        assert!(refused("sonar").contains("no sensor `sonar`"));
        assert!(refused("consumer@left").contains("`@left` of `consumer@left` is unknown"));
        assert!(refused("consumer@views0").contains("`@views0`"));
        assert!(refused("consumer@thick").contains("`@thick`"));
        assert!(refused("consumer@post@pedestal").contains("`@pedestal`"));
        assert!(refused("consumer@top@below").contains("contradicts"));
        assert!(refused("consumer@below@floor200").contains("lower than 260 mm"));
    }
}
