//! From surfaces to patches.

use glam::DVec3;
use rayon::prelude::*;

use super::cut::{Lie, Plan, cut};
use super::joints::{balance, joints};
use super::meetings::meetings;
use super::refinement::{Origin, Place, Refinement};
use super::split::{Net, Parted};
use super::{Block, Cutting, MOST_GRADING, MOST_PATCHES, Patches, SubdivideError, Subdivision};
use crate::geometry::contact::Contact;
use crate::light::Rgb;
use crate::scene::{Scene, Shape};

/// Bytes that [`Patches`] keep a patch, where it is a cell of a parallelogram; in pieces it takes up to twice as many.
pub const BYTES_PER_PATCH: u64 = 4 * 24 + 8 + 2 * 24 + 4;

/// More patches than this are not made to be counted.
const COUNTED: u64 = 1_000_000;

/// What becomes of each surface.
fn plans(scene: &Scene, subdivision: Subdivision) -> Result<Vec<Plan>, SubdivideError> {
    let positive = |number: f64| number.is_finite() && number > 0.0;
    let planned = |plan: &dyn Fn(&Shape) -> Plan| {
        Ok(scene.surfaces.iter().map(|surface| plan(&surface.shape)).collect())
    };
    match subdivision {
        Subdivision::Factor(factor) if positive(factor) => planned(&|shape| Plan::by_factor(shape, factor)),
        Subdivision::Factor(_) => Err(SubdivideError::BadFactor),
        Subdivision::PatchSize(size) if positive(size) => planned(&|shape| Plan::by_size(shape, size)),
        Subdivision::PatchSize(_) => Err(SubdivideError::BadSize),
        Subdivision::Patches(_) => plans(scene, subdivision.for_scene(scene)?),
    }
}

/// How many patches [`subdivide`] would make, saturating; where they are too many to be solved for, perhaps a lower bound. Of
/// more than a million those that are split are estimated, from a coarser cut.
///
/// # Errors
/// [`SubdivideError`], but never that they are too many.
pub fn count(scene: &Scene, cutting: impl Into<Cutting>) -> Result<u64, SubdivideError> {
    let cutting = cutting.into().for_scene(scene)?;
    let whole = total(&plans(scene, cutting.subdivision)?);
    if !cutting.split {
        return Ok(whole);
    }
    let counted = (COUNTED >> (2 * cutting.grading.min(MOST_GRADING))) as f64;
    let share = (counted / whole as f64).sqrt().min(1.0);
    let coarser = Cutting { subdivision: cutting.subdivision.coarser(share), ..cutting };
    let parted = lay(scene, coarser, &Refinement::default())?.patches;
    // What is near to a line is as its length: twice as fine, twice as many.
    let more = parted.len() as u64 - total(&plans(scene, coarser.subdivision)?);
    Ok(whole.saturating_add((more as f64 / share) as u64))
}

fn total(plans: &[Plan]) -> u64 {
    plans.iter().map(|plan| plan.count()).fold(0, u64::saturating_add)
}

/// Cut every surface of `scene` into patches.
///
/// By a factor ([`Subdivision::Factor`], or just a number) each n and m is multiplied by it; polygons are one patch,
/// meshes one a triangle, whatever the factor. By size, polygons and triangles are cut too: quadrilaterals into a grid,
/// others into triangles that meet corner to corner. With [`Cutting::split`] patches end where another surface stands.
/// Each has the mean of its surface's textures over its own part.
///
/// Step 1 of the assignment, `DeterminerPieces`.
///
/// # Errors
/// [`SubdivideError`].
pub fn subdivide(scene: &Scene, cutting: impl Into<Cutting>) -> Result<Patches, SubdivideError> {
    Ok(refined(scene, cutting, &Refinement::default())?.0)
}

