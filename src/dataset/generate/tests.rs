use std::path::Path;
use std::sync::atomic::AtomicU64;

use arrow_array::{Array as _, BooleanArray};
use arrow_schema::DataType;
use parquet::arrow::arrow_reader::ParquetRecordBatchReaderBuilder;

use super::*;
use crate::base::frame::UP;
use crate::base::{Boundary, Point3, Shard, Vector3, boundary};
use crate::dataset::SHEETS_FOLDER;
use crate::dataset::card::CARD_FILE;
use crate::dataset::drape_file::read_drape;
use crate::dataset::drapes::{self, dataset_options};
use crate::dataset::manifest::MANIFEST_FILE;
use crate::dataset::row::{Ending, SimulatedRow};
use crate::dataset::table::{read_file, read_folder};
use crate::geom::Mesh;
use crate::sim::grid::Grid;
use crate::sim::{Drop, Fall, SimOptions, Stop, drape};

/// A cheap stand-in for the simulator: deterministic in its arguments, and it
/// fails for every seventh sample.
fn fake(sample: &Sample, _: Option<()>) -> Simulated<()> {
    Simulated { row: row(sample), sheet: sheet(sample), next: None }
}

/// A sheet of 5 x 5 vertices that tells its fabric.
fn sheet(sample: &Sample) -> Mesh {
    let grid = Grid::shared(5, 0.3);
    let fall = sample.fabric.density_kg_m2;
    let at = |p: Vector3| p - UP * (fall * p.norm_squared());
    grid.mesh(&(0..25).map(|vertex| at(grid.flat(vertex))).collect::<Vec<_>>())
}

fn row(&Sample { index, fabric, run_seed, .. }: &Sample) -> SimulatedRow {
    let wave = (fabric.bending_weft_nm * 1e9 + run_seed as f64).sin();
    let point = |i: usize| {
        let [x, z] = Boundary::flat_xz_m(i, 0.3);
        Point3::new(x, 0.01 * wave * (i as f64).cos(), z)
    };
    SimulatedRow {
        boundary: Boundary::exact((0..boundary::POINTS).map(point)).unwrap(),
        ending: ending(index),
        node_count: (index % 5) as u32,
        energy_j: -wave,
        residual_n: 1e-6 / (1.0 + index as f64),
        walked: false,
    }
}

fn ending(index: u64) -> Ending {
    match index % 7 {
        3 => Ending::Stopped(Stop::Iterations),
        5 => Ending::Stopped(Stop::Slow),
        _ => Ending::Stopped(Stop::AtRest),
    }
}

fn options(out: &Path, count: u64) -> GenerateOptions {
    GenerateOptions { chunk_rows: 8, threads: 2, ..GenerateOptions::new(out, count) }
}

fn go_on(_: Progress) -> ControlFlow<()> {
    ControlFlow::Continue(())
}

/// Every file of a folder with its bytes.
fn contents(folder: &Path) -> BTreeMap<String, Vec<u8>> {
    std::fs::read_dir(folder)
        .unwrap()
        .map(|entry| entry.unwrap().path())
        .filter(|path| path.is_file())
        .map(|path| {
            let name = path.file_name().unwrap().to_string_lossy().into_owned();
            (name, std::fs::read(path).unwrap())
        })
        .collect()
}

#[test]
fn rows_come_back_as_they_were_made_and_failed_drapes_are_among_them() {
    let folder = tempfile::tempdir().unwrap();
    let options = options(folder.path(), 20);
    let summary = generate(&options, fake, go_on).unwrap();
    assert_eq!((summary.made, summary.files_written, summary.interrupted), (20, 3, false));
    assert_eq!(summary.not_converged, BTreeMap::from([("iterations".to_owned(), 3)]));
    let rows = read_folder(folder.path()).unwrap();
    assert_eq!(rows.len(), 20);
    for (k, row) in rows.iter().enumerate() {
        let k = k as u64;
        let fabric = options.prior.sample(options.seed, k).unwrap();
        let expected = super::tests::row(&Sample {
            index: k,
            fabric_index: k,
            fabric,
            run_seed: options.seed,
            fall: Fall::Perturbed,
        });
        assert_eq!((row.index, row.fabric_index), (k, k));
        for (a, b) in row.fabric.to_paper_units().into_iter().zip(fabric.to_paper_units()) {
            assert!((a / b - 1.0).abs() < 1e-15);
        }
        // f32 millimetres of at most 150 round by at most 8e-6 mm per coordinate.
        assert!(row.drape.boundary.mean_distance_m(&expected.boundary) < 1.5e-8);
        assert_eq!(
            SimulatedRow { boundary: expected.boundary.clone(), ..row.drape.clone() },
            expected
        );
    }
}

