//! Rows to Parquet and back. The columns are in the header of [`super`].

use std::fs::File;
use std::path::{Path, PathBuf};
use std::sync::Arc;

use parquet::basic::Compression;
use parquet::column::reader::get_typed_column_reader;
use parquet::data_type::{
    BoolType, ByteArray, ByteArrayType, DataType, DoubleType, FixedLenByteArray,
    FixedLenByteArrayType, Int32Type, Int64Type,
};
use parquet::errors::{ParquetError, Result};
use parquet::file::properties::{EnabledStatistics, WriterProperties};
use parquet::file::reader::{FileReader as _, RowGroupReader, SerializedFileReader};
use parquet::file::writer::{SerializedFileWriter, SerializedRowGroupWriter};
use parquet::schema::parser::parse_message_type;

use super::row::{Row, SimulatedRow};
use crate::base::units::M_PER_MM;
use crate::base::{Boundary, Point3, boundary};
use crate::fabric::{Fabric, PARAMETERS};
use crate::io::part::Part;

/// Bytes of one boundary.
const BOUNDARY_BYTES: usize = boundary::POINTS * 3 * size_of::<f32>();

const SCHEMA: &str = "message drape {
    required int64 index;
    required int64 fabric_index;
    required double stretch_weft;
    required double stretch_warp;
    required double shear;
    required double bending_weft;
    required double bending_warp;
    required double bending_bias;
    required double density;
    required fixed_len_byte_array(2928) boundary_mm;
    required boolean at_rest;
    required binary stop (UTF8);
    required boolean stable;
    required int32 node_count;
    required double energy_j;
    required double residual_n;
    required boolean walked;
}";
/// The last column, which files from before walks do not have.
const WALKED: usize = 16;
const _: () = assert!(BOUNDARY_BYTES == 2928);

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
pub(super) fn write_file(path: &Path, rows: &[Row], durability: Durability) -> std::io::Result<()> {
    let part = Part::of(path)?;
    write_rows(part.file(), rows).map_err(of_parquet)?;
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

fn write_rows(file: &File, rows: &[Row]) -> Result<()> {
    let properties = WriterProperties::builder()
        .set_compression(Compression::SNAPPY)
        .set_dictionary_enabled(false)
        .set_statistics_enabled(EnabledStatistics::None)
        .set_created_by("scan2params".into());
    let schema = Arc::new(parse_message_type(SCHEMA)?);
    let mut writer = SerializedFileWriter::new(file, schema, Arc::new(properties.build()))?;
    let mut group = writer.next_row_group()?;
    let integer = |value: u64| i64::try_from(value).unwrap_or(i64::MAX);
    put::<Int64Type>(&mut group, rows, |r| integer(r.index))?;
    put::<Int64Type>(&mut group, rows, |r| integer(r.fabric_index))?;
    for parameter in 0..PARAMETERS {
        put::<DoubleType>(&mut group, rows, |r| r.fabric.to_paper_units()[parameter])?;
    }
    put::<FixedLenByteArrayType>(&mut group, rows, |r| boundary_bytes(&r.drape.boundary))?;
    put::<BoolType>(&mut group, rows, |r| r.drape.at_rest)?;
    put::<ByteArrayType>(&mut group, rows, |r| ByteArray::from(r.drape.stop.as_str()))?;
    put::<BoolType>(&mut group, rows, |r| r.drape.stable)?;
    put::<Int32Type>(&mut group, rows, |r| i32::try_from(r.drape.node_count).unwrap_or(i32::MAX))?;
    put::<DoubleType>(&mut group, rows, |r| r.drape.energy_j)?;
    put::<DoubleType>(&mut group, rows, |r| r.drape.residual_n)?;
    put::<BoolType>(&mut group, rows, |r| r.drape.walked)?;
    group.close()?;
    writer.into_inner()?;
    Ok(())
}

fn put<T: DataType>(
    group: &mut SerializedRowGroupWriter<'_, &File>,
    rows: &[Row],
    value: impl Fn(&Row) -> T::T,
) -> Result<()> {
    let mut column = group.next_column()?.ok_or_else(|| ParquetError::EOF("column".into()))?;
    let values: Vec<T::T> = rows.iter().map(value).collect();
    column.typed::<T>().write_batch(&values, None, None)?;
    column.close()
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
    let reader = SerializedFileReader::new(File::open(path)?)?;
    let expected = parse_message_type(SCHEMA)?;
    let found = reader.metadata().file_metadata().schema_descr().root_schema().get_fields();
    let names = |fields: &[parquet::schema::types::TypePtr]| -> Vec<(String, _)> {
        fields.iter().map(|f| (f.name().to_owned(), f.get_physical_type())).collect()
    };
    let expected = names(expected.get_fields());
    let known = [&expected[..], &expected[..WALKED]].contains(&&names(found)[..]);
    if found.iter().any(|field| field.is_group()) || !known {
        return Err(ParquetError::General("its columns are not those of a drape".into()));
    }
    let mut rows = Vec::new();
    for group in 0..reader.num_row_groups() {
        rows.extend(read_group(reader.get_row_group(group)?.as_ref())?);
    }
    Ok(rows)
}

fn read_group(group: &dyn RowGroupReader) -> Result<Vec<Row>> {
    let unsigned = |value: i64| {
        u64::try_from(value).map_err(|_| ParquetError::General(format!("index {value}")))
    };
    let index = take::<Int64Type>(group, 0)?;
    let fabric_index = take::<Int64Type>(group, 1)?;
    let parameters: Vec<Vec<f64>> =
        (0..PARAMETERS).map(|p| take::<DoubleType>(group, 2 + p)).collect::<Result<_>>()?;
    let next = 2 + PARAMETERS;
    let boundaries = take::<FixedLenByteArrayType>(group, next)?;
    let at_rest = take::<BoolType>(group, next + 1)?;
    let stop = take::<ByteArrayType>(group, next + 2)?;
    let stable = take::<BoolType>(group, next + 3)?;
    let node_count = take::<Int32Type>(group, next + 4)?;
    let energy_j = take::<DoubleType>(group, next + 5)?;
    let residual_n = take::<DoubleType>(group, next + 6)?;
    let has_walked = group.metadata().num_columns() > WALKED;
    let walked =
        if has_walked { take::<BoolType>(group, WALKED)? } else { vec![false; index.len()] };
    (0..index.len())
        .map(|row| {
            let drape = SimulatedRow {
                boundary: boundary_from_bytes(boundaries[row].data())?,
                at_rest: at_rest[row],
                stop: stop[row].as_utf8()?.to_owned(),
                stable: stable[row],
                node_count: u32::try_from(node_count[row]).unwrap_or(0),
                energy_j: energy_j[row],
                residual_n: residual_n[row],
                walked: walked[row],
            };
            Ok(Row {
                index: unsigned(index[row])?,
                fabric_index: unsigned(fabric_index[row])?,
                fabric: Fabric::from_paper_units(std::array::from_fn(|p| parameters[p][row])),
                drape,
            })
        })
        .collect()
}

fn take<T: DataType>(group: &dyn RowGroupReader, column: usize) -> Result<Vec<T::T>> {
    let rows = usize::try_from(group.metadata().num_rows()).unwrap_or(0);
    let mut reader = get_typed_column_reader::<T>(group.get_column_reader(column)?);
    let mut values = Vec::new();
    while values.len() < rows {
        let (read, ..) = reader.read_records(rows - values.len(), None, None, &mut values)?;
        if read == 0 {
            return Err(ParquetError::EOF(format!("column {column} ends early")));
        }
    }
    Ok(values)
}

/// 732 coordinates \[mm\] as little-endian f32.
fn boundary_bytes(boundary: &Boundary) -> FixedLenByteArray {
    let coordinates = boundary.positions_m().flat_map(|p| [p.x, p.y, p.z]);
    let bytes: Vec<u8> =
        coordinates.flat_map(|metres| ((metres / M_PER_MM) as f32).to_le_bytes()).collect();
    bytes.into()
}

fn boundary_from_bytes(bytes: &[u8]) -> Result<Boundary> {
    let metres: Vec<f64> = bytes
        .as_chunks::<4>()
        .0
        .iter()
        .map(|&mm| f64::from(f32::from_le_bytes(mm)) * M_PER_MM)
        .collect();
    Boundary::exact(metres.as_chunks::<3>().0.iter().map(|&[x, y, z]| Point3::new(x, y, z)))
        .map_err(|error| ParquetError::General(error.to_string()))
}
