//! Rows four at a time: neighbours see much the same blocks of patches, so a solver that takes them together reads the
//! light of a block once for all four.

use super::rows::{self, ChangeBlocks, Row};
use crate::light::Rgb;
use crate::simd::{self, Kernel, LANES, Level, Simd};

/// Rows in a band. Their sums and what they are made of just fill the registers of AVX-512.
pub const BAND: usize = 4;

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
    /// For each band, where its tiles end, and whether its rows may be gathered together.
    bands: Vec<(usize, bool)>,
}

/// Up to [`BAND`] rows that follow each other.
#[derive(Clone, Copy, Debug)]
pub struct Band<'a> {
    first: usize,
    rows: &'a [Row],
    /// Those of the band after it, which are wanted next.
    next: &'a [Row],
    tiles: &'a [Tile],
    apart: bool,
}

impl Bands {
    /// Bytes for each block of [`LANES`] columns that a row sees, where its neighbours see the same.
    pub(super) const BYTES_PER_BLOCK: u64 = (size_of::<Tile>() / BAND) as u64;

    pub(super) fn new(rows: &[Row]) -> Self {
        let mut all = Self::default();
        for (band, rows) in rows.chunks(BAND).enumerate() {
            let mut next: [_; BAND] = std::array::from_fn(|k| rows.get(k).map(|row| row.blocks()));
            let mut step =
                |k: usize| -> Option<(usize, u16)> { next[k].as_mut()?.find(|&(_, mask)| mask != 0) };
            let mut at: [_; BAND] = std::array::from_fn(&mut step);
            let mut apart = true;
            while let Some(block) = at.iter().flatten().map(|&(block, _)| block).min() {
                let mut masks = [0; BAND];
                for k in 0..BAND {
                    if let Some((_, mask)) = at[k].filter(|&(here, _)| here == block) {
                        masks[k] = mask;
                        at[k] = step(k);
                    }
                }
                if block == band * BAND / LANES {
                    // Whether a row sees one before it in the band.
                    apart &= (0..BAND).all(|k| masks[k] >> (band * BAND % LANES) & ((1 << k) - 1) == 0);
                }
                all.tiles.push(Tile { block: block as u32, masks });
            }
            all.bands.push((all.tiles.len(), apart));
        }
        all.tiles.shrink_to_fit();
        all
    }

    /// The bands of `all` the rows that these were made of.
    pub(super) fn iter<'a>(&'a self, all: &'a [Row]) -> impl Iterator<Item = Band<'a>> {
        let starts = std::iter::once(0).chain(self.bands.iter().map(|&(end, _)| end));
        let bands = self.bands.iter().zip(starts).zip(all.chunks(BAND)).enumerate();
        bands.map(|(band, ((&(end, apart), start), rows))| Band {
            first: band * BAND,
            rows,
            next: all.get((band + 1) * BAND..).unwrap_or_default(),
            tiles: &self.tiles[start..end],
            apart,
        })
    }
}

impl<'a> Band<'a> {
    /// A row by itself.
    pub fn of_one(patch: usize, row: &'a Row) -> Self {
        Self { first: patch, rows: std::slice::from_ref(row), next: &[], tiles: &[], apart: false }
    }

    /// Each row with its patch.
    pub fn rows(&self) -> impl Iterator<Item = (usize, &'a Row)> + use<'a> {
        (self.first..).zip(self.rows)
    }

    /// [`Row::gather_changes`] of each row, the same bits: together where that is faster and no row sees one before it, so
    /// that nothing is lost by taking them at once; `None` where it is not so, and they are better taken one at a time.
    pub fn gather_changes(&self, changes: &ChangeBlocks) -> Option<[Rgb; BAND]> {
        // With fewer registers the sums of four rows would be carried to memory and back.
        let together = self.apart && Level::best() == Level::Avx512;
        together.then(|| self.gather_changes_at(Level::Avx512, changes))
    }

    fn gather_changes_at(&self, level: Level, changes: &ChangeBlocks) -> [Rgb; BAND] {
        simd::run(level, GatherBand { band: *self, changes })
    }
}

struct GatherBand<'a> {
    band: Band<'a>,
    changes: &'a ChangeBlocks,
}

impl Kernel for GatherBand<'_> {
    type Output = [Rgb; BAND];

    #[inline(always)]
    fn run<S: Simd>(self, simd: S) -> [Rgb; BAND] {
        let (mut values, next) = (values_of(self.band.rows), values_of(self.band.next));
        let lengths = values.map(<[f32]>::len);
        let mut sums = [[simd.splat(0.0); 3]; BAND];
        for tile in self.band.tiles {
            let changes = self.changes.block(tile.block as usize);
            let changes = [simd.load(&changes[0]), simd.load(&changes[1]), simd.load(&changes[2])];
            for k in 0..BAND {
                // Each row is a piece of memory of its own, and no processor foresees where the next one lies: asked for
                // now, it is there when its turn comes.
                simd.fetch(next[k], lengths[k] - values[k].len());
                let factors = simd.expand_next(tile.masks[k], &mut values[k]);
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

/// The values of each of up to [`BAND`] rows.
#[inline(always)]
fn values_of(rows: &[Row]) -> [&[f32]; BAND] {
    let mut values: [&[f32]; BAND] = [&[]; BAND];
    for (values, row) in values.iter_mut().zip(rows) {
        *values = row.values();
    }
    values
}

#[cfg(test)]
mod tests {
    use proptest::prelude::*;

    use super::*;

    proptest! {
        #[test]
        fn a_band_is_its_rows(
            full in proptest::collection::vec(
                proptest::collection::vec(prop_oneof![3 => Just(0.0), 2 => 1e-6..1.0_f64], 75), 0..20,
            ),
            seed in 0.0..6.0,
        ) {
            let rows: Vec<Row> = full.iter().map(|row| Row::from_dense(row)).collect();
            let mut changes = ChangeBlocks::none(75);
            for j in 0..75 {
                let wave = |step: f64| f64::sin(f64::from(j as u32) * step + seed);
                changes.set(j, Rgb::new(wave(0.7), wave(1.3), wave(2.9)));
            }
            let bands = Bands::new(&rows);
            let mut shown = 0;
            for band in bands.iter(&rows) {
                for level in Level::available() {
                    let together = band.gather_changes_at(level, &changes);
                    for ((_, row), together) in band.rows().zip(together) {
                        prop_assert_eq!(together, row.gather_changes(&changes));
                    }
                }
                let patches: Vec<usize> = band.rows().map(|(patch, _)| patch).collect();
                let sees_one_before = band.rows().any(|(i, row)| (patches[0]..i).any(|j| row.get(j) > 0.0));
                prop_assert_eq!(band.apart, !sees_one_before);
                prop_assert_eq!(patches[0], shown);
                shown += patches.len();
            }
            prop_assert_eq!(shown, rows.len());
        }
    }
}
