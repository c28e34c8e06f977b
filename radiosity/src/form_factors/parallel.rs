//! Rows in parallel: each is independent of the others, so the answer is the same on any number of threads.

use std::sync::atomic::{AtomicBool, AtomicUsize, Ordering};
use std::sync::mpsc;

use super::rows::{FormFactors, Row};
use crate::watch::{Interrupted, Progress, Watch, tell};

/// Find row i of the form factors of `count` patches by `row(i, scratch)`, on `threads` threads (0: one a
/// core), each with a scratch of its own from `scratch()`. `watch` is asked after every row, on the calling
/// thread.
///
/// # Errors
/// [`Interrupted`] as soon as `watch` says stop; each thread still ends the row it is at.
pub fn compute_rows<S>(
    count: usize,
    threads: usize,
    scratch: impl Fn() -> S + Sync,
    row: impl Fn(usize, &mut S) -> Row + Sync,
    watch: &mut Watch<'_>,
) -> Result<FormFactors, Interrupted> {
    let threads = match threads {
        0 => std::thread::available_parallelism().map_or(1, std::num::NonZero::get),
        given => given,
    };
    let next = AtomicUsize::new(0);
    let stop = AtomicBool::new(false);
    let mut rows = vec![Row::default(); count];
    std::thread::scope(|scope| {
        let (sender, receiver) = mpsc::channel();
        for _ in 0..threads.min(count) {
            let (sender, next, stop, scratch, row) = (sender.clone(), &next, &stop, &scratch, &row);
            scope.spawn(move || {
                let mut scratch = scratch();
                while !stop.load(Ordering::Relaxed) {
                    let patch = next.fetch_add(1, Ordering::Relaxed);
                    if patch >= count || sender.send((patch, row(patch, &mut scratch))).is_err() {
                        break;
                    }
                }
            });
        }
        drop(sender);
        for (done, (patch, row)) in receiver.into_iter().enumerate() {
            rows[patch] = row;
            let progress = Progress::FormFactors { done: done + 1, total: count };
            if let Err(interrupted) = tell(watch, progress) {
                stop.store(true, Ordering::Relaxed);
                return Err(interrupted);
            }
        }
        Ok(())
    })?;
    Ok(FormFactors::from_rows(rows))
}
