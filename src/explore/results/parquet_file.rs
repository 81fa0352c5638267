//! Parquet: the typed columns, one row a point, all optional; snappy.
//!
//! ```text
//! columns --schema, column by column--> bytes     footer: key "radeng" (JSON: question, space, technology, version,
//!                                                 workloads, search), key "columns" (JSON: unit and meaning by name)
//! ```
//! The same columns give the same bytes: the footer names the program, no time.

use std::sync::Arc;

use ::parquet::basic::{Compression, LogicalType, Repetition, Type as PhysicalType};
use ::parquet::data_type::{BoolType, ByteArray, ByteArrayType, DataType, DoubleType, Int64Type};
use ::parquet::errors::ParquetError;
use ::parquet::file::metadata::KeyValue;
use ::parquet::file::properties::WriterProperties;
use ::parquet::file::writer::{SerializedColumnWriter, SerializedFileWriter};
use ::parquet::schema::types::{Type, TypePtr};

use super::Results;
use super::columns::{Cells, Column};

/// The columns as a file.
///
/// # Errors
/// What the encoder says.
pub fn bytes(results: &Results, columns: &[Column<'_>]) -> Result<Vec<u8>, ParquetError> {
    let fields: Vec<TypePtr> = columns.iter().map(field).collect::<Result<_, _>>()?;
    let schema = Type::group_type_builder("results").with_fields(fields).build()?;
    let properties = WriterProperties::builder()
        .set_compression(Compression::SNAPPY)
        .set_created_by(format!("radeng {}", env!("CARGO_PKG_VERSION")))
        .set_key_value_metadata(Some(metadata(results, columns)))
        .build();
    let mut file = SerializedFileWriter::new(Vec::new(), Arc::new(schema), Arc::new(properties))?;
    let mut group = file.next_row_group()?;
    for column in columns {
        let Some(mut writer) = group.next_column()? else {
            return Err(ParquetError::General(format!("no place for the column {}", column.name)));
        };
        match &column.cells {
            Cells::Bool(v) => write::<BoolType>(&mut writer, v.iter().copied())?,
            Cells::Integer(v) => write::<Int64Type>(&mut writer, v.iter().copied())?,
            Cells::Float(v) => write::<DoubleType>(&mut writer, v.iter().copied())?,
            Cells::Text(v) => {
                let text = v.iter().map(|t| t.as_deref().map(ByteArray::from));
                write::<ByteArrayType>(&mut writer, text)?;
            }
        }
        writer.close()?;
    }
    group.close()?;
    file.into_inner()
}

fn write<T: DataType>(
    writer: &mut SerializedColumnWriter<'_>,
    cells: impl Iterator<Item = Option<T::T>>,
) -> Result<(), ParquetError> {
    let (mut values, mut levels) = (Vec::new(), Vec::new());
    for cell in cells {
        levels.push(i16::from(cell.is_some()));
        values.extend(cell);
    }
    writer.typed::<T>().write_batch(&values, Some(&levels), None)?;
    Ok(())
}

fn field(column: &Column<'_>) -> Result<TypePtr, ParquetError> {
    let (physical, logical) = match column.cells {
        Cells::Bool(_) => (PhysicalType::BOOLEAN, None),
        Cells::Integer(_) => (PhysicalType::INT64, None),
        Cells::Float(_) => (PhysicalType::DOUBLE, None),
        Cells::Text(_) => (PhysicalType::BYTE_ARRAY, Some(LogicalType::String)),
    };
    let field = Type::primitive_type_builder(&column.name, physical)
        .with_repetition(Repetition::OPTIONAL)
        .with_logical_type(logical)
        .build()?;
    Ok(Arc::new(field))
}

fn metadata(results: &Results, columns: &[Column<'_>]) -> Vec<KeyValue> {
    let about = serde_json::json!({
        "question": results.question,
        "space": results.name,
        "space_file": results.space_file,
        "technology": results.technology,
        "version": results.version,
        "workloads": results.workloads,
        "search": results.search,
        "n_combinations": results.n_combinations,
        "n_impossible": results.impossible.len(),
        "objectives": results.metrics.iter().filter(|m| m.is_objective).collect::<Vec<_>>(),
    });
    let of = |c: &Column<'_>| (c.name.clone(), serde_json::json!({ "unit": c.unit, "meaning": c.what }));
    let meanings: serde_json::Map<String, serde_json::Value> = columns.iter().map(of).collect();
    [("radeng", about), ("columns", serde_json::Value::Object(meanings))]
        .into_iter()
        .map(|(key, value)| KeyValue::new(key.to_owned(), value.to_string()))
        .collect()
}
