//! Radiosities by random walks: an answer that owes nothing to form factors, hemicubes, or patches that send evenly.
//!
//! A walk begins anywhere on a patch and looks in any direction, the more often the nearer to its normal; what it meets
//! reflects it on, from the very point that was met. At every point the light of a lamp is added, from a point of it and
//! past what stands between, and what a walk meets emits; both tell the same light, and are weighed with how likely each
//! was to find it \[Veach95\], so that neither a small lamp nor one that touches a wall is told badly. After some bounces a
//! walk goes on as likely as it is bright. The mean of all walks of a patch is the mean of B over it, without bias.
//!
//! Surfaces are the facets, as `RayTree` sees them in double precision: of flat ones the scene itself, however it is cut.
//!
//! \[Veach95\] Veach & Guibas, Optimally Combining Sampling Techniques for Monte Carlo Rendering, 1995.

#![allow(dead_code, unreachable_pub, reason = "each program uses its own part")]

use std::f64::consts::{FRAC_1_PI, TAU};

use glam::DVec3;
use radiosity::light::Rgb;
use radiosity::patches::Patches;
use radiosity::scene::{BackFaces, Scene};
use radiosity::visibility::{Facet, FacetShape, Facets, RayTree};
use rayon::prelude::*;
use sobol_burley::{NUM_DIMENSION_SETS_4D, sample_4d};

/// Off a plane by less than this, relative to the scene's extent, is in the plane.
const HORIZON: f64 = 1e-9;

/// Bounces that every walk makes, were it never so dark.
const CERTAIN: u32 = 2;

/// Independent sets of walks: they tell how far their mean may be off.
pub const SETS: usize = 8;

/// The most walks of a set: no sequence of `sobol_burley` is longer.
pub const MOST: u32 = 1 << 16;

/// A scene to walk about in.
pub struct Walks<'a> {
    patches: &'a Patches,
    facets: &'a Facets,
    tree: RayTree<'a>,
    lamps: Vec<Lamp>,
    /// For each facet, which of the lamps it is.
    lamp_of: Vec<Option<u32>>,
    lit: bool,
    horizon: f64,
    /// Of each patch, the triangles that it is made of, with the sums of their areas; none where it is a cell.
    pieces: Vec<Vec<([DVec3; 3], f64)>>,
}

/// A facet that emits.
struct Lamp {
    facet: u32,
    centre: DVec3,
    area: f64,
    emission: Rgb,
}

/// A point of a surface's front.
#[derive(Clone, Copy)]
struct Spot {
    point: DVec3,
    normal: DVec3,
}

/// The mean radiosity of each patch, by independent sets of walks.
#[derive(Clone, Debug, Default)]
pub struct Reference {
    pub sets: Vec<Vec<Rgb>>,
}

impl<'a> Walks<'a> {
    /// Of `patches`, which lie on `facets`.
    pub fn new(scene: &Scene, patches: &'a Patches, facets: &'a Facets, back_faces: BackFaces) -> Self {
        let facets = facets.fewest();
        let mut lamps = Vec::new();
        let mut lamp_of = Vec::new();
        for (facet, number) in facets.as_slice().iter().zip(0..) {
            let emission = scene.surfaces[facet.surface as usize].material.emission;
            lamp_of.push((!emission.is_black()).then_some(lamps.len() as u32));
            if !emission.is_black() {
                let share = if facet.shape == FacetShape::Triangle { 0.5 } else { 1.0 };
                let (corners, count) = facet.corners();
                let centre = corners[..count].iter().sum::<DVec3>() / count as f64;
                lamps.push(Lamp {
                    facet: number,
                    centre,
                    area: facet.u.cross(facet.v).length() * share,
                    emission,
                });
            }
        }
        let mut pieces = vec![Vec::new(); patches.len()];
        for of_surface in patches.pieces.iter().flatten() {
            for (&[a, b, c], &patch) in of_surface.triangles.iter().zip(&of_surface.patch) {
                let own = &mut pieces[patch as usize];
                let before = own.last().map_or(0.0, |&(_, sum)| sum);
                own.push(([a, b, c], before + 0.5 * (b - a).cross(c - a).length()));
            }
        }
        let (tree, horizon) = (RayTree::new(facets), HORIZON * facets.extent());
        Self { patches, facets, tree, lamps, lamp_of, lit: back_faces == BackFaces::Lit, horizon, pieces }
    }

    /// The mean radiosity of each patch, by [`SETS`] times `walks` from each (a power of two is best; [`MOST`] at most).
    pub fn radiosities(&self, walks: u32) -> Reference {
        let every: Vec<u32> = (0..self.patches.len() as u32).collect();
        let set = |set: usize| -> Vec<Rgb> {
            every
                .par_iter()
                .map(|&patch| self.radiosity(patch as usize, walks.min(MOST), set as u32))
                .collect()
        };
        Reference { sets: (0..SETS).map(set).collect() }
    }

