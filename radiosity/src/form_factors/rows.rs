//! The matrix of form factors as sparse rows, and the laws it obeys.
//!
//! A row is kept as blocks of [`LANES`] columns: a mask tells which columns of the block are seen, and their values
//! follow packed. An entry takes 4 bytes and its share of the 4 of its block: 4.4 in most scenes, where a list of columns
//! would take 8, and never more than those 8. A kernel opens a block into its lanes with one instruction.

use std::sync::OnceLock;

use super::bands::{Bands, Stretch};
use super::parallel::Crew;
use crate::light::Rgb;
use crate::simd::{self, Kernel, LANES, Level, Simd};

/// One row: the form factors from patch i to every patch that it sees.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Row {
    /// For each block with anything in it, in ascending order: above, how many blocks it lies after the one before it (the
    /// first: after block 0); below, a bit a column. Where 16 bits do not hold the distance, empty blocks lie between.
    blocks: Box<[u32]>,
    /// The form factors, all above zero, in ascending order of columns, and [`LANES`] zeros, so that a kernel may read whole
    /// registers to the end. A row of nothing may lack them.
    values: Box<[f32]>,
    elsewhere: Elsewhere,
}

/// Of the energy leaving a patch, the shares that arrive at no other. With the row's own sum they make 1, but for the
/// method's error.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Elsewhere {
    /// What meets nothing: it leaves the scene, and as much of what the surroundings send comes in.
    pub surroundings: f64,
    /// What meets black backs.
    pub backs: f64,
}

/// Sparse rows, F\[i\]\[j\], one a patch.
#[derive(Clone, Debug, Default)]
pub struct FormFactors {
    rows: Vec<Row>,
    /// Made when they are first asked for.
    bands: OnceLock<Bands>,
    crew: Crew,
}

impl PartialEq for FormFactors {
    fn eq(&self, other: &Self) -> bool {
        self.rows == other.rows
    }
}

/// Memory that one row after another is packed in.
#[derive(Clone, Debug, Default)]
pub struct Packing {
    blocks: Vec<u32>,
    /// The last block among them.
    last: usize,
    /// As many as `entries`; what lies behind is left from rows before.
    values: Vec<f32>,
    entries: usize,
}

/// What follows the values of a row.
pub(super) static NOTHING: [f32; LANES] = [0.0; LANES];

/// The most that a block can say it lies after the one before it.
const FARTHEST: usize = 0xffff;

impl Row {
    /// The most that an entry takes in memory, beyond what a row of none does; see [`Row::bytes`] for what a row does take.
    pub const MOST_BYTES_PER_ENTRY: u64 = 4 + 4;

    /// From a full row: its entries above zero, rounded to single precision.
    pub fn from_dense(full: &[f64]) -> Self {
        Self::take_dense(&mut full.to_vec(), &mut Packing::default())
    }

    /// The same at the speed of the memory, for who works out one row after another: `full` is black, all zeros, when it
    /// comes back, and ready for the next.
    pub fn take_dense(full: &mut [f64], packing: &mut Packing) -> Self {
        Self::take_dense_at(Level::best(), full, packing)
    }

    /// The same with no more of the processor than `level`; the bits do not depend on it.
    pub fn take_dense_at(level: Level, full: &mut [f64], packing: &mut Packing) -> Self {
        simd::run(level, Pack { full, packing })
    }

    /// Each block: its number, and a bit for each of its columns that is seen.
    #[inline(always)]
    pub(super) fn blocks(&self) -> impl Iterator<Item = (usize, u16)> {
        self.blocks.iter().scan(0, |block, &packed| {
            *block += (packed >> 16) as usize;
            Some((*block, packed as u16))
        })
    }

    /// Have it brought nearer, for it is wanted next: where a row lies, no processor foresees.
    pub(super) fn fetch(&self) {
        simd::fetch(&self.blocks);
        simd::fetch(&self.values);
    }

    /// The same row with this known of what goes elsewhere; from a full row nothing is.
    pub fn with_elsewhere(self, elsewhere: Elsewhere) -> Self {
        Self { elsewhere, ..self }
    }

    /// What arrives at no patch.
    pub fn elsewhere(&self) -> Elsewhere {
        self.elsewhere
    }

