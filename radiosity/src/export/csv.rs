//! The solution as a table, one row a patch.

use std::fmt;
use std::io::Write;
use std::path::Path;

use super::{ExportError, whole_file};
use crate::estimate::ErrorEstimate;
use crate::patches::Patches;
use crate::solve::Solution;

const HEADER: &str = "patch,object,x,y,z,nx,ny,nz,area,emission_r,emission_g,emission_b,reflectance_r,\
                      reflectance_g,reflectance_b,radiosity_r,radiosity_g,radiosity_b";

const ERROR_HEADER: &str = ",error_r,error_g,error_b";

const PARENT_HEADER: &str = ",parent";

/// Write one row a patch, in patch order: its number and its object's, both from 0; centre, normal, area; emission,
/// reflectance, radiosity; where it was estimated, the radiosity's error; and where patches were refined, the number of the patch
/// that each would be (part of) without. A number is the shortest decimal that reads back as the same double.
///
/// # Panics
///
/// Where `solution` or `error` is not of these `patches`.
pub fn write_solution_csv(
    path: &Path,
    patches: &Patches,
    solution: &Solution,
    error: Option<&ErrorEstimate>,
) -> Result<(), ExportError> {
    assert_eq!(solution.radiosity.len(), patches.len(), "one radiosity a patch");
    whole_file(path, |writer| {
        let error_header = if error.is_some() { ERROR_HEADER } else { "" };
        let parent_header = if patches.parent.is_empty() { "" } else { PARENT_HEADER };
        writeln!(writer, "{HEADER}{error_header}{parent_header}")?;
        for patch in 0..patches.len() {
            write!(writer, "{patch},{}", patches.surface[patch])?;
            let mut put = |numbers: &[f64]| {
                numbers.iter().try_for_each(|&number| write!(writer, ",{}", Shortest(number)))
            };
            put(&patches.centre[patch].to_array())?;
            put(&patches.normal[patch].to_array())?;
            put(&[patches.area[patch]])?;
            put(&patches.emission[patch].to_array())?;
            put(&patches.reflectance[patch].to_array())?;
            put(&solution.radiosity[patch].to_array())?;
            if let Some(error) = error {
                put(&error.radiosity[patch].to_array())?;
            }
            if let Some(parent) = patches.parent.get(patch) {
                write!(writer, ",{parent}")?;
            }
            writeln!(writer)?;
        }
        Ok(())
    })
}

/// A double in the fewest digits that read back as itself; with an exponent where zeros would abound.
struct Shortest(f64);

impl fmt::Display for Shortest {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        // Adding zero takes the sign off a zero, which would only puzzle.
        let value = self.0 + 0.0;
        if value == 0.0 || !value.is_finite() || (1e-5..1e16).contains(&value.abs()) {
            write!(f, "{value}")
        } else {
            write!(f, "{value:e}")
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use proptest::prelude::*;

    #[test]
    fn numbers_are_short() {
        let written = |value| Shortest(value).to_string();
        assert_eq!(written(0.1), "0.1");
        assert_eq!(written(20.0), "20");
        assert_eq!(written(-0.0), "0");
        assert_eq!(written(1.0 / 3.0), "0.3333333333333333");
        assert_eq!(written(1.25e-30), "1.25e-30");
        assert_eq!(written(-3e20), "-3e20");
        assert_eq!(written(f64::NAN), "NaN");
    }

    proptest! {
        #[test]
        fn numbers_come_back(value in prop::num::f64::ANY.prop_filter("a number", |v| !v.is_nan())) {
            prop_assert_eq!(Shortest(value).to_string().parse::<f64>().unwrap(), value);
        }
    }
}
