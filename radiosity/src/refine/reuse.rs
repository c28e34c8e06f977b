//! Rows of a cut before that are rows of the next.
//!
//! A row that sees nothing of what is quartered stays as it is, to the bit, but for the numbers of its columns. By exact form
//! factors a row that sees a quartered patch as it is seen by it stays, too: what it exchanges with the quarters is in
//! their rows, A_i F_ij = A_j F_ji. A hemicube's rows know no reciprocity; one that sees anything new is found anew, and is so
//! what it would be had there been no other cut before.

use std::ops::ControlFlow;

use crate::bake::{RowFinder, Scratch};
use crate::form_factors::{FormFactors, Packing, Row, compute_rows_of};
use crate::patches::Patches;
use crate::watch::{Interrupted, Progress, Watch};

/// Patches and their rows.
pub(super) struct Before<'a> {
    pub(super) patches: &'a Patches,
    pub(super) factors: &'a FormFactors,
}

/// What two rows have of one exchange is the same where it differs by no more than this share: a patch that sees another's back,
/// or what is covered, is not seen by it.
const RECIPROCAL: f64 = 1e-4;

/// Form factors below this are not asked whether they are reciprocal: rounding could have made them nothing.
const NEGLIGIBLE: f64 = 1e-12;

/// A column that has no place in the new cut.
const GONE: u32 = u32::MAX;

impl Before<'_> {
    /// What it takes in memory while the new rows are found, besides them.
    pub(super) fn bytes(&self, exact: bool) -> u64 {
        // Entries that are read by column, at most all of both cuts.
        self.factors.bytes() + if exact { 2 * 8 * self.factors.nonzeros() as u64 } else { 0 }
    }
}

/// The rows of `patches`, and how many of them were found; patch i was `was[i]`, where it is not new. `row` finds a row. `exact`
/// where A_i F_ij = A_j F_ji.
///
/// # Errors
/// [`Interrupted`].
pub(super) fn rows(
    before: &Before<'_>,
    patches: &Patches,
    was: &[Option<u32>],
    exact: bool,
    row: RowFinder<'_>,
    threads: usize,
    watch: &mut Watch<'_>,
) -> Result<(FormFactors, usize), Interrupted> {
    let mut now = vec![GONE; before.patches.len()];
    for (was, i) in was.iter().zip(0..) {
        if let Some(was) = was {
            now[*was as usize] = i;
        }
    }
    let areas = [before.patches, patches].map(flat_areas);
    let gone = |j: usize| now[j] == GONE;
    // What the rows of those that are gone say of those that see them.
    let mut seen_by = vec![Vec::new(); if exact { now.len() } else { 0 }];
    if exact {
        for j in (0..now.len()).filter(|&j| gone(j)) {
            for (i, factor) in before.factors.row(j).iter().filter(|&(i, _)| !gone(i)) {
                seen_by[i].push((j, factor * areas[0][j] / areas[0][i]));
            }
        }
    }
    let stays = |i: usize| {
        let mut sees = before.factors.row(i).iter().filter(|&(j, _)| gone(j));
        if !exact {
            return sees.next().is_none();
        }
        agree(sees, seen_by[i].iter().copied())
    };
    let kept: Vec<bool> = was.iter().map(|was| was.is_some_and(|was| stays(was as usize))).collect();
    drop(seen_by);

    let numbers = |wanted: bool| -> Vec<u32> {
        (0..patches.len() as u32).filter(|&i| kept[i as usize] == wanted).collect()
    };
    let mut rows = vec![Row::default(); patches.len()];
    let fresh = numbers(false);
    let mut done = 0;
    let end = compute_rows_of(&fresh, threads, Scratch::default, row, |patch, row| {
        rows[patch] = row;
        done += 1;
        watch(&Progress::FormFactors { done, total: fresh.len() })
    });
    if end.is_break() {
        return Err(Interrupted);
    }
    // What they exchange with those that stay.
    let mut new: Vec<Vec<(u32, f32)>> = vec![Vec::new(); patches.len()];
    if exact {
        for &j in fresh.iter().filter(|&&j| was[j as usize].is_none()) {
            for (i, factor) in rows[j as usize].iter().filter(|&(i, _)| kept[i]) {
                new[i].push((j, (factor * areas[1][j as usize] / areas[1][i]) as f32));
            }
        }
    }
    let full = || (vec![0.0; patches.len()], Packing::default());
    let stays = |i: usize, (full, packing): &mut (Vec<f64>, Packing)| {
        let old = before.factors.row(was[i].unwrap_or_default() as usize);
        for (j, factor) in old.iter().filter(|&(j, _)| !gone(j)) {
            full[now[j] as usize] = factor;
        }
        for &(j, factor) in &new[i] {
            full[j as usize] = f64::from(factor);
        }
        Row::take_dense(full, packing).with_elsewhere(old.elsewhere())
    };
    let end = compute_rows_of(&numbers(true), threads, full, stays, |patch, row| {
        rows[patch] = row;
        ControlFlow::Continue(())
    });
    debug_assert!(end.is_continue(), "nobody says stop");
    Ok((FormFactors::from_rows(rows).on_threads(threads), fresh.len()))
}

/// Whether two lists of entries, in ascending order, say the same.
fn agree(one: impl Iterator<Item = (usize, f64)>, other: impl Iterator<Item = (usize, f64)>) -> bool {
    let counts = |&(_, factor): &(usize, f64)| factor > NEGLIGIBLE;
    let same = |((i, one), (j, other)): ((usize, f64), (usize, f64))| {
        i == j && (one - other).abs() <= RECIPROCAL * one.max(other)
    };
    let (mut one, mut other) = (one.filter(counts), other.filter(counts));
    loop {
        match (one.next(), other.next()) {
            (None, None) => return true,
            (Some(one), Some(other)) if same((one, other)) => {}
            _ => return false,
        }
    }
}

/// The areas of the flat parts of patches, which exact rows go by.
fn flat_areas(patches: &Patches) -> Vec<f64> {
    let mut areas = patches.area.clone();
    for (block, pieces) in patches.blocks.iter().zip(&patches.pieces) {
        let Some(pieces) = pieces else { continue };
        areas[block.patches()].fill(0.0);
        for (&[a, b, c], &patch) in pieces.triangles.iter().zip(&pieces.patch) {
            areas[patch as usize] += (b - a).cross(c - a).length() * 0.5;
        }
    }
    areas
}
