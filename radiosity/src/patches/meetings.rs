//! Where the surfaces of a scene meet: the lines that their patches are to be parted along.

use std::collections::HashMap;

use glam::DVec3;

use super::cut::{Plan, cut};
use crate::geometry::contact::{Contact, Plate, contacts};
use crate::geometry::polygon;
use crate::scene::{Mesh, Scene, Shape};

/// What is nearer than this, relative to the scene's longest side, touches: what numbers in single precision, and written
/// with six digits, leave of walls that were to stand on a floor.
const TOUCHING: f64 = 1e-6;

/// Triangles of one plane, as far as their normals tell (the cosine of their angle).
const ONE_PLANE: f64 = 1.0 - 1e-9;

/// Corners out of one plane by no more than this, relative to their distance, are in it.
const FLAT: f64 = 1e-9;

/// For each surface of a scene, the lines on it where others meet it; and how near counts as touching, as a length.
pub(super) fn meetings(scene: &Scene, plans: &[Plan]) -> (Vec<Vec<Contact>>, f64) {
    let (mut plates, mut surface_of) = (Vec::new(), Vec::new());
    let (mut low, mut high) = (DVec3::INFINITY, DVec3::NEG_INFINITY);
    for ((surface, &plan), index) in scene.surfaces.iter().zip(plans).zip(0..) {
        plates_of(&surface.shape, plan, index, &mut plates);
        surface_of.resize(plates.len(), index);
        for vertex in surface.shape.vertices() {
            (low, high) = (low.min(vertex), high.max(vertex));
        }
    }
    let tolerance = (high - low).max_element().max(0.0) * TOUCHING;
    let mut found = vec![Vec::new(); scene.surfaces.len()];
    for contact in contacts(&plates, tolerance) {
        found[surface_of[contact.plate as usize] as usize].push(contact);
    }
    (found, tolerance)
}

/// The flat plates that a shape is made of, whatever patches they are cut into.
fn plates_of(shape: &Shape, plan: Plan, surface: u32, plates: &mut Vec<Plate>) {
    match shape {
        Shape::Parallelogram(p) => {
            let mut corners = p.corners();
            if p.u.cross(p.v).dot(p.normal) < 0.0 {
                corners.reverse();
            }
            plates.push(Plate::new(&corners, p.normal, 0b1111, None));
        }
        Shape::Polygon(p) => flat(&p.vertices, plates),
        Shape::Quadrilateral(q) if is_flat(&q.corners) => {
            let mut corners = q.corners;
            if q.mirrored {
                corners.reverse();
            }
            flat(&corners, plates);
        }
        Shape::Mesh(m) | Shape::Fractal(m) => mesh(m, plates),
        // What is curved is what is drawn of it, and has no contact with itself.
        Shape::Quadrilateral(_) | Shape::Sphere(_) | Shape::Cylinder(_) => {
            let pieces = cut(shape, plan, 0, |_| {}).unwrap_or_default();
            plates.extend(pieces.triangles.iter().map(|corners| {
                let normal = polygon::area_vector(corners).normalize_or_zero();
                Plate::new(corners, normal, 0b111, Some(surface))
            }));
        }
    }
}

fn is_flat(corners: &[DVec3]) -> bool {
    polygon::thickness(corners) <= FLAT * polygon::diameter(corners)
}

/// A flat polygon, counter-clockwise seen from the front.
fn flat(corners: &[DVec3], plates: &mut Vec<Plate>) {
    let normal = polygon::area_vector(corners).normalize_or_zero();
    let count = corners.len() as u32;
    for triangle in polygon::triangulate(corners).unwrap_or_default() {
        let border = (0..3).fold(0, |border, k| {
            let (from, to) = (triangle[k], triangle[(k + 1) % 3]);
            border | u8::from((from + 1) % count == to) << k
        });
        plates.push(Plate::new(&triangle.map(|k| corners[k as usize]), normal, border, None));
    }
}

fn mesh(m: &Mesh, plates: &mut Vec<Plate>) {
    let corners = |triangle: &[u32; 3]| triangle.map(|k| m.vertices[k as usize]);
    let normals: Vec<DVec3> = m
        .triangles
        .iter()
        .map(|triangle| polygon::area_vector(&corners(triangle)).normalize_or_zero())
        .collect();
    // An edge between two triangles of one plane is no border.
    let edge = |triangle: &[u32; 3], k: usize| {
        let (a, b) = (triangle[k], triangle[(k + 1) % 3]);
        [a.min(b), a.max(b)]
    };
    let mut at_edge: HashMap<[u32; 2], (u32, DVec3, bool)> = HashMap::new();
    for (triangle, &normal) in m.triangles.iter().zip(&normals) {
        for k in 0..3 {
            let (count, first, flat) = at_edge.entry(edge(triangle, k)).or_insert((0, normal, true));
            *count += 1;
            *flat &= first.dot(normal) > ONE_PLANE;
        }
    }
    for (triangle, &normal) in m.triangles.iter().zip(&normals) {
        let border = (0..3).fold(0, |border, k| {
            let (count, _, flat) = at_edge[&edge(triangle, k)];
            border | u8::from(count != 2 || !flat) << k
        });
        plates.push(Plate::new(&corners(triangle), normal, border, None));
    }
}