    /// The mean radiosity of one patch by one set of walks.
    fn radiosity(&self, patch: usize, walks: u32, set: u32) -> Rgb {
        let mut sum = Rgb::BLACK;
        for walk in 0..walks {
            sum += self.irradiance(patch, walk, mixed(patch as u32 * SETS as u32 + set));
        }
        self.patches.emission[patch] + self.patches.reflectance[patch] * sum * f64::from(walks).recip()
    }

    /// What arrives at one point of a patch by one walk.
    fn irradiance(&self, patch: usize, walk: u32, seed: u32) -> Rgb {
        let numbers = |set: u32| {
            let (set, turn) = (set % NUM_DIMENSION_SETS_4D, set / NUM_DIMENSION_SETS_4D);
            // In the middle of what a number in single precision stands for: never on an edge.
            sample_4d(walk, set, seed.wrapping_add(mixed(turn))).map(|x| f64::from(x) + 0.5_f64.powi(25))
        };
        let mut direction = numbers(0);
        let mut spot = self.start(patch, [direction[0], direction[1]]);
        direction.swap(0, 2);
        direction.swap(1, 3);
        let (mut sum, mut weight) = (Rgb::BLACK, Rgb::WHITE);
        for bounce in 0.. {
            sum += weight * self.lamp_light(spot, numbers(2 * bounce + 1));
            let way = around(spot.normal, [direction[0], direction[1]]);
            let Some((facet, number, point, u, v)) = self.nearest(spot, way) else { break };
            if !self.lit && !facet.faces(spot.point) {
                break;
            }
            if let Some(lamp) = self.lamp_of[number as usize] {
                let by_way = spot.normal.dot(way) * FRAC_1_PI;
                let by_lamp = self.density(spot, lamp as usize, point);
                sum += weight * self.lamps[lamp as usize].emission * (by_way / (by_way + by_lamp));
            }
            weight = weight * self.patches.reflectance[facet.patch_at(u, v) as usize];
            direction = numbers(2 * bounce + 2);
            if bounce >= CERTAIN {
                let alive = weight.max_channel().min(1.0);
                if direction[2] >= alive {
                    break;
                }
                weight *= alive.recip();
            }
            if weight.is_black() {
                break;
            }
            spot = Spot { point, normal: facet.normal };
        }
        sum
    }

    /// A point of a patch, all alike.
    fn start(&self, patch: usize, [s, t]: [f64; 2]) -> Spot {
        let pieces = &self.pieces[patch];
        let Some(&(_, area)) = pieces.last() else {
            let (u, v) = (self.patches.tangent_u[patch], self.patches.tangent_v[patch]);
            let point = self.patches.centre[patch] + u * (s - 0.5) + v * (t - 0.5);
            return Spot { point, normal: self.patches.normal[patch] };
        };
        let k = pieces.partition_point(|&(_, sum)| sum <= s * area).min(pieces.len() - 1);
        let (triangle, to) = pieces[k];
        let from = if k > 0 { pieces[k - 1].1 } else { 0.0 };
        let [a, b, c] = triangle;
        let [u, v] = in_triangle([(s * area - from) / (to - from), t]);
        Spot { point: a + (b - a) * u + (c - a) * v, normal: (b - a).cross(c - a).normalize() }
    }

    /// What is met first from a point, as hemicubes have it: not what lies in the point's plane, nor what it lies in.
    fn nearest(&self, spot: Spot, way: DVec3) -> Option<(&Facet, u32, DVec3, f64, f64)> {
        let label = |number: u32| {
            let facet = &self.facets[number];
            let above = facet.greatest_height(spot.point, spot.normal) > self.horizon
                && facet.normal.dot(facet.origin - spot.point).abs() > self.horizon;
            // What sends no light gives way to what does.
            above.then(|| u32::from(!self.lit && !facet.faces(spot.point)))
        };
        let hit = self.tree.nearest(spot.point, way, f64::INFINITY, label)?;
        Some((&self.facets[hit.facet], hit.facet, spot.point + way * hit.distance, hit.u, hit.v))
    }

    /// About what a lamp sends to a point, were it all at its centre: 0 only where it can send nothing.
    fn importance(&self, spot: Spot, lamp: &Lamp) -> f64 {
        let facet = &self.facets[lamp.facet];
        let height = facet.greatest_height(spot.point, spot.normal);
        let before = facet.normal.dot(spot.point - facet.origin);
        let before = if self.lit { before.abs() } else { before };
        if height <= self.horizon || before <= self.horizon {
            return 0.0;
        }
        let squared = spot.point.distance_squared(lamp.centre) + lamp.area;
        lamp.emission.max_channel() * lamp.area * height * before / (squared * squared)
    }

    /// How likely [`Walks::lamp_light`] looks towards this point of a lamp, a solid angle.
    fn density(&self, spot: Spot, lamp: usize, point: DVec3) -> f64 {
        let all: f64 = self.lamps.iter().map(|lamp| self.importance(spot, lamp)).sum();
        if all <= 0.0 {
            return 0.0;
        }
        let chosen = &self.lamps[lamp];
        let to = point - spot.point;
        let cosine = self.facets[chosen.facet].normal.dot(to).abs() / to.length();
        self.importance(spot, chosen) / all * to.length_squared() / (chosen.area * cosine)
    }