    /// How many patches are seen.
    pub fn len(&self) -> usize {
        self.values.len().saturating_sub(LANES)
    }

    /// Whether none is.
    pub fn is_empty(&self) -> bool {
        self.len() == 0
    }

    /// The patches seen, in ascending order.
    pub fn columns(&self) -> impl Iterator<Item = u32> + '_ {
        self.blocks().flat_map(|(block, mask)| {
            let lanes = (0..LANES).filter(move |lane| mask >> lane & 1 == 1);
            lanes.map(move |lane| (block * LANES + lane) as u32)
        })
    }

    /// The form factor to each of [`Row::columns`], all above zero.
    pub fn values(&self) -> &[f32] {
        &self.values[..self.len()]
    }

    /// The same, and [`LANES`] zeros behind them.
    #[inline(always)]
    pub(super) fn padded_values(&self) -> &[f32] {
        if self.values.is_empty() { &NOTHING } else { &self.values }
    }

    /// (j, F_ij) of every patch seen, in ascending order.
    pub fn iter(&self) -> impl Iterator<Item = (usize, f64)> + '_ {
        self.columns().zip(self.values()).map(|(column, &value)| (column as usize, f64::from(value)))
    }

    /// F_ij, zero where j is not seen.
    pub fn get(&self, column: usize) -> f64 {
        let (wanted, lane) = (column / LANES, column % LANES);
        let mut before = 0;
        for (block, mask) in self.blocks().take_while(|&(block, _)| block <= wanted) {
            if block == wanted && mask >> lane & 1 == 1 {
                let below = mask & !(u16::MAX << lane);
                return f64::from(self.values[before + below.count_ones() as usize]);
            }
            before += mask.count_ones() as usize;
        }
        0.0
    }

    /// Σ_j F_ij: 1 in a closed scene (closure).
    pub fn sum(&self) -> f64 {
        // From 0: what `sum` makes of nothing is -0.
        self.values().iter().fold(0.0, |sum, &value| sum + f64::from(value))
    }

    /// What the row takes in memory, in bytes, with its record in the matrix.
    pub fn bytes(&self) -> u64 {
        (size_of::<Self>() + size_of_val(&*self.blocks) + size_of_val(&*self.values)) as u64
    }

    /// The same with what a solver adds to it: a quarter of what tells which columns four rows see that are read together, where
    /// its neighbours see much the same patches as it does.
    pub fn bytes_at_work(&self) -> u64 {
        self.bytes() + self.blocks.len() as u64 * Bands::BYTES_PER_BLOCK
    }

    /// Σ_j F_ij B_j: the irradiance that radiosities `b` bring to patch i.
    ///
    /// The order of the sum is part of the answer: column j is added to partial sum j mod 16, in ascending order, and
    /// partial sum k takes to itself k + 8, then k + 4, k + 2 and k + 1. [`Row::gather_blocks`] is the same, bit for bit.
    pub fn gather(&self, b: &[Rgb]) -> Rgb {
        let mut sums = [Rgb::BLACK; LANES];
        for (j, factor) in self.iter() {
            sums[j % LANES] += b[j] * factor;
        }
        folded(sums, |a, b| a + b)
    }

    /// [`Row::gather`] at the speed of the memory.
    pub fn gather_blocks(&self, b: &LightBlocks) -> Rgb {
        self.gather_blocks_at(Level::best(), b)
    }

    /// The same with no more of the processor than `level`; the bits do not depend on it.
    pub fn gather_blocks_at(&self, level: Level, b: &LightBlocks) -> Rgb {
        simd::run(level, Gather { row: self, light: b })
    }

    /// Σ_j F_ij ΔB_j of changes in single precision, in which the products are added up, too: column j is added to partial
    /// sum j mod 16 in ascending order, each product fused with its sum, and the partial sums are brought together in
    /// double precision as [`Row::gather`] has it. Its error is at most m 2⁻²⁴ Σ_j F_ij |ΔB_j|, m the blocks in the row.
    pub fn gather_changes(&self, changes: &ChangeBlocks) -> Rgb {
        self.gather_changes_at(Level::best(), changes)
    }

    /// The same with no more of the processor than `level`; the bits do not depend on it.
    pub fn gather_changes_at(&self, level: Level, changes: &ChangeBlocks) -> Rgb {
        simd::run(level, GatherChanges { row: self, changes })
    }

    /// [`Row::gather`] of `b`, and in the same pass what patch i sends along its row: `onto`_j += F_ij `power`. A step of
    /// F B and of its transpose Fᵀ x at once.
    pub fn gather_and_scatter<const CHANNELS: usize>(
        &self,
        b: &Blocks<CHANNELS>,
        power: [f64; CHANNELS],
        onto: &mut Blocks<CHANNELS>,
    ) -> [f64; CHANNELS] {
        self.gather_and_scatter_at(Level::best(), b, power, onto)
    }

    /// The same with no more of the processor than `level`; the bits do not depend on it.
    pub fn gather_and_scatter_at<const CHANNELS: usize>(
        &self,
        level: Level,
        b: &Blocks<CHANNELS>,
        power: [f64; CHANNELS],
        onto: &mut Blocks<CHANNELS>,
    ) -> [f64; CHANNELS] {
        let (light, onto) = (&b.blocks, &mut onto.blocks);
        simd::run(level, GatherAndScatter { row: self, light, power, onto })
    }
}

