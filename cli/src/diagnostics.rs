//! Errors and warnings as a compiler tells them: the place, the line, a caret under the fault, the cure.
//!
//! All of it goes to standard error, in colour where that is a terminal and nobody set `NO_COLOR`.

use std::io::Write;
use std::panic::PanicHookInfo;

use annotate_snippets::{AnnotationKind, Group, Level, Renderer, Snippet, normalize_untrusted_str};
use radiosity::scene::{Place, Scene, SceneError, Warning};

use crate::progress;

/// More kinds of warning than this are only counted.
const WARNINGS_TOLD: usize = 8;

/// A line of plain text.
pub(crate) fn plain(text: &str) {
    // Nobody is left to tell when standard error itself is gone.
    let _ = writeln!(anstream::stderr(), "{text}");
}

/// `error: ...`
pub(crate) fn error(message: &str) {
    tell(Group::with_title(Level::ERROR.primary_title(message)));
}

/// Why a file is no scene.
pub(crate) fn scene_error(fault: &SceneError) {
    match fault {
        SceneError::File { .. } => error(&fault.to_string()),
        SceneError::Syntax { file, place, length, line, caret, message, help } => {
            plain(&excerpt(file, *place, *caret, *length, line, message, help));
        }
    }
}

/// `warning: ...`
pub(crate) fn warning(message: &str) {
    tell(Group::with_title(Level::WARNING.primary_title(message)));
}

/// What was read but plays no part: equal warnings are told once, with their number.
pub(crate) fn warnings(scene: &Scene) {
    let mut kinds: Vec<(&Warning, usize)> = Vec::new();
    for warning in &scene.warnings {
        match kinds.iter_mut().find(|(first, _)| first.message == warning.message) {
            Some((_, times)) => *times += 1,
            None => kinds.push((warning, 1)),
        }
    }
    for (first, times) in kinds.iter().take(WARNINGS_TOLD) {
        let more = match times - 1 {
            0 => String::new(),
            others => format!(" (and {others} more like it)"),
        };
        warning(&format!("{first}{more}"));
    }
    if let Some(others) = kinds.len().checked_sub(WARNINGS_TOLD).filter(|&others| others > 0) {
        warning(&format!("{others} more kinds of warning"));
    }
}

/// The line at fault, with a caret under the fault.
fn excerpt(
    file: &str,
    place: Place,
    caret: u32,
    length: u32,
    line: &str,
    message: &str,
    help: &str,
) -> String {
    let byte_of = |character: usize| line.char_indices().nth(character).map_or(line.len(), |(at, _)| at);
    let span = byte_of(caret as usize)..byte_of((caret + length.max(1)) as usize);
    let snippet = Snippet::source(line)
        .path(file)
        .line_start(place.line as usize)
        .annotation(AnnotationKind::Primary.span(span));
    let group = Level::ERROR.primary_title(message).element(snippet);
    let group = match help {
        "" => group,
        help => group.element(Level::HELP.message(normalize_untrusted_str(help))),
    };
    // The renderer counts columns in what it is given; of a very long line that is only a part.
    let told = format!("{file}:{}:{}\n", place.line, caret + 1);
    render(group).replacen(&told, &format!("{file}:{place}\n"), 1)
}

fn tell(group: Group<'_>) {
    plain(&render(group));
}

/// In colour: `anstream` takes the colours out again where they do not belong.
fn render(group: Group<'_>) -> String {
    let width = terminal_size::terminal_size_of(std::io::stderr()).map(|(width, _)| usize::from(width.0));
    Renderer::styled().term_width(width.unwrap_or(100).clamp(40, 140)).render(&[group])
}

/// A fault of ours, not of the scene: told in one line, for whoever will mend it.
pub(crate) fn bug(panic: &PanicHookInfo<'_>) {
    progress::wipe();
    let what = panic.payload_as_str().unwrap_or("no reason given");
    let place = panic.location().map_or_else(|| "an unknown place".into(), ToString::to_string);
    error(&format!("this is a bug in radiosity, please report it: {what} ({place})"));
}
