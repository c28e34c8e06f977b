//! The matrix of form factors as sparse rows, and the laws it obeys.
//!
//! A row is kept as blocks of [`LANES`] columns: a mask tells which columns of the block are seen, and their values
//! follow packed. An entry takes 4 bytes and its share of the 4 of its block: 4.4 in most scenes, where a list of columns
//! would take 8, and never more than those 8. A kernel opens a block into its lanes with one instruction.

use crate::light::Rgb;
use crate::simd::{self, Kernel, LANES, Level, Simd};

/// One row: the form factors from patch i to every patch that it sees.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Row {
    /// For each block with anything in it, in ascending order: above, how many blocks it lies after the one before it (the
    /// first: after block 0); below, a bit a column. Where 16 bits do not hold the distance, empty blocks lie between.
    blocks: Box<[u32]>,
    /// The form factors, all above zero, in ascending order of columns.
    values: Box<[f32]>,
}

/// Sparse rows, F\[i\]\[j\], one a patch.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct FormFactors {
    rows: Vec<Row>,
}

/// The most that a block can say it lies after the one before it.
const FARTHEST: usize = 0xffff;

impl Row {
    /// The most that an entry takes in memory; see [`Row::bytes`] for what a row does take.
    pub const MOST_BYTES_PER_ENTRY: u64 = 4 + 4;

    /// From a full row: its entries above zero, rounded to single precision.
    pub fn from_dense(full: &[f64]) -> Self {
        let (mut blocks, mut values) = (Vec::new(), Vec::with_capacity(full.len()));
        let mut last = 0;
        for (block, columns) in full.chunks(LANES).enumerate() {
            let seen = columns.iter().zip(0..).map(|(&value, lane)| u32::from(value > 0.0) << lane);
            let mask = seen.sum::<u32>();
            if mask == 0 {
                continue;
            }
            while block - last > FARTHEST {
                blocks.push((FARTHEST as u32) << 16);
                last += FARTHEST;
            }
            blocks.push(((block - last) as u32) << 16 | mask);
            last = block;
            values.extend(columns.iter().filter(|&&value| value > 0.0).map(|&value| value as f32));
        }
        Self { blocks: blocks.into(), values: values.as_slice().into() }
    }

    /// Each block: its number, and a bit for each of its columns that is seen.
    #[inline(always)]
    fn blocks(&self) -> impl Iterator<Item = (usize, u16)> {
        self.blocks.iter().scan(0, |block, &packed| {
            *block += (packed >> 16) as usize;
            Some((*block, packed as u16))
        })
    }

    /// How many patches are seen.
    pub fn len(&self) -> usize {
        self.values.len()
    }

    /// Whether none is.
    pub fn is_empty(&self) -> bool {
        self.values.is_empty()
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
        &self.values
    }

