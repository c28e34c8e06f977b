//! NumPy archives: the solution as arrays, form factors as a SciPy sparse matrix.
//!
//! An .npz is a zip of .npy files, here stored, not compressed: light and matrices do not shrink by much, and a stored
//! array is read at the disk's speed. All is streamed: nothing is held twice in memory.

use std::io::{self, BufWriter, Seek, Write};
use std::mem::ManuallyDrop;
use std::path::Path;

use npyz::{AutoSerialize, DType, WriterBuilder};
use zip::CompressionMethod;
use zip::write::{SimpleFileOptions, ZipWriter};

use super::{ExportError, whole_file};
use crate::estimate::ErrorEstimate;
use crate::form_factors::{ExchangeAreas, FormFactors};
use crate::light::Rgb;
use crate::patches::Patches;
use crate::solve::Solution;

/// Write the solution as arrays, patch by patch: `centre`, `normal` (n, 3), `area` (n), `emission`, `reflectance`,
/// `radiosity` (n, 3), float64, and `object` (n), int64; where it was estimated, the radiosity's `error` (n, 3), float64, with its
/// parts `error_discretisation`, `error_form_factors` and `error_residual`; and where patches were refined `parent` (n), int64, the
/// patch that each would be (part of) without.
///
/// # Panics
///
/// Where `solution` or `error` is not of these `patches`.
pub fn write_solution_npz(
    path: &Path,
    patches: &Patches,
    solution: &Solution,
    error: Option<&ErrorEstimate>,
) -> Result<(), ExportError> {
    assert_eq!(solution.radiosity.len(), patches.len(), "one radiosity a patch");
    let n = patches.len() as u64;
    fn rgb(values: &[Rgb]) -> impl Iterator<Item = f64> {
        values.iter().flat_map(|value| value.to_array())
    }
    whole_file(path, |writer| {
        let mut archive = Archive::new(writer);
        archive.array("centre", &[n, 3], patches.centre.iter().flat_map(|p| p.to_array()))?;
        archive.array("normal", &[n, 3], patches.normal.iter().flat_map(|p| p.to_array()))?;
        archive.array("area", &[n], patches.area.iter().copied())?;
        archive.array("emission", &[n, 3], rgb(&patches.emission))?;
        archive.array("reflectance", &[n, 3], rgb(&patches.reflectance))?;
        archive.array("radiosity", &[n, 3], rgb(&solution.radiosity))?;
        archive.array("object", &[n], patches.surface.iter().map(|&surface| i64::from(surface)))?;
        if !patches.parent.is_empty() {
            archive.array("parent", &[n], patches.parent.iter().map(|&parent| i64::from(parent)))?;
        }
        for (name, values) in error.iter().flat_map(|error| error.columns()) {
            archive.array(name, &[n, 3], rgb(values))?;
        }
        archive.finish()
    })
}

/// Write form factors so that `scipy.sparse.load_npz` reads them, as a CSR matrix whose row i holds F_ij: `data`
/// float32, `indices` int32, `indptr` int32 (int64 each where 2³¹ is reached), `shape`, `format`. With `surroundings` the
/// matrix has a column more, the last: what leaves the scene.
pub fn write_form_factors_npz(
    path: &Path,
    factors: &FormFactors,
    surroundings: bool,
) -> Result<(), ExportError> {
    let row = |i: usize| {
        let row = factors.row(i);
        let share = row.elsewhere().surroundings as f32;
        row.columns().zip(row.values().iter().copied()).chain(last_column(factors.len(), surroundings, share))
    };
    write_csr(path, factors.len(), surroundings, row)
}

/// Write repaired form factors likewise, `data` being float64: each row, with what goes elsewhere, sums to 1 to the last
/// digits, and A_i F_ij is A_j F_ji.
pub fn write_exchange_npz(path: &Path, areas: &ExchangeAreas, surroundings: bool) -> Result<(), ExportError> {
    let row = |i: usize| {
        let share = areas.elsewhere(i).surroundings;
        areas.row(i).chain(last_column(areas.len(), surroundings, share))
    };
    write_csr(path, areas.len(), surroundings, row)
}

/// What stands in the column after all patches.
fn last_column<T: PartialOrd + Default>(patches: usize, wanted: bool, share: T) -> Option<(u32, T)> {
    (wanted && share > T::default()).then_some((patches as u32, share))
}