/// The same, with patches quartered as `refinement` has it; and of each patch where it comes from.
///
/// Quarters keep the shape of the surface: those of a curved one's flat cells lie on the cell. Where a cell is parted by what
/// meets it, its quarters are. Besides those that are asked for, faces are quartered until of two that share an edge none is
/// more than twice as long, within a surface and from one to the next where they meet at less than 45 degrees and
/// corner to corner; and each has the corners of the others on its edges, so that smooth shading has no cracks.
///
/// # Errors
/// [`SubdivideError`].
pub fn refined(
    scene: &Scene,
    cutting: impl Into<Cutting>,
    refinement: &Refinement,
) -> Result<(Patches, Vec<Origin>), SubdivideError> {
    let Laid { mut patches, origins, sources } = lay(scene, cutting, refinement)?;
    paint(scene, &mut patches, &sources);
    Ok((patches, origins))
}

/// Patches with the coefficients that a whole triangle of a mesh has.
struct Laid {
    patches: Patches,
    /// Where they come from.
    origins: Vec<Origin>,
    /// For each surface whose triangles have textures the triangle that each patch is of; none of any other.
    sources: Vec<Vec<u32>>,
}

fn lay(scene: &Scene, cutting: impl Into<Cutting>, refinement: &Refinement) -> Result<Laid, SubdivideError> {
    let cutting = cutting.into().for_scene(scene)?;
    if cutting.grading > MOST_GRADING {
        return Err(SubdivideError::BadGrading);
    }
    let plans = plans(scene, cutting.subdivision)?;
    let total = total(&plans);
    if total > MOST_PATCHES {
        return Err(SubdivideError::TooMany { patches: total });
    }
    let (contacts, tolerance) =
        if cutting.split { meetings(scene, &plans) } else { (vec![Vec::new(); plans.len()], 0.0) };
    let parted: Vec<Option<Parted>> = if refinement.is_empty() {
        let surfaces = scene.surfaces.iter().zip(&plans).zip(&contacts).zip(0..);
        surfaces
            .map(|(((surface, &plan), contacts), index)| {
                split(index, &surface.shape, plan, contacts, tolerance, cutting.grading)
            })
            .collect()
    } else {
        quartered(scene, &plans, &contacts, tolerance, cutting.grading, refinement)
    };
    let mut patches = Patches::default();
    let (mut origins, mut sources) = (Vec::new(), Vec::with_capacity(scene.surfaces.len()));
    for ((index, (surface, &plan)), parted) in (0..).zip(scene.surfaces.iter().zip(&plans)).zip(parted) {
        let first = patches.len() as u32;
        let painted = surface.is_painted();
        let mut source = Vec::new();
        let mut put = |Lie { centre, normal, tangents, area, triangle }| {
            let (emission, reflectance) = surface.coefficients(triangle);
            patches.centre.push(centre);
            patches.normal.push(normal);
            patches.tangent_u.push(tangents[0]);
            patches.tangent_v.push(tangents[1]);
            patches.area.push(area);
            patches.emission.push(emission);
            patches.reflectance.push(reflectance);
            patches.surface.push(index);
            if painted {
                source.push(triangle as u32);
            }
        };
        let pieces = match parted {
            Some(Parted { lies, origins: own, mut pieces }) => {
                lies.into_iter().for_each(&mut put);
                origins.extend(own);
                pieces.patch.iter_mut().for_each(|patch| *patch += first);
                patches.blocks.push(Block { first, columns: patches.len() as u32 - first, rows: 1 });
                Some(pieces)
            }
            None => {
                let pieces = cut(&surface.shape, plan, first, put);
                let count = patches.len() as u32 - first;
                origins.extend((0..count).map(|cell| Origin { place: Place::of_cell(index, cell), part: 0 }));
                let (columns, rows) = match plan {
                    Plan::Grid(columns, rows) => (columns as u32, rows as u32),
                    Plan::Whole(_) | Plan::Triangles(..) | Plan::Filled(..) => (count, 1),
                };
                patches.blocks.push(Block { first, columns, rows });
                pieces
            }
        };
        patches.pieces.push(pieces);
        sources.push(source);
        if patches.len() as u64 > MOST_PATCHES {
            return Err(SubdivideError::TooMany { patches: patches.len() as u64 });
        }
    }
    Ok(Laid { patches, origins, sources })
}