/// Partial sums brought together, halves first.
#[inline(always)]
fn folded<T: Copy>(mut sums: [T; LANES], add: impl Fn(T, T) -> T) -> T {
    let mut half = LANES / 2;
    while half > 0 {
        for lane in 0..half {
            sums[lane] = add(sums[lane], sums[lane + half]);
        }
        half /= 2;
    }
    sums[0]
}

/// Numbers a patch, laid out as rows read them: blocks of sixteen patches, in each the channels one after the other.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Blocks<const CHANNELS: usize> {
    blocks: Vec<Block<f64, CHANNELS>>,
}

/// A light a patch.
pub type LightBlocks = Blocks<3>;

/// A number a patch.
pub type GreyBlocks = Blocks<1>;

/// What the light of each patch has changed by, in single precision, laid out likewise.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct ChangeBlocks {
    blocks: Vec<Block<f32>>,
}

/// Sixteen patches, from the start of a line of the cache: a load that straddles two takes twice as long.
#[derive(Clone, Copy, Debug, PartialEq)]
#[repr(align(64))]
pub(super) struct Block<T, const CHANNELS: usize = 3>(pub(super) [[T; LANES]; CHANNELS]);

impl<T: Copy, const CHANNELS: usize> Block<T, CHANNELS> {
    fn all(value: T) -> Self {
        Self([[value; LANES]; CHANNELS])
    }

    fn set(&mut self, lane: usize, light: [T; CHANNELS]) {
        for (channel, value) in self.0.iter_mut().zip(light) {
            channel[lane] = value;
        }
    }
}

impl ChangeBlocks {
    /// No change of `count` patches.
    pub fn none(count: usize) -> Self {
        Self { blocks: vec![Block::all(0.0); count.div_ceil(LANES)] }
    }

    /// Patch i has changed by this, rounded to single precision. Returns what it was rounded to.
    pub fn set(&mut self, patch: usize, change: Rgb) -> Rgb {
        let rounded = change.to_array().map(|value| value as f32);
        self.blocks[patch / LANES].set(patch % LANES, rounded);
        Rgb::from(rounded.map(f64::from))
    }

    #[inline(always)]
    pub(super) fn blocks(&self) -> &[Block<f32>] {
        &self.blocks
    }

    /// Of patch i.
    pub fn get(&self, patch: usize) -> Rgb {
        Rgb::from(self.blocks[patch / LANES].0.map(|channel| f64::from(channel[patch % LANES])))
    }
}

impl<const CHANNELS: usize> Blocks<CHANNELS> {
    /// Black on `count` patches.
    pub fn black(count: usize) -> Self {
        Self { blocks: vec![Block::all(0.0); count.div_ceil(LANES)] }
    }

    /// Black everywhere.
    pub fn clear(&mut self) {
        self.blocks.fill(Block::all(0.0));
    }

