//! What lies under the pointer.

use std::sync::{Arc, OnceLock};

use glam::DVec3;
use radiosity::visibility::{Facets, RayTree, View};

/// Scenes with more facets get their tree in a thread of its own: nothing is picked until it stands, and the window
/// does not wait.
const MANY_FACETS: usize = 50_000;

/// A point of a surface that is seen.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) struct Pick {
    /// The patch.
    pub(crate) patch: u32,
    /// Its surface: the object's number.
    pub(crate) surface: u32,
    /// The point, in the scene's own coordinates.
    pub(crate) point: DVec3,
    /// Where on the facet, 0..1: on a parallelogram, where on the surface.
    pub(crate) u: f64,
    /// Likewise.
    pub(crate) v: f64,
    /// Whether its front is seen.
    pub(crate) front: bool,
}

/// Finds what a pixel sees.
#[derive(Clone, Debug)]
pub(super) struct Picker {
    facets: Arc<Facets>,
    tree: Arc<OnceLock<RayTree<'static>>>,
}

impl Picker {
    pub(super) fn new(facets: Arc<Facets>) -> Self {
        let tree = Arc::new(OnceLock::new());
        let build = {
            let (facets, tree) = (Arc::clone(&facets), Arc::clone(&tree));
            move || {
                let _ = tree.set(RayTree::shared(facets));
            }
        };
        if facets.as_slice().len() < MANY_FACETS {
            build();
        } else {
            // Where no thread can be had, nothing can be picked; all else works.
            let _ = std::thread::Builder::new().name("picking".into()).spawn(build);
        }
        Self { facets, tree }
    }

    /// What is seen through (x, y) of `view`, in its cells: (0, 0) is the centre of the first. Surfaces seen from
    /// behind are seen through where `culled`.
    pub(super) fn pick(&self, view: &View, x: f64, y: f64, culled: bool) -> Option<Pick> {
        let direction = view.direction(x, y);
        let start = view.eye + direction * view.near;
        // Of a sheet's two sides, the one that faces the eye.
        let seen = |facet: u32| match self.facets[facet].faces(view.eye) {
            true => Some(0),
            false => (!culled).then_some(1),
        };
        let hit = self.tree.get()?.nearest(start, direction, view.far - view.near, seen)?;
        let facet = &self.facets[hit.facet];
        Some(Pick {
            patch: facet.patch_at(hit.u, hit.v),
            surface: facet.surface,
            point: start + direction * hit.distance,
            u: hit.u,
            v: hit.v,
            front: facet.faces(view.eye),
        })
    }

    /// Whether `eye` is shut in: nearly every way out meets a surface.
    pub(super) fn indoors(&self, eye: DVec3) -> bool {
        let Some(tree) = self.tree.get() else { return false };
        let mut ways = 0;
        let mut shut = 0;
        for x in -1..=1 {
            for y in -1..=1 {
                for z in -1..=1 {
                    let direction = DVec3::new(f64::from(x), f64::from(y), f64::from(z));
                    if direction != DVec3::ZERO {
                        // A little askew: scenes are built along the axes, and edges decide nothing.
                        let direction = direction + DVec3::new(0.03, 0.02, 0.01);
                        ways += 1;
                        shut += i32::from(tree.nearest(eye, direction, f64::INFINITY, |_| Some(0)).is_some());
                    }
                }
            }
        }
        // A room with one side open, as Cornell's, still is a room: 9 of 26 ways lead out.
        3 * shut > 2 * ways - 6
    }
}