/// A sparse matrix of n rows, and of n columns or one more.
fn write_csr<T: AutoSerialize, R: Iterator<Item = (u32, T)>>(
    path: &Path,
    n: usize,
    one_more: bool,
    row: impl Fn(usize) -> R,
) -> Result<(), ExportError> {
    let rows = || (0..n).map(&row);
    let nonzeros = rows().map(|row| row.count() as u64).sum::<u64>();
    let width = n as u64 + u64::from(one_more);
    let narrow = |greatest: u64| i32::try_from(greatest).is_ok();
    whole_file(path, |writer| {
        let mut archive = Archive::new(writer);
        archive.array("data", &[nonzeros], rows().flatten().map(|(_, value)| value))?;
        let indices = rows().flatten().map(|(column, _)| column);
        if narrow(width) {
            archive.array("indices", &[nonzeros], indices.map(|column| column as i32))?;
        } else {
            archive.array("indices", &[nonzeros], indices.map(i64::from))?;
        }
        let ends = rows().scan(0_i64, |end, row| {
            *end += row.count() as i64;
            Some(*end)
        });
        let starts = std::iter::once(0).chain(ends);
        if narrow(nonzeros) {
            archive.array("indptr", &[n as u64 + 1], starts.map(|start| start as i32))?;
        } else {
            archive.array("indptr", &[n as u64 + 1], starts)?;
        }
        archive.array("shape", &[2], [n as i64, width as i64])?;
        archive.bytes("format", b"csr")?;
        archive.finish()
    })
}

/// A zip of .npy files.
///
/// A `ZipWriter` that is dropped unfinished tries to finish, and prints to stderr when it cannot: on a full disk, say.
/// So it is never dropped; what leaks then is its list of names.
struct Archive<W: Write + Seek>(ManuallyDrop<ZipWriter<W>>);

impl<W: Write + Seek> Archive<W> {
    fn new(writer: W) -> Self {
        Self(ManuallyDrop::new(ZipWriter::new(writer)))
    }

    fn start(&mut self, name: &str, bytes: u64) -> io::Result<()> {
        let options = SimpleFileOptions::default()
            .compression_method(CompressionMethod::Stored)
            // A size of 4 GB or more needs a wider field, which has to be there from the start.
            .large_file(bytes > u64::from(u32::MAX) - (1 << 16));
        Ok(self.0.start_file(format!("{name}.npy"), options)?)
    }

    /// An array of this shape, C order, little-endian.
    fn array<T: AutoSerialize>(
        &mut self,
        name: &str,
        shape: &[u64],
        values: impl IntoIterator<Item = T>,
    ) -> io::Result<()> {
        self.start(name, shape.iter().product::<u64>() * size_of::<T>() as u64)?;
        // The zip takes a checksum each time it is handed something: hand it much at a time.
        let mut buffered = BufWriter::with_capacity(1 << 16, &mut *self.0);
        let mut array =
            npyz::WriteOptions::new().default_dtype().shape(shape).writer(&mut buffered).begin_nd()?;
        array.extend(values)?;
        array.finish()?;
        buffered.flush()
    }

    /// A byte string of no dimension, as `numpy.array(b"...")` is.
    fn bytes(&mut self, name: &str, value: &[u8]) -> io::Result<()> {
        self.start(name, value.len() as u64)?;
        let kind = format!("|S{}", value.len()).parse().map_err(io::Error::other)?;
        let mut array = npyz::WriteOptions::<[u8]>::new()
            .dtype(DType::Plain(kind))
            .shape(&[])
            .writer(&mut *self.0)
            .begin_nd()?;
        array.push(value)?;
        array.finish()
    }

    fn finish(mut self) -> io::Result<()> {
        // Meet a full disk here, where it can be told, and leave `finish` little more to write than the list of names.
        self.0.flush()?;
        ManuallyDrop::into_inner(self.0).finish()?.flush()
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Beyond 4 GB a zip needs its wide fields, in the array's own record and in the ones after it.
    #[test]
    #[ignore = "writes 4.3 GB"]
    fn an_array_may_exceed_4_gb() {
        let folder = tempfile::tempdir().unwrap();
        let path = folder.path().join("large.npz");
        let length = (1_u64 << 30) + 12_345;
        whole_file(&path, |writer| {
            let mut archive = Archive::new(writer);
            archive.array("large", &[length], (0..length).map(|k| k as f32))?;
            archive.array("after", &[2], [7_i64, 8])?;
            archive.finish()
        })
        .unwrap();

        let file = std::fs::File::open(&path).unwrap();
        let mut archive = zip::ZipArchive::new(io::BufReader::new(file)).unwrap();
        let large = npyz::NpyFile::new(archive.by_name("large.npy").unwrap()).unwrap();
        assert_eq!(large.shape(), [length]);
        assert!(large.data::<f32>().unwrap().enumerate().all(|(k, value)| value.unwrap() == k as f32));
        let after = npyz::NpyFile::new(archive.by_name("after.npy").unwrap()).unwrap();
        assert_eq!(after.into_vec::<i64>().unwrap(), [7, 8]);
    }
}
