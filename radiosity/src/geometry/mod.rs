//! Geometry: no light in here.

pub mod boxes;
pub mod contact;
pub mod curved;
pub mod fill;
pub mod polygon;
pub mod refine;
