//! Rows to Parquet and back.
//!
//! In: rows and the manifest of their folder. Out: one file, whose columns are those of
//! [`super::columns`] and whose metadata says how it was made ([`Manifest::described`]). Reading
//! takes files of schema 1 as well: their rims are 2928 bytes each, 732 little-endian floats.

use std::collections::HashMap;
use std::fs::File;
use std::path::{Path, PathBuf};
use std::sync::Arc;

use arrow_array::{
    Array, ArrayRef, BooleanArray, FixedSizeBinaryArray, FixedSizeListArray, Float32Array,
    Float64Array, Int32Array, Int64Array, RecordBatch, StringArray,
};
use arrow_schema::DataType;
use parquet::arrow::ArrowWriter;
use parquet::arrow::arrow_reader::ParquetRecordBatchReaderBuilder;
use parquet::arrow::arrow_writer::ArrowWriterOptions;
use parquet::basic::Compression;
use parquet::errors::{ParquetError, Result};
use parquet::file::metadata::KeyValue;
use parquet::file::properties::{EnabledStatistics, WriterProperties};
use parquet::file::reader::{FileReader as _, SerializedFileReader};

use super::columns::{self, BOUNDARY, POINTS};
use super::manifest::Manifest;
use super::row::{Ending, Row, SimulatedRow};
use crate::base::units::M_PER_MM;
use crate::base::{Boundary, Point3, boundary};
use crate::fabric::{Fabric, PARAMETERS, TABLE_2};
use crate::io::part::Part;

/// Coordinates of one rim.
const COORDINATES: usize = boundary::POINTS * 3;
/// Bytes of one rim in files of schema 1.
const BOUNDARY_BYTES: i32 = (COORDINATES * size_of::<f32>()) as i32;
/// Column that files from before walks do not have.
const WALKED: &str = "walked";

/// A dataset file that cannot be read.
#[derive(Debug, thiserror::Error)]
#[error("{path}: {source}", path = path.display())]
pub struct TableError {
    path: PathBuf,
    source: ParquetError,
}

/// What a file outlives once it is written.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum Durability {
    /// The end of this program: the system has it.
    Kill,
    /// The end of the system: the disk has it.
    PowerCut,
}

/// Writes `rows` as one file, which appears whole or not at all.
pub(super) fn write_file(
    path: &Path,
    rows: &[Row],
    manifest: &Manifest,
    durability: Durability,
) -> std::io::Result<()> {
    let part = Part::of(path)?;
    write_rows(part.file(), rows, manifest).map_err(of_parquet)?;
    match durability {
        Durability::Kill => part.finish(),
        Durability::PowerCut => part.finish_durably(),
    }
}

/// The system's error for a file that cannot be written.
fn of_parquet(error: ParquetError) -> std::io::Error {
    match error {
        ParquetError::External(source) => match source.downcast() {
            Ok(error) => *error,
            Err(other) => std::io::Error::other(other),
        },
        other => std::io::Error::other(other),
    }
}

fn write_rows(file: &File, rows: &[Row], manifest: &Manifest) -> Result<()> {
    let pairs = manifest.described().map(|(key, value)| KeyValue::new(key, value));
    let properties = WriterProperties::builder()
        .set_compression(Compression::SNAPPY)
        .set_dictionary_enabled(false)
        .set_statistics_enabled(EnabledStatistics::None)
        .set_created_by("scan2params".into())
        .set_key_value_metadata(Some(pairs.collect()));
    let options = ArrowWriterOptions::new().with_properties(properties.build());
    // pyarrow shows the metadata of the Arrow schema, other readers that of the file.
    let schema = columns::schema().with_metadata(manifest.described().collect::<HashMap<_, _>>());
    let batch = RecordBatch::try_new(Arc::new(schema), arrays(rows)?)?;
    let mut writer = ArrowWriter::try_new_with_options(file, batch.schema(), options)?;
    writer.write(&batch)?;
    writer.close()?;
    Ok(())
}

