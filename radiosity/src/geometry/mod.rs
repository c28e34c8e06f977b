//! Flat geometry: no light in here.

pub mod polygon;
