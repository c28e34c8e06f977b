//! Exact rows that are all kept: each pair of patches is worked out once, for both of its rows.
//!
//! Patches look out sixteen at a time, in the order of their numbers, each at those after it. What they find is packed
//! away, once for the looker's row, and turned, a tile of sixteen by sixteen, for the rows of the others. The rows of
//! sixteen patches are made as soon as all before them have looked out, and the tiles they are made of given back: what
//! waits and what is done never take more than some [`WAITING`] times what all rows do.
//!
//! The sums are of numbers that add up without rounding, so a row has the bits that it has by itself
//! ([`ExactVisible::row`]), whoever came first.

use std::ops::ControlFlow;
use std::sync::atomic::{AtomicBool, AtomicUsize, Ordering};
use std::sync::mpsc::{self, RecvTimeoutError};
use std::sync::{Mutex, PoisonError};
use std::time::{Duration, Instant};

use super::rows::{FormFactors, Packing, Row};
use super::visible::{Asked, ExactVisible, Scratch};
use crate::simd::{LANES, Level};
use crate::watch::{Interrupted, Progress, Watch};

/// How much memory it takes at most to find rows, in terms of what they take themselves: where a share x of the patches
/// has looked out, x of the rows is done and x (1 - x) waits, at twice as much an entry, which is 1.125 at most; and a
/// fifth is lost between what was given back and what is kept (1.33 in all, measured with 8,515 patches).
pub const WAITING: f64 = 1.35;

/// What is found within this time is handed over together.
const TOGETHER: Duration = Duration::from_millis(4);

/// Who watches is asked at least so often, whether there is news or not.
const PATIENCE: Duration = Duration::from_millis(100);

/// What sixteen patches that follow each other, from `first` on, exchange with sixteen others.
#[derive(Debug)]
struct Tile {
    first: usize,
    /// For each of the others, a bit for each of the sixteen that it exchanges anything with, and how much, others first.
    masks: [u16; LANES],
    values: Box<[f64]>,
}

/// What a patch found when it looked out itself.
#[derive(Debug, Default)]
struct Own {
    columns: Box<[u32]>,
    values: Box<[f64]>,
}

/// Sixteen patches, on their way to rows.
#[derive(Debug, Default)]
struct Block {
    own: Vec<Own>,
    tiles: Vec<Tile>,
}

/// Who has looked out, and whose rows are made.
#[derive(Debug, Default)]
struct Order {
    looked: Vec<bool>,
    /// All before this have looked out.
    complete: usize,
    /// The rows of all before this are made, or being made.
    made: usize,
}

/// What is handed over: for how many patches it was asked what they exchange with how many others, and rows.
type News = (u64, Vec<(usize, Row)>);

impl ExactVisible {
    /// All rows, on `threads` threads (0: one a core), the same bits on any number of them. Each thread has a closure of
    /// `finisher`'s, which is shown every row before it is kept. `watch` is told on the calling thread how many rows what
    /// is done is worth.
    ///
    /// # Errors
    /// [`Interrupted`] as soon as `watch` says stop, which is asked several times a second.
    pub fn rows<F: FnMut(usize, Row) -> Row>(
        &self,
        threads: usize,
        finisher: impl Fn() -> F + Sync,
        watch: &mut Watch<'_>,
    ) -> Result<FormFactors, Interrupted> {
        let total = self.count();
        let mut rows = vec![Row::default(); total];
        let work = self.work(None);
        let mut worked = 0;
        let end = self.find(None, threads, finisher, |(more, found)| {
            worked += more;
            for (patch, row) in found {
                rows[patch] = row;
            }
            let share = if work > 0 { worked as f64 / work as f64 } else { 1.0 };
            watch(&Progress::FormFactors { done: (share * total as f64) as usize, total })
        });
        match end {
            ControlFlow::Continue(()) => Ok(FormFactors::from_rows(rows).on_threads(threads)),
            ControlFlow::Break(()) => Err(Interrupted),
        }
    }

    /// The other door, for patches that have come new among others whose rows are there: the rows of those that are
    /// `new` (a flag a patch), whole, and of each of the others what it sends to the new ones, a row of those columns
    /// alone, which no closure of `finisher`'s is shown. Each is handed to `sink` on the calling thread, in no set order.
    ///
    /// Breaks as soon as `sink` does.
    pub fn rows_of_new<F: FnMut(usize, Row) -> Row>(
        &self,
        new: &[bool],
        threads: usize,
        finisher: impl Fn() -> F + Sync,
        mut sink: impl FnMut(usize, Row) -> ControlFlow<()>,
    ) -> ControlFlow<()> {
        self.find(Some(new), threads, finisher, |(_, found)| {
            found.into_iter().try_for_each(|(patch, row)| sink(patch, row))
        })
    }