#[test]
fn shards_and_thread_counts_give_the_same_bytes_as_one_run() {
    let whole = tempfile::tempdir().unwrap();
    generate(&options(whole.path(), 61), fake, go_on).unwrap();
    let sharded = tempfile::tempdir().unwrap();
    for index in [2, 0, 1] {
        let shard = Shard { index, of: 3 };
        let options = GenerateOptions { shard, threads: 1, ..options(sharded.path(), 61) };
        generate(&options, fake, go_on).unwrap();
    }
    let threaded = tempfile::tempdir().unwrap();
    let options = GenerateOptions { threads: 5, ..options(threaded.path(), 61) };
    generate(&options, fake, go_on).unwrap();
    assert_eq!(contents(whole.path()).len(), 10, "8 files, the card and the manifest");
    assert_eq!(contents(whole.path()), contents(sharded.path()));
    assert_eq!(contents(whole.path()), contents(threaded.path()));
}

#[test]
fn a_run_that_was_stopped_goes_on_and_makes_only_what_is_missing() {
    let whole = tempfile::tempdir().unwrap();
    generate(&options(whole.path(), 60), fake, go_on).unwrap();
    let folder = tempfile::tempdir().unwrap();
    let options = options(folder.path(), 60);
    let stop_at_30 = |p: Progress| {
        if p.made >= 30 { ControlFlow::Break(()) } else { ControlFlow::Continue(()) }
    };
    let first = generate(&options, fake, stop_at_30).unwrap();
    assert!(first.interrupted && first.files_written >= 3, "{first:?}");
    // What a kill leaves behind: half a chunk under its provisional name.
    std::fs::write(folder.path().join("drapes-000007.parquet.part"), b"PAR1 half").unwrap();
    let simulated = AtomicU64::new(0);
    let counted = |sample: &Sample, state| {
        simulated.fetch_add(1, Ordering::Relaxed);
        fake(sample, state)
    };
    let second = generate(&options, counted, go_on).unwrap();
    assert_eq!(second.files_kept, first.files_written);
    assert_eq!(simulated.into_inner(), 60 - first.made, "nothing is made twice");
    assert_eq!(second.rows_kept, first.made - 8 * first.files_written as u64);
    assert_eq!(contents(folder.path()), contents(whole.path()));
    let third = generate(&options, fake, go_on).unwrap();
    assert_eq!((third.made, third.files_kept), (0, 8));
}

/// The folder of a run that was ended after each of its drapes, and begun again.
#[test]
fn a_run_of_one_file_loses_nothing_wherever_it_ends() {
    let whole = tempfile::tempdir().unwrap();
    generate(&options(whole.path(), 6), fake, go_on).unwrap();
    let folder = tempfile::tempdir().unwrap();
    let options = GenerateOptions { threads: 1, ..options(folder.path(), 6) };
    for there in 0..6 {
        let one = |_: Progress| ControlFlow::Break(());
        let summary = generate(&options, fake, one).unwrap();
        assert_eq!((summary.made, summary.rows_kept), (1, there));
    }
    assert_eq!(contents(folder.path()), contents(whole.path()));
    // Ended between the last row and the file: it is written from the rows.
    let file = folder.path().join("drapes-000000.parquet");
    std::fs::rename(&file, file.with_extension("partial")).unwrap();
    let summary = generate(&options, fake, go_on).unwrap();
    assert_eq!((summary.made, summary.rows_kept, summary.files_written), (0, 6, 1));
    assert_eq!(contents(folder.path()), contents(whole.path()));
    // What is damaged is made again.
    std::fs::remove_file(&file).unwrap();
    std::fs::write(file.with_extension("partial"), b"PAR1 half").unwrap();
    assert_eq!(generate(&options, fake, go_on).unwrap().made, 6);
    assert_eq!(contents(folder.path()), contents(whole.path()));
}

