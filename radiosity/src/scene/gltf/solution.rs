//! What a file of ours says besides what it shows: the scene that was solved. It stands in `extras`, under one key.
//!
//! ```text
//! materials[i].extras.radiosity = {"reflectance": [r, g, b], "emission": [r, g, b]}
//! meshes[i].extras.radiosity    = {"parallelogram": {"origin", "u", "v", "normal": [x, y, z], "columns", "rows"}}
//! ```

use glam::{DAffine3, DVec3};
use serde_json::{Value, json};

use super::material::{ours, sound};
use crate::light::Rgb;
use crate::scene::Parallelogram;

/// The key in `extras`.
pub(crate) const SOLUTION_KEY: &str = "radiosity";

/// A material's own coefficients.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) struct SolvedMaterial {
    pub(crate) reflectance: Rgb,
    pub(crate) emission: Rgb,
}

impl SolvedMaterial {
    pub(crate) fn to_json(self) -> Value {
        let Self { reflectance, emission } = self;
        json!({SOLUTION_KEY: {"reflectance": reflectance.to_array(), "emission": emission.to_array()}})
    }

    pub(super) fn parse(extras: &str) -> Option<Self> {
        let ours = ours(extras)?;
        let colour = |name| Some(Rgb::from(triple(&ours, name)?)).filter(|&colour| sound(colour));
        Some(Self { reflectance: colour("reflectance")?, emission: colour("emission")? })
    }
}

/// The parallelogram that a mesh's triangles are those of.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) struct SolvedMesh(pub(crate) Parallelogram);

impl SolvedMesh {
    pub(crate) fn to_json(self) -> Value {
        let Parallelogram { origin, u, v, normal, columns, rows } = self.0;
        let [origin, u, v, normal] = [origin, u, v, normal].map(|v| v.to_array());
        json!({SOLUTION_KEY: {"parallelogram": {
            "origin": origin, "u": u, "v": v, "normal": normal, "columns": columns, "rows": rows,
        }}})
    }

    /// The parallelogram, where `extras` tell one that spans the very box that the mesh's `positions` do: a mesh that
    /// was changed since is what its triangles are.
    pub(super) fn parse(extras: &str, positions: &[[f32; 3]]) -> Option<Self> {
        let ours = ours(extras)?;
        let told = ours.get("parallelogram")?;
        let vector = |name| Some(DVec3::from(triple(told, name)?));
        let cells = |name| {
            told.get(name)?.as_u64().and_then(|n| u32::try_from(n).ok()).filter(|n| (1..=10_000).contains(n))
        };
        let p = Parallelogram {
            origin: vector("origin")?,
            u: vector("u")?,
            v: vector("v")?,
            normal: vector("normal")?,
            columns: cells("columns")?,
            rows: cells("rows")?,
        };
        let cross = p.u.cross(p.v);
        let area = cross.length() > 1e-12 * p.u.length_squared().max(p.v.length_squared());
        let facing = (cross.normalize_or_zero().dot(p.normal).abs() - 1.0).abs() < 1e-9;
        let bounds = |points: &mut dyn Iterator<Item = DVec3>| {
            points.fold((DVec3::INFINITY, DVec3::NEG_INFINITY), |(low, high), p| (low.min(p), high.max(p)))
        };
        let (low, high) = bounds(&mut p.corners().into_iter());
        let (mesh_low, mesh_high) =
            bounds(&mut positions.iter().map(|&[x, y, z]| DVec3::new(x.into(), y.into(), z.into())));
        // Single precision, of the numbers as large as they are.
        let close = 1e-6 * (low.abs().max(high.abs()).max_element() + (high - low).max_element());
        let same =
            (low - mesh_low).abs().max_element() <= close && (high - mesh_high).abs().max_element() <= close;
        (area && facing && same).then_some(Self(p))
    }

    /// Where a node's transform takes it; its front stays the front. `None` where nothing is left of it.
    pub(super) fn moved(self, transform: &DAffine3) -> Option<Parallelogram> {
        let p = self.0;
        let (origin, u, v) = (
            transform.transform_point3(p.origin),
            transform.transform_vector3(p.u),
            transform.transform_vector3(p.v),
        );
        let turned = (p.u.cross(p.v).dot(p.normal) < 0.0) != (transform.matrix3.determinant() < 0.0);
        let normal = match *transform == DAffine3::IDENTITY {
            true => p.normal,
            false => u.cross(v).try_normalize()? * if turned { -1.0 } else { 1.0 },
        };
        (origin.is_finite() && u.is_finite() && v.is_finite()).then_some(Parallelogram {
            origin,
            u,
            v,
            normal,
            ..p
        })
    }
}

fn triple(object: &Value, name: &str) -> Option<[f64; 3]> {
    let list = object.get(name)?.as_array()?;
    let number = |k: usize| list.get(k)?.as_f64().filter(|value| value.abs() <= 1e15);
    (list.len() == 3).then_some(())?;
    Some([number(0)?, number(1)?, number(2)?])
}