/// The columns' values, in the order of [`columns::columns`].
fn arrays(rows: &[Row]) -> Result<Vec<ArrayRef>> {
    let integers = |value: &dyn Fn(&Row) -> u64| -> ArrayRef {
        let signed = |row| i64::try_from(value(row)).unwrap_or(i64::MAX);
        Arc::new(Int64Array::from_iter_values(rows.iter().map(signed)))
    };
    let doubles = |value: &dyn Fn(&Row) -> f64| -> ArrayRef {
        Arc::new(Float64Array::from_iter_values(rows.iter().map(value)))
    };
    let flags = |value: &dyn Fn(&Row) -> Option<bool>| -> ArrayRef {
        Arc::new(rows.iter().map(value).collect::<BooleanArray>())
    };
    let folds = |row: &Row| i32::try_from(row.drape.node_count).unwrap_or(i32::MAX);
    let mut arrays = vec![integers(&|row| row.index), integers(&|row| row.fabric_index)];
    for parameter in 0..PARAMETERS {
        arrays.push(doubles(&|row| row.fabric.to_paper_units()[parameter]));
    }
    arrays.extend([
        Arc::new(rims(rows)?) as ArrayRef,
        Arc::new(StringArray::from_iter_values(rows.iter().map(|row| row.drape.ending.name()))),
        flags(&|row| Some(row.drape.ending.is_converged())),
        flags(&|row| Some(row.drape.ending.is_at_rest())),
        flags(&|row| row.drape.ending.is_stable()),
        Arc::new(Int32Array::from_iter_values(rows.iter().map(folds))),
        doubles(&|row| row.drape.energy_j),
        doubles(&|row| row.drape.residual_n),
        flags(&|row| Some(row.drape.walked)),
    ]);
    Ok(arrays)
}

/// The rims \[mm\].
fn rims(rows: &[Row]) -> Result<FixedSizeListArray> {
    let coordinates = rows.iter().flat_map(|row| row.drape.boundary.positions_m());
    let coordinates = coordinates.flat_map(|p| [p.x, p.y, p.z]);
    let values = Float32Array::from_iter_values(coordinates.map(|m| (m / M_PER_MM) as f32));
    let points = FixedSizeListArray::try_new(
        columns::element(DataType::Float32),
        3,
        Arc::new(values),
        None,
    )?;
    let point = columns::element(columns::point());
    Ok(FixedSizeListArray::try_new(point, POINTS, Arc::new(points), None)?)
}

/// Number of rows of the complete file at `path`; `None` when there is no such
/// file or it is not a complete one.
pub(super) fn rows_of_complete_file(path: &Path) -> Option<u64> {
    let reader = SerializedFileReader::new(File::open(path).ok()?).ok()?;
    u64::try_from(reader.metadata().file_metadata().num_rows()).ok()
}

/// The rows of one file.
///
/// # Errors
/// When it cannot be read, or its columns are not those of [`super`].
pub fn read_file(path: &Path) -> std::result::Result<Vec<Row>, TableError> {
    try_read(path).map_err(|source| TableError { path: path.into(), source })
}

/// The rows of all `drapes-*.parquet` in a folder, in the order of their index.
///
/// # Errors
/// When the folder or one of its files cannot be read.
pub fn read_folder(folder: &Path) -> std::result::Result<Vec<Row>, TableError> {
    let fail = |error: std::io::Error| TableError { path: folder.into(), source: error.into() };
    let mut files = Vec::new();
    for entry in std::fs::read_dir(folder).map_err(fail)? {
        let path = entry.map_err(fail)?.path();
        let name = path.file_name().unwrap_or_default().to_string_lossy();
        if name.starts_with("drapes-") && name.ends_with(".parquet") {
            files.push(path);
        }
    }
    files.sort();
    let mut rows = Vec::new();
    for file in &files {
        rows.extend(read_file(file)?);
    }
    Ok(rows)
}

fn try_read(path: &Path) -> Result<Vec<Row>> {
    let mut rows = Vec::new();
    for batch in ParquetRecordBatchReaderBuilder::try_new(File::open(path)?)?.build()? {
        rows.extend(read_batch(&batch?)?);
    }
    Ok(rows)
}