#[test]
fn one_run_at_a_time_makes_a_shard_and_other_shards_go_on() {
    let folder = tempfile::tempdir().unwrap();
    let all = options(folder.path(), 16);
    let first = GenerateOptions { shard: Shard { index: 0, of: 2 }, ..all.clone() };
    let second = GenerateOptions { shard: Shard { index: 1, of: 2 }, ..all };
    let tried = Mutex::new(Vec::new());
    let meanwhile = |_: Progress| {
        let mut tried = locked(&tried);
        if tried.is_empty() {
            let said = generate(&first, fake, go_on).map_err(|error| error.to_string());
            let other = generate(&second, fake, go_on).map_err(|error| error.to_string());
            tried.extend([said, other]);
        }
        ControlFlow::Continue(())
    };
    generate(&first, fake, meanwhile).unwrap();
    let tried = tried.into_inner().unwrap();
    let said = tried[0].as_ref().unwrap_err();
    assert!(said.contains(&format!("process {} (for ", std::process::id())), "{said}");
    assert_eq!(tried[1].as_ref().unwrap().made, 8);
    let names: Vec<String> = contents(folder.path()).into_keys().collect();
    assert_eq!(names, [CARD_FILE, "drapes-000000.parquet", "drapes-000001.parquet", MANIFEST_FILE]);
}

#[test]
fn a_damaged_file_and_a_grown_count_are_made_again_and_reported() {
    let folder = tempfile::tempdir().unwrap();
    generate(&options(folder.path(), 20), fake, go_on).unwrap();
    let damaged = folder.path().join("drapes-000001.parquet");
    let bytes = std::fs::read(&damaged).unwrap();
    std::fs::write(&damaged, &bytes[..bytes.len() / 2]).unwrap();
    assert!(read_file(&damaged).unwrap_err().to_string().contains("drapes-000001"));
    let summary = generate(&options(folder.path(), 24), fake, go_on).unwrap();
    assert_eq!(
        summary.files_remade,
        [damaged.clone(), folder.path().join("drapes-000002.parquet")]
    );
    assert_eq!(std::fs::read(&damaged).unwrap(), bytes);
    assert_eq!(read_folder(folder.path()).unwrap().len(), 24);
    assert_eq!(crate::dataset::Manifest::read(folder.path()).unwrap().count, 24);
}

#[test]
fn drops_of_one_fabric_share_it() {
    let folder = tempfile::tempdir().unwrap();
    let options = GenerateOptions { drops_per_fabric: 4, ..options(folder.path(), 10) };
    generate(&options, fake, go_on).unwrap();
    let rows = read_folder(folder.path()).unwrap();
    assert!(rows.iter().all(|row| row.fabric_index == row.index / 4));
    assert_eq!(rows[0].fabric, rows[3].fabric);
    assert_ne!(rows[3].fabric, rows[4].fabric);
}

#[test]
fn a_folder_made_with_other_options_is_refused_and_the_options_are_named() {
    let folder = tempfile::tempdir().unwrap();
    generate(&options(folder.path(), 8), fake, go_on).unwrap();
    let before = contents(folder.path());
    let other = GenerateOptions {
        seed: 2,
        simulator: serde_json::json!({ "resolution": 31 }),
        ..options(folder.path(), 8)
    };
    let error = generate(&other, fake, go_on).unwrap_err().to_string();
    assert!(error.contains("seed: 1 there, 2 now") && error.contains("resolution"), "{error}");
    std::fs::write(folder.path().join(MANIFEST_FILE), "{}").unwrap();
    let error = generate(&other, fake, go_on).unwrap_err().to_string();
    assert!(error.contains(MANIFEST_FILE), "{error}");
    std::fs::write(folder.path().join(MANIFEST_FILE), &before[MANIFEST_FILE]).unwrap();
    assert_eq!(contents(folder.path()), before);
}

