//! Hemicube rows, ours and Embree's, in alternation: `cargo run --release`, or `cargo run --release -- office` for
//! the scenes whose names hold a word. README.md beside this crate tells what is measured.

mod rival;
mod scenes;

use std::collections::BTreeMap;
use std::hint::black_box;

use radiosity::form_factors::Row;
use radiosity::form_factors::hemicube::{CellWeights, Face, Hemicube, Scratch, frame};
use radiosity::patches::{self, Patches};
use radiosity::scene::BackFaces;
use radiosity::simd::Level;
use radiosity::visibility::{Facets, RayTree};
use rival::Embree;
use scenes::Task;

const PRECISION: u32 = 100;
const RAYS: usize = 3 * (PRECISION * PRECISION) as usize;

/// Rows that one takes before the other has its turn, and how many turns.
const BATCH: usize = 8;
const TURNS: usize = 60;
/// Rows that are compared cell by cell.
const COMPARED: usize = 200;
/// Cells whose rays, moved by this much of a cell, meet another patch lie on an edge.
const ON_EDGE: f64 = 0.01;

fn main() {
    let mut wanted: Vec<String> = std::env::args().skip(1).map(|word| word.to_lowercase()).collect();
    let profiled = wanted.iter().any(|word| word == "profile");
    wanted.retain(|word| word != "profile");
    let chosen = |task: &Task| wanted.iter().all(|word| task.name.to_lowercase().contains(word));
    let tasks: Vec<_> = scenes::tasks().into_iter().filter(chosen).collect();
    println!("Hemicubes of {PRECISION}, {RAYS} rays; one thread; ours at {:?}.", Level::best());
    let (mut levels, mut checks) = (Vec::new(), Vec::new());
    for (index, task) in tasks.iter().enumerate() {
        let patches = patches::subdivide(&task.scene, task.subdivision).expect("patches");
        let facets = Facets::new(&task.scene, &patches);
        let weights = CellWeights::new(PRECISION).expect("a precision");
        if profiled {
            alone(&Hemicube::new(&patches, &facets, BackFaces::Lit, weights), patches.len(), task.name);
            continue;
        }
        let fast = Embree::new(&patches, &facets, &weights, false);
        let robust = Embree::new(&patches, &facets, &weights, true);
        let ours = Hemicube::new(&patches, &facets, BackFaces::Lit, weights);
        if index == 0 {
            let (version, native) = fast.about();
            let (version, native) = (version as f64 / 10_000.0, if native { "native" } else { "split" });
            println!("Embree {version:.4}, packets of 16: {native}.\n");
            println!(
                "| scene | facets | patches | ours, Mrays/s | Embree | it traces alone | ratio | Embree, robust | ratio |"
            );
            println!("|---|---|---|---|---|---|---|---|---|");
        }
        let times = race(&ours, &fast, &robust, &patches);
        let [mine, theirs, traced, watertight, avx2, portable] = times;
        let rate = |times: &[f64]| show(times.iter().map(|t| (BATCH * RAYS) as f64 / t / 1e6));
        let ratio = |slow: &[f64]| show(slow.iter().zip(&mine).map(|(slow, mine)| slow / mine));
        levels.push((task.name, [&portable, &avx2, &mine].map(|times| rate(times))));
        println!(
            "| {} | {} | {} | {} | {} | {} | {} | {} | {} |",
            task.name,
            facets.as_slice().len(),
            patches.len(),
            rate(&mine),
            rate(&theirs),
            rate(&traced),
            ratio(&theirs),
            rate(&watertight),
            ratio(&watertight)
        );
        let judge = Judge { patches: &patches, facets: &facets, tree: RayTree::new(&facets) };
        checks.push((task.name, compare(&ours, &fast, &judge), compare(&ours, &robust, &judge)));
    }
    if profiled {
        return;
    }
    println!("\nOurs in the same run, by what of the processor it may use (no more than there is):\n");
    println!("| scene | portable, Mrays/s | AVX2 | AVX-512 |\n|---|---|---|---|");
    for (name, [portable, avx2, avx512]) in &levels {
        println!("| {name} | {portable} | {avx2} | {avx512} |");
    }
    println!("\nMedians, in brackets the quartiles. Do both see the same patches?\n");
    println!(
        "| scene | Embree | cells that differ | of these at no edge | ours is right | its is right | missed by it alone | by us alone | row sums differ by | \
         rows differ by, mean | most | our row sums | its row sums |"
    );
    println!("|---|---|---|---|---|---|---|---|---|---|---|---|---|");
    for (name, fast, robust) in &checks {
        for (kind, check) in [("fast", fast), ("robust", robust)] {
            println!("| {name} | {kind} | {check}");
        }
    }
}

