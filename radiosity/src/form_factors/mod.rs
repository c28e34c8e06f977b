//! Form factors: F_ij is the share of the energy leaving patch i that arrives at patch j.
//!
//! A method says how one row is found; [`compute_rows`] runs any of them over all patches. A method of your
//! own is a closure that fills a row.

mod abreast;
mod bands;
mod cutting;
pub mod exact;
mod exchange;
pub mod hemicube;
mod pairs;
mod parallel;
mod partial;
mod parts;
mod passes;
mod repair;
mod rows;
mod runs;
pub mod shares;
pub mod visible;

pub use bands::Stretch;
pub(crate) use cutting::FlatPieces;
pub(crate) use exact::seen_from;
pub use pairs::WAITING;
pub use parallel::{compute_rows, compute_rows_of};
pub(crate) use parts::Outline;
pub use passes::{Gathered, Passes, RecomputedRows};
pub use repair::{Closing, ExchangeAreas};
pub use rows::{Blocks, ChangeBlocks, Elsewhere, FormFactors, GreyBlocks, LightBlocks, Packing, Row};