#[test]
fn impossible_options_are_refused_all_at_once() {
    let folder = tempfile::tempdir().unwrap();
    let bad = GenerateOptions {
        chunk_rows: 0,
        shard: Shard { index: 3, of: 3 },
        ..options(folder.path(), 8)
    };
    let error = generate(&bad, fake, go_on).unwrap_err().to_string();
    assert!(error.contains("chunk_rows") && error.contains("shard 3/3"), "{error}");
    assert!("3/3".parse::<Shard>().is_err() && "1".parse::<Shard>().is_err());
    assert_eq!("2/3".parse(), Ok(Shard { index: 2, of: 3 }));
}

/// A walker whose row tells every fabric that its sheet has seen; it falls anew after each seventh.
fn walker(sample: &Sample, seen: Option<f64>) -> Simulated<f64> {
    let energy_j = 0.5 * seen.unwrap_or(0.0) + sample.fabric.bending_weft_nm;
    let row = SimulatedRow { energy_j, walked: seen.is_some(), ..row(sample) };
    let next = row.ending.is_converged().then_some(energy_j);
    Simulated { row, sheet: sheet(sample), next }
}

fn walks(out: &Path, count: u64) -> GenerateOptions {
    GenerateOptions { walks: Some(Walks { rows: 4, pool: 16 }), ..options(out, count) }
}

#[test]
fn walks_have_the_priors_fabrics_in_another_order_and_are_the_same_however_they_are_made() {
    let whole = tempfile::tempdir().unwrap();
    generate(&walks(whole.path(), 64), walker, go_on).unwrap();
    let rows = read_folder(whole.path()).unwrap();
    let mut fabrics: Vec<u64> = rows.iter().map(|row| row.fabric_index).collect();
    assert_ne!(fabrics, (0..64).collect::<Vec<_>>());
    fabrics.sort_unstable();
    assert_eq!(fabrics, (0..64).collect::<Vec<_>>());
    for row in &rows {
        let falls = row.index % 4 == 0 || (row.index - 1) % 7 == 3;
        assert_eq!(row.drape.walked, !falls, "{}", row.index);
    }
    let sharded = tempfile::tempdir().unwrap();
    for index in [1, 2, 0] {
        let shard = Shard { index, of: 3 };
        let options = GenerateOptions { shard, threads: 1, ..walks(sharded.path(), 64) };
        generate(&options, walker, go_on).unwrap();
    }
    let grown = tempfile::tempdir().unwrap();
    for count in [13, 64] {
        let options = GenerateOptions { threads: 5, ..walks(grown.path(), count) };
        generate(&options, walker, go_on).unwrap();
    }
    assert_eq!(contents(whole.path()), contents(sharded.path()));
    assert_eq!(contents(whole.path()).len(), contents(grown.path()).len());
    assert_eq!(read_folder(grown.path()).unwrap(), rows);
}

#[test]
fn a_run_that_is_stopped_within_a_walk_keeps_the_walks_before_it() {
    let whole = tempfile::tempdir().unwrap();
    generate(&walks(whole.path(), 16), walker, go_on).unwrap();
    let folder = tempfile::tempdir().unwrap();
    let options = GenerateOptions { threads: 1, ..walks(folder.path(), 16) };
    for kept in [0, 4, 8] {
        let stop_in_the_second = |p: Progress| match p.made {
            6 => ControlFlow::Break(()),
            _ => ControlFlow::Continue(()),
        };
        let summary = generate(&options, walker, stop_in_the_second).unwrap();
        let of_this_file = if kept == 8 { 0 } else { kept };
        assert_eq!((summary.made, summary.rows_kept), (4, of_this_file));
    }
    assert_eq!(generate(&options, walker, go_on).unwrap().made, 4);
    assert_eq!(contents(folder.path()), contents(whole.path()));
}

#[test]
fn walks_that_do_not_fit_are_refused_and_folders_tell_them_from_falls() {
    let folder = tempfile::tempdir().unwrap();
    let bad = GenerateOptions {
        walks: Some(Walks { rows: 3, pool: 20 }),
        drops_per_fabric: 2,
        ..options(folder.path(), 8)
    };
    let error = generate(&bad, walker, go_on).unwrap_err().to_string();
    for said in ["walks of 3 rows: give a divisor of 8", "a pool of 20", "2 drops per fabric"] {
        assert!(error.contains(said), "{error}");
    }
    let bad = GenerateOptions { canonical: true, drops_per_fabric: 2, ..options(folder.path(), 8) };
    let error = generate(&bad, fake, go_on).unwrap_err().to_string();
    assert!(error.contains("2 canonical drops per fabric: they are all the same"), "{error}");
    generate(&walks(folder.path(), 8), walker, go_on).unwrap();
    let error = generate(&options(folder.path(), 8), fake, go_on).unwrap_err().to_string();
    assert!(error.contains("walks: {\"pool\":16,\"rows\":4} there, null now"), "{error}");
}