    /// The numbers of patch i.
    pub fn channels(&self, patch: usize) -> [f64; CHANNELS] {
        self.blocks[patch / LANES].0.map(|channel| channel[patch % LANES])
    }

    /// Give patch i these.
    pub fn set_channels(&mut self, patch: usize, channels: [f64; CHANNELS]) {
        self.blocks[patch / LANES].set(patch % LANES, channels);
    }

    /// Add `other`, of as many patches.
    pub(super) fn add(&mut self, other: &Self) {
        for (to, from) in self.blocks.iter_mut().zip(&other.blocks) {
            for (to, from) in to.0.iter_mut().flatten().zip(from.0.iter().flatten()) {
                *to += from;
            }
        }
    }

    /// Black on as many patches.
    pub(super) fn black_alike(&self) -> Self {
        Self { blocks: vec![Block::all(0.0); self.blocks.len()] }
    }

    #[inline(always)]
    pub(super) fn blocks(&self) -> &[Block<f64, CHANNELS>] {
        &self.blocks
    }

    #[inline(always)]
    pub(super) fn blocks_mut(&mut self) -> &mut [Block<f64, CHANNELS>] {
        &mut self.blocks
    }
}

impl LightBlocks {
    /// Of patch i.
    pub fn get(&self, patch: usize) -> Rgb {
        Rgb::from(self.channels(patch))
    }

    /// Give patch i this light.
    pub fn set(&mut self, patch: usize, light: Rgb) {
        self.set_channels(patch, light.to_array());
    }
}

impl GreyBlocks {
    /// Of each patch.
    pub fn new(values: &[f64]) -> Self {
        let mut all = Self::black(values.len());
        for (patch, &value) in values.iter().enumerate() {
            all.set_channels(patch, [value]);
        }
        all
    }
}

impl FromIterator<Rgb> for LightBlocks {
    fn from_iter<I: IntoIterator<Item = Rgb>>(lights: I) -> Self {
        let mut blocks = Vec::new();
        for (patch, light) in lights.into_iter().enumerate() {
            let lane = patch % LANES;
            if lane == 0 {
                blocks.push(Block::all(0.0));
            }
            if let Some(block) = blocks.last_mut() {
                block.set(lane, light.to_array());
            }
        }
        Self { blocks }
    }
}

struct Gather<'a> {
    row: &'a Row,
    light: &'a LightBlocks,
}

impl Kernel for Gather<'_> {
    type Output = Rgb;

    #[inline(always)]
    fn run<S: Simd>(self, simd: S) -> Rgb {
        let mut sums = [simd.splat_double(0.0); 3];
        let (mut at, mut values) = (0, &*self.row.values);
        for &packed in &self.row.blocks {
            at += (packed >> 16) as usize;
            let mask = packed as u16;
            let factors = simd.widen(simd.expand_next(mask, &mut values));
            let light = &self.light.blocks[at].0;
            for channel in 0..3 {
                let arriving = simd.mul_double(simd.load_double(&light[channel]), factors);
                sums[channel] = simd.add_double(sums[channel], arriving);
            }
        }
        total(simd, sums)
    }
}

struct GatherAndScatter<'a, const CHANNELS: usize> {
    row: &'a Row,
    light: &'a [Block<f64, CHANNELS>],
    power: [f64; CHANNELS],
    onto: &'a mut [Block<f64, CHANNELS>],
}

impl<const CHANNELS: usize> Kernel for GatherAndScatter<'_, CHANNELS> {
    type Output = [f64; CHANNELS];

    #[inline(always)]
    fn run<S: Simd>(self, simd: S) -> [f64; CHANNELS] {
        let mut sums = [simd.splat_double(0.0); CHANNELS];
        let mut power = sums;
        for (power, &sent) in power.iter_mut().zip(&self.power) {
            *power = simd.splat_double(sent);
        }
        let (mut at, mut values) = (0, &*self.row.values);
        for &packed in &self.row.blocks {
            at += (packed >> 16) as usize;
            let mask = packed as u16;
            let factors = simd.widen(simd.expand_next(mask, &mut values));
            let (light, onto) = (&self.light[at].0, &mut self.onto[at].0);
            for channel in 0..CHANNELS {
                let arriving = simd.mul_double(simd.load_double(&light[channel]), factors);
                sums[channel] = simd.add_double(sums[channel], arriving);
                let sent = simd.mul_double(power[channel], factors);
                let there = simd.load_double(&onto[channel]);
                simd.store_double(simd.add_double(there, sent), &mut onto[channel]);
            }
        }
        let mut totals = [0.0; CHANNELS];
        for (total, &sum) in totals.iter_mut().zip(&sums) {
            *total = simd.sum_double(sum);
        }
        totals
    }
}

