//! Geometry: no light in here.

pub mod curved;
pub mod polygon;
pub mod refine;
