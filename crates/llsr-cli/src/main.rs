//! The `llsr` command: finished soft shadows from tube lights.

#[macro_use]
mod output;

mod args;
mod camera;
mod clock;
mod command;
mod drawing;
mod failure;
mod load;
mod plot;
mod progress;
mod report;

use std::process::ExitCode;

use clap::Parser;

use crate::args::{Cli, Command};
use crate::failure::Failure;

fn main() -> ExitCode {
    let cli = Cli::parse();
    progress::watch_interrupt();
    match run(&cli) {
        Ok(()) => ExitCode::SUCCESS,
        Err(failure) => {
            eprintln!("llsr: {failure}");
            ExitCode::from(failure.exit_code())
        }
    }
}

fn run(cli: &Cli) -> Result<(), Failure> {
    if let Some(threads) = cli.common.threads {
        rayon::ThreadPoolBuilder::new()
            .num_threads(usize::from(threads))
            .build_global()
            .map_err(|error| Failure::Work(format!("--threads {threads}: {error}")))?;
    }
    if let Some(command) = &cli.command {
        output::check(command, &cli.common)?;
    }
    match &cli.command {
        None => {
            // The flags of `render` with their defaults.
            let Some(Command::Render(args)) = Cli::parse_from(["llsr", "render"]).command else {
                unreachable!("this command line is a constant")
            };
            output::check(&Command::Render(args.clone()), &cli.common)?;
            command::render::run(&args, &cli.common, true)
        }
        Some(Command::Render(args)) => command::render::run(args, &cli.common, false),
        Some(Command::Walk(args)) => command::walk::run(args, &cli.common),
        Some(Command::Edges(args)) => command::edges::run(args, &cli.common),
        Some(Command::View(args)) => command::view::run(args, &cli.common),
        Some(Command::Bench(args)) => command::bench::run(args, &cli.common),
        Some(Command::Info(args)) => command::info::run(args, &cli.common),
        Some(Command::Diff(args)) => command::diff::run(args, &cli.common),
        Some(Command::Demo(args)) => command::demo::run(args, &cli.common),
    }
}
