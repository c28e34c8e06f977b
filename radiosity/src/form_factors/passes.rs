//! Rows as a solver asks for them: all in patch order, pass after pass, or one alone.
//!
//! Where the rows fit into memory they are stored, and a pass reads them. Where they do not, as many are kept as fit and
//! the others found anew at every pass, in parallel, a batch at a time. A row is the same bits whenever it is found, so
//! the answer is the same, too.

use std::fmt;
use std::ops::ControlFlow;
use std::sync::{Mutex, PoisonError};

use super::bands::Band;
use super::parallel::compute_rows_of;
use super::rows::{FormFactors, Row};
use crate::watch::{Interrupted, Progress, Watch};

/// Rows, stored or not.
pub trait Passes {
    /// How many there are, one a patch.
    fn count(&self) -> usize;

    /// Show every row to `visit`, in patch order. Where rows have to be found for it, `watch` is told of each.
    ///
    /// # Errors
    /// [`Interrupted`] where `watch` says stop.
    fn pass(&self, watch: &mut Watch<'_>, visit: impl FnMut(usize, &Row)) -> Result<(), Interrupted>;

    /// The same with as many rows at a time as are at hand together.
    ///
    /// # Errors
    /// As of [`Passes::pass`].
    fn pass_bands(&self, watch: &mut Watch<'_>, mut visit: impl FnMut(Band<'_>)) -> Result<(), Interrupted> {
        self.pass(watch, |patch, row| visit(Band::of_one(patch, row)))
    }

    /// Show row i alone.
    fn with_row<T>(&self, patch: usize, visit: impl FnOnce(&Row) -> T) -> T;
}

impl Passes for FormFactors {
    fn count(&self) -> usize {
        self.len()
    }

    fn pass(&self, _: &mut Watch<'_>, mut visit: impl FnMut(usize, &Row)) -> Result<(), Interrupted> {
        for (patch, row) in self.rows().iter().enumerate() {
            if let Some(next) = self.rows().get(patch + 1) {
                next.fetch();
            }
            visit(patch, row);
        }
        Ok(())
    }

    fn pass_bands(&self, _: &mut Watch<'_>, visit: impl FnMut(Band<'_>)) -> Result<(), Interrupted> {
        self.bands().for_each(visit);
        Ok(())
    }

    fn with_row<T>(&self, patch: usize, visit: impl FnOnce(&Row) -> T) -> T {
        visit(self.row(patch))
    }
}

/// Rows that are found anew at every pass, but for the first of them, which are kept.
pub struct RecomputedRows<S, M, F> {
    count: usize,
    threads: usize,
    batch: usize,
    scratch: M,
    /// One that is at hand for rows asked for alone.
    spare: Mutex<Option<Box<S>>>,
    row: F,
    kept: Vec<Row>,
    row_sums: (f64, f64),
    nonzeros: usize,
}

impl<S, M, F> fmt::Debug for RecomputedRows<S, M, F> {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let (count, kept) = (self.count, self.kept.len());
        f.debug_struct("RecomputedRows").field("count", &count).field("kept", &kept).finish_non_exhaustive()
    }
}

impl<S, M: Fn() -> S + Sync, F: Fn(usize, &mut S) -> Row + Sync> RecomputedRows<S, M, F> {
    /// Row i of `count` is `row(i, scratch)`, found on `threads` threads (0: one a core), each with a scratch of its own
    /// from `scratch()`; `batch` rows are held at a time, and besides them as many of the first as take no more than
    /// `kept_bytes`. All rows are found once, here.
    ///
    /// # Errors
    /// [`Interrupted`] as soon as `watch`, told of every row, says stop.
    pub fn new(
        count: usize,
        threads: usize,
        (batch, kept_bytes): (usize, u64),
        scratch: M,
        row: F,
        watch: &mut Watch<'_>,
    ) -> Result<Self, Interrupted> {
        let (kept, row_sums, nonzeros) = (Vec::new(), (f64::INFINITY, f64::NEG_INFINITY), 0);
        let (batch, spare) = (batch.max(1), Mutex::new(None));
        let mut rows = Self { count, threads, batch, scratch, spare, row, kept, row_sums, nonzeros };
        let (mut kept, mut left, mut nonzeros, (mut low, mut high)) =
            (Vec::new(), Some(kept_bytes), 0, row_sums);
        rows.pass(watch, |_, row| {
            left = left.and_then(|left| left.checked_sub(row.bytes()));
            if left.is_some() {
                kept.push(row.clone());
            }
            nonzeros += row.len();
            let sum = row.sum();
            (low, high) = (low.min(sum), high.max(sum));
        })?;
        kept.shrink_to_fit();
        (rows.kept, rows.nonzeros) = (kept, nonzeros);
        rows.row_sums = if count == 0 { (1.0, 1.0) } else { (low, high) };
        Ok(rows)
    }

    /// How many rows are kept.
    pub fn kept(&self) -> usize {
        self.kept.len()
    }

    /// How many form factors all rows have together.
    pub fn nonzeros(&self) -> usize {
        self.nonzeros
    }

    /// The least and the greatest row sum, as of [`FormFactors::row_sum_range`].
    pub fn row_sum_range(&self) -> (f64, f64) {
        self.row_sums
    }
}

impl<S, M: Fn() -> S + Sync, F: Fn(usize, &mut S) -> Row + Sync> Passes for RecomputedRows<S, M, F> {
    fn count(&self) -> usize {
        self.count
    }

    fn pass(&self, watch: &mut Watch<'_>, mut visit: impl FnMut(usize, &Row)) -> Result<(), Interrupted> {
        for (patch, row) in self.kept.iter().enumerate() {
            visit(patch, row);
        }
        let (mut first, total) = (self.kept.len(), self.count);
        while first < total {
            let wanted: Vec<u32> = (first..total.min(first + self.batch)).map(|patch| patch as u32).collect();
            let mut found = vec![Row::default(); wanted.len()];
            let mut done = first;
            let end = compute_rows_of(&wanted, self.threads, &self.scratch, &self.row, |patch, row| {
                found[patch - first] = row;
                done += 1;
                watch(&Progress::FormFactors { done, total })
            });
            if let ControlFlow::Break(()) = end {
                return Err(Interrupted);
            }
            for (row, patch) in found.iter().zip(first..) {
                visit(patch, row);
            }
            first += wanted.len();
        }
        Ok(())
    }

    fn with_row<T>(&self, patch: usize, visit: impl FnOnce(&Row) -> T) -> T {
        match self.kept.get(patch) {
            Some(row) => visit(row),
            None => {
                // A scratch takes longer to make than a row; nobody holds this lock while a row is found.
                let spare = || self.spare.lock().unwrap_or_else(PoisonError::into_inner);
                let mut scratch = spare().take().unwrap_or_else(|| Box::new((self.scratch)()));
                let row = (self.row)(patch, &mut scratch);
                *spare() = Some(scratch);
                visit(&row)
            }
        }
    }
}
