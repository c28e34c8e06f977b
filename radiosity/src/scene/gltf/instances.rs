//! Nodes, one after the other, each with its meshes where its transforms take them.

use std::collections::HashMap;
use std::collections::hash_map::Entry;
use std::sync::Arc;

use glam::{DAffine3, DMat4, DQuat, DVec3};
use gltf::camera::Projection;
use gltf::mesh::{Mode, Primitive};
use gltf::scene::Transform;
use gltf::{Node, Semantic};

use super::accessor::{indices, vectors};
use super::buffers::Buffers;
use super::container::Opened;
use super::material::{Looks, Notes, looks, sound};
use super::solution::SolvedMesh;
use super::texture::{Images, Placing};
use super::{Fault, fault, part};
use crate::light::Rgb;
use crate::scene::mesh_builder::MeshBuilder;
use crate::scene::paint::{Paint, TextureOn};
use crate::scene::texture::Texture;
use crate::scene::{BackFaces, Camera, Material, Mesh, Place, Scene, Shape, Surface, Warning};

/// Triangles of a scene, each as often as it stands in it.
const MOST_TRIANGLES: usize = 1 << 25;
/// The greatest coordinate.
const GREATEST: f64 = 1e15;

/// A primitive in its mesh's own axes, with what its material says of each triangle.
struct Piece {
    positions: Vec<[f32; 3]>,
    triangles: Vec<[u32; 3]>,
    /// Empty, or one a triangle.
    diffuse: Vec<Rgb>,
    emission: Vec<Rgb>,
    /// What varies over the triangles themselves, whose means the former are.
    diffuse_paint: Option<Paint>,
    emission_paint: Option<Paint>,
    material: Material,
    double_sided: bool,
    /// What it is the triangles of, in a file of ours.
    parallelogram: Option<SolvedMesh>,
}

/// The scene of an opened document.
pub(super) fn scene(
    name: &str,
    opened: &Opened<'_>,
    buffers: &Buffers<'_>,
    resource: &mut impl FnMut(&str) -> Result<Vec<u8>, String>,
) -> Result<Scene, Fault> {
    let mut notes = Notes::default();
    let mut images = Images::default();
    let mut pieces: HashMap<(usize, usize), Option<Piece>> = HashMap::new();
    let mut surfaces = Vec::new();
    let mut double_sided = Vec::new();
    let mut camera = None;
    let (mut triangles, mut lamps) = (0_usize, 0_usize);
    walk(opened, |node, transform| {
        if node.light().is_some() {
            lamps += 1;
        }
        if camera.is_none() {
            camera = node.camera().and_then(|camera| see(&camera, transform, &mut notes));
        }
        if node.skin().is_some() {
            notes.add("it has a skin, which is left out: the mesh stands as it was modelled", called(node));
        }
        let Some(mesh) = node.mesh() else { return Ok(()) };
        let parts = mesh.primitives().len();
        for primitive in mesh.primitives() {
            let there = match pieces.entry((mesh.index(), primitive.index())) {
                Entry::Occupied(there) => there.into_mut(),
                Entry::Vacant(place) => {
                    let mut textures = |index| images.get(index, opened, buffers, resource);
                    place.insert(piece(&mesh, &primitive, buffers, &mut textures, &mut notes)?)
                }
            };
            let Some(piece) = there else { continue };
            triangles += piece.triangles.len() * if piece.double_sided { 2 } else { 1 };
            if triangles > MOST_TRIANGLES {
                return fault(format!(
                    "{}: with it the scene has more than {MOST_TRIANGLES} triangles, instances counted: split it",
                    called(node)
                ));
            }
            let mut named = node.name().or(mesh.name()).unwrap_or_default().to_owned();
            if let (true, Some(material)) = (parts > 1, primitive.material().name()) {
                named = format!("{named}: {material}");
            }
            let shape = match piece.parallelogram.and_then(|p| p.moved(transform)) {
                Some(p) => Some((Shape::Parallelogram(p), piece.material)),
                None => {
                    let (mesh, material) =
                        placed(piece, transform).map_err(|why| Fault(format!("{}: {why}", called(node))))?;
                    (!mesh.triangles.is_empty()).then_some((Shape::Mesh(mesh), material))
                }
            };
            let Some((shape, material)) = shape else {
                notes.add("none of its triangles has an area: it is left out", called(node));
                continue;
            };
            if piece.double_sided {
                double_sided.push(surfaces.len());
            }
            surfaces.push(Surface { name: named, shape, material, place: Place::default() });
        }
        Ok(())
    })?;
    if surfaces.is_empty() {
        return fault("the scene has no triangle, so there is nothing to light");
    }
    let surfaces = with_backs(surfaces, &double_sided);
    let mut told: Vec<String> = Vec::new();
    if lamps > 0 {
        told.push(format!(
            "{lamps} lamp{} without surface (KHR_lights_punctual) {} left out: in radiosity, light comes from surfaces; \
             give the material of a lamp's surface an emissiveFactor",
            if lamps == 1 { "" } else { "s" },
            if lamps == 1 { "is" } else { "are" },
        ));
    }
    told.extend(notes.told());
    if opened.document.animations().len() > 0 {
        told.push("animations are left out: everything stands where its node says".into());
    }
    if !opened.passed_over.is_empty() {
        told.push(format!("extensionsUsed: {} play no part", opened.passed_over.join(", ")));
    }
    let warn = |message| Warning { file: name.to_owned(), place: Place::default(), message };
    Ok(Scene {
        name: name.to_owned(),
        surfaces,
        camera,
        back_faces: back_faces(opened),
        warnings: told.into_iter().map(warn).collect(),
    })
}