#[test]
fn canonical_falls_depend_on_the_fabric_alone_and_their_folder_says_so() {
    let folder = tempfile::tempdir().unwrap();
    let canonical = GenerateOptions { canonical: true, ..options(folder.path(), 2) };
    let simulator = SimOptions { vertices: 31, ..dataset_options() };
    let simulate = |sample: &_, _: Option<()>| drapes::simulate(sample, &simulator);
    generate(&canonical, simulate, go_on).unwrap();
    assert!(Manifest::read(folder.path()).unwrap().canonical);
    let fabric = canonical.prior.sample(canonical.seed, 1).unwrap();
    let alone = drape(&fabric, &Drop::canonical(), &simulator);
    let row = &read_folder(folder.path()).unwrap()[1];
    assert!(row.drape.boundary.mean_distance_m(&alone.boundary) < 1e-7);
    let error = generate(&options(folder.path(), 2), fake, go_on).unwrap_err().to_string();
    assert!(error.contains("canonical: true there, null now"), "{error}");
}

/// A file of schema 1 has rims as bytes, and `at_rest` for what is `converged` now.
#[test]
fn files_of_schema_1_are_read_and_their_folder_is_not_continued() {
    let fixture = &Path::new("fixtures").join("rims");
    let rows = read_folder(fixture).unwrap();
    assert_eq!(rows.len(), 64);
    let file = std::fs::File::open(fixture.join("drapes-000000.parquet")).unwrap();
    let reader = ParquetRecordBatchReaderBuilder::try_new(file).unwrap().build().unwrap();
    let batches: Vec<_> = reader.map(|batch| batch.unwrap()).collect();
    let old = batches.iter().flat_map(|batch| {
        let column = batch.column_by_name("at_rest").unwrap().as_any();
        column.downcast_ref::<BooleanArray>().unwrap().iter().flatten().collect::<Vec<_>>()
    });
    assert!(old.eq(rows.iter().map(|row| row.drape.ending.is_converged())));
    assert!(rows.iter().any(|row| !row.drape.ending.is_at_rest()), "all of them ended as `slow`");
    let lowest_m = |row: &Row| row.drape.boundary.positions_m().map(|p| p.y).fold(0.0, f64::min);
    assert!(rows.iter().all(|row| (-0.2..-0.001).contains(&lowest_m(row))));

    let folder = tempfile::tempdir().unwrap();
    let manifest = folder.path().join(MANIFEST_FILE);
    std::fs::copy(fixture.join(MANIFEST_FILE), &manifest).unwrap();
    let error = generate(&options(folder.path(), 8), fake, go_on).unwrap_err().to_string();
    assert!(error.contains("scan2params/dataset/1") && error.contains("another folder"), "{error}");
    let newer = std::fs::read_to_string(fixture.join(MANIFEST_FILE)).unwrap().replace("/1", "/9");
    std::fs::remove_file(&manifest).unwrap();
    std::fs::write(&manifest, newer).unwrap();
    let error = Manifest::read(folder.path()).unwrap_err().to_string();
    assert!(error.contains("scan2params/dataset/9"), "{error}");
}

