//! Rows four at a time, and as many at a time as may gather at once.
//!
//! Neighbours see much the same blocks of patches: a *band* of four reads the light of a block once for all of them. And the
//! patches of one flat surface never see one another: in a *stretch*, rows that follow each other of which none sees one
//! before it, each gathers the same whether those before it have had their turn or not. So the rows of a stretch may be shared
//! among threads, and a solver that takes one row after another still comes to the same bits.

use super::rows::{self, Block, Blocks, ChangeBlocks, LightBlocks, NOTHING, Row};
use crate::light::Rgb;
use crate::simd::{self, Kernel, LANES, Level, Padded, Simd};

/// Rows in a band. Their sums and what they are made of just fill the registers of AVX-512.
pub(super) const BAND: usize = 4;

/// Tiles that one thread takes at a time, at the least: some microseconds' work, many times what handing it over takes.
pub(super) const PIECE: usize = 1024;

/// What is sent along the rows is added up in no more pieces than this, of so many rows at the least, whatever the number of
/// threads: the order of a sum is part of the answer.
const MOST_PIECES: usize = 8;
const LEAST_ROWS: usize = 512;

/// A block of columns that any row of a band sees, and for each row a bit for each column that it sees.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
struct Tile {
    block: u32,
    masks: [u16; BAND],
}

/// What the rows of a matrix see, band by band; their values stay where they are.
#[derive(Clone, Debug, Default)]
pub(super) struct Bands {
    tiles: Vec<Tile>,
    /// Where the tiles of each band begin; one more entry ends the last.
    starts: Vec<usize>,
    /// At which row each stretch ends.
    stretches: Vec<usize>,
}

/// Rows that follow each other, of which none sees one before it.
#[derive(Clone, Copy, Debug)]
pub struct Stretch<'a> {
    first: usize,
    rows: &'a [Row],
    /// Those behind it, which are wanted next.
    after: &'a [Row],
    tiles: &'a [Tile],
    /// As of [`Bands`], for each band of it; none where the rows are taken one by one.
    starts: &'a [usize],
    /// Whether threads are at hand.
    shared: bool,
}

/// Up to [`BAND`] rows.
#[derive(Clone, Copy, Debug)]
struct Band<'a> {
    rows: &'a [Row],
    next: &'a [Row],
    tiles: &'a [Tile],
}

impl Bands {
    /// Bytes for each block of [`LANES`] columns that a row sees, where its neighbours see the same.
    pub(super) const BYTES_PER_BLOCK: u64 = (size_of::<Tile>() / BAND) as u64;

    pub(super) fn new(rows: &[Row]) -> Self {
        let mut all = Self { starts: vec![0], ..Self::default() };
        let mut stretch = 0;
        for (band, rows) in rows.chunks(BAND).enumerate() {
            let first = band * BAND;
            let Seen { before, within } = all.add(first, rows);
            if (within || before >= Some(stretch)) && first > stretch {
                all.stretches.push(first);
                stretch = first;
            }
            if within {
                // One sees another before it: here each is a stretch of its own.
                all.stretches.extend((first + 1..).take(rows.len()));
                stretch = first + rows.len();
            }
        }
        if stretch < rows.len() {
            all.stretches.push(rows.len());
        }
        all.tiles.shrink_to_fit();
        all
    }

    /// A band more, whose first row is this one.
    fn add(&mut self, first: usize, rows: &[Row]) -> Seen {
        let mut seen = Seen { before: None, within: false };
        let mut next: [_; BAND] = std::array::from_fn(|k| rows.get(k).map(|row| row.blocks()));
        let mut step = |k: usize| -> Option<(usize, u16)> { next[k].as_mut()?.find(|&(_, mask)| mask != 0) };
        let mut at: [_; BAND] = std::array::from_fn(&mut step);
        while let Some(block) = at.iter().flatten().map(|&(block, _)| block).min() {
            let mut masks = [0; BAND];
            for k in 0..BAND {
                if let Some((_, mask)) = at[k].filter(|&(here, _)| here == block) {
                    masks[k] = mask;
                    at[k] = step(k);
                }
            }
            seen.look(first, block, masks);
            self.tiles.push(Tile { block: block as u32, masks });
        }
        self.starts.push(self.tiles.len());
        seen
    }

    /// How much there is to read in a pass.
    pub(super) fn work(&self) -> usize {
        self.tiles.len()
    }

