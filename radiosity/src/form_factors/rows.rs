//! The matrix of form factors as sparse rows, and the laws it obeys.

use crate::light::Rgb;

/// One row: the form factors from patch i to every patch that it sees.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Row {
    columns: Box<[u32]>,
    values: Box<[f32]>,
}

/// Sparse rows, F\[i\]\[j\], one a patch.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct FormFactors {
    rows: Vec<Row>,
}

impl Row {
    /// What an entry takes in memory.
    pub const BYTES_PER_ENTRY: u64 = 4 + 4;

    /// From a full row: its entries above zero, rounded to single precision.
    pub fn from_dense(full: &[f64]) -> Self {
        let kept = || full.iter().enumerate().filter(|&(_, &value)| value > 0.0);
        Self {
            columns: kept().map(|(column, _)| column as u32).collect(),
            values: kept().map(|(_, &value)| value as f32).collect(),
        }
    }

    /// The patches seen, in ascending order.
    pub fn columns(&self) -> &[u32] {
        &self.columns
    }

    /// The form factor to each of [`Row::columns`], all above zero.
    pub fn values(&self) -> &[f32] {
        &self.values
    }

    /// (j, F_ij) of every patch seen, in ascending order.
    pub fn iter(&self) -> impl Iterator<Item = (usize, f64)> + '_ {
        self.columns.iter().zip(&self.values).map(|(&column, &value)| (column as usize, f64::from(value)))
    }

    /// F_ij, zero where j is not seen.
    pub fn get(&self, column: usize) -> f64 {
        match self.columns.binary_search(&(column as u32)) {
            Ok(at) => f64::from(self.values[at]),
            Err(_) => 0.0,
        }
    }

    /// Σ_j F_ij: 1 in a closed scene (closure).
    pub fn sum(&self) -> f64 {
        self.values.iter().map(|&value| f64::from(value)).sum()
    }

    /// Σ_j F_ij B_j: the irradiance that radiosities `b` bring to patch i.
    pub fn gather(&self, b: &[Rgb]) -> Rgb {
        self.iter().map(|(j, factor)| b[j] * factor).sum()
    }
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
        self.rows.iter().map(|row| row.columns.len()).sum()
    }

    /// The least and the greatest row sum: both 1 where the scene is closed and nothing leaks. (1, 1) for no rows.
    pub fn row_sum_range(&self) -> (f64, f64) {
        let mut sums = self.rows.iter().map(Row::sum);
        let first = sums.next().unwrap_or(1.0);
        sums.fold((first, first), |(low, high), sum| (low.min(sum), high.max(sum)))
    }
}