#[test]
fn a_file_says_what_it_holds_and_how_it_was_made() {
    let folder = tempfile::tempdir().unwrap();
    let options = GenerateOptions {
        simulator: serde_json::json!({ "vertices": 61, "energy_drop": 1e-4 }),
        ..options(folder.path(), 8)
    };
    generate(&options, fake, go_on).unwrap();
    let file = std::fs::File::open(folder.path().join("drapes-000000.parquet")).unwrap();
    let reader = ParquetRecordBatchReaderBuilder::try_new(file).unwrap();
    let fields = reader.schema().fields().clone();
    assert_eq!(fields.len(), 18);
    for field in &fields {
        let said = |key: &str| field.metadata().get(key).map(|value| value.to_string());
        assert!(said("meaning").is_some_and(|meaning| meaning.ends_with('.')), "{field}");
        assert!(said("unit").is_some_and(|unit| !unit.is_empty()), "{field}");
        let unit_in_name = match field.name().as_str() {
            "boundary_mm" => Some("mm"),
            "energy_j" => Some("J"),
            "residual_n" => Some("N"),
            "stretch_weft" => Some("g/s^2"),
            "density" => Some("g/m^2"),
            _ => None,
        };
        assert!(unit_in_name.is_none_or(|unit| said("unit").as_deref() == Some(unit)), "{field}");
    }
    let rim = fields.iter().find(|field| field.name() == "boundary_mm").unwrap();
    assert!(rim.metadata().get("frame").is_some_and(|frame| frame.contains("y up")));
    let DataType::FixedSizeList(point, 244) = rim.data_type() else { panic!("{rim}") };
    assert!(matches!(point.data_type(), DataType::FixedSizeList(_, 3)), "{rim}");
    let pairs = reader.metadata().file_metadata().key_value_metadata().unwrap();
    let said = |key: &str| {
        let pair = pairs.iter().find(|pair| pair.key == format!("scan2params.{key}"));
        pair.and_then(|pair| pair.value.clone()).unwrap_or_else(|| panic!("{key}"))
    };
    assert_eq!(
        said("command"),
        "scan2params generate --prior knit-2020 --seed 1 --energy-drop 0.0001 --vertices 61"
    );
    for pair in pairs.iter().filter(|pair| pair.key.starts_with("scan2params.")) {
        let of_schema = reader.schema().metadata().get(&pair.key).map(|value| value.to_string());
        assert_eq!(of_schema, pair.value, "{}", pair.key);
    }
    assert_eq!(said("schema"), "scan2params/dataset/2");
    assert_eq!(said("program"), concat!("scan2params ", env!("CARGO_PKG_VERSION")));
    assert_eq!(said("simulator_numerics"), crate::sim::NUMERICS_VERSION.to_string());
    assert!(said("frame").contains("weft along z") && said("units").contains("unit"));
}

/// `stop`, `converged`, `at_rest` and `stable` of every ending, as the file has them.
#[test]
fn the_columns_of_an_ending_agree() {
    let word = |ending: Ending| {
        let stable = ending.is_stable().map_or("null", |s| if s { "true" } else { "false" });
        format!("{} {} {} {stable}", ending.name(), ending.is_converged(), ending.is_at_rest())
    };
    assert_eq!(
        Ending::ALL.map(|(ending, _)| word(ending)),
        [
            "at_rest true true true",
            "slow true false null",
            "unstable false false false",
            "iterations false false null",
            "intersects false false null"
        ]
    );
    for (ending, _) in Ending::ALL {
        assert_eq!(Ending::named(ending.name()), Some(ending));
    }
    let folder = tempfile::tempdir().unwrap();
    let ends = |sample: &Sample, _: Option<()>| {
        let (ending, _) = Ending::ALL[sample.index as usize % 5];
        let made = fake(sample, None);
        Simulated { row: SimulatedRow { ending, ..made.row }, ..made }
    };
    generate(&options(folder.path(), 5), ends, go_on).unwrap();
    let file = std::fs::File::open(folder.path().join("drapes-000000.parquet")).unwrap();
    let mut reader = ParquetRecordBatchReaderBuilder::try_new(file).unwrap().build().unwrap();
    let batch = reader.next().unwrap().unwrap();
    let flags = |name: &str| {
        let column = batch.column_by_name(name).unwrap().as_any();
        column.downcast_ref::<BooleanArray>().unwrap().iter().collect::<Vec<_>>()
    };
    let (yes, no) = (Some(true), Some(false));
    assert_eq!(flags("converged"), [yes, yes, no, no, no]);
    assert_eq!(flags("at_rest"), [yes, no, no, no, no]);
    assert_eq!(flags("stable"), [yes, None, no, None, None]);
}