    /// The stretches of `rows`, those that these were made of.
    pub(super) fn stretches<'a>(
        &'a self,
        rows: &'a [Row],
        shared: bool,
    ) -> impl Iterator<Item = Stretch<'a>> {
        let firsts = std::iter::once(0).chain(self.stretches.iter().copied());
        firsts.zip(&self.stretches).map(move |(first, &end)| {
            let alone = end - first == 1;
            let starts = if alone { &[][..] } else { &self.starts[first / BAND..=end.div_ceil(BAND)] };
            let (after, tiles) = (&rows[end..], &*self.tiles);
            Stretch { first, rows: &rows[first..end], after, tiles, starts, shared }
        })
    }

    /// All `rows` as if none saw another: for who gathers from light that does not change meanwhile.
    pub(super) fn all<'a>(&'a self, rows: &'a [Row], shared: bool) -> Stretch<'a> {
        let (tiles, starts) = (&*self.tiles, &*self.starts);
        Stretch { first: 0, rows, after: &[], tiles, starts, shared }
    }
}

/// What the rows of a band see of those before them.
struct Seen {
    /// The last row before the band that any sees.
    before: Option<usize>,
    /// Whether one sees another before it in the band.
    within: bool,
}

impl Seen {
    /// Look at a block of what is seen; blocks come in ascending order.
    fn look(&mut self, first: usize, block: usize, masks: [u16; BAND]) {
        let lane = first % LANES;
        let here = block == first / LANES;
        if here {
            self.within |= (0..BAND).any(|k| masks[k] >> lane & ((1 << k) - 1) != 0);
        }
        if here || block < first / LANES {
            let seen = masks.iter().fold(0, |seen, mask| seen | mask);
            let seen = if here { seen & !(u16::MAX << lane) } else { seen };
            if seen != 0 {
                self.before = Some(block * LANES + seen.ilog2() as usize);
            }
        }
    }
}

impl<'a> Stretch<'a> {
    /// A row by itself.
    pub fn of_one(patch: usize, row: &'a Row) -> Self {
        let rows = std::slice::from_ref(row);
        Self { first: patch, rows, after: &[], tiles: &[], starts: &[], shared: false }
    }

    /// The patch of its first row.
    pub fn first(&self) -> usize {
        self.first
    }

    /// [`Row::gather`] of each row, the same bits.
    pub fn gather(&self, light: &LightBlocks, to: &mut Vec<Rgb>) {
        self.gather_at(Level::best(), light, to);
    }

    fn gather_at(&self, level: Level, light: &LightBlocks, to: &mut Vec<Rgb>) {
        let alone = |row: &Row| row.gather_blocks_at(level, light);
        self.each(level, to, &alone, &|band| simd::run(level, GatherBand { band, light }));
    }

    /// [`Row::gather_changes`] of each row, the same bits.
    pub fn gather_changes(&self, changes: &ChangeBlocks, to: &mut Vec<Rgb>) {
        self.gather_changes_at(Level::best(), changes, to);
    }

    fn gather_changes_at(&self, level: Level, changes: &ChangeBlocks, to: &mut Vec<Rgb>) {
        let alone = |row: &Row| row.gather_changes_at(level, changes);
        self.each(level, to, &alone, &|band| simd::run(level, GatherBandChanges { band, changes }));
    }

