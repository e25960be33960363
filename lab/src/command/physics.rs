//! `scan2params-lab physics`: the simulator held against laws and measurements.

use std::path::Path;

use anyhow::Context as _;
use clap::ValueEnum as _;
use image::RgbImage;

use super::{Failure, Outcome, args};
use scan2params::io::output;
use scan2params::report::files;
use scan2params_lab::evaluate::physics::{drapes, effects, sections, strips};

pub(super) fn run(given: &args::Physics) -> Outcome {
    use args::PhysicsPart as Part;
    let (out, data) = (given.out.as_deref(), given.data.as_deref());
    let parts = if given.parts.is_empty() { Part::value_variants() } else { &given.parts };
    if let Some(out) = out {
        output::check_folder(out).map_err(Failure::of_output)?;
        std::fs::create_dir_all(out).with_context(|| out.display().to_string())?;
    }
    for part in parts {
        match part {
            Part::Cantilever => cantilever(data, out)?,
            Part::Hanging => println!("{}", strips::hanging_strips()),
            Part::Friction => println!("{}", strips::friction()),
            Part::Meshes => {
                println!("# square drapes on one branch\n{}", drapes::MESH_COLUMNS);
                let mut pictures = Vec::new();
                drapes::meshes(given.mesh_fabrics, |name, row, image| {
                    println!("{}", row.join(", "));
                    pictures.push((name.to_owned(), image));
                });
                save_all(out, pictures)?;
            }
            Part::Effects => {
                let tell = |line: &str| println!("{line}");
                println!("# standard Cusick drapes with an effect\n{}", effects::COLUMNS);
                effects::asymmetry(given.effect_drops, tell);
                match data {
                    Some(data) => effects::hysteresis(data, given.effect_drops, tell)
                        .with_context(|| data.display().to_string())?,
                    None => {
                        eprintln!("without --data there is no fabric with a measured hysteresis");
                    }
                }
            }
            Part::Sections => match data {
                Some(data) => {
                    let (table, chart) = sections::sections(data)?;
                    println!("{table}");
                    save(out, "sections.png", &chart.draw())?;
                }
                None => eprintln!("without --data there is no real drape to compare with"),
            },
            Part::Cusick => match data {
                Some(data) => cusick(data, given.cusick_fabrics, out)?,
                None => eprintln!("without --data there are no measured fabrics to drape"),
            },
        }
    }
    Ok(())
}

/// Strips that droop, beside the elastica and on finer and finer cells.
fn cantilever(data: Option<&Path>, out: Option<&Path>) -> Outcome {
    let (table, chart) = strips::master_curve();
    println!("{table}");
    save(out, "cantilever.png", &chart.draw())?;
    if let Some(data) = data {
        let path = data.join("cantilever_master_curve.csv");
        for most_gamma in [1e3, 1e4] {
            let error = strips::elastica_against(&path, most_gamma)
                .with_context(|| path.display().to_string())?;
            println!("elastica against {}: {error}", path.display());
        }
    } else {
        eprintln!("without --data the elastica is not held against a file");
    }
    for fold_correction in [0.0, 0.04] {
        println!("{}", strips::resolution(fold_correction));
    }
    let (table, chart) = strips::refinement();
    println!("{table}");
    save(out, "cantilever_cells.png", &chart.draw())?;
    println!("{}", strips::bias_alone());
    Ok(())
}

/// Standard Cusick drapes of measured fabrics.
fn cusick(data: &Path, fabrics: usize, out: Option<&Path>) -> Outcome {
    let mut pictures = Vec::new();
    let keep = |name: &str, image| pictures.push((name.to_owned(), image));
    let (tables, chart) =
        drapes::cusick(data, fabrics, keep).with_context(|| data.display().to_string())?;
    for table in tables {
        println!("{table}");
    }
    save(out, "cusick.png", &chart.draw())?;
    save_all(out, pictures)
}

fn save_all(out: Option<&Path>, pictures: Vec<(String, RgbImage)>) -> Outcome {
    for (name, image) in pictures {
        save(out, &format!("{}.png", name.replace(' ', "_")), &image)?;
    }
    Ok(())
}

/// Writes a picture into the folder, where there is one.
fn save(out: Option<&Path>, name: &str, image: &RgbImage) -> Outcome {
    if let Some(out) = out {
        files::picture(&out.join(name), image)?;
    }
    Ok(())
}
