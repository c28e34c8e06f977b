//! How much the light straight from the lamps varies within each patch: what shadows' edges, contacts and near lamps do within one,
//! whether its neighbours show it or not.

use glam::DVec3;
use rayon::prelude::*;

use super::lamps::{LampScratch, Lamps, Receiver, Receivers};
use crate::light::Rgb;
use crate::patches::Patches;
use crate::scene::BackFaces;
use crate::visibility::Facets;

/// Points along either side of a cell.
const ALONG: u32 = 4;

/// Points of a patch in pieces, at least, and the most on one of its pieces: a square of both.
const POINTS: u32 = 9;
const ON_A_PIECE: u32 = 3;

/// Of a scene that emits from more than this share of its area, no light is straight from lamps: what they send to one place and not
/// to another others may well make up for, as in a furnace.
const ALL_LAMPS: f64 = 0.25;

/// For each patch, the root of the mean square over it of the irradiance straight from the lamps, less its mean; black where the
/// scene has no lamps but surfaces that shine.
pub fn straight_variation(patches: &Patches, facets: &Facets, back_faces: BackFaces) -> Vec<Rgb> {
    let emits = |i: &usize| !patches.emission[*i].is_black();
    let emitting: f64 = (0..patches.len()).filter(emits).map(|i| patches.area[i]).sum();
    if emitting == 0.0 || emitting > ALL_LAMPS * patches.total_area() {
        return vec![Rgb::BLACK; patches.len()];
    }
    let lamps = Lamps::new(patches, facets, back_faces);
    // The pieces of each patch, which follow one another.
    let mut own: Vec<&[[DVec3; 3]]> = vec![&[]; patches.len()];
    for pieces in patches.pieces.iter().flatten() {
        let mut at = 0;
        for same in pieces.patch.chunk_by(|one, other| one == other) {
            own[same[0] as usize] = &pieces.triangles[at..at + same.len()];
            at += same.len();
        }
    }
    (0..patches.len())
        .into_par_iter()
        .map_init(Scratch::default, |scratch, i| {
            if patches.reflectance[i].is_black() {
                return Rgb::BLACK;
            }
            scratch.found.clear();
            match own[i] {
                [] => scratch.on_cell(&lamps, patches, i),
                pieces => {
                    let sides = f64::from(POINTS.div_ceil(pieces.len() as u32)).sqrt().ceil() as u32;
                    pieces.iter().for_each(|piece| scratch.on_piece(&lamps, piece, sides.min(ON_A_PIECE)));
                }
            }
            scratch.spread()
        })
        .collect()
}

#[derive(Default)]
struct Scratch {
    lamps: LampScratch,
    points: Vec<Receiver>,
    light: Vec<Rgb>,
    /// Light and how much it counts.
    found: Vec<(Rgb, f64)>,
}

impl Scratch {
    fn on_cell(&mut self, lamps: &Lamps, patches: &Patches, i: usize) {
        let (centre, normal) = (patches.centre[i], patches.normal[i]);
        let (u, v) = (patches.tangent_u[i], patches.tangent_v[i]);
        let at = |s: f64, t: f64| centre + u * s + v * t;
        self.points.clear();
        let place = |k: u32| (f64::from(k) + 0.5) / f64::from(ALONG) - 0.5;
        for (s, t) in (0..ALONG).flat_map(|k| (0..ALONG).map(move |l| (place(k), place(l)))) {
            self.points.push(Receiver { point: at(s, t), normal });
        }
        let outline = [at(-0.5, -0.5), at(0.5, -0.5), at(0.5, 0.5), at(-0.5, 0.5)];
        self.look(lamps, outline, normal, 1.0);
    }

    /// At the middles of the triangles that one is cut into, `sides` along each side.
    fn on_piece(&mut self, lamps: &Lamps, &[a, b, c]: &[DVec3; 3], sides: u32) {
        let area_vector = (b - a).cross(c - a);
        let normal = area_vector.normalize_or_zero();
        self.points.clear();
        let third = |k: u32, thirds: u32| (f64::from(k) + f64::from(thirds) / 3.0) / f64::from(sides);
        for row in 0..sides {
            for column in 0..sides - row {
                let halves = if column + row + 1 < sides { 1..=2 } else { 1..=1 };
                for thirds in halves {
                    let point = a + (b - a) * third(column, thirds) + (c - a) * third(row, thirds);
                    self.points.push(Receiver { point, normal });
                }
            }
        }
        self.look(lamps, [a, b, c, c], normal, area_vector.length());
    }

    fn look(&mut self, lamps: &Lamps, outline: [DVec3; 4], normal: DVec3, area: f64) {
        self.light.clear();
        self.light.resize(self.points.len(), Rgb::BLACK);
        let receivers = Receivers { points: &self.points, outline, normal, curved: None };
        lamps.add_light(&receivers, &mut self.light, &mut self.lamps);
        let each = area / self.points.len() as f64;
        self.found.extend(self.light.iter().map(|&light| (light, each)));
    }

    fn spread(&self) -> Rgb {
        let whole: f64 = self.found.iter().map(|(_, share)| share).sum();
        if whole == 0.0 {
            return Rgb::BLACK;
        }
        let mean: Rgb = self.found.iter().map(|&(light, share)| light * (share / whole)).sum();
        let off = |&(light, share): &(Rgb, f64)| (light - mean) * (light - mean) * (share / whole);
        let square: Rgb = self.found.iter().map(off).sum();
        Rgb::new(square.r.sqrt(), square.g.sqrt(), square.b.sqrt())
    }
}