    /// The light of one lamp from one point of it.
    fn lamp_light(&self, spot: Spot, [choice, s, t, _]: [f64; 4]) -> Rgb {
        let all: f64 = self.lamps.iter().map(|lamp| self.importance(spot, lamp)).sum();
        if all <= 0.0 {
            return Rgb::BLACK;
        }
        let (mut left, mut chosen) = (choice * all, None);
        for (number, lamp) in self.lamps.iter().enumerate() {
            let share = self.importance(spot, lamp);
            if share > 0.0 {
                chosen = Some(number);
                if left < share {
                    break;
                }
                left -= share;
            }
        }
        let Some(chosen) = chosen else { return Rgb::BLACK };
        let lamp = &self.lamps[chosen];
        let facet = &self.facets[lamp.facet];
        let [u, v] = if facet.shape == FacetShape::Triangle { in_triangle([s, t]) } else { [s, t] };
        let point = facet.origin + facet.u * u + facet.v * v;
        let way = (point - spot.point).normalize_or_zero();
        let cosine = spot.normal.dot(way);
        if cosine <= 0.0 || self.nearest(spot, way).is_none_or(|(_, number, ..)| number != lamp.facet) {
            return Rgb::BLACK;
        }
        let (by_way, by_lamp) = (cosine * FRAC_1_PI, self.density(spot, chosen, point));
        lamp.emission * (by_way / (by_way + by_lamp))
    }
}

impl Reference {
    /// The mean of all sets.
    pub fn mean(&self, patch: usize) -> Rgb {
        self.sets.iter().map(|set| set[patch]).sum::<Rgb>() * (self.sets.len() as f64).recip()
    }

    /// The variance of [`Reference::mean`], all channels together, as the sets differ.
    pub fn variance(&self, patch: usize) -> f64 {
        let (mean, n) = (self.mean(patch), self.sets.len() as f64);
        self.sets.iter().map(|set| (set[patch] - mean).norm_squared()).sum::<f64>() / (n * (n - 1.0))
    }

    /// The error of `found`: sqrt(Σ A |found - B|² / Σ A |B|²) over patches that emit nothing, channels together, without
    /// what the walks' own noise adds to both sums; and the standard error of that. Negative squares are 0.
    pub fn error(&self, patches: &Patches, found: &[Rgb]) -> (f64, f64) {
        let (mut off, mut all, mut spread) = (0.0, 0.0, 0.0);
        for i in (0..patches.len()).filter(|&i| patches.emission[i].is_black()) {
            let (mean, variance, area) = (self.mean(i), self.variance(i), patches.area[i]);
            let squared = (found[i] - mean).norm_squared() - variance;
            off += area * squared;
            all += area * (mean.norm_squared() - variance);
            // Channels go together at worst: one normal variable.
            spread += (area * variance).powi(2) * 2.0 + area * area * 4.0 * variance * squared.max(0.0);
        }
        let error = (off / all).max(0.0).sqrt();
        let least = (spread.sqrt() / all).sqrt();
        (error, if error > least { 0.5 * spread.sqrt() / all / error } else { least })
    }

    /// The walks' own noise: sqrt(Σ A variance / Σ A |B|²), of the mean of all sets.
    pub fn noise(&self, patches: &Patches) -> f64 {
        let dark = (0..patches.len()).filter(|&i| patches.emission[i].is_black());
        let (noise, all) = dark.fold((0.0, 0.0), |(noise, all), i| {
            (noise + patches.area[i] * self.variance(i), all + patches.area[i] * self.mean(i).norm_squared())
        });
        (noise / all).sqrt()
    }
}

/// A direction about a normal, as often as its cosine.
fn around(normal: DVec3, [s, t]: [f64; 2]) -> DVec3 {
    let (x, y) = normal.any_orthonormal_pair();
    let (sine, radius) = (1.0 - s, s.sqrt());
    let (b, a) = (TAU * t).sin_cos();
    ((x * a + y * b) * radius + normal * sine.max(0.0).sqrt()).normalize()
}

/// A point of the unit square, as one of the triangle u + v <= 1: alike everywhere.
fn in_triangle([s, t]: [f64; 2]) -> [f64; 2] {
    let root = s.sqrt();
    [root * (1.0 - t), root * t]
}

/// Numbers that have nothing to do with one another, of numbers that follow each other (splitmix).
fn mixed(number: u32) -> u32 {
    let mut bits = u64::from(number).wrapping_add(0x9e37_79b9_7f4a_7c15);
    bits = (bits ^ bits >> 30).wrapping_mul(0xbf58_476d_1ce4_e5b9);
    bits = (bits ^ bits >> 27).wrapping_mul(0x94d0_49bb_1331_11eb);
    (bits ^ bits >> 31) as u32
}
