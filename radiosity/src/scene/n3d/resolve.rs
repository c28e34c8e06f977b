//! From objects in composites to surfaces in world space.

use super::check;
use super::keywords::Coefficient;
use super::source::{Source, Spot};
use super::transform::Transform;
use crate::light::Rgb;
use crate::scene::{Curved, Material, SceneError, Shape, Surface};

/// An object as written.
#[derive(Clone, Debug)]
pub(super) struct Object {
    /// The composite it stands in, which stands before it in the list.
    pub(super) parent: Option<usize>,
    /// Its keyword.
    pub(super) spot: Spot,
    pub(super) geometry: Geometry,
    /// Its own transforms together; after [`place_objects`], those around it as well.
    pub(super) transform: Transform,
    /// Whether any was written.
    pub(super) transformed: bool,
    pub(super) coefficients: Coefficients,
}

#[derive(Clone, Debug, PartialEq)]
pub(super) enum Geometry {
    Composite,
    Shape(Shape),
    /// Drawn by N3D, but without area.
    Nothing,
}

impl Geometry {
    /// The sphere or cylinder, where it is one.
    pub(super) fn curved(&mut self) -> Option<&mut Curved> {
        match self {
            Self::Shape(Shape::Sphere(curved) | Shape::Cylinder(curved)) => Some(curved),
            _ => None,
        }
    }
}

/// The coefficients that somebody defined.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub(super) struct Coefficients([Option<Rgb>; 10]);

impl Coefficients {
    /// The last definition stands.
    pub(super) fn set(&mut self, coefficient: Coefficient, value: Rgb) {
        self.0[coefficient as usize] = Some(value);
    }

    /// The object's own, else the composite's around it.
    fn or(self, around: Self) -> Self {
        let mut all = self;
        for (own, around) in all.0.iter_mut().zip(around.0) {
            *own = own.or(around);
        }
        all
    }

    fn material(self) -> Material {
        let value = |coefficient| self.0[coefficient as usize].unwrap_or_default();
        Material {
            diffuse: value(Coefficient::Diffuse),
            emission: value(Coefficient::Emission),
            specular: value(Coefficient::Specular),
            ambient: value(Coefficient::Ambient),
            diffuse_transmission: value(Coefficient::DiffuseTransmission),
            specular_transmission: value(Coefficient::SpecularTransmission),
            ambient_transmission: value(Coefficient::AmbientTransmission),
            mirror: value(Coefficient::Mirror),
            transparency: value(Coefficient::Transparency),
            shadow: value(Coefficient::Shadow),
        }
    }
}

/// Put each shape where its own transforms and those of the composites around it take it, with the
/// coefficients that it inherits. One pass, from the outside in: a parent's sum is ready before its parts ask.
pub(super) fn place_objects(
    source: &Source<'_>,
    objects: &mut [Object],
    surfaces: &mut Vec<Surface>,
) -> Result<(), SceneError> {
    for index in 0..objects.len() {
        if let Some(parent) = objects[index].parent {
            let around = &objects[parent];
            let (transform, transformed, coefficients) =
                (around.transform, around.transformed, around.coefficients);
            let object = &mut objects[index];
            let Some(together) = object.transform.then(transform) else {
                return Err(source.error(
                    object.spot,
                    "the transforms on this object and on the composites around it make numbers too large",
                    "scale less",
                ));
            };
            object.transform = together;
            object.transformed |= transformed;
            object.coefficients = object.coefficients.or(coefficients);
        }
        // Taken out, not copied: a mesh may be large. Nobody asks for a composite's geometry any more.
        let taken = std::mem::replace(&mut objects[index].geometry, Geometry::Nothing);
        let Geometry::Shape(mut shape) = taken else { continue };
        let object = &objects[index];
        if object.transformed {
            move_shape(&mut shape, object.transform);
            // It was sound as written; now it may be squashed, or too large to compute with.
            check::check(&shape).map_err(|fault| {
                let around = object.parent.map_or(String::new(), |parent| {
                    format!(" and those of the composite of line {}", objects[parent].spot.place.line)
                });
                source.error(
                    object.spot,
                    format!("this object, where its transforms{around} take it, {}", fault.message),
                    fault.help,
                )
            })?;
        }
        surfaces.push(Surface {
            name: String::new(),
            shape,
            material: object.coefficients.material(),
            place: object.spot.place,
        });
    }
    Ok(())
}

/// Move a shape. The author's front stays the front: a mirror would turn the winding over, so it is turned back.
fn move_shape(shape: &mut Shape, transform: Transform) {
    let map = transform.map;
    match shape {
        Shape::Parallelogram(p) => {
            p.origin = map.transform_point3(p.origin);
            p.u = map.transform_vector3(p.u);
            p.v = map.transform_vector3(p.v);
            // The cells keep their numbers, so u and v keep their order, and only the normal is turned.
            let normal = p.u.cross(p.v).normalize_or_zero();
            p.normal = if transform.mirrors { -normal } else { normal };
        }
        Shape::Polygon(p) => {
            for vertex in &mut p.vertices {
                *vertex = map.transform_point3(*vertex);
            }
            if transform.mirrors {
                // The first corner stays the first.
                p.vertices[1..].reverse();
            }
        }
        Shape::Quadrilateral(q) => {
            q.corners = q.corners.map(|corner| map.transform_point3(corner));
            q.mirrored ^= transform.mirrors;
        }
        // Outside stays outside.
        Shape::Sphere(c) | Shape::Cylinder(c) => c.map = map * c.map,
        Shape::Mesh(m) | Shape::Fractal(m) => {
            for vertex in &mut m.vertices {
                *vertex = map.transform_point3(*vertex);
            }
            if transform.mirrors {
                for triangle in &mut m.triangles {
                    triangle.swap(1, 2);
                }
            }
        }
    }
}
