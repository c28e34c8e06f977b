//! Rows in parallel: each is independent of the others, so the answer is the same on any number of threads.

use std::ops::ControlFlow;
use std::sync::atomic::{AtomicBool, AtomicUsize, Ordering};
use std::sync::{Arc, OnceLock, mpsc};
use std::time::{Duration, Instant};

use rayon::{ThreadPool, ThreadPoolBuilder};

use super::bands::PIECE;
use super::rows::{FormFactors, Row};
use crate::watch::{Interrupted, Progress, Watch};

/// Rows found within this time are handed over together: waking the calling thread for each takes as long as half a row.
const TOGETHER: Duration = Duration::from_millis(4);

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
    let wanted: Vec<u32> = (0..count as u32).collect();
    let mut rows = vec![Row::default(); count];
    let mut done = 0;
    let end = compute_rows_of(&wanted, threads, scratch, row, |patch, row| {
        rows[patch] = row;
        done += 1;
        watch(&Progress::FormFactors { done, total: count })
    });
    match end {
        ControlFlow::Continue(()) => Ok(FormFactors::from_rows(rows).on_threads(threads)),
        ControlFlow::Break(()) => Err(Interrupted),
    }
}

/// The other door: the rows of the patches `wanted` only, each handed to `sink` on the calling thread as it is done, in
/// no set order. Who keeps them can stop and go on later with those that are missing.
///
/// Breaks as soon as `sink` does; each thread still ends the row it is at, and what was not handed over yet is lost.
pub fn compute_rows_of<S>(
    wanted: &[u32],
    threads: usize,
    scratch: impl Fn() -> S + Sync,
    row: impl Fn(usize, &mut S) -> Row + Sync,
    mut sink: impl FnMut(usize, Row) -> ControlFlow<()>,
) -> ControlFlow<()> {
    let threads = match threads {
        0 => std::thread::available_parallelism().map_or(1, std::num::NonZero::get),
        given => given,
    };
    let next = AtomicUsize::new(0);
    let stop = AtomicBool::new(false);
    std::thread::scope(|scope| {
        let (sender, receiver) = mpsc::channel();
        for _ in 0..threads.min(wanted.len()) {
            let (sender, next, stop, scratch, row) = (sender.clone(), &next, &stop, &scratch, &row);
            scope.spawn(move || {
                let mut scratch = scratch();
                let mut done = Vec::new();
                let mut since = Instant::now();
                while !stop.load(Ordering::Relaxed) {
                    let place = next.fetch_add(1, Ordering::Relaxed);
                    let Some(&patch) = wanted.get(place) else { break };
                    let patch = patch as usize;
                    done.push((patch, row(patch, &mut scratch)));
                    if since.elapsed() >= TOGETHER {
                        if sender.send(std::mem::take(&mut done)).is_err() {
                            return;
                        }
                        since = Instant::now();
                    }
                }
                // Where nobody waits for them any more they are lost, as was said.
                let _ = sender.send(done);
            });
        }
        drop(sender);
        for (patch, row) in receiver.into_iter().flatten() {
            if sink(patch, row).is_break() {
                stop.store(true, Ordering::Relaxed);
                return ControlFlow::Break(());
            }
        }
        ControlFlow::Continue(())
    })
}

/// The threads that a pass over stored rows is shared among.
#[derive(Clone, Debug, Default)]
pub(super) enum Crew {
    /// Those of the rayon pool about it.
    #[default]
    About,
    /// The calling thread.
    Alone,
    /// So many: the rayon pool about it where that has as many, or else a pool of its own, made when it is first wanted. `None`
    /// in it where no threads can be had.
    Own(usize, Arc<OnceLock<Option<ThreadPool>>>),
}

/// Below so much work a pass is over before other threads have heard of it: a third of a million form factors. \[tiles\]
const WORTH_SHARING: usize = 8 * PIECE;

impl Crew {
    /// So many threads; 0: those about.
    pub(super) fn of(threads: usize) -> Self {
        match threads {
            0 => Self::About,
            1 => Self::Alone,
            _ => Self::Own(threads, Arc::default()),
        }
    }

    /// Have this much work (in tiles) done, told whether threads are there to share it.
    pub(super) fn run<T: Send>(&self, size: usize, work: impl FnOnce(bool) -> T + Send) -> T {
        if size < WORTH_SHARING {
            return work(false);
        }
        let about = || rayon::current_num_threads();
        match self {
            Self::Alone => work(false),
            Self::About if about() == 1 => work(false),
            Self::About => rayon::scope(|_| work(true)),
            Self::Own(threads, _) if about() == *threads => rayon::scope(|_| work(true)),
            Self::Own(threads, pool) => {
                match pool.get_or_init(|| ThreadPoolBuilder::new().num_threads(*threads).build().ok()) {
                    Some(pool) => pool.install(|| work(true)),
                    None => work(false),
                }
            }
        }
    }
}
