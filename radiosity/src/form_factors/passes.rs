//! Rows as a solver asks for them: all in patch order, pass after pass, or one alone.
//!
//! Where the rows fit into memory they are stored, and a pass reads them. Where they do not, as many are kept as fit and
//! the others found anew at every pass, in parallel, a batch at a time. A row is the same bits whenever it is found, so
//! the answer is the same, too.

use std::fmt;
use std::ops::ControlFlow;
use std::sync::{Mutex, PoisonError};

use super::bands::{Stretch, rows_a_piece};
use super::parallel::compute_rows_of;
use super::rows::{Blocks, FormFactors, LightBlocks, Row};
use crate::light::Rgb;
use crate::watch::{Interrupted, Progress, Watch};

/// What each row gathers, and what all of them send to each patch.
pub type Gathered<const CHANNELS: usize> = (Vec<[f64; CHANNELS]>, Blocks<CHANNELS>);

/// Rows, stored or not.
pub trait Passes: Sync {
    /// How many there are, one a patch.
    fn count(&self) -> usize;

    /// Show every row to `visit`, in patch order. Where rows have to be found for it, `watch` is told of each.
    ///
    /// # Errors
    /// [`Interrupted`] where `watch` says stop.
    fn pass(&self, watch: &mut Watch<'_>, visit: impl FnMut(usize, &Row)) -> Result<(), Interrupted>;

    /// The same with as many rows at a time as may gather at once.
    ///
    /// # Errors
    /// As of [`Passes::pass`].
    fn pass_stretches(
        &self,
        watch: &mut Watch<'_>,
        mut visit: impl FnMut(Stretch<'_>) + Send,
    ) -> Result<(), Interrupted> {
        self.pass(watch, |patch, row| visit(Stretch::of_one(patch, row)))
    }

    /// F b: [`Row::gather`] of each row.
    ///
    /// # Errors
    /// As of [`Passes::pass`].
    fn gather(&self, watch: &mut Watch<'_>, b: &LightBlocks) -> Result<Vec<Rgb>, Interrupted> {
        let mut gathered = Vec::with_capacity(self.count());
        self.pass(watch, |_, row| gathered.push(row.gather_blocks(b)))?;
        Ok(gathered)
    }

    /// F b and Fᵀ x, x being `power`: what each row gathers of `b`, and what all rows together send to each patch. The latter
    /// is summed in pieces of some hundreds of rows or more each, whatever the number of threads, then piece by piece.
    ///
    /// # Errors
    /// As of [`Passes::pass`].
    fn gather_and_scatter<const CHANNELS: usize>(
        &self,
        watch: &mut Watch<'_>,
        b: &Blocks<CHANNELS>,
        power: &[[f64; CHANNELS]],
    ) -> Result<Gathered<CHANNELS>, Interrupted> {
        let size = rows_a_piece(self.count());
        let mut gathered = Vec::with_capacity(self.count());
        let (mut sum, mut piece) = (Blocks::black(self.count()), Blocks::black(self.count()));
        self.pass(watch, |i, row| {
            gathered.push(row.gather_and_scatter(b, power[i], &mut piece));
            if (i + 1) % size == 0 {
                sum.add(&piece);
                piece.clear();
            }
        })?;
        sum.add(&piece);
        Ok((gathered, sum))
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

    fn pass_stretches(
        &self,
        _: &mut Watch<'_>,
        visit: impl FnMut(Stretch<'_>) + Send,
    ) -> Result<(), Interrupted> {
        self.each_stretch(visit);
        Ok(())
    }

    fn gather(&self, _: &mut Watch<'_>, b: &LightBlocks) -> Result<Vec<Rgb>, Interrupted> {
        let mut gathered = Vec::new();
        self.at_once(|all| all.gather(b, &mut gathered));
        Ok(gathered)
    }

    fn gather_and_scatter<const CHANNELS: usize>(
        &self,
        _: &mut Watch<'_>,
        b: &Blocks<CHANNELS>,
        power: &[[f64; CHANNELS]],
    ) -> Result<Gathered<CHANNELS>, Interrupted> {
        Ok(self.at_once(|all| all.gather_and_scatter(b, power)))
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

impl<S: Send, M: Fn() -> S + Sync, F: Fn(usize, &mut S) -> Row + Sync> RecomputedRows<S, M, F> {
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

impl<S: Send, M: Fn() -> S + Sync, F: Fn(usize, &mut S) -> Row + Sync> Passes for RecomputedRows<S, M, F> {
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

#[cfg(test)]
mod tests {
    use super::*;
    use crate::form_factors::GreyBlocks;
    use crate::watch::ignore;

    /// Rows shown one by one, as those are that are found anew.
    struct OneByOne(Vec<Row>);

    impl Passes for OneByOne {
        fn count(&self) -> usize {
            self.0.len()
        }

        fn pass(&self, _: &mut Watch<'_>, mut visit: impl FnMut(usize, &Row)) -> Result<(), Interrupted> {
            self.0.iter().enumerate().for_each(|(patch, row)| visit(patch, row));
            Ok(())
        }

        fn with_row<T>(&self, patch: usize, visit: impl FnOnce(&Row) -> T) -> T {
            visit(&self.0[patch])
        }
    }

    #[test]
    fn products_are_the_same_bits_on_any_number_of_threads_and_row_by_row() {
        // Enough to be shared, in more pieces than one: every third patch is seen, and not those nearby.
        let count = 1303;
        let factor = |i: usize, j: usize| match (i + j) % 3 {
            0 if i / 200 != j / 200 => ((i * 31 + j * 17) % 101 + 1) as f64 * 1e-5,
            _ => 0.0,
        };
        let mut full = vec![0.0; count];
        let rows: Vec<Row> = (0..count)
            .map(|i| {
                full.iter_mut().enumerate().for_each(|(j, full)| *full = factor(i, j));
                Row::from_dense(&full)
            })
            .collect();
        assert!(count > rows_a_piece(count), "of one piece only");
        let wave = |k: usize, step: f64| (k as f64 * step).sin();
        let light: Vec<Rgb> =
            (0..count).map(|k| Rgb::new(wave(k, 0.7), wave(k, 1.3), wave(k, 2.9))).collect();
        let (power, grey): (Vec<_>, Vec<_>) =
            light.iter().rev().map(|light| (light.to_array(), [light.g])).unzip();
        let blocks: LightBlocks = light.iter().copied().collect();
        let grey_blocks = GreyBlocks::new(&light.iter().map(|light| light.g).collect::<Vec<_>>());

        let plain = OneByOne(rows.clone());
        let gathered = plain.gather(&mut ignore, &blocks).unwrap();
        let both = plain.gather_and_scatter(&mut ignore, &blocks, &power).unwrap();
        let both_grey = plain.gather_and_scatter(&mut ignore, &grey_blocks, &grey).unwrap();
        assert!(gathered.iter().zip(&both.0).all(|(gathered, both)| gathered.to_array() == *both));
        // What is sent, told plainly.
        for j in [0, 640, count - 1] {
            let sent: Rgb = (0..count).map(|i| Rgb::from(power[i]) * rows[i].get(j)).sum();
            let off = (both.1.get(j) - sent).norm_squared().sqrt();
            assert!(off < 1e-12 && (both_grey.1.channels(j)[0] - sent.g).abs() < 1e-12, "{off:e}");
        }
        for threads in [0, 1, 2, 3] {
            let stored = FormFactors::from_rows(rows.clone()).on_threads(threads);
            assert_eq!(stored.gather(&mut ignore, &blocks).unwrap(), gathered);
            assert_eq!(stored.gather_and_scatter(&mut ignore, &blocks, &power).unwrap(), both);
            assert_eq!(stored.gather_and_scatter(&mut ignore, &grey_blocks, &grey).unwrap(), both_grey);
        }
    }
}
