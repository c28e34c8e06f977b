//! What patches hide that send light evenly, as a few places within each know it by small hemicubes.

use std::ops::ControlFlow;

use super::rows::hemicube;
use super::{BakeError, Request, Run};
use crate::estimate::{Hidden, Places};
use crate::form_factors::{LightBlocks, Row, compute_rows_of};
use crate::light::Rgb;
use crate::scene::{BackFaces, Scene};
use crate::visibility::Facets;
use crate::watch::Interrupted;

/// Patches that are looked out from at a time: their rows take 60 MB at most.
const BATCH: usize = 128;

/// The light of an answer, and what else it was found with.
pub(super) struct Lit<'a> {
    pub(super) facets: &'a Facets,
    pub(super) light: LightBlocks,
    pub(super) surroundings: Rgb,
    pub(super) back_faces: BackFaces,
    pub(super) threads: usize,
}

impl<'a> Lit<'a> {
    pub(super) fn new(
        scene: &Scene,
        facets: &'a Facets,
        radiosity: &[Rgb],
        request: &Request,
        run: &Run,
    ) -> Self {
        Self {
            facets,
            light: radiosity.iter().copied().collect(),
            surroundings: request.surroundings,
            back_faces: request.back_faces.unwrap_or(scene.back_faces),
            threads: run.threads.unwrap_or(0),
        }
    }

    /// The irradiance that each patch lacks, by hemicubes of `precision` at the `places`; `step` is told of each.
    pub(super) fn hidden(
        &self,
        places: &Places<'_>,
        precision: u32,
        step: &mut impl FnMut() -> ControlFlow<()>,
    ) -> Result<Vec<Rgb>, BakeError> {
        let patches = places.patches();
        let cube = hemicube(patches, self.facets, self.back_faces, precision)?;
        let count = places.count();
        let row = |number: usize, scratch: &mut _| {
            cube.row_from(places.of(number / count, number % count), scratch)
        };
        let mut hidden = Hidden::new(patches.len());
        let every: Vec<u32> = (0..(patches.len() * count) as u32).collect();
        for batch in every.chunks(BATCH * count) {
            let first = batch[0] as usize;
            let mut rows = vec![Row::default(); batch.len()];
            let end = compute_rows_of(batch, self.threads, Default::default, row, |number, row| {
                rows[number - first] = row;
                step()
            });
            if end.is_break() {
                return Err(Interrupted.into());
            }
            for (rows, patch) in rows.chunks_exact(count).zip(first / count..) {
                hidden.add(places, patch, rows, &self.light, self.surroundings);
            }
        }
        Ok(hidden.irradiance(patches))
    }
}