/// Black, unless a file of ours says that backs are lit.
fn back_faces(opened: &Opened<'_>) -> BackFaces {
    let extras = opened.document.as_json().asset.extras.as_ref();
    let ours = extras.and_then(|extras| super::material::ours(extras.get()));
    match ours.as_ref().and_then(|ours| ours.get("backFaces")?.as_str()) {
        Some("lit") => BackFaces::Lit,
        _ => BackFaces::Black,
    }
}

fn called(node: &Node<'_>) -> String {
    part("nodes", node.index(), node.name())
}

/// Hand every node of the scene to `visit` with its transform to the world, parents first, in the order of the file.
fn walk<'a>(
    opened: &'a Opened<'_>,
    mut visit: impl FnMut(&Node<'a>, &DAffine3) -> Result<(), Fault>,
) -> Result<(), Fault> {
    let document = &opened.document;
    let scene = document.default_scene().or_else(|| document.scenes().next());
    let mut stack: Vec<(Node<'a>, DAffine3)> = match scene {
        Some(scene) => scene.nodes().map(|node| (node, DAffine3::IDENTITY)).collect(),
        None => {
            let children: Vec<bool> = document
                .nodes()
                .flat_map(|node| node.children().collect::<Vec<_>>())
                .fold(vec![false; document.nodes().len()], |mut children, child| {
                    children[child.index()] = true;
                    children
                });
            let roots = document.nodes().filter(|node| !children[node.index()]);
            roots.map(|node| (node, DAffine3::IDENTITY)).collect()
        }
    };
    stack.reverse();
    let mut visited = vec![false; document.nodes().len()];
    while let Some((node, around)) = stack.pop() {
        if std::mem::replace(&mut visited[node.index()], true) {
            return fault(format!(
                "{}: it stands in the scene twice, or is its own child; give each node one parent",
                called(&node)
            ));
        }
        let transform = around * local(&node);
        if !transform.is_finite() || transform.matrix3.to_cols_array().iter().any(|x| x.abs() > GREATEST) {
            return fault(format!("{}: its transform is not finite; export the scene again", called(&node)));
        }
        visit(&node, &transform)?;
        let first = stack.len();
        stack.extend(node.children().map(|child| (child, transform)));
        stack[first..].reverse();
    }
    Ok(())
}

/// A node's own transform.
fn local(node: &Node<'_>) -> DAffine3 {
    match node.transform() {
        Transform::Matrix { matrix } => {
            DAffine3::from_mat4(DMat4::from_cols_array_2d(&matrix.map(|column| column.map(f64::from))))
        }
        Transform::Decomposed { translation, rotation, scale } => {
            let rotation = DQuat::from_array(rotation.map(f64::from));
            let length = rotation.length();
            let rotation = if length > 0.0 { rotation / length } else { DQuat::IDENTITY };
            let [translation, scale] = [translation, scale].map(|v| DVec3::from(v.map(f64::from)));
            DAffine3::from_scale_rotation_translation(scale, rotation, translation)
        }
    }
}