/// Give the patches of surfaces with textures the mean over their own parts of a triangle, `sources` telling which.
fn paint(scene: &Scene, patches: &mut Patches, sources: &[Vec<u32>]) {
    for (index, (surface, source)) in scene.surfaces.iter().zip(sources).enumerate() {
        let Some(pieces) = patches.pieces[index].as_ref().filter(|_| !source.is_empty()) else { continue };
        let first = patches.blocks[index].first as usize;
        let mut at = 0;
        let parts: Vec<&[[DVec3; 3]]> = (pieces.patch.chunk_by(|one, other| one == other))
            .map(|same| {
                at += same.len();
                &pieces.triangles[at - same.len()..at]
            })
            .collect();
        let means: Vec<(Rgb, Rgb)> = (parts.par_iter().zip(source))
            .map(|(parts, &triangle)| surface.coefficients_over(triangle as usize, parts))
            .collect();
        for (patch, (emission, reflectance)) in (first..).zip(means) {
            patches.emission[patch] = emission;
            patches.reflectance[patch] = reflectance;
        }
    }
}

/// The patches of a shape, counted from 0, parted along lines; `None` where none of them crosses it within.
fn split(
    surface: u32,
    shape: &Shape,
    plan: Plan,
    contacts: &[Contact],
    tolerance: f64,
    grading: u32,
) -> Option<Parted> {
    // What meets a parallelogram at its border alone changes nothing.
    let at_border = grading == 0 && shape.parallelogram().is_some();
    if contacts.is_empty() || at_border && !contacts.iter().any(|contact| contact.inner) {
        return None;
    }
    let (mut net, lies, smooth) = net(surface, shape, plan);
    net.grade(contacts, grading);
    let mut parted = net.parted(contacts, &lies, tolerance)?;
    parted.pieces.smooth = smooth;
    Some(parted)
}

/// The faces of a shape, its patches as they are, and whether it is smooth whatever the angles in it.
fn net(surface: u32, shape: &Shape, plan: Plan) -> (Net, Vec<Lie>, bool) {
    let mut lies = Vec::new();
    let pieces = cut(shape, plan, 0, |lie| lies.push(lie));
    let net = match (&pieces, shape.parallelogram(), plan) {
        (None, Some(p), Plan::Grid(columns, rows)) => Net::of_cells(surface, &p, columns as u32, rows as u32),
        (Some(pieces), ..) => Net::of_pieces(surface, pieces),
        _ => unreachable!("what is not in pieces is a parallelogram"),
    };
    (net, lies, pieces.is_none_or(|pieces| pieces.smooth))
}

/// The same of all surfaces, quartered first.
fn quartered(
    scene: &Scene,
    plans: &[Plan],
    contacts: &[Vec<Contact>],
    tolerance: f64,
    grading: u32,
    refinement: &Refinement,
) -> Vec<Option<Parted>> {
    let (mut nets, mut of_nets) = (Vec::with_capacity(plans.len()), Vec::with_capacity(plans.len()));
    for ((surface, &plan), index) in scene.surfaces.iter().zip(plans).zip(0..) {
        let (net, lies, smooth) = net(index, &surface.shape, plan);
        nets.push(net);
        of_nets.push((lies, smooth));
    }
    let joints = joints(&nets);
    for (net, contacts) in nets.iter_mut().zip(contacts) {
        net.grade(contacts, grading);
        net.refine(refinement);
    }
    balance(&mut nets, &joints);
    let all = nets.into_iter().zip(of_nets).zip(contacts);
    all.map(|((net, (lies, smooth)), contacts)| {
        let mut parted = net.parted(contacts, &lies, tolerance)?;
        parted.pieces.smooth = smooth;
        Some(parted)
    })
    .collect()
}
