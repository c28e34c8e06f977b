//! Step 4: by how much the radiosities may be off.

use super::hidden::Lit;
use super::rows::{Scratch, row_finder};
use super::{BakeError, Method, Request, Run};
use crate::estimate::{ErrorEstimate, Local, Looks, Places};
use crate::form_factors::{Passes, compute_rows_of, shares};
use crate::light::Rgb;
use crate::patches::Patches;
use crate::scene::Scene;
use crate::solve::Solution;
use crate::visibility::Facets;
use crate::watch::{Interrupted, Progress, Watch};

/// Step 4, where [`Request::error`] asks for it: by how much the radiosities may be off. With hemicubes every second patch looks
/// out anew from two places, which takes as long as its form factors did; with exact form factors, or shares, every patch from
/// four, by small hemicubes.
///
/// # Errors
/// [`BakeError::Interrupted`], or [`BakeError::BadRequest`] as of [`rows`](super::rows()).
#[expect(clippy::too_many_arguments, reason = "every stage's value, what is asked and how it is run")]
pub fn error(
    scene: &Scene,
    patches: &Patches,
    facets: &Facets,
    rows: &impl Passes,
    solution: &Solution,
    request: &Request,
    run: &Run,
    watch: &mut Watch<'_>,
) -> Result<ErrorEstimate, BakeError> {
    let lit = Lit::new(scene, facets, &solution.radiosity, request, run);
    let looks = match request.method {
        Method::Exact { .. } => None,
        _ => Some(Looks::new(patches)),
    };
    let within = request.method.from_patch_to_patch().then(|| Places::four(patches));
    let (places, again) = match (&looks, request.method) {
        (None, _) => (Vec::new(), *request),
        // Several hemicubes know what one at the centre does not; more of them, and elsewhere, know better.
        (Some(_), Method::HemicubeExact { precision, eyes, accuracy }) => {
            let other = if eyes < *shares::EYES.end() { eyes + 1 } else { eyes - 1 };
            let precision = precision.div_ceil(eyes) * other;
            let method = Method::HemicubeExact { precision, eyes: other, accuracy };
            (vec![patches], Request { method, ..*request })
        }
        (Some(looks), _) => (vec![&looks.one, &looks.other], *request),
    };
    let wanted = looks.as_ref().map_or(&[][..], |looks| &looks.wanted);
    let looks = within.as_ref().map_or(0, |places| places.count() * patches.len());
    let total = places.len() * wanted.len() + looks;
    let mut done = 0;
    let mut step = || {
        done += 1;
        watch(&Progress::Looks { done, total })
    };

    let share = (places.len().max(1) as f64).recip();
    let mut seen = vec![None; patches.len()];
    for moved in places {
        let row = row_finder(moved, facets, &again, lit.back_faces)?;
        let end = compute_rows_of(wanted, lit.threads, Scratch::default, row, |patch, row| {
            let arrives = row.gather_blocks(&lit.light) + request.surroundings * row.elsewhere().surroundings;
            let before = seen[patch].unwrap_or(Rgb::BLACK);
            seen[patch] = Some(before + arrives * share);
            step()
        });
        if end.is_break() {
            return Err(Interrupted.into());
        }
    }
    let mut hidden = within.map(|places| lit.hidden(&places, WITHIN_PRECISION, &mut step)).transpose()?;
    if let Some(hidden) = hidden.as_mut().filter(|_| request.correct) {
        // The answer has it already, and the form factors know nothing of it.
        for (seen, &hidden) in seen.iter_mut().zip(&*hidden) {
            *seen = seen.map(|seen| seen + hidden);
        }
        hidden.iter_mut().for_each(|hidden| *hidden *= LEFT);
    }
    let local = match request.method {
        Method::Exact { accuracy } => Local::Accuracy(accuracy),
        _ => Local::Looked(seen),
    };
    Ok(ErrorEstimate::new(patches, rows, solution, &local, hidden.as_deref(), watch)?)
}

/// Of the hemicubes that look out from four places on each patch: together as many cells as one of the usual precision has.
const WITHIN_PRECISION: u32 = 50;

/// Of what patches hide, the share that may be left once it was looked for and sent after: a few places do not know all of it.
const LEFT: f64 = 0.35;