/// A camera in perspective where its node takes it; `None` for any other.
fn see(camera: &gltf::Camera<'_>, transform: &DAffine3, notes: &mut Notes) -> Option<Camera> {
    let called = part("cameras", camera.index(), camera.name());
    let Projection::Perspective(lens) = camera.projection() else {
        notes.add("it is orthographic, and left out: make it one in perspective", called);
        return None;
    };
    let forward = (-transform.matrix3.z_axis).try_normalize();
    let right = forward.and_then(|forward| forward.cross(transform.matrix3.y_axis).try_normalize());
    let half = (f64::from(lens.yfov()) / 2.0).tan();
    let aspect = f64::from(lens.aspect_ratio().unwrap_or(1.0));
    let seen = (1e-9..=1e9).contains(&half) && (1e-6..=1e6).contains(&aspect);
    let (Some(forward), Some(right), true) = (forward, right, seen) else {
        notes.add("it sees nothing (its field of view or its node's scale is zero), and is left out", called);
        return None;
    };
    let near = f64::from(lens.znear()).clamp(0.0, GREATEST);
    let far = lens.zfar().map_or(f64::INFINITY, f64::from);
    Some(Camera {
        eye: transform.translation,
        forward,
        right,
        up: right.cross(forward),
        horizontal: [-half * aspect, half * aspect],
        vertical: [-half, half],
        near,
        far: if far > near { far } else { f64::INFINITY },
        viewport: [0.0, 1.0, 0.0, 1.0],
    })
}

/// Gives the image of a number, and whether it had to be made coarser; or says why not.
type Textures<'t> = dyn FnMut(usize) -> Result<(Arc<Texture>, bool), String> + 't;

/// A primitive's triangles and their colours; `None` where it has none.
fn piece(
    mesh: &gltf::Mesh<'_>,
    primitive: &Primitive<'_>,
    buffers: &Buffers<'_>,
    textures: &mut Textures<'_>,
    notes: &mut Notes,
) -> Result<Option<Piece>, Fault> {
    let mesh_part = part("meshes", mesh.index(), mesh.name());
    let called = format!("{mesh_part}.primitives[{}]", primitive.index());
    let Some(positions) = primitive.get(&Semantic::Positions) else { return Ok(None) };
    if primitive.morph_targets().len() > 0 {
        notes.add("its morph targets are left out: it stands as it was modelled", mesh_part);
    }
    let triangulated = matches!(primitive.mode(), Mode::Triangles | Mode::TriangleStrip | Mode::TriangleFan);
    if !triangulated {
        notes.add("its points or lines have no area, and are left out", called);
        return Ok(None);
    }
    let positions: Vec<[f32; 3]> = vectors(buffers, &positions)?;
    let far = |position: &[f32; 3]| !position.iter().all(|x| f64::from(x.abs()) <= GREATEST);
    if let Some(k) = positions.iter().position(far) {
        return fault(format!(
            "{called}: its vertex {k} is not finite, or beyond 1e15; export the scene again"
        ));
    }
    let indices = match primitive.indices() {
        Some(accessor) => indices(buffers, &accessor)?,
        None => (0..positions.len() as u32).collect(),
    };
    if let Some(index) = indices.iter().find(|&&index| index as usize >= positions.len()) {
        let count = positions.len();
        return fault(format!(
            "{called}: index {index} is beyond its {count} vertices; export the scene again"
        ));
    }
    let triangles: Vec<[u32; 3]> = match primitive.mode() {
        Mode::TriangleStrip => {
            let turned =
                |(k, t): (usize, &[u32])| if k % 2 == 0 { [t[0], t[1], t[2]] } else { [t[1], t[0], t[2]] };
            // Strips are joined by triangles that name a corner twice.
            let joint = |t: &[u32; 3]| t[0] == t[1] || t[1] == t[2] || t[2] == t[0];
            indices.windows(3).enumerate().map(turned).filter(|t| !joint(t)).collect()
        }
        Mode::TriangleFan => match indices.split_first() {
            Some((&first, rest)) => rest.windows(2).map(|pair| [first, pair[0], pair[1]]).collect(),
            None => Vec::new(),
        },
        _ => indices.chunks_exact(3).map(|t| [t[0], t[1], t[2]]).collect(),
    };
    if triangles.is_empty() {
        return Ok(None);
    }

    let looks = looks(&primitive.material(), notes);
    let material_part = match primitive.material().index() {
        Some(index) => part("materials", index, primitive.material().name()),
        None => {
            let grey = Rgb::WHITE * looks.diffuse.r;
            notes.add(
                format!("no material is told: a grey that reflects {} is taken", grey.r),
                called.clone(),
            );
            called.clone()
        }
    };
    let colours =
        Colours { primitive, positions: positions.len(), triangles: &triangles, buffers, called: &called };
    let at_corners = if looks.vertex_colours { colours.corners()? } else { Vec::new() };
    let diffuse_paint = colours.paint(looks.diffuse, &looks.diffuse_texture, at_corners, textures, notes)?;
    let emission_paint =
        colours.paint(looks.emission, &looks.emission_texture, Vec::new(), textures, notes)?;
    let means = |paint: &Option<Paint>| paint.as_ref().map(Paint::means).unwrap_or_default();
    let (own_diffuse, own_emission) = match looks.vertex_colours {
        true => (means(&diffuse_paint), means(&emission_paint)),
        // A file of ours tells them triangle by triangle where they differ.
        false => (colours.told("REFLECTANCE")?, colours.told("EMISSION")?),
    };
    let Looks { diffuse, emission, double_sided, .. } = looks;
    let all = own_diffuse.iter().chain(&own_emission).chain([&diffuse, &emission]);
    if let Some(bad) = all.copied().find(|&colour| !sound(colour)) {
        let [r, g, b] = bad.to_array();
        return fault(format!(
            "{material_part}: the colour {r} {g} {b} is negative or not finite; correct it"
        ));
    }
    let told = mesh.extras().as_ref().filter(|_| mesh.primitives().len() == 1);
    let parallelogram = told.and_then(|extras| SolvedMesh::parse(extras.get(), &positions));
    let material = Material { diffuse, emission, ..Material::default() };
    Ok(Some(Piece {
        positions,
        triangles,
        diffuse: own_diffuse,
        emission: own_emission,
        diffuse_paint,
        emission_paint,
        material,
        double_sided,
        parallelogram,
    }))
}

