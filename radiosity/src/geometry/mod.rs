//! Geometry: no light in here.

pub mod boxes;
#[cfg(test)]
pub(crate) mod chance;
pub mod contact;
pub mod curved;
pub mod fill;
pub mod polygon;
pub mod refine;