    /// Pairs, and as many again for the rows.
    fn work(&self, new: Option<&[bool]>) -> u64 {
        (0..self.count()).map(|patch| self.work_of(patch, new)).sum()
    }

    /// How many others a patch is the first of.
    fn work_of(&self, patch: usize, new: Option<&[bool]>) -> u64 {
        if new.is_none_or(|new| new[patch]) { (self.count() - patch) as u64 } else { 0 }
    }

    fn find<F: FnMut(usize, Row) -> Row>(
        &self,
        new: Option<&[bool]>,
        threads: usize,
        finisher: impl Fn() -> F + Sync,
        mut sink: impl FnMut(News) -> ControlFlow<()>,
    ) -> ControlFlow<()> {
        let threads = match threads {
            0 => std::thread::available_parallelism().map_or(1, std::num::NonZero::get),
            given => given,
        };
        let blocks = self.count().div_ceil(LANES);
        let finding = Finding {
            method: self,
            new,
            one_way: self.one_way(),
            blocks: (0..blocks).map(|_| Mutex::default()).collect(),
            next: AtomicUsize::new(0),
            order: Mutex::new(Order { looked: vec![false; blocks], ..Order::default() }),
            stop: AtomicBool::new(false),
        };
        std::thread::scope(|scope| {
            let (sender, receiver) = mpsc::channel();
            for _ in 0..threads.min(blocks) {
                let (sender, finding, finisher) = (sender.clone(), &finding, &finisher);
                scope.spawn(move || {
                    let finish = finisher();
                    let mut worker =
                        Worker { finding, finish, sender, done: (0, Vec::new()), since: Instant::now() };
                    // Where nobody waits any more for what is found, it is lost, as was said.
                    if worker.work().is_some() {
                        let _ = worker.sender.send(worker.done);
                    }
                });
            }
            drop(sender);
            loop {
                // A patch among very many takes seconds.
                let news = match receiver.recv_timeout(PATIENCE) {
                    Ok(news) => news,
                    Err(RecvTimeoutError::Timeout) => News::default(),
                    Err(RecvTimeoutError::Disconnected) => return ControlFlow::Continue(()),
                };
                if sink(news).is_break() {
                    finding.stop.store(true, Ordering::Relaxed);
                    return ControlFlow::Break(());
                }
            }
        })
    }
}

/// What all threads share.
struct Finding<'a> {
    method: &'a ExactVisible,
    new: Option<&'a [bool]>,
    one_way: bool,
    blocks: Vec<Mutex<Block>>,
    /// The next block that is to look out.
    next: AtomicUsize,
    order: Mutex<Order>,
    stop: AtomicBool,
}

fn locked<T>(mutex: &Mutex<T>) -> std::sync::MutexGuard<'_, T> {
    mutex.lock().unwrap_or_else(PoisonError::into_inner)
}

/// One thread.
struct Worker<'a, F> {
    finding: &'a Finding<'a>,
    finish: F,
    sender: mpsc::Sender<News>,
    done: News,
    since: Instant,
}

/// What a thread works in.
#[derive(Default)]
struct Memory {
    scratch: Scratch,
    /// What each of sixteen patches exchanges with every other both ways, and what only it sees.
    both_ways: Vec<f64>,
    one_way: Vec<f64>,
    /// What one of them exchanges anything with, and how much.
    columns: Vec<u32>,
    values: Vec<f64>,
    row: Vec<f64>,
    packing: Packing,
}