    /// (j, F_ij) of every patch seen, in ascending order.
    pub fn iter(&self) -> impl Iterator<Item = (usize, f64)> + '_ {
        self.columns().zip(&self.values).map(|(column, &value)| (column as usize, f64::from(value)))
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
        self.values.iter().map(|&value| f64::from(value)).sum()
    }

    /// What the row takes in memory, in bytes, with its record in the matrix.
    pub fn bytes(&self) -> u64 {
        (size_of::<Self>() + size_of_val(&*self.blocks) + size_of_val(&*self.values)) as u64
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

    /// [`Row::gather`] of `b`, and in the same pass what patch i sends along its row: `onto`_j += F_ij `power`. A step of
    /// F B and of its transpose Fᵀ x at once.
    pub fn gather_and_scatter(&self, b: &LightBlocks, power: Rgb, onto: &mut LightBlocks) -> Rgb {
        self.gather_and_scatter_at(Level::best(), b, power, onto)
    }

    /// The same with no more of the processor than `level`; the bits do not depend on it.
    pub fn gather_and_scatter_at(
        &self,
        level: Level,
        b: &LightBlocks,
        power: Rgb,
        onto: &mut LightBlocks,
    ) -> Rgb {
        simd::run(level, GatherAndScatter { row: self, light: b, power, onto })
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

/// A light a patch, laid out as rows read it: blocks of sixteen patches, in each the three channels one after the other.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct LightBlocks {
    blocks: Vec<[[f64; LANES]; 3]>,
}

impl LightBlocks {
    /// Black on `count` patches.
    pub fn black(count: usize) -> Self {
        Self { blocks: vec![[[0.0; LANES]; 3]; count.div_ceil(LANES)] }
    }

    /// Of patch i.
    pub fn get(&self, patch: usize) -> Rgb {
        let [r, g, b] = &self.blocks[patch / LANES];
        let lane = patch % LANES;
        Rgb::new(r[lane], g[lane], b[lane])
    }

    /// Give patch i this light.
    pub fn set(&mut self, patch: usize, light: Rgb) {
        let block = &mut self.blocks[patch / LANES];
        for (channel, value) in block.iter_mut().zip(light.to_array()) {
            channel[patch % LANES] = value;
        }
    }

    /// Black everywhere.
    pub fn clear(&mut self) {
        self.blocks.fill([[0.0; LANES]; 3]);
    }
}

impl FromIterator<Rgb> for LightBlocks {
    fn from_iter<I: IntoIterator<Item = Rgb>>(lights: I) -> Self {
        let mut blocks = Vec::new();
        for (patch, light) in lights.into_iter().enumerate() {
            let lane = patch % LANES;
            if lane == 0 {
                blocks.push([[0.0; LANES]; 3]);
            }
            if let Some(block) = blocks.last_mut() {
                for (channel, value) in block.iter_mut().zip(light.to_array()) {
                    channel[lane] = value;
                }
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
            let factors = simd.widen(simd.expand(mask, values));
            values = &values[mask.count_ones() as usize..];
            let light = &self.light.blocks[at];
            for channel in 0..3 {
                let arriving = simd.mul_double(simd.load_double(&light[channel]), factors);
                sums[channel] = simd.add_double(sums[channel], arriving);
            }
        }
        total(simd, sums)
    }
}

struct GatherAndScatter<'a> {
    row: &'a Row,
    light: &'a LightBlocks,
    power: Rgb,
    onto: &'a mut LightBlocks,
}

impl Kernel for GatherAndScatter<'_> {
    type Output = Rgb;

    #[inline(always)]
    fn run<S: Simd>(self, simd: S) -> Rgb {
        let mut sums = [simd.splat_double(0.0); 3];
        let power = self.power.to_array();
        let power = [simd.splat_double(power[0]), simd.splat_double(power[1]), simd.splat_double(power[2])];
        let (mut at, mut values) = (0, &*self.row.values);
        for &packed in &self.row.blocks {
            at += (packed >> 16) as usize;
            let mask = packed as u16;
            let factors = simd.widen(simd.expand(mask, values));
            values = &values[mask.count_ones() as usize..];
            let (light, onto) = (&self.light.blocks[at], &mut self.onto.blocks[at]);
            for channel in 0..3 {
                let arriving = simd.mul_double(simd.load_double(&light[channel]), factors);
                sums[channel] = simd.add_double(sums[channel], arriving);
                let sent = simd.mul_double(power[channel], factors);
                let there = simd.load_double(&onto[channel]);
                simd.store_double(simd.add_double(there, sent), &mut onto[channel]);
            }
        }
        total(simd, sums)
    }
}

#[inline(always)]
fn total<S: Simd>(simd: S, sums: [S::Doubles; 3]) -> Rgb {
    let mut totals = [0.0; 3];
    for channel in 0..3 {
        let mut lanes = [0.0; LANES];
        simd.store_double(sums[channel], &mut lanes);
        totals[channel] = folded(lanes, |a, b| a + b);
    }
    Rgb::from(totals)
}

impl FormFactors {
    /// From rows, one a patch, in patch order.
    pub fn from_rows(rows: Vec<Row>) -> Self {
        Self { rows }
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
            let least = size_of::<Row>() as u64;
            prop_assert!(row.bytes() - least <= Row::MOST_BYTES_PER_ENTRY * seen.len() as u64);
        }

        #[test]
        fn every_level_gathers_and_scatters_the_same_bits(full in full_rows(), seed in 0.0..6.0) {
            let row = Row::from_dense(&full);
            let b = light(full.len(), seed);
            let blocks: LightBlocks = b.iter().copied().collect();
            let plain = row.gather(&b);
            let power = Rgb::new(0.3, 1e-3, 7.0);
            let scattered: Vec<Rgb> = (0..full.len()).map(|j| b[j] + power * row.get(j)).collect();
            for level in Level::available() {
                prop_assert_eq!(row.gather_blocks_at(level, &blocks), plain);
                let mut onto = blocks.clone();
                prop_assert_eq!(row.gather_and_scatter_at(level, &blocks, power, &mut onto), plain);
                for (j, &expected) in scattered.iter().enumerate() {
                    prop_assert_eq!(onto.get(j), expected);
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
