//! The `radiosity` command.

mod args;
mod backs;
mod check;
mod diagnostics;
mod factors;
mod failure;
mod info;
mod interrupt;
mod job;
mod numbers;
mod progress;
mod refined;
mod render;
mod report;
mod solve;
mod stages;
mod validate;
mod view;

use std::panic;
use std::process::ExitCode;

use clap::Parser;

use args::{Command, Typed};
use failure::Failure;

fn main() -> ExitCode {
    interrupt::listen();
    panic::set_hook(Box::new(diagnostics::bug));
    // A panic has told of itself by then; all that is left is the exit code.
    panic::catch_unwind(run).unwrap_or(ExitCode::FAILURE)
}

fn run() -> ExitCode {
    let outcome = match Typed::parse().command {
        Command::Render(typed) => render::run(&typed).map(|()| ExitCode::SUCCESS),
        Command::Solve(typed) => solve::run(&typed).map(|()| ExitCode::SUCCESS),
        Command::Factors(typed) => factors::run(&typed).map(|()| ExitCode::SUCCESS),
        Command::Info(typed) => info::run(&typed).map(|()| ExitCode::SUCCESS),
        Command::Check(typed) => check::run(&typed).map(|right| ExitCode::from(u8::from(!right))),
        Command::Validate(typed) => validate::run(&typed).map(|right| ExitCode::from(u8::from(!right))),
        Command::View(typed) => view::run(&typed),
    };
    outcome.unwrap_or_else(|failure: Failure| ExitCode::from(failure.tell()))
}
