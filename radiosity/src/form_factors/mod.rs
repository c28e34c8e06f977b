//! Form factors: F_ij is the share of the energy leaving patch i that arrives at patch j.

mod rows;

pub use rows::{FormFactors, Row};