#[inline(always)]
pub(super) fn total<S: Simd>(simd: S, sums: [S::Doubles; 3]) -> Rgb {
    Rgb::new(simd.sum_double(sums[0]), simd.sum_double(sums[1]), simd.sum_double(sums[2]))
}

struct GatherChanges<'a> {
    row: &'a Row,
    changes: &'a ChangeBlocks,
}

impl Kernel for GatherChanges<'_> {
    type Output = Rgb;

    #[inline(always)]
    fn run<S: Simd>(self, simd: S) -> Rgb {
        let mut sums = [simd.splat(0.0); 3];
        let (mut at, mut values) = (0, &*self.row.values);
        for &packed in &self.row.blocks {
            at += (packed >> 16) as usize;
            let factors = simd.expand_next(packed as u16, &mut values);
            let changes = &self.changes.blocks[at].0;
            for channel in 0..3 {
                sums[channel] = simd.fused(factors, simd.load(&changes[channel]), sums[channel]);
            }
        }
        total(simd, [simd.widen(sums[0]), simd.widen(sums[1]), simd.widen(sums[2])])
    }
}

struct Pack<'a> {
    full: &'a mut [f64],
    packing: &'a mut Packing,
}

impl Kernel for Pack<'_> {
    type Output = Row;

    #[inline(always)]
    fn run<S: Simd>(self, simd: S) -> Row {
        let packing = self.packing;
        packing.begin(self.full.len());
        let (whole, rest) = self.full.as_chunks_mut();
        for (block, columns) in whole.iter_mut().enumerate() {
            packing.add(simd, block, columns);
            *columns = [0.0; LANES];
        }
        if !rest.is_empty() {
            let mut columns = [0.0; LANES];
            columns[..rest.len()].copy_from_slice(rest);
            packing.add(simd, whole.len(), &columns);
            rest.fill(0.0);
        }
        Row {
            blocks: packing.blocks.as_slice().into(),
            values: packing.padded().into(),
            elsewhere: Elsewhere::default(),
        }
    }
}

impl Packing {
    fn padded(&mut self) -> &[f32] {
        let end = self.entries + LANES;
        self.values[self.entries..end].fill(0.0);
        &self.values[..end]
    }

    fn begin(&mut self, columns: usize) {
        // Sixteen are written at a time, of which as many count as are above zero.
        if self.values.len() < columns + LANES {
            self.values.resize(columns + LANES, 0.0);
        }
        self.blocks.clear();
        (self.entries, self.last) = (0, 0);
    }

    #[inline(always)]
    fn add<S: Simd>(&mut self, simd: S, block: usize, columns: &[f64; LANES]) {
        let to = self.values[self.entries..].first_chunk_mut().expect("room for sixteen more");
        let mask = simd.pack_positive(columns, to);
        if mask == 0 {
            return;
        }
        self.entries += mask.count_ones() as usize;
        while block - self.last > FARTHEST {
            self.blocks.push((FARTHEST as u32) << 16);
            self.last += FARTHEST;
        }
        self.blocks.push(((block - self.last) as u32) << 16 | u32::from(mask));
        self.last = block;
    }
}

impl FormFactors {
    /// From rows, one a patch, in patch order.
    pub fn from_rows(rows: Vec<Row>) -> Self {
        Self { rows, ..Self::default() }
    }

    /// Share passes over them among so many threads (0: those of the rayon pool that the pass is called in, one a core where
    /// it is called in none). Changes no bit of what comes of it.
    pub fn on_threads(self, threads: usize) -> Self {
        Self { crew: Crew::of(threads), ..self }
    }

    /// How many patches.
    pub fn len(&self) -> usize {
        self.rows.len()
    }