impl<F: FnMut(usize, Row) -> Row> Worker<'_, F> {
    /// Work until there is nothing left; `None` where nobody waits for it any more.
    fn work(&mut self) -> Option<()> {
        let (finding, mut memory) = (self.finding, Memory::default());
        loop {
            let block = finding.next.fetch_add(1, Ordering::Relaxed);
            if block >= finding.blocks.len() {
                return Some(());
            }
            self.look_out(block, &mut memory)?;
            let mut order = locked(&finding.order);
            order.looked[block] = true;
            while order.looked.get(order.complete) == Some(&true) {
                order.complete += 1;
            }
            // Patches that are not new wait for all.
            let all = order.complete == finding.blocks.len();
            if finding.new.is_some() && !all {
                continue;
            }
            while order.made < order.complete {
                let block = order.made;
                order.made += 1;
                drop(order);
                self.make_rows(block, &mut memory)?;
                order = locked(&finding.order);
            }
        }
    }

    /// Hand over what is done, if it is time.
    fn tell(&mut self) -> Option<()> {
        if self.since.elapsed() >= TOGETHER {
            self.sender.send(std::mem::take(&mut self.done)).ok()?;
            self.since = Instant::now();
        }
        (!self.finding.stop.load(Ordering::Relaxed)).then_some(())
    }

    /// Have a block of patches look out, and put away what they find.
    fn look_out(&mut self, block: usize, memory: &mut Memory) -> Option<()> {
        let Finding { method, new, one_way, ref blocks, .. } = *self.finding;
        let count = method.count();
        let width = blocks.len() * LANES;
        memory.both_ways.resize(width * LANES, 0.0);
        memory.one_way.resize(if one_way { width * LANES } else { 0 }, 0.0);
        let first = block * LANES;
        let last = count.min(first + LANES);
        let asked = new.map_or(Asked::Once, Asked::New);
        for patch in first..last {
            let at = (patch - first) * width;
            let Memory { scratch, both_ways, one_way, .. } = memory;
            method.exchanges(Level::best(), patch, asked, &self.finding.stop, scratch, |found| {
                let other = found.patch as usize;
                let exchange = method.rounded(patch, other, found.exchange);
                let to = if found.both_ways { &mut *both_ways } else { &mut *one_way };
                to[at + other] += exchange;
            });
            self.done.0 += method.work_of(patch, new);
            self.tell()?;
        }
        let mut own: Vec<Own> = (first..last).map(|_| Own::default()).collect();
        for (k, own) in own.iter_mut().enumerate() {
            let Memory { both_ways, one_way: ways, columns, values, .. } = &mut *memory;
            let both_ways = &both_ways[k * width..][..count];
            columns.resize(count, 0);
            values.resize(count, 0.0);
            let mut found = 0;
            for (column, &both) in both_ways.iter().enumerate() {
                let mut value = both;
                if one_way {
                    value += std::mem::take(&mut ways[k * width + column]);
                }
                // Written in any case, and kept where it counts: what is seen and what not, no processor foresees.
                (columns[found], values[found]) = (column as u32, value);
                found += usize::from(value > 0.0);
            }
            (own.columns, own.values) = (columns[..found].into(), values[..found].into());
        }
        for (number, other) in blocks.iter().enumerate() {
            if let Some(tile) = Tile::turned(first, number, width, &mut memory.both_ways) {
                locked(other).tiles.push(tile);
            }
        }
        locked(&blocks[block]).own = own;
        Some(())
    }

    /// Make the rows of a block of patches.
    fn make_rows(&mut self, block: usize, memory: &mut Memory) -> Option<()> {
        let Finding { method, new, ref blocks, .. } = *self.finding;
        let Block { own, tiles } = std::mem::take(&mut *locked(&blocks[block]));
        memory.row.resize(method.count(), 0.0);
        let mut starts = vec![0; tiles.len()];
        for (k, own) in own.into_iter().enumerate() {
            let patch = block * LANES + k;
            for (column, value) in own.columns.into_iter().zip(own.values) {
                memory.row[column as usize] = value;
            }
            for (tile, start) in tiles.iter().zip(&mut starts) {
                let mut mask = tile.masks[k];
                if mask == u16::MAX {
                    let values = &tile.values[*start..][..LANES];
                    for (sum, value) in memory.row[tile.first..][..LANES].iter_mut().zip(values) {
                        *sum += value;
                    }
                    *start += LANES;
                    continue;
                }
                while mask != 0 {
                    memory.row[tile.first + mask.trailing_zeros() as usize] += tile.values[*start];
                    *start += 1;
                    mask &= mask - 1;
                }
            }
            let row = method.row_of(patch, &mut memory.row, &mut memory.packing);
            let whole = new.is_none_or(|new| new[patch]);
            let row = if whole { (self.finish)(patch, row) } else { row };
            self.done.1.push((patch, row));
            self.tell()?;
        }
        Some(())
    }
}

impl Tile {
    /// Of sixteen rows of `width` numbers, those of the sixteen columns of a block, which are black when it comes back.
    /// What a patch exchanges with itself stands in its row already.
    fn turned(first: usize, block: usize, width: usize, rows: &mut [f64]) -> Option<Self> {
        // Read row after row, a line of the cache or two of each: column after column would read sixteen lines for each
        // sixteen numbers.
        let mut columns = [[0.0; LANES]; LANES];
        for k in 0..LANES {
            let row = &mut rows[k * width + block * LANES..][..LANES];
            for (column, value) in columns.iter_mut().zip(row) {
                column[k] = std::mem::take(value);
            }
            if first == block * LANES {
                columns[k][k] = 0.0;
            }
        }
        let mut masks = [0; LANES];
        let (mut values, mut count) = ([0.0; LANES * LANES + 1], 0);
        for (column, mask) in columns.iter().zip(&mut masks) {
            for (k, &value) in column.iter().enumerate() {
                values[count] = value;
                count += usize::from(value > 0.0);
                *mask |= u16::from(value > 0.0) << k;
            }
        }
        (count > 0).then(|| Self { first, masks, values: values[..count].into() })
    }
}
