//! `completions` and `man`: scripts for shells and pages of the manual, made from the flags.

use clap::CommandFactory as _;
use clap_complete::Shell;

use super::args::{self, Arguments};
use super::{Failure, Outcome, verb};
use scan2params::io::{atomically, output};

pub(crate) fn completions(given: &args::Completions) -> Outcome {
    print!("{}", completion(given.shell));
    Ok(())
}

/// The script that completes verbs, flags and their values. Where the verb is left out, the flags
/// are those of `estimate`.
fn completion(shell: Shell) -> String {
    let mut script = Vec::new();
    clap_complete::generate(shell, &mut with_default_flags(), "scan2params", &mut script);
    let script = String::from_utf8_lossy(&script).into_owned();
    match shell {
        Shell::Zsh => zsh(&script),
        Shell::Fish => fish(&script),
        _ => script,
    }
}

/// The program whose own flags are also those of `estimate`.
fn with_default_flags() -> clap::Command {
    let program = Arguments::command();
    let Some(estimate) = program.find_subcommand("estimate") else { return program };
    let flags = estimate.get_arguments().filter(|arg| arg.get_long().is_some());
    let flags: Vec<clap::Arg> =
        flags.map(|arg| arg.clone().required(false).global(false)).collect();
    program.args(flags)
}

/// Zsh takes the first word for the verb: another word stands for `estimate`.
fn zsh(script: &str) -> String {
    let verbs: Vec<&str> = verb::all().collect();
    let verbs = verbs.join("|");
    let case = "        case $line[1] in\n";
    let own = format!(
        "        local verb=estimate\n        case $line[1] in ({verbs}) verb=$line[1] ;; esac\n        \
         case $verb in\n"
    );
    script.replacen(case, &own, 1)
}

/// Fish offers the program's own flags only before the first word: they are offered until a verb is
/// seen.
fn fish(script: &str) -> String {
    const BEFORE: &str = "-n \"__fish_scan2params_needs_command\"";
    let verbs: Vec<&str> = verb::all().collect();
    let unseen = format!("-n \"not __fish_seen_subcommand_from {}\"", verbs.join(" "));
    let line = |line: &str| {
        let is_flag = line.contains(BEFORE) && [" -l ", " -s "].iter().any(|f| line.contains(f));
        if is_flag { line.replacen(BEFORE, &unseen, 1) } else { line.to_owned() }
    };
    script.lines().map(|text| line(text) + "\n").collect()
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
