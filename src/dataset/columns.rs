//! The columns of a dataset file, each with what a reader of it must know.
//!
//! Out: the Arrow schema, whose fields carry `unit`, `frame`, `symbol` and `meaning` as metadata.
//! pyarrow, pandas and polars show these without this package. The data card has the same table.

use std::sync::Arc;

use arrow_schema::{DataType, Field, Schema};

use crate::base::boundary;
use crate::fabric::TABLE_2;

/// Where coordinates are measured, for the metadata of columns and files.
pub const FRAME: &str = "simulation: right-handed, origin at the centre of the plate's top face, \
                         y up, weft along z, warp along x";

/// Points of a rim, as a length of Arrow's lists.
pub(super) const POINTS: i32 = boundary::POINTS as i32;
/// Name of the rim's column.
pub(super) const BOUNDARY: &str = "boundary_mm";

/// A column.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Column {
    /// Name in the file.
    pub name: &'static str,
    /// Type and shape, for people.
    pub kind: Kind,
    /// Unit; `-` of what has none.
    pub unit: &'static str,
    /// Symbol in the paper; empty of what has none there.
    pub symbol: &'static str,
    /// What it means: one sentence.
    pub meaning: &'static str,
}

/// The type of a column.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Kind {
    /// 64-bit integer.
    Int64,
    /// 32-bit integer.
    Int32,
    /// 64-bit float.
    Double,
    /// True or false.
    Boolean,
    /// True, false, or null where there is neither.
    BooleanOrNull,
    /// Text.
    Text,
    /// A rim: a fixed-size list of 244 points, each one of three 32-bit floats.
    Rim,
}

impl Kind {
    /// The words for people.
    #[must_use]
    pub fn name(self) -> &'static str {
        match self {
            Self::Int64 => "int64",
            Self::Int32 => "int32",
            Self::Double => "double",
            Self::Boolean => "boolean",
            Self::BooleanOrNull => "boolean or null",
            Self::Text => "string",
            Self::Rim => "float[244][3]",
        }
    }

    fn arrow(self) -> DataType {
        match self {
            Self::Int64 => DataType::Int64,
            Self::Int32 => DataType::Int32,
            Self::Double => DataType::Float64,
            Self::Boolean | Self::BooleanOrNull => DataType::Boolean,
            Self::Text => DataType::Utf8,
            Self::Rim => DataType::FixedSizeList(element(point()), POINTS),
        }
    }
}

/// The type of one point of a rim.
pub(super) fn point() -> DataType {
    DataType::FixedSizeList(element(DataType::Float32), 3)
}

/// The field of a list's elements, none of which is null.
pub(super) fn element(kind: DataType) -> Arc<Field> {
    Arc::new(Field::new("element", kind, false))
}

impl Column {
    fn field(&self) -> Field {
        let mut metadata = vec![("meaning", self.meaning), ("unit", self.unit)];
        if self.kind == Kind::Rim {
            metadata.extend([("frame", FRAME), ("shape", "244 points x 3 coordinates (x, y, z)")]);
        }
        if !self.symbol.is_empty() {
            metadata.push(("symbol", self.symbol));
        }
        let metadata = metadata.into_iter().map(|(key, value)| (key.to_owned(), value.to_owned()));
        Field::new(self.name, self.kind.arrow(), self.kind == Kind::BooleanOrNull)
            .with_metadata(metadata.collect::<std::collections::HashMap<_, _>>())
    }
}

/// The columns in the order of the file.
#[must_use]
pub fn columns() -> Vec<Column> {
    let plain = |name, kind, unit, meaning| Column { name, kind, unit, symbol: "", meaning };
    let mut columns = vec![
        plain("index", Kind::Int64, "-", "Number of the drape in the run, from 0."),
        plain("fabric_index", Kind::Int64, "-", "Number of the fabric in the prior's sequence."),
    ];
    columns.extend(TABLE_2.iter().map(|parameter| Column {
        name: parameter.key,
        kind: Kind::Double,
        unit: parameter.unit,
        symbol: parameter.symbol,
        meaning: meaning_of(parameter.key),
    }));
    columns.extend([
        plain(
            BOUNDARY,
            Kind::Rim,
            "mm",
            "Rim of the drape: four sides of 61 points, from the flat corner (x, z) = (150, -150) \
             along x = 150 and on around; each side has both of its corners.",
        ),
        plain("stop", Kind::Text, "-", "Why the simulation ended; the data card has the words."),
        plain(
            "converged",
            Kind::Boolean,
            "-",
            "The search ended as its options asked, and the sheet does not pass through itself: \
             train on these rows.",
        ),
        plain("at_rest", Kind::Boolean, "-", "Forces balance in a stable equilibrium."),
        plain(
            "stable",
            Kind::BooleanOrNull,
            "-",
            "Where forces balance: whether every small move raises the energy; else null.",
        ),
        plain("node_count", Kind::Int32, "count", "Folds of the drape."),
        plain("energy_j", Kind::Double, "J", "Potential energy: elastic and of gravity."),
        plain("residual_n", Kind::Double, "N", "Largest force that is not in balance."),
        plain(
            "walked",
            Kind::Boolean,
            "-",
            "The sheet was continued from the row before (`--walk`); else it fell.",
        ),
    ]);
    columns
}

fn meaning_of(key: &str) -> &'static str {
    match key {
        "stretch_weft" => "Stretch stiffness along the weft.",
        "stretch_warp" => "Stretch stiffness along the warp.",
        "shear" => "Shear stiffness.",
        "bending_weft" => "Bending stiffness of a strip along the weft.",
        "bending_warp" => "Bending stiffness of a strip along the warp.",
        "bending_bias" => "Bending stiffness of a strip at 45 degrees to the yarns.",
        _ => "Areal density.",
    }
}

/// The Arrow schema of [`columns`].
#[must_use]
pub fn schema() -> Schema {
    Schema::new(columns().iter().map(Column::field).collect::<Vec<_>>())
}