/// Ours alone, for five seconds, for a profiler to watch.
fn alone(ours: &Hemicube<'_>, patches: usize, name: &str) {
    let mut scratch = Scratch::default();
    let start = rival::seconds();
    let mut rows = 0;
    for patch in every_patch(patches) {
        drop(black_box(ours.row(patch, &mut scratch)));
        rows += 1;
        let taken = rival::seconds() - start;
        if taken > 5.0 {
            println!("{name}: {:.1} us a row", taken / f64::from(rows) * 1e6);
            break;
        }
    }
}

/// The times of each turn: ours, Embree's fast, its tracing alone, its robust, ours with AVX2, ours with neither.
fn race(ours: &Hemicube<'_>, fast: &Embree<'_>, robust: &Embree<'_>, patches: &Patches) -> [Vec<f64>; 6] {
    let mut scratch = Scratch::default();
    let mut dense = Vec::new();
    let mut times = [const { Vec::new() }; 6];
    let mut sample = every_patch(patches.len());
    for turn in 0..=TURNS {
        let batch: Vec<_> = sample.by_ref().take(BATCH).collect();
        // Each goes first in its turn.
        for k in 0..6 {
            let runner = (k + turn) % 6;
            let start = rival::seconds();
            for &patch in &batch {
                match runner {
                    0 => drop(black_box(ours.row(patch, &mut scratch))),
                    1 => drop(black_box(row(fast, patch, patches.len(), &mut dense))),
                    2 => fast.trace(patch),
                    3 => drop(black_box(row(robust, patch, patches.len(), &mut dense))),
                    4 => drop(black_box(ours.row_at(Level::Avx2, patch, &mut scratch))),
                    _ => drop(black_box(ours.row_at(Level::Portable, patch, &mut scratch))),
                }
            }
            // The first turn only warms up.
            if turn > 0 {
                times[runner].push(rival::seconds() - start);
            }
        }
    }
    times
}

fn row(embree: &Embree<'_>, patch: usize, count: usize, dense: &mut Vec<f64>) -> Row {
    dense.clear();
    dense.resize(count + 1, 0.0);
    embree.cast(patch, dense, None);
    Row::from_dense(&dense[..count])
}

/// Patches of all kinds, far apart, without end.
fn every_patch(count: usize) -> impl Iterator<Item = usize> {
    let stride = (0.618 * count as f64) as usize;
    let gcd = |mut a: usize, mut b: usize| {
        while b > 0 {
            (a, b) = (b, a % b);
        }
        a
    };
    let stride = (stride.max(1)..).find(|&stride| gcd(stride, count) == 1).unwrap_or(1);
    (0..).map(move |k| k * stride % count)
}

/// Median, and the quartiles in brackets.
fn show(values: impl Iterator<Item = f64>) -> String {
    let mut values: Vec<_> = values.collect();
    values.sort_by(f64::total_cmp);
    let at = |share: f64| values[(share * (values.len() - 1) as f64).round() as usize];
    let digits = match at(0.5) {
        ..1.0 => 2,
        ..30.0 => 1,
        _ => 0,
    };
    format!("{:.digits$} ({:.digits$}-{:.digits$})", at(0.5), at(0.25), at(0.75))
}

/// How two ways to see differ.
#[derive(Default)]
struct Check {
    cells: usize,
    differing: usize,
    /// Of these, those about which the judge finds not both patches.
    off_edges: usize,
    /// In which the judge's ray through the centre meets what Embree shows, and what we show.
    embree_right: usize,
    we_right: usize,
    missed_by_embree: usize,
    missed_by_us: usize,
    rows: usize,
    greatest_sum_difference: f64,
    variation: f64,
    greatest_variation: f64,
    our_sums: Range,
    embree_sums: Range,
}

struct Range(f64, f64);

impl Default for Range {
    fn default() -> Self {
        Self(f64::INFINITY, f64::NEG_INFINITY)
    }
}

impl Range {
    fn hold(&mut self, value: f64) {
        *self = Self(self.0.min(value), self.1.max(value));
    }
}