/// What the triangles of a primitive are coloured by.
struct Colours<'a> {
    primitive: &'a Primitive<'a>,
    positions: usize,
    triangles: &'a [[u32; 3]],
    buffers: &'a Buffers<'a>,
    called: &'a str,
}

impl Colours<'_> {
    /// A value a vertex, where the file has them and there are as many as positions.
    fn attribute<const N: usize>(&self, semantic: &Semantic) -> Result<Option<Vec<[f32; N]>>, Fault> {
        let Some(accessor) = self.primitive.get(semantic) else { return Ok(None) };
        let values: Vec<[f32; N]> = vectors(self.buffers, &accessor)?;
        match values.len() == self.positions {
            true => Ok(Some(values)),
            false => fault(format!(
                "{}: {} vertices, but {} of {semantic:?}; export the scene again",
                self.called,
                self.positions,
                values.len()
            )),
        }
    }

    /// What varies over the triangles: the factor times a texture and the colours at their corners, where there is either.
    fn paint(
        &self,
        factor: Rgb,
        texture: &Option<gltf::texture::Info<'_>>,
        colours: Vec<[[f32; 3]; 3]>,
        textures: &mut Textures<'_>,
        notes: &mut Notes,
    ) -> Result<Option<Paint>, Fault> {
        let texture = match texture.as_ref().filter(|_| !factor.is_black()) {
            Some(info) => self.texture(info, textures, notes)?,
            None => None,
        };
        let any = texture.is_some() || !colours.is_empty();
        Ok(any.then_some(Paint { factor, texture, colours }))
    }

    /// A texture on the triangles; `None` where it cannot be had.
    fn texture(
        &self,
        info: &gltf::texture::Info<'_>,
        textures: &mut Textures<'_>,
        notes: &mut Notes,
    ) -> Result<Option<TextureOn>, Fault> {
        let Placing { wrap, transform, set } = Placing::new(info);
        let Some(coordinates) = self.attribute::<2>(&Semantic::TexCoords(set))? else {
            let what = format!("it has no TEXCOORD_{set} for its texture, which is left out");
            notes.add(what, self.called.to_owned());
            return Ok(None);
        };
        let called = part("textures", info.texture().index(), None);
        match textures(info.texture().source().index()) {
            Ok((texture, coarser)) => {
                if coarser {
                    let [width, height] = texture.size();
                    notes.add(
                        format!(
                            "the images of the scene take more memory than is kept for them, 2 GiB: this one is taken as \
                             {width} x {height} pixels; make them smaller"
                        ),
                        called,
                    );
                }
                let coordinates = self.at_corners(&coordinates);
                Ok(Some(TextureOn { texture, wrap, transform, coordinates }))
            }
            Err(why) => {
                notes.add(format!("the image cannot be used, and its colour is left out: {why}"), called);
                Ok(None)
            }
        }
    }

    /// The vertices' colours at the corners of each triangle, where there are any.
    fn corners(&self) -> Result<Vec<[[f32; 3]; 3]>, Fault> {
        let colours = self.attribute::<3>(&Semantic::Colors(0))?;
        Ok(colours.map(|colours| self.at_corners(&colours)).unwrap_or_default())
    }

    fn at_corners<T: Copy>(&self, values: &[T]) -> Vec<[T; 3]> {
        self.triangles.iter().map(|triangle| triangle.map(|k| values[k as usize])).collect()
    }

    /// An attribute of ours, one a triangle.
    fn told(&self, name: &str) -> Result<Vec<Rgb>, Fault> {
        let values = self.attribute::<3>(&Semantic::Extras(name.to_owned()))?.unwrap_or_default();
        let of = |triangle: &[u32; 3]| mean(triangle.map(|k| values[k as usize]));
        Ok(if values.is_empty() { Vec::new() } else { self.triangles.iter().map(of).collect() })
    }
}

