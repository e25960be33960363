//! Figures that one stage measures and `limits` judges.

/// What a mark tells.
#[derive(Clone, Copy, Debug)]
pub(super) enum Marking {
    /// The scan has no colours on the plate.
    NoColors,
    /// The cloth is of the mark's colour; its shares of red, green and blue in percent.
    LikeCloth {
        /// Shares in percent.
        cloth_percent: [u8; 3],
    },
    /// The side with most of the mark's points.
    Side(MarkedSide),
}

/// The side of the square that a mark's points tell.
#[derive(Clone, Copy, Debug)]
pub(super) struct MarkedSide {
    /// Points that have the mark's colour.
    pub points: usize,
    /// Share of them that lie towards the side that has most.
    pub share: f64,
    /// Angle between their middle and the middle of that side, seen from the specimen's
    /// centre \[degrees\].
    pub off_deg: f64,
    /// Bearing of their middle in the parameter plane \[degrees\].
    pub middle_bearing_deg: f64,
    /// Bearing of that side in the parameter plane \[degrees\].
    pub side_bearing_deg: f64,
}

/// The size of what was scanned.
#[derive(Clone, Copy, Debug)]
pub(super) struct MeasuredSize {
    /// Side of the square that the flattened cloth makes \[m\].
    pub side_m: f64,
    /// Radius at which the cloth leaves the plate \[m\].
    pub plate_radius_m: f64,
    /// Noise of single points \[m\]: it makes the square larger.
    pub noise_m: f64,
}

/// How far the surface points lie off the sheet.
#[derive(Clone, Copy, Debug)]
pub(super) struct Misfit {
    /// Root mean square distance \[m\].
    pub rms_m: f64,
    /// The same over the plate, where the cloth is smooth: what the scan's noise leaves of
    /// itself on the smoothed surface. Little of white noise remains, and most of a noise that
    /// is smooth over several points \[m\].
    pub on_plate_m: f64,
    /// The same of a typical point, robustly \[m\].
    pub typical_m: f64,
    /// Share of the sheet's places that hold half of the squared distances.
    pub half_share: f64,
    /// Where it is largest, bearing in the parameter plane \[degrees\].
    pub worst_bearing_deg: f64,
    /// Median over the sheet of its larger principal strain \[-\]: cloth hardly stretches, and what
    /// cannot be laid flat makes the sheet stretch.
    pub strain: f64,
}

/// How far the scanned points scatter across the sheet, robustly, as a standard deviation.
#[derive(Clone, Copy, Debug)]
pub(super) struct Scatter {
    /// Over the plate: the sensor's noise. Passes that miss each other sideways meet there \[m\].
    pub on_plate_m: f64,
    /// Over the hanging cloth, the upper quartile over its places \[m\].
    pub hanging_m: f64,
}