    /// Whether there is none.
    pub fn is_empty(&self) -> bool {
        self.rows.is_empty()
    }

    /// Row i.
    pub fn row(&self, patch: usize) -> &Row {
        &self.rows[patch]
    }

    /// The rows, in patch order.
    pub fn rows(&self) -> &[Row] {
        &self.rows
    }

    /// The rows, in patch order, as many at a time as may gather at once.
    pub(super) fn each_stretch(&self, visit: impl FnMut(Stretch<'_>) + Send) {
        let (bands, rows) = (self.bands(), &self.rows);
        self.crew.run(bands.work(), |shared| bands.stretches(rows, shared).for_each(visit));
    }

    /// What comes of all rows at once.
    pub(super) fn at_once<T: Send>(&self, work: impl FnOnce(Stretch<'_>) -> T + Send) -> T {
        let (bands, rows) = (self.bands(), &self.rows);
        self.crew.run(bands.work(), |shared| work(bands.all(rows, shared)))
    }

    fn bands(&self) -> &Bands {
        self.bands.get_or_init(|| Bands::new(&self.rows))
    }

    /// How many form factors are stored.
    pub fn nonzeros(&self) -> usize {
        self.rows.iter().map(Row::len).sum()
    }

    /// What they take in memory, in bytes.
    pub fn bytes(&self) -> u64 {
        self.rows.iter().map(Row::bytes).sum()
    }

    /// The least and the greatest row sum: both 1 where the scene is closed and nothing leaks. (1, 1) for no rows.
    pub fn row_sum_range(&self) -> (f64, f64) {
        let mut sums = self.rows.iter().map(Row::sum);
        let first = sums.next().unwrap_or(1.0);
        sums.fold((first, first), |(low, high), sum| (low.min(sum), high.max(sum)))
    }
}

#[cfg(test)]
mod tests {
    use proptest::prelude::*;

    use super::*;

    /// Rows with long runs, gaps of all lengths, and lone entries.
    fn full_rows() -> impl Strategy<Value = Vec<f64>> {
        let run = (prop_oneof![Just(0.0_f64), 1e-6..1.0_f64], 1..60_usize);
        proptest::collection::vec(run, 0..30)
            .prop_map(|runs| runs.into_iter().flat_map(|(value, count)| vec![value; count]).collect())
            .prop_map(|full: Vec<f64>| full.iter().enumerate().map(|(k, v)| v * (1.0 + k as f64)).collect())
    }

    fn light(count: usize, seed: f64) -> Vec<Rgb> {
        let wave = |k: usize, step: f64| (k as f64 * step + seed).sin();
        (0..count).map(|k| Rgb::new(wave(k, 0.7), wave(k, 1.3), wave(k, 2.9))).collect()
    }

    proptest! {
        #[test]
        fn a_row_gives_back_what_it_was_made_of(full in full_rows()) {
            let row = Row::from_dense(&full);
            let seen: Vec<_> =
                full.iter().enumerate().filter(|&(_, &f)| f > 0.0).map(|(j, &f)| (j, f64::from(f as f32))).collect();
            prop_assert_eq!(row.iter().collect::<Vec<_>>(), seen.clone());
            prop_assert_eq!(row.len(), seen.len());
            for (j, &f) in full.iter().enumerate() {
                prop_assert_eq!(row.get(j), f64::from(f as f32));
            }
            prop_assert_eq!(row.get(full.len() + 100), 0.0);
            let least = Row::from_dense(&[]).bytes();
            prop_assert!(row.bytes() - least <= Row::MOST_BYTES_PER_ENTRY * seen.len() as u64);
        }

        #[test]
        fn every_level_packs_the_same_row_and_clears(full in full_rows(), before in full_rows()) {
            // The plain twin: column after column.
            let mut plain = Row::default();
            let (mut blocks, mut values, mut last) = (Vec::new(), Vec::new(), 0);
            for (block, columns) in full.chunks(LANES).enumerate() {
                let mask = columns.iter().rev().fold(0, |mask, &value| mask << 1 | u32::from(value > 0.0));
                if mask != 0 {
                    blocks.push(((block - last) as u32) << 16 | mask);
                    last = block;
                }
                values.extend(columns.iter().filter(|&&value| value > 0.0).map(|&value| value as f32));
            }
            values.extend(NOTHING);
            (plain.blocks, plain.values) = (blocks.into(), values.into());
            for level in Level::available() {
                // Whatever was packed before.
                let mut packing = Packing::default();
                Row::take_dense_at(level, &mut before.clone(), &mut packing);
                let mut taken = full.clone();
                prop_assert_eq!(&Row::take_dense_at(level, &mut taken, &mut packing), &plain);
                prop_assert!(taken.iter().all(|&value| value == 0.0));
            }
        }

        #[test]
        fn changes_are_gathered_within_their_bound_and_the_same_at_every_level(full in full_rows(), seed in 0.0..6.0) {
            let row = Row::from_dense(&full);
            let light = light(full.len(), seed);
            let mut changes = ChangeBlocks::none(full.len());
            let told: Vec<Rgb> = light.iter().enumerate().map(|(j, &change)| changes.set(j, change)).collect();
            // The plain twin: a partial sum a lane, in single precision, fused.
            let mut sums = [[0.0_f32; 3]; LANES];
            for (j, factor) in row.iter() {
                for (sum, change) in sums[j % LANES].iter_mut().zip(told[j].to_array()) {
                    *sum = (factor as f32).mul_add(change as f32, *sum);
                }
            }
            let plain = folded(sums.map(|sum| Rgb::from(sum.map(f64::from))), |a, b| a + b);
            let magnitude = |light: Rgb| Rgb::from(light.to_array().map(f64::abs));
            let size = row.gather(&told.iter().map(|&change| magnitude(change)).collect::<Vec<_>>());
            let bound = size * (row.blocks.len() as f64 * 2.0_f64.powi(-24));
            let off = magnitude(plain - row.gather(&told));
            prop_assert!(off.r <= bound.r && off.g <= bound.g && off.b <= bound.b, "{off:?} {bound:?}");
            for level in Level::available() {
                prop_assert_eq!(row.gather_changes_at(level, &changes), plain);
            }
        }

        #[test]
        fn every_level_gathers_and_scatters_the_same_bits(full in full_rows(), seed in 0.0..6.0) {
            let row = Row::from_dense(&full);
            let b = light(full.len(), seed);
            let blocks: LightBlocks = b.iter().copied().collect();
            let plain = row.gather(&b);
            let power = Rgb::new(0.3, 1e-3, 7.0);
            let scattered: Vec<Rgb> = (0..full.len()).map(|j| b[j] + power * row.get(j)).collect();
            let green = GreyBlocks::new(&b.iter().map(|b| b.g).collect::<Vec<_>>());
            for level in Level::available() {
                prop_assert_eq!(row.gather_blocks_at(level, &blocks), plain);
                let (mut onto, mut onto_green) = (blocks.clone(), green.clone());
                let found = row.gather_and_scatter_at(level, &blocks, power.to_array(), &mut onto);
                prop_assert_eq!(Rgb::from(found), plain);
                let found = row.gather_and_scatter_at(level, &green, [power.g], &mut onto_green);
                prop_assert_eq!(found, [plain.g]);
                for (j, &expected) in scattered.iter().enumerate() {
                    prop_assert_eq!(onto.get(j), expected);
                    prop_assert_eq!(onto_green.channels(j), [expected.g]);
                }
            }
        }
    }

    #[test]
    fn blocks_far_apart_are_reached() {
        let mut full = vec![0.0; LANES * (3 * FARTHEST + 5) + 3];
        for j in [0, LANES * (FARTHEST + 1), full.len() - 1] {
            full[j] = 0.25;
        }
        let row = Row::from_dense(&full);
        let seen: Vec<_> = row.columns().map(|j| j as usize).collect();
        assert_eq!(seen, [0, LANES * (FARTHEST + 1), full.len() - 1]);
        assert_eq!(row.get(full.len() - 1), 0.25);
        let ones: LightBlocks = full.iter().map(|_| Rgb::WHITE).collect();
        assert_eq!(row.gather_blocks(&ones), Rgb::grey(0.75));
    }
}
