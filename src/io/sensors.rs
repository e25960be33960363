//! What the depth images of well-known sources hold, by name.

/// The unit of a source's 16-bit depth images.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct DepthSource {
    /// Name, as the command line takes it.
    pub name: &'static str,
    /// Units of depth in a metre.
    pub units_per_metre: f64,
    /// What it is, and where the number is from.
    pub source: &'static str,
}

impl DepthSource {
    /// Every named source.
    pub const ALL: [Self; 5] = [
        Self {
            name: "d4xx",
            units_per_metre: 1000.0,
            source: "RealSense D400 series; SDK: RS2_OPTION_DEPTH_UNITS is 0.001 m unless it was changed",
        },
        Self {
            name: "d405",
            units_per_metre: 10_000.0,
            source: "RealSense D405; its SDK default is 0.0001 m",
        },
        Self {
            name: "k4a",
            units_per_metre: 1000.0,
            source: "Azure Kinect; SDK: K4A_IMAGE_FORMAT_DEPTH16 is in millimetres",
        },
        Self {
            name: "tum",
            units_per_metre: 5000.0,
            source: "TUM RGB-D benchmark's file formats: a factor of 5000",
        },
        Self {
            name: "polycam",
            units_per_metre: 1000.0,
            source: "Polycam raw data export: millimetres",
        },
    ];

    /// The source of this name.
    #[must_use]
    pub fn named(name: &str) -> Option<Self> {
        Self::ALL.into_iter().find(|source| source.name == name)
    }
}