    fn each(
        &self,
        level: Level,
        to: &mut Vec<Rgb>,
        alone: &(impl Fn(&Row) -> Rgb + Sync),
        together: &(impl Fn(Band<'_>) -> [Rgb; BAND] + Sync),
    ) {
        to.clear();
        to.resize(self.rows.len(), Rgb::BLACK);
        if self.starts.is_empty() {
            to.iter_mut().zip(self.rows).for_each(|(to, row)| *to = alone(row));
            return;
        }
        // With fewer registers the sums of four rows would be carried to memory and back.
        let one_by_one = level < Level::Avx512;
        self.share(to, &|band: Band<'_>, to: &mut [Rgb]| {
            if one_by_one {
                for (k, (to, row)) in to.iter_mut().zip(band.rows).enumerate() {
                    if let Some(next) = band.rows.get(k + 1).or(band.next.first()) {
                        next.fetch();
                    }
                    *to = alone(row);
                }
            } else {
                to.copy_from_slice(&together(band)[..to.len()]);
            }
        });
    }

    /// Each band with the places of its rows in `to`, shared among the threads at hand.
    fn share<T: Send>(self, to: &mut [T], visit: &(impl Fn(Band<'_>, &mut [T]) + Sync)) {
        let bands = self.starts.len() - 1;
        if self.shared && bands > 1 && self.starts[bands] - self.starts[0] > PIECE {
            let half = bands / 2;
            let (rows, after) = self.rows.split_at(half * BAND);
            let (to, behind) = to.split_at_mut(half * BAND);
            let one = Self { rows, after, starts: &self.starts[..=half], ..self };
            let other = Self { rows: after, starts: &self.starts[half..], ..self };
            rayon::join(|| one.share(to, visit), || other.share(behind, visit));
            return;
        }
        for (band, to) in self.bands().zip(to.chunks_mut(BAND)) {
            visit(band, to);
        }
    }

    fn bands(self) -> impl Iterator<Item = Band<'a>> {
        self.starts.windows(2).zip(self.rows.chunks(BAND)).enumerate().map(move |(k, (ends, rows))| {
            let next = self.rows.get((k + 1) * BAND..).filter(|next| !next.is_empty()).unwrap_or(self.after);
            Band { rows, next, tiles: &self.tiles[ends[0]..ends[1]] }
        })
    }

    /// [`Row::gather_and_scatter`] of all rows of a matrix, of which this is the whole: what each gathers of `b`, and what all
    /// send of `power`, summed as [`rows_a_piece`] has it.
    pub(super) fn gather_and_scatter<const CHANNELS: usize>(
        &self,
        b: &Blocks<CHANNELS>,
        power: &[[f64; CHANNELS]],
    ) -> (Vec<[f64; CHANNELS]>, Blocks<CHANNELS>) {
        let size = rows_a_piece(self.rows.len());
        let piece = |k: usize| {
            let first = k * size;
            let end = self.rows.len().min(first + size);
            let starts = &self.starts[first / BAND..=end.div_ceil(BAND)];
            let piece =
                Self { first, rows: &self.rows[first..end], after: &self.rows[end..], starts, ..*self };
            piece.gather_and_scatter_piece(b, &power[first..end])
        };
        let count = self.rows.len().div_ceil(size);
        let found: Vec<_> = if self.shared {
            use rayon::prelude::*;
            (0..count).into_par_iter().map(piece).collect()
        } else {
            (0..count).map(piece).collect()
        };
        let (mut gathered, mut sum) = (Vec::with_capacity(self.rows.len()), Blocks::black(self.rows.len()));
        for (piece, scattered) in found {
            gathered.extend(piece);
            sum.add(&scattered);
        }
        (gathered, sum)
    }

    fn gather_and_scatter_piece<const CHANNELS: usize>(
        self,
        b: &Blocks<CHANNELS>,
        power: &[[f64; CHANNELS]],
    ) -> (Vec<[f64; CHANNELS]>, Blocks<CHANNELS>) {
        let mut onto = b.black_alike();
        let mut gathered = Vec::with_capacity(self.rows.len());
        let level = Level::best();
        for (band, power) in self.bands().zip(power.chunks(BAND)) {
            if level < Level::Avx512 {
                let rows = band.rows.iter().zip(power);
                gathered.extend(rows.map(|(row, &power)| row.gather_and_scatter(b, power, &mut onto)));
            } else {
                let (light, onto) = (b.blocks(), onto.blocks_mut());
                let found = simd::run(level, GatherAndScatterBand { band, light, power, onto });
                gathered.extend(&found[..band.rows.len()]);
            }
        }
        (gathered, onto)
    }
}

/// What is sent along the rows of a matrix is summed in pieces of so many rows each, and then one piece after the other.
pub(super) fn rows_a_piece(rows: usize) -> usize {
    let pieces = (rows / LEAST_ROWS).clamp(1, MOST_PIECES);
    rows.div_ceil(pieces).max(1).next_multiple_of(BAND)
}

/// How far ahead of its turn what a row has next is brought into the nearest cache. \[numbers\]
const AHEAD: usize = 128;

/// The values of a band's rows, as they are read.
struct Reading<'a> {
    values: [Padded<'a>; BAND],
    /// How many of each have been read.
    at: [usize; BAND],
    next: [Padded<'a>; BAND],
}

impl<'a> Reading<'a> {
    #[inline(always)]
    fn new(band: Band<'a>) -> Self {
        Self { values: values_of(band.rows), at: [0; BAND], next: values_of(band.next) }
    }

    /// Those of row k in the lanes that have their bit.
    ///
    /// Each row is a piece of memory of its own, and no processor foresees where the next one lies. So while this one is read,
    /// as much of the one in its place in the next band is asked for: into the second cache, for the first would not hold both.
    #[inline(always)]
    fn expand<S: Simd>(&mut self, simd: S, k: usize, mask: u16) -> S::Floats {
        let at = self.at[k];
        self.at[k] = at + mask.count_ones() as usize;
        simd.fetch_far(self.next[k].numbers(), at);
        simd.fetch(self.values[k].numbers(), at + AHEAD);
        simd.expand_padded(mask, self.values[k], at)
    }
}

struct GatherBandChanges<'a> {
    band: Band<'a>,
    changes: &'a ChangeBlocks,
}

impl Kernel for GatherBandChanges<'_> {
    type Output = [Rgb; BAND];

    #[inline(always)]
    fn run<S: Simd>(self, simd: S) -> [Rgb; BAND] {
        let mut reading = Reading::new(self.band);
        let mut sums = [[simd.splat(0.0); 3]; BAND];
        let blocks = self.changes.blocks();
        for tile in self.band.tiles {
            let changes = &blocks[tile.block as usize].0;
            let changes = [simd.load(&changes[0]), simd.load(&changes[1]), simd.load(&changes[2])];
            let masks = tile.masks;
            for k in 0..BAND {
                let factors = reading.expand(simd, k, masks[k]);
                for channel in 0..3 {
                    sums[k][channel] = simd.fused(factors, changes[channel], sums[k][channel]);
                }
            }
        }
        let mut totals = [Rgb::BLACK; BAND];
        for k in 0..BAND {
            let [r, g, b] = sums[k];
            totals[k] = rows::total(simd, [simd.widen(r), simd.widen(g), simd.widen(b)]);
        }
        totals
    }
}

struct GatherBand<'a> {
    band: Band<'a>,
    light: &'a LightBlocks,
}