#[test]
fn the_card_names_every_column_and_stays_as_people_leave_it() {
    let folder = tempfile::tempdir().unwrap();
    generate(&options(folder.path(), 8), fake, go_on).unwrap();
    let path = folder.path().join(CARD_FILE);
    let card = std::fs::read_to_string(&path).unwrap();
    for column in crate::dataset::columns::columns() {
        let row = format!("| `{}` | {} | {} |", column.name, column.kind.name(), column.unit);
        assert!(card.contains(&row), "{row}");
    }
    for said in
        ["--prior knit-2020 --seed 1", "numerics of the simulator", "`fabric_index`", "slow"]
    {
        assert!(card.contains(said), "{said}: {card}");
    }
    std::fs::write(&path, "ours").unwrap();
    generate(&options(folder.path(), 16), fake, go_on).unwrap();
    assert_eq!(std::fs::read_to_string(&path).unwrap(), "ours");
}

fn with_sheets(out: &Path, count: u64) -> GenerateOptions {
    GenerateOptions { sheets: true, ..options(out, count) }
}

fn sheets_of(folder: &Path) -> BTreeMap<String, Vec<u8>> {
    contents(&folder.join(SHEETS_FOLDER))
}

#[test]
fn sheets_are_the_same_bytes_in_any_order_and_those_missing_are_made_again() {
    let whole = tempfile::tempdir().unwrap();
    generate(&with_sheets(whole.path(), 20), fake, go_on).unwrap();
    assert_eq!(sheets_of(whole.path()).len(), 40, "a mesh and a fabric for each");
    let sharded = tempfile::tempdir().unwrap();
    for index in [1, 0] {
        let shard = Shard { index, of: 2 };
        let options = GenerateOptions { shard, threads: 1, ..with_sheets(sharded.path(), 20) };
        generate(&options, fake, go_on).unwrap();
    }
    assert_eq!(sheets_of(whole.path()), sheets_of(sharded.path()));
    // Rims first, sheets later: the rows stay as they are.
    let later = tempfile::tempdir().unwrap();
    generate(&options(later.path(), 20), fake, go_on).unwrap();
    let rims = contents(later.path());
    assert!(!later.path().join(SHEETS_FOLDER).exists());
    assert_eq!(generate(&with_sheets(later.path(), 20), fake, go_on).unwrap().made, 20);
    assert_eq!(contents(later.path()), rims);
    assert_eq!(sheets_of(later.path()), sheets_of(whole.path()));
    std::fs::remove_file(later.path().join(SHEETS_FOLDER).join("drape-00000011.ply")).unwrap();
    assert_eq!(generate(&with_sheets(later.path(), 20), fake, go_on).unwrap().made, 1);
    assert_eq!(sheets_of(later.path()), sheets_of(whole.path()));
    assert_eq!(generate(&with_sheets(later.path(), 20), fake, go_on).unwrap().made, 0);
}

#[test]
fn a_sheet_lies_next_to_its_own_fabric() {
    let folder = tempfile::tempdir().unwrap();
    let options = with_sheets(folder.path(), 8);
    generate(&options, fake, go_on).unwrap();
    let rows = read_folder(folder.path()).unwrap();
    for index in [0, 3, 7] {
        let stem = folder.path().join(SHEETS_FOLDER).join(format!("drape-{index:08}"));
        let sample = Sample {
            index,
            fabric_index: index,
            fabric: options.prior.sample(options.seed, index).unwrap(),
            run_seed: options.seed,
            fall: Fall::Perturbed,
        };
        let mesh = read_drape(&stem.with_extension("ply")).unwrap();
        for (found, expected) in mesh.vertices.iter().zip(&sheet(&sample).vertices) {
            assert!((found - expected).norm() < 2e-8, "{found} {expected}");
        }
        let params = stem.with_extension("params.json");
        let fabric = crate::fabric::params::fabric(&params, [None; 7]).unwrap();
        for (a, b) in
            fabric.to_paper_units().into_iter().zip(rows[index as usize].fabric.to_paper_units())
        {
            assert!((a / b - 1.0).abs() < 1e-14);
        }
        let text = std::fs::read_to_string(&params).unwrap();
        assert!(text.contains(&format!("\"stop\": \"{}\"", ending(index).name())), "{text}");
    }
}
