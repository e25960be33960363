//! What the experiment is made on: specimen, plate, post and base, in metres.
//!
//! In: which experiment. Out: its [`Bench`], whose specimen and plate are those of the simulator
//! ([`Experiment`]) and whose stand is a choice of this kit: four or five printed parts, each on a
//! flat face without supports.

use crate::sim::Experiment;

/// Which experiment a kit is for.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Kind {
    /// A square of 300 mm on a plate of radius 50 mm, scanned: what `estimate` takes.
    Square,
    /// A disc of radius 150 mm on a plate of radius 90 mm, seen from above: what `calibrate` takes.
    Cusick,
}

impl Kind {
    /// The word in file names and flags.
    #[must_use]
    pub fn name(self) -> &'static str {
        match self {
            Self::Square => "square",
            Self::Cusick => "cusick",
        }
    }
}

/// Radius of the spigots that join the parts \[m\].
const SPIGOT_RADIUS_M: f64 = 6.0e-3;
/// By how much a hole is wider than its spigot, in the radius \[m\]: what a filament printer errs
/// by.
const FIT_M: f64 = 0.15e-3;
/// Depth of a socket, and how much shorter its spigot is \[m\].
const SOCKET_M: f64 = 8.3e-3;
const SHORTER_M: f64 = 0.3e-3;
/// Radius of the post \[m\]: thin against the plate, so that cloth may swing in under it.
const POST_RADIUS_M: f64 = 12.0e-3;
/// Length of a piece of the post \[m\]: any printer's height.
const POST_PIECE_M: f64 = 112.0e-3;
/// Radius and thickness of the base \[m\].
const BASE_M: [f64; 2] = [70.0e-3, 6.0e-3];
/// By how much the hole of the placement card is wider than the plate, in the radius \[m\].
const CARD_GAP_M: f64 = 1.0e-3;
/// By how much hanging cloth may be longer than the flat one \[-\], what `estimate` allows the rim
/// of a file.
const DEEPEST_STRETCH: f64 = 1.25;
/// Room left between the lowest cloth and the base \[m\].
const ROOM_M: f64 = 20.0e-3;

/// Specimen and stand \[m\].
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Bench {
    /// Which experiment.
    pub kind: Kind,
    /// Side of the square specimen, or diameter of the disc.
    pub specimen_m: f64,
    /// Radius of the plate.
    pub plate_radius_m: f64,
    /// Radius of the plate's rounded edge, half its thickness.
    pub edge_radius_m: f64,
    /// Radius of the spigots.
    pub spigot_radius_m: f64,
    /// Radius of the holes that take them.
    pub hole_radius_m: f64,
    /// Depth of the socket of a piece of the post.
    pub socket_m: f64,
    /// Length of the spigot that goes into it.
    pub spigot_m: f64,
    /// Radius of the post.
    pub post_radius_m: f64,
    /// Length of one piece of it, without spigot.
    pub post_piece_m: f64,
    /// Pieces of the post.
    pub post_pieces: usize,
    /// Radius of the base.
    pub base_radius_m: f64,
    /// Thickness of the base.
    pub base_m: f64,
    /// Radius of the hole of the placement card.
    pub card_hole_m: f64,
}

impl Bench {
    /// The bench of an experiment: specimen and plate are those that the simulator assumes.
    #[must_use]
    pub fn of(kind: Kind) -> Self {
        let (experiment, post_pieces) = match kind {
            Kind::Square => (Experiment::default(), 2),
            Kind::Cusick => (Experiment::standard_cusick(), 1),
        };
        let plate = experiment.plate;
        Self {
            kind,
            specimen_m: experiment.specimen.warp_m,
            plate_radius_m: plate.radius_m,
            edge_radius_m: plate.edge_radius_m,
            spigot_radius_m: SPIGOT_RADIUS_M,
            hole_radius_m: SPIGOT_RADIUS_M + FIT_M,
            socket_m: SOCKET_M,
            spigot_m: SOCKET_M - SHORTER_M,
            post_radius_m: POST_RADIUS_M,
            post_piece_m: POST_PIECE_M,
            post_pieces,
            base_radius_m: BASE_M[0],
            base_m: BASE_M[1],
            card_hole_m: plate.radius_m + CARD_GAP_M,
        }
    }

    /// Farthest that the flat specimen reaches from the plate's axis.
    #[must_use]
    pub fn reach_m(&self) -> f64 {
        match self.kind {
            Kind::Square => self.specimen_m * std::f64::consts::FRAC_1_SQRT_2,
            Kind::Cusick => 0.5 * self.specimen_m,
        }
    }

    /// How deep cloth that does not stretch hangs below the plate's top at most.
    #[must_use]
    pub fn hanging_m(&self) -> f64 {
        self.reach_m() - self.plate_radius_m
    }

    /// Height of the plate's top above the base's top that leaves limp cloth free.
    #[must_use]
    pub fn least_height_m(&self) -> f64 {
        DEEPEST_STRETCH * self.hanging_m() + ROOM_M
    }

    /// Height of the plate's top above the base's top.
    #[must_use]
    pub fn height_m(&self) -> f64 {
        self.post_pieces as f64 * self.post_piece_m + self.plate_m()
    }

    /// Height of the plate's top above the table.
    #[must_use]
    pub fn top_m(&self) -> f64 {
        self.base_m + self.height_m()
    }

    /// Thickness of the plate.
    #[must_use]
    pub fn plate_m(&self) -> f64 {
        2.0 * self.edge_radius_m
    }

    /// Depth of the blind hole in the plate's upper half, which is half as thick as the plate.
    #[must_use]
    pub fn blind_m(&self) -> f64 {
        0.5 * self.edge_radius_m
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn cloth_hangs_free_of_the_base() {
        for kind in [Kind::Square, Kind::Cusick] {
            let bench = Bench::of(kind);
            assert!(bench.height_m() >= bench.least_height_m(), "{bench:?}");
            // one piece less would not do: the stand is no higher than it needs to be
            let shorter = Bench { post_pieces: bench.post_pieces - 1, ..bench };
            assert!(shorter.height_m() < bench.least_height_m(), "{bench:?}");
        }
    }

    #[test]
    fn the_benches_are_those_of_the_documents() {
        let square = Bench::of(Kind::Square);
        let mm = |m: f64| (m * 1e6).round() / 1e3;
        assert_eq!([square.specimen_m, square.plate_radius_m].map(mm), [300.0, 50.0]);
        let cusick = Bench::of(Kind::Cusick);
        assert_eq!([cusick.specimen_m, cusick.plate_radius_m].map(mm), [300.0, 90.0]);
    }
}