impl Kernel for GatherBand<'_> {
    type Output = [Rgb; BAND];

    #[inline(always)]
    fn run<S: Simd>(self, simd: S) -> [Rgb; BAND] {
        let mut reading = Reading::new(self.band);
        let mut sums = [[simd.splat_double(0.0); 3]; BAND];
        let blocks = self.light.blocks();
        for tile in self.band.tiles {
            let light = &blocks[tile.block as usize].0;
            let masks = tile.masks;
            for k in 0..BAND {
                let factors = simd.widen(reading.expand(simd, k, masks[k]));
                for channel in 0..3 {
                    let arriving = simd.mul_double(simd.load_double(&light[channel]), factors);
                    sums[k][channel] = simd.add_double(sums[k][channel], arriving);
                }
            }
        }
        let mut totals = [Rgb::BLACK; BAND];
        for k in 0..BAND {
            totals[k] = rows::total(simd, sums[k]);
        }
        totals
    }
}

struct GatherAndScatterBand<'a, const CHANNELS: usize> {
    band: Band<'a>,
    light: &'a [Block<f64, CHANNELS>],
    power: &'a [[f64; CHANNELS]],
    onto: &'a mut [Block<f64, CHANNELS>],
}

impl<const CHANNELS: usize> Kernel for GatherAndScatterBand<'_, CHANNELS> {
    type Output = [[f64; CHANNELS]; BAND];

    #[inline(always)]
    fn run<S: Simd>(self, simd: S) -> [[f64; CHANNELS]; BAND] {
        let mut reading = Reading::new(self.band);
        let mut sums = [[simd.splat_double(0.0); CHANNELS]; BAND];
        let mut powers = sums;
        for (powers, sent) in powers.iter_mut().zip(self.power) {
            for (power, &sent) in powers.iter_mut().zip(sent) {
                *power = simd.splat_double(sent);
            }
        }
        for tile in self.band.tiles {
            let (light, onto) = (&self.light[tile.block as usize].0, &mut self.onto[tile.block as usize].0);
            let (masks, mut factors) = (tile.masks, [simd.splat_double(0.0); BAND]);
            for k in 0..BAND {
                factors[k] = simd.widen(reading.expand(simd, k, masks[k]));
            }
            for channel in 0..CHANNELS {
                let from = simd.load_double(&light[channel]);
                // One row after another, as they come.
                let mut there = simd.load_double(&onto[channel]);
                for k in 0..BAND {
                    let arriving = simd.mul_double(from, factors[k]);
                    sums[k][channel] = simd.add_double(sums[k][channel], arriving);
                    there = simd.add_double(there, simd.mul_double(powers[k][channel], factors[k]));
                }
                simd.store_double(there, &mut onto[channel]);
            }
        }
        let mut totals = [[0.0; CHANNELS]; BAND];
        for k in 0..BAND {
            for channel in 0..CHANNELS {
                totals[k][channel] = simd.sum_double(sums[k][channel]);
            }
        }
        totals
    }
}

