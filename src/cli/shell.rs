//! `completions` and `man`: what a shell and `man` are told of this program, from its flags.

use clap::CommandFactory as _;

use super::args::{self, Arguments};
use super::{Failure, Outcome};
use scan2params::io::{atomically, output};

pub(crate) fn completions(given: &args::Completions) -> Outcome {
    let mut script = Vec::new();
    clap_complete::generate(given.shell, &mut Arguments::command(), "scan2params", &mut script);
    print!("{}", String::from_utf8_lossy(&script));
    Ok(())
}

pub(crate) fn man(given: &args::Man) -> Outcome {
    let Some(folder) = &given.out else {
        print!("{}", String::from_utf8_lossy(&page(Arguments::command())?));
        return Ok(());
    };
    output::check_folder(folder).map_err(Failure::of_output)?;
    std::fs::create_dir_all(folder)?;
    let mut program = Arguments::command();
    // Names the verbs `scan2params-VERB`, as their pages are.
    program.build();
    let verbs = program.get_subcommands().filter(|verb| verb.get_name() != "help").cloned();
    let pages: Vec<clap::Command> = std::iter::once(program.clone()).chain(verbs).collect();
    for command in pages {
        let name = command.get_display_name().unwrap_or(command.get_name()).to_owned();
        let path = folder.join(format!("{name}.1"));
        let text = page(command)?;
        atomically(&path, |out| out.write_all(&text))?;
        eprintln!("wrote {}", path.display());
    }
    Ok(())
}

/// A manual page.
fn page(command: clap::Command) -> Result<Vec<u8>, std::io::Error> {
    let mut text = Vec::new();
    clap_mangen::Man::new(command).render(&mut text)?;
    Ok(text)
}
