//! The flat plates that surfaces are made of, however their patches are cut.

use std::collections::HashMap;

use glam::DVec3;

use super::{Mesh, Shape};
use crate::geometry::contact::Plate;
use crate::geometry::polygon;

/// Triangles of one plane, as far as their normals tell (the cosine of their angle).
const ONE_PLANE: f64 = 1.0 - 1e-9;

/// Corners out of one plane by no more than this, relative to their distance, are in it.
const FLAT: f64 = 1e-9;

impl Shape {
    /// The triangles and parallelograms that the shape is made of; `None` of one that is not flat, whose flat pieces are as
    /// fine as its patches.
    pub fn plates(&self) -> Option<Vec<Plate>> {
        match self {
            Self::Parallelogram(p) => {
                let mut corners = p.corners();
                if p.u.cross(p.v).dot(p.normal) < 0.0 {
                    corners.reverse();
                }
                Some(vec![Plate::new(&corners, p.normal, 0b1111, None)])
            }
            Self::Polygon(p) => Some(flat(&p.vertices)),
            Self::Quadrilateral(q) if is_flat(&q.corners) => {
                let mut corners = q.corners;
                if q.mirrored {
                    corners.reverse();
                }
                Some(flat(&corners))
            }
            Self::Mesh(m) | Self::Fractal(m) => Some(mesh(m)),
            Self::Quadrilateral(_) | Self::Sphere(_) | Self::Cylinder(_) => None,
        }
    }
}

fn is_flat(corners: &[DVec3]) -> bool {
    polygon::thickness(corners) <= FLAT * polygon::diameter(corners)
}

/// A flat polygon, counter-clockwise seen from the front.
fn flat(corners: &[DVec3]) -> Vec<Plate> {
    let normal = polygon::area_vector(corners).normalize_or_zero();
    let count = corners.len() as u32;
    let triangles = polygon::triangulate(corners).unwrap_or_default().into_iter();
    let plate = |triangle: [u32; 3]| {
        let border = (0..3).fold(0, |border, k| {
            let (from, to) = (triangle[k], triangle[(k + 1) % 3]);
            border | u8::from((from + 1) % count == to) << k
        });
        Plate::new(&triangle.map(|k| corners[k as usize]), normal, border, None)
    };
    triangles.map(plate).collect()
}

fn mesh(m: &Mesh) -> Vec<Plate> {
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
    let plate = |(triangle, &normal): (&[u32; 3], &DVec3)| {
        let border = (0..3).fold(0, |border, k| {
            let (count, _, flat) = at_edge[&edge(triangle, k)];
            border | u8::from(count != 2 || !flat) << k
        });
        Plate::new(&corners(triangle), normal, border, None)
    };
    m.triangles.iter().zip(&normals).map(plate).collect()
}