/// The values of each of up to [`BAND`] rows, with what is behind them.
#[inline(always)]
fn values_of(rows: &[Row]) -> [Padded<'_>; BAND] {
    std::array::from_fn(|k| Padded::new(rows.get(k).map_or(&NOTHING[..], Row::padded_values)))
}

#[cfg(test)]
mod tests {
    use proptest::prelude::*;

    use super::*;

    fn light(count: usize, seed: f64) -> Vec<Rgb> {
        let wave = |k: usize, step: f64| (k as f64 * step + seed).sin();
        (0..count).map(|k| Rgb::new(wave(k, 0.7), wave(k, 1.3), wave(k, 2.9))).collect()
    }

    /// Rows of 75 columns; those of one surface, some patches that follow each other, do not see one another.
    fn rows() -> impl Strategy<Value = Vec<Row>> {
        let entry = prop_oneof![3 => Just(0.0), 2 => 1e-6..1.0_f64];
        let full = proptest::collection::vec(proptest::collection::vec(entry, 75), 0..40);
        (full, proptest::collection::vec(1..12_usize, 40)).prop_map(|(mut full, sizes)| {
            let mut surfaces = sizes.into_iter().enumerate().flat_map(|(k, size)| vec![k; size]);
            let surface: Vec<usize> = surfaces.by_ref().take(40).collect();
            for (i, row) in full.iter_mut().enumerate() {
                (0..40).filter(|&j| surface[j] == surface[i]).for_each(|j| row[j] = 0.0);
            }
            full.iter().map(|row| Row::from_dense(row)).collect()
        })
    }

    proptest! {
        #[test]
        fn a_stretch_is_its_rows_and_none_sees_one_before_it(rows in rows(), seed in 0.0..6.0) {
            let light = light(75, seed);
            let blocks: LightBlocks = light.iter().copied().collect();
            let mut changes = ChangeBlocks::none(75);
            for (j, &change) in light.iter().enumerate() {
                changes.set(j, change);
            }
            let bands = Bands::new(&rows);
            let (mut shown, mut found) = (0, Vec::new());
            for stretch in bands.stretches(&rows, false).chain([bands.all(&rows, true)]) {
                let these = &rows[stretch.first()..][..stretch.rows.len()];
                for level in Level::available() {
                    stretch.gather_changes_at(level, &changes, &mut found);
                    prop_assert_eq!(found.len(), these.len());
                    for (row, &found) in these.iter().zip(&found) {
                        prop_assert_eq!(found, row.gather_changes(&changes));
                    }
                    stretch.gather_at(level, &blocks, &mut found);
                    for (row, &found) in these.iter().zip(&found) {
                        prop_assert_eq!(found, row.gather_blocks(&blocks));
                    }
                }
                if shown == rows.len() {
                    // All at once, whoever sees whom.
                    prop_assert_eq!(these.len(), rows.len());
                    break;
                }
                prop_assert_eq!(stretch.first(), shown);
                for (i, row) in (shown..).zip(these) {
                    prop_assert!((shown..i).all(|j| row.get(j) == 0.0));
                }
                shown += these.len();
            }
            prop_assert_eq!(shown, rows.len());
        }
    }

    #[test]
    fn a_stretch_is_as_long_as_a_surface() {
        // Two surfaces of 23 and 37 patches that see one another wholly, and themselves not.
        let sees = |i: usize, j: usize| (i < 23) != (j < 23);
        let row = |i: usize| (0..60).map(|j| if sees(i, j) { 0.01 } else { 0.0 }).collect::<Vec<f64>>();
        let rows: Vec<Row> = (0..60).map(|i| Row::from_dense(&row(i))).collect();
        let lengths: Vec<usize> =
            Bands::new(&rows).stretches(&rows, false).map(|stretch| stretch.rows.len()).collect();
        // The band that has patches of both is taken row by row.
        assert_eq!(lengths, [20, 1, 1, 1, 1, 36]);
    }
}
