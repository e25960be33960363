//! What both fits take drapes of scans for: how sure they are, how they lie, how weakly they are
//! tied, how far their cells are from cloth. Where the numbers come from is in
//! `docs/design/refinement.md`.

/// Standard deviation of a scanned place along the surface \[m\].
pub(crate) const ALONG_M: f64 = 0.7e-3;
/// Standard deviation by which a tied drape of the true fabric lies off \[m\].
pub(crate) const MODEL_M: f64 = 0.5e-3;
/// Standard deviations of how a bench is laid: place of the specimen on the plate, or of the
/// plate's axis \[m\], the warp's bearing \[rad\], height of the plate's face \[m\], its tilt
/// \[rad\].
pub(crate) const OFFSET_M: f64 = 0.5e-3;
pub(crate) const ROTATION_RAD: f64 = 5e-3;
pub(crate) const HEIGHT_M: f64 = 0.3e-3;
pub(crate) const TILT_RAD: f64 = 3e-3;
/// How far the weight of a piece of cloth stretches the springs that tie it to a scanned sheet
/// \[m\],
pub(crate) const HOLD_SAG_M: f64 = 30e-3;
/// and those that tie a rim alone.
pub(crate) const RIM_HOLD_SAG_M: f64 = 1e-3;
/// How far cloth lies beyond a drape's cells, in parts of what an error that falls with the square
/// of the cell predicts from the moves of coarser ones to these: mean and standard deviation.
pub(crate) const CELLS: [f64; 2] = [0.62, 0.5];

/// Such parts in moves from cells that are so many times as wide.
pub(crate) fn beyond_cells(parts: [f64; 2], times: f64) -> [f64; 2] {
    let second_order = 1.0 / (times * times - 1.0);
    parts.map(|part| part * second_order)
}