impl std::fmt::Display for Check {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        let share = self.differing as f64 / self.cells as f64;
        let Self {
            off_edges,
            missed_by_embree,
            missed_by_us,
            we_right,
            embree_right,
            greatest_sum_difference,
            ..
        } = self;
        write!(
            f,
            "{} of {} ({:.4} %) | {off_edges} | {we_right} | {embree_right} | ",
            self.differing,
            self.cells,
            100.0 * share
        )?;
        write!(f, "{missed_by_embree} | {missed_by_us} | {greatest_sum_difference:.1e} | ")?;
        write!(f, "{:.1e} | {:.1e} | ", self.variation / self.rows as f64, self.greatest_variation)?;
        let [ours, embree] = [&self.our_sums, &self.embree_sums];
        write!(f, "{:.6}-{:.6} | {:.6}-{:.6} |", ours.0, ours.1, embree.0, embree.1)
    }
}

/// Cell by cell, and row by row in total variation: half the sum of |F_ij - F'_ij|.
fn compare(ours: &Hemicube<'_>, embree: &Embree<'_>, judge: &Judge<'_>) -> Check {
    let patches = judge.patches;
    let nowhere = patches.len() as u32;
    let mut scratch = Scratch::default();
    let mut check = Check::default();
    let mut seen = vec![nowhere; RAYS];
    let mut dense = vec![0.0; patches.len() + 1];
    let sample: Vec<_> = every_patch(patches.len()).take(COMPARED.min(patches.len())).collect();
    for patch in sample {
        dense.fill(0.0);
        embree.cast(patch, &mut dense, Some(&mut seen));
        let mut theirs = &seen[..];
        for face in Face::ALL {
            let mine = ours.face(patch, face, &mut scratch);
            let mine: Vec<_> = mine.into_iter().map(|patch| patch.unwrap_or(nowhere)).collect();
            let (here, rest) = theirs.split_at(mine.len());
            check.cells += mine.len();
            for (cell, (&mine, &theirs)) in mine.iter().zip(here).enumerate().filter(|(_, (a, b))| a != b) {
                check.differing += 1;
                check.missed_by_embree += usize::from(theirs == nowhere);
                check.missed_by_us += usize::from(mine == nowhere);
                let met = judge.met(patch, face, cell);
                check.off_edges += usize::from(!(met.contains(&mine) && met.contains(&theirs)));
                check.we_right += usize::from(met[0] == mine);
                check.embree_right += usize::from(met[0] == theirs);
            }
            theirs = rest;
        }
        let row = ours.row(patch, &mut scratch);
        let mut difference: BTreeMap<usize, f64> = row.iter().collect();
        for (j, &weight) in dense[..patches.len()].iter().enumerate().filter(|(_, weight)| **weight > 0.0) {
            *difference.entry(j).or_default() -= weight;
        }
        let variation = 0.5 * difference.values().map(|d| d.abs()).sum::<f64>();
        let (mine, theirs) = (row.sum(), dense[..patches.len()].iter().sum::<f64>());
        check.rows += 1;
        check.variation += variation;
        check.greatest_variation = check.greatest_variation.max(variation);
        check.greatest_sum_difference = check.greatest_sum_difference.max((mine - theirs).abs());
        check.our_sums.hold(mine);
        check.embree_sums.hold(theirs);
    }
    check
}

/// Rays in double precision, one by one.
struct Judge<'a> {
    patches: &'a Patches,
    facets: &'a Facets,
    tree: RayTree<'a>,
}

impl Judge<'_> {
    /// What the rays through a cell's centre, and around it, meet.
    fn met(&self, patch: usize, face: Face, cell: usize) -> Vec<u32> {
        let (eye, axes) = (self.patches.centre[patch], frame(self.patches, patch));
        let width = PRECISION as usize;
        let view = face.view(eye, axes, width);
        // Not what is flush with the patch, nor what is seen edge-on.
        let horizon = 1e-9 * self.facets.extent();
        let above = |number: u32| {
            let facet = &self.facets[number];
            let above = facet.greatest_height(eye, axes[2]) > horizon
                && facet.normal.dot(facet.origin - eye).abs() > horizon;
            above.then_some(0)
        };
        let met = |dx: f64, dy: f64| {
            let (x, y) = ((cell % width) as f64 + dx, (cell / width) as f64 + dy);
            let hit = self.tree.nearest(eye, view.direction(x, y), f64::INFINITY, above);
            hit.map_or(self.patches.len() as u32, |hit| self.facets[hit.facet].patch_at(hit.u, hit.v))
        };
        let beside = [0.0, -ON_EDGE, ON_EDGE];
        beside.iter().flat_map(|&dx| beside.map(|dy| met(dx, dy))).collect()
    }
}
