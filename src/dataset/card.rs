//! The data card of a folder of drapes: `README.md`, for whoever finds the folder.
//!
//! In: the manifest. Out: what the data are, how they were made, the columns with their units,
//! splits, limits, licence. It is written once: a card that is there stays, since people add to it.
//! Its text follows from the manifest alone and not from the count, which may grow.

use std::fmt::Write as _;
use std::io::Write as _;
use std::path::Path;

use super::columns::{FRAME, columns};
use super::error::GenerateError;
use super::manifest::Manifest;
use super::row::Ending;
use crate::io::part::Part;

/// Name of the card in its folder.
pub const CARD_FILE: &str = "README.md";

/// Writes the card of a folder that has none.
pub(super) fn write(folder: &Path, manifest: &Manifest) -> Result<(), GenerateError> {
    let path = folder.join(CARD_FILE);
    if path.exists() {
        return Ok(());
    }
    // Several shards may begin one folder at once: each writes its own file, all with one text.
    let part = folder.join(format!("{CARD_FILE}.{}.part", std::process::id()));
    let write = || -> std::io::Result<()> {
        let part = Part::named(part, &path)?;
        part.file().write_all(text(manifest).as_bytes())?;
        part.finish_durably()
    };
    write().map_err(GenerateError::io(&path))
}

fn text(manifest: &Manifest) -> String {
    let made = made(manifest);
    let (columns, rules) = (columns_table(), rules(manifest));
    format!(
        "# Simulated drapes

Each row is a square of cloth, 300 mm wide, that was simulated as it drapes over a round plate of 100 mm (the modified
Cusick drape). It has the fabric's stiffnesses and density, and the rim of the drape. Nothing here was measured on cloth.

## How it was made

    scan2params generate {flags} --count COUNT --out DIR

{made}
The same command makes the same bytes with this version, on one platform. A row depends on the seed and its index alone.
`manifest.json` has every option of the simulator. `drapes-NNNNNN.parquet` hold {chunk_rows} rows each. With `--sheets` the
folder `sheets` has each row's sheet as `drape-INDEX.ply` (mm, same frame), and its fabric as `drape-INDEX.params.json`.

## To read it

    import glob, numpy as np, pyarrow.parquet as pq
    table = pq.read_table(sorted(glob.glob(\"drapes-*.parquet\")))
    rims_mm = table[\"boundary_mm\"].combine_chunks().flatten().flatten().to_numpy().reshape(-1, 244, 3)

    import polars as pl
    rims_mm = pl.read_parquet(\"drapes-*.parquet\")[\"boundary_mm\"].to_numpy()  # the same array

Frame: {FRAME}.

{columns}
Units, frame and meaning of each column are in its field's metadata, and the settings in each file's:
`pq.read_schema(FILE)` shows both.

{rules}",
        flags = manifest.flags(),
        chunk_rows = manifest.chunk_rows,
    )
}

/// What to train on, how to split, where the data end, whose they are.
fn rules(manifest: &Manifest) -> String {
    let endings = endings_table();
    let groups = match manifest.walks {
        Some(walks) => format!("`index // {}` (drapes of one walk)", walks.rows),
        None => "`fabric_index` (drapes of one fabric)".to_owned(),
    };
    format!(
        "## How a drape ended

{endings}
Train on rows that are `converged`. One that ended as `slow` is near to rest, and not at rest.

## Splits

There are none in the files. Split by {groups}, so that no test row has a near twin among the training rows. Take another
seed for a test set of new fabrics.

## Limits

- One simulator made all drapes: what is trained on them learns its faults, too.
- Rims are exact. A scanner's noise is not in them.
- A fabric has several stable drapes. A perturbed drop ends in one of them.
- Fabrics are drawn from the prior `{prior}`. They say nothing of fabrics outside its limits (`manifest.json`).

## Licence

The program claims no rights in its output. Its own licence (MIT or Apache-2.0) does not cover it. State yours here before
you publish the folder.
",
        prior = manifest.prior,
    )
}

/// The settings as a table.
fn made(manifest: &Manifest) -> String {
    let mut table = String::from("| setting | value |\n|---|---|\n");
    let falls = match (manifest.walks, manifest.canonical) {
        (Some(walks), _) => format!("one in {} falls, the others are continued", walks.rows),
        (None, true) => "canonical".to_owned(),
        (None, false) => "each perturbed in its own way".to_owned(),
    };
    for (setting, value) in [
        ("program", manifest.program.clone()),
        ("numerics of the simulator", manifest.simulator_numerics.to_string()),
        ("prior", format!("{}, SHA-256 `{}`", manifest.prior, manifest.prior_sha256)),
        ("seed", manifest.seed.to_string()),
        ("drops of a fabric", manifest.drops_per_fabric.to_string()),
        ("falls", falls),
    ] {
        let _ = writeln!(table, "| {setting} | {value} |");
    }
    table
}

fn columns_table() -> String {
    let mut table =
        String::from("| column | type | unit | symbol | meaning |\n|---|---|---|---|---|\n");
    for column in columns() {
        let (name, kind, unit) = (column.name, column.kind.name(), column.unit);
        let _ = writeln!(
            table,
            "| `{name}` | {kind} | {unit} | {} | {} |",
            column.symbol, column.meaning
        );
    }
    table
}

fn endings_table() -> String {
    let mut table = String::from(
        "| `stop` | meaning | `converged` | `at_rest` | `stable` |\n|---|---|---|---|---|\n",
    );
    for (ending, meaning) in Ending::ALL {
        let stable = ending.is_stable().map_or("null".to_owned(), |stable| stable.to_string());
        let (converged, at_rest) = (ending.is_converged(), ending.is_at_rest());
        let _ = writeln!(
            table,
            "| `{}` | {meaning} | {converged} | {at_rest} | {stable} |",
            ending.name()
        );
    }
    table
}