fn mean(corners: [[f32; 3]; 3]) -> Rgb {
    let sum: Rgb = corners.into_iter().map(|corner| Rgb::from(corner.map(f64::from))).sum();
    sum * (1.0 / 3.0)
}

/// A primitive where a transform takes it; a mirrored one is wound the other way, so that its front stays the front.
fn placed(piece: &Piece, transform: &DAffine3) -> Result<(Mesh, Material), String> {
    let mirrored = transform.matrix3.determinant() < 0.0;
    let position =
        |k: u32| transform.transform_point3(DVec3::from(piece.positions[k as usize].map(f64::from)));
    let mut builder = MeshBuilder::default();
    let mut kept = Vec::new();
    for (index, triangle) in piece.triangles.iter().enumerate() {
        let [a, b, c] = triangle.map(position);
        if ![a, b, c].iter().all(|p| p.abs().max_element() <= GREATEST) {
            return Err("its transform takes vertices beyond 1e15; scale less".into());
        }
        let corners = if mirrored { [a, c, b] } else { [a, b, c] };
        let own = [&piece.diffuse, &piece.emission].map(|column| column.get(index).copied());
        if builder.coloured_triangle(corners, own) {
            kept.push(index as u32);
        }
    }
    let (mut mesh, material) = builder.finish(piece.material);
    let paint = |paint: &Option<Paint>| paint.as_ref().map(|paint| Arc::new(paint.of(&kept, mirrored)));
    (mesh.diffuse_paint, mesh.emission_paint) = (paint(&piece.diffuse_paint), paint(&piece.emission_paint));
    Ok((mesh, material))
}

/// The surfaces, each of those at `double_sided` followed by its back.
fn with_backs(surfaces: Vec<Surface>, double_sided: &[usize]) -> Vec<Surface> {
    let mut all = Vec::with_capacity(surfaces.len() + double_sided.len());
    let mut next = double_sided.iter().peekable();
    for (index, surface) in surfaces.into_iter().enumerate() {
        let back = next.next_if_eq(&&index).map(|_| Surface {
            name: format!("{} (back)", surface.name).trim_start().to_owned(),
            shape: back(&surface.shape),
            ..surface.clone()
        });
        all.push(surface);
        all.extend(back);
    }
    all
}

/// The same shape, facing the other way. Who sees the two, equally near, sees the one that faces him.
fn back(shape: &Shape) -> Shape {
    let mut back = shape.clone();
    match &mut back {
        Shape::Parallelogram(p) => p.normal = -p.normal,
        Shape::Mesh(mesh) => {
            mesh.triangles.iter_mut().for_each(|triangle| triangle.swap(1, 2));
            for paint in [&mut mesh.diffuse_paint, &mut mesh.emission_paint].into_iter().flatten() {
                *paint = Arc::new(paint.turned());
            }
        }
        _ => {}
    }
    back
}