/// What a file says that is no drape's.
fn fault(what: impl Into<String>) -> ParquetError {
    ParquetError::General(what.into())
}

/// A column by its name and type.
fn column<'a, T: 'static>(batch: &'a RecordBatch, name: &str) -> Result<&'a T> {
    let found = batch.column_by_name(name).filter(|column| column.null_count() == 0);
    found
        .and_then(|column| column.as_any().downcast_ref())
        .ok_or_else(|| fault(format!("its columns are not those of a drape: `{name}`")))
}

fn read_batch(batch: &RecordBatch) -> Result<Vec<Row>> {
    let unsigned = |value: i64| u64::try_from(value).map_err(|_| fault(format!("index {value}")));
    let index: &Int64Array = column(batch, "index")?;
    let fabric_index: &Int64Array = column(batch, "fabric_index")?;
    let parameters: Vec<&Float64Array> =
        TABLE_2.iter().map(|parameter| column(batch, parameter.key)).collect::<Result<_>>()?;
    let boundaries = boundaries(batch)?;
    // `converged`, `at_rest` and `stable` follow of it.
    let stop: &StringArray = column(batch, "stop")?;
    let node_count: &Int32Array = column(batch, "node_count")?;
    let energy_j: &Float64Array = column(batch, "energy_j")?;
    let residual_n: &Float64Array = column(batch, "residual_n")?;
    let walked: Option<&BooleanArray> = match batch.column_by_name(WALKED) {
        Some(_) => Some(column(batch, WALKED)?),
        None => None,
    };
    let row = |(row, boundary): (usize, Boundary)| {
        let ending = Ending::named(stop.value(row))
            .ok_or_else(|| fault(format!("no drape ends as `{}`", stop.value(row))))?;
        let drape = SimulatedRow {
            boundary,
            ending,
            node_count: u32::try_from(node_count.value(row)).unwrap_or(0),
            energy_j: energy_j.value(row),
            residual_n: residual_n.value(row),
            walked: walked.is_some_and(|walked| walked.value(row)),
        };
        Ok(Row {
            index: unsigned(index.value(row))?,
            fabric_index: unsigned(fabric_index.value(row))?,
            fabric: Fabric::from_paper_units(std::array::from_fn(|p| parameters[p].value(row))),
            drape,
        })
    };
    boundaries.into_iter().enumerate().map(row).collect()
}

/// The rims of files of either schema.
fn boundaries(batch: &RecordBatch) -> Result<Vec<Boundary>> {
    let old = column::<FixedSizeBinaryArray>(batch, BOUNDARY);
    if let Some(bytes) = old.ok().filter(|bytes| bytes.value_length() == BOUNDARY_BYTES) {
        let coordinate = |&bytes: &[u8; 4]| f32::from_le_bytes(bytes);
        return bytes
            .iter()
            .flatten()
            .map(|bytes| rim(bytes.as_chunks().0.iter().map(coordinate)))
            .collect();
    }
    let rims: &FixedSizeListArray = column(batch, BOUNDARY)?;
    let points = rims.values().as_any().downcast_ref::<FixedSizeListArray>();
    let values = points.and_then(|points| points.values().as_any().downcast_ref::<Float32Array>());
    values
        .filter(|values| values.len() == rims.len() * COORDINATES && values.null_count() == 0)
        .ok_or_else(|| fault(format!("`{BOUNDARY}` is not of {POINTS} points")))?
        .values()
        .chunks_exact(COORDINATES)
        .map(|coordinates| rim(coordinates.iter().copied()))
        .collect()
}

/// The rim of these coordinates \[mm\].
fn rim(coordinates_mm: impl Iterator<Item = f32>) -> Result<Boundary> {
    let metres: Vec<f64> = coordinates_mm.map(|mm| f64::from(mm) * M_PER_MM).collect();
    Boundary::exact(metres.as_chunks::<3>().0.iter().map(|&[x, y, z]| Point3::new(x, y, z)))
        .map_err(|error| fault(error.to_string()))
}
