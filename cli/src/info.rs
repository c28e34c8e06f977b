//! `radiosity info`: what is in a scene, and what a solution would need.

use std::io::{self, Write};
use std::time::Instant;

use radiosity::bake::{self, BakeError, Need, Request};
use radiosity::light::Rgb;
use radiosity::patches::{self, Patches, Subdivision};
use radiosity::scene::{
    BackFaces, Camera, Found, Overlap, Scene, Shape, Warning, check_meshes, coincident, overlaps,
};
use radiosity::shade;
use radiosity::visibility::Facets;
use serde::Serialize;

use crate::args::Info;
use crate::backs::{self, Backs, named};
use crate::failure::Failure;
use crate::job::Job;
use crate::numbers::{bytes, grouped, measure};
use crate::report::{self, Report};
use crate::{diagnostics, stages};

/// All that is told of a scene; `--json` prints it as it stands.
#[derive(Debug, Serialize)]
struct Facts {
    scene: String,
    objects: Objects,
    surfaces: usize,
    /// Surfaces with an emission.
    lights: usize,
    patches: u64,
    /// What the author's n and m are multiplied by; null where patches are made to a size instead.
    subdivision: Option<f64>,
    /// The longest that an edge of a patch may be; null where the author's n and m count.
    patch_size: Option<f64>,
    /// Patches that there are for surfaces being split where others stand on them; null where they are not split.
    split: Option<u64>,
    total_area: f64,
    /// Area times emission, summed, a channel.
    emitted_power: [f64; 3],
    /// The least and the greatest reflectance of any surface and channel.
    reflectance: [f64; 2],
    /// The least and the greatest corner; null for an empty scene.
    bounding_box: Option<[[f64; 3]; 2]>,
    /// What is wrong with its meshes; null where it has none.
    meshes: Option<Meshes>,
    back_faces: &'static str,
    camera: View,
    /// What the camera sees from behind, where backs are black: the surfaces, and the share of the picture.
    seen_from_behind: Option<Backs>,
    warnings: usize,
    /// Objects that lie exactly on an earlier one: that one, and they.
    coincident: Vec<[u32; 2]>,
    /// Objects that lie on an earlier one in part, in one plane and facing one way: that one, they, and the area.
    overlapping: Vec<(u32, u32, f64)>,
    /// What a solution would need; null where the patches alone are too many.
    need: Option<Needed>,
    machine_memory_bytes: Option<u64>,
    /// Why a solution would be refused, where it would.
    refused: Option<String>,
}

/// Surfaces by kind.
#[derive(Debug, Default, Serialize)]
struct Objects {
    parallelograms: usize,
    quadrilaterals: usize,
    polygons: usize,
    spheres: usize,
    cylinders: usize,
    fractals: usize,
    fractal_triangles: usize,
    meshes: usize,
    mesh_triangles: usize,
}

/// What is wrong with the meshes, all together.
#[derive(Debug, Serialize)]
struct Meshes {
    triangles: u64,
    open_edges: Fault,
    crowded_edges: Fault,
    turned_edges: Fault,
    /// Triangles that were left out: those without area, and those that were there already.
    without_area: u64,
    repeated: u64,
}

/// How often something is wrong, and where for example.
#[derive(Debug, Serialize)]
struct Fault {
    count: u64,
    at: Option<[f64; 3]>,
    surface: Option<String>,
}

#[derive(Debug, Serialize)]
struct View {
    /// `scene` where the author left a view, `framed` where one is chosen to show the whole.
    from: &'static str,
    eye: [f64; 3],
    forward: [f64; 3],
    up: [f64; 3],
}

#[derive(Debug, Serialize)]
struct Needed {
    nonzeros: u64,
    /// With what the program takes by itself.
    bytes: u64,
    /// Whether that is above the limit: rows of form factors are then found anew for every step of the solver.
    recomputed: bool,
}

pub(crate) fn run(typed: &Info) -> Result<(), Failure> {
    let started = Instant::now();
    let job = Job::new(&typed.common)?;
    let scene = stages::read(&job)?;
    let facts = gather(&job, &scene)?;

    let mut out = io::stdout().lock();
    if typed.json {
        serde_json::to_writer_pretty(&mut out, &facts).map_err(io::Error::from)?;
        writeln!(out)?;
    } else {
        print(&mut out, &facts)?;
    }
    out.flush()?;

    let report = Report {
        scene: facts.scene,
        patches: facts.patches.try_into().unwrap_or(usize::MAX),
        form_factors: None,
        solve: None,
        correction: None,
        error: None,
        refinement: None,
        total_seconds: started.elapsed().as_secs_f64(),
        threads: job.threads,
        peak_memory_bytes: report::peak_memory(),
    };
    report.write(&job)
}

/// What the program takes by itself while it solves, and not before: its own pages that it then runs through; and each of
/// its threads. \[bytes\]
const WHILE_SOLVING: u64 = 1_500_000;
const A_THREAD: u64 = 500_000;

fn gather(job: &Job, scene: &Scene) -> Result<Facts, Failure> {
    // What the program takes by itself, and the scene.
    let program = report::peak_memory().unwrap_or(0);
    // Area and power are the same however finely the scene is cut: asked of the coarsest cut, they are told even
    // of what is too fine to be solved.
    let coarse = patches::subdivide(scene, f64::MIN_POSITIVE).map_err(BakeError::from)?;
    let cutting = job.request.cutting().for_scene(scene).map_err(BakeError::from)?;
    let request = Request { subdivision: cutting.subdivision, split: Some(cutting.split), ..job.request };
    let (need, refused) = match bake::foretell(scene, &request, &job.run) {
        Ok(Need { nonzeros, bytes, .. }) => {
            let recomputed = bytes > bake::memory_limit(&job.run);
            let besides = program + WHILE_SOLVING + job.threads as u64 * A_THREAD;
            (Some(Needed { nonzeros, bytes: besides + bytes, recomputed }), None)
        }
        Err(error @ (BakeError::Memory { .. } | BakeError::Subdivide(_))) => (None, Some(error.to_string())),
        Err(error) => return Err(error.into()),
    };
    let back_faces = job.request.back_faces.unwrap_or(scene.back_faces);
    let coincident = coincident(scene, back_faces);
    let mut overlapping = overlaps(scene);
    overlapping.retain(|overlap| !coincident.contains(&overlap.surfaces));
    if !job.quiet {
        tell_coincident(scene, &coincident);
        tell_overlapping(scene, &overlapping);
    }
    let (factor, patch_size) = match request.subdivision {
        Subdivision::Factor(factor) => (Some(factor), None),
        Subdivision::PatchSize(size) => (None, Some(size)),
        Subdivision::Patches(_) => (None, None),
    };
    let patches = patches::count(scene, cutting).map_err(BakeError::from)?;
    let whole = patches::count(scene, cutting.subdivision).map_err(BakeError::from)?;
    stages::warn_of_pairs(job, patches);
    let camera = scene.camera.unwrap_or_else(|| shade::frame(scene));
    Ok(Facts {
        scene: job.scene.display().to_string(),
        objects: objects(scene),
        surfaces: scene.surfaces.len(),
        lights: scene.surfaces.iter().filter(|surface| !surface.material.emission.is_black()).count(),
        patches,
        subdivision: factor,
        patch_size,
        split: cutting.split.then_some(patches.saturating_sub(whole)),
        total_area: coarse.total_area(),
        emitted_power: coarse.total_power().to_array(),
        reflectance: reflectance_range(&coarse),
        bounding_box: bounding_box(scene),
        meshes: meshes(scene),
        back_faces: match back_faces {
            BackFaces::Black => "black",
            BackFaces::Lit => "lit",
        },
        camera: view(scene, &camera),
        seen_from_behind: backs::seen(scene, &Facets::new(scene, &coarse), &camera, back_faces),
        warnings: scene.warnings.len(),
        coincident,
        overlapping: overlapping.iter().map(|o| (o.surfaces[0], o.surfaces[1], o.area)).collect(),
        need,
        machine_memory_bytes: bake::machine_memory(),
        refused,
    })
}

/// One warning for all of them, at the first.
fn tell_coincident(scene: &Scene, pairs: &[[u32; 2]]) {
    let Some(&[first, second]) = pairs.first() else { return };
    let surface = |object: u32| &scene.surfaces[object as usize];
    let more = match pairs.len() {
        1 => String::new(),
        2 => "; so does another object".to_owned(),
        n => format!("; so do {} other objects", grouped(n - 1)),
    };
    let message = match first == second {
        true => format!(
            "object {second} has a triangle twice{more}: only one of the two is seen, so take one out"
        ),
        false => format!(
            "object {second} lies exactly on object {first} of line {}{more}: only one of the two is seen, so take one out",
            surface(first).place.line
        ),
    };
    let warning = Warning { file: scene.name.clone(), place: surface(second).place, message };
    diagnostics::warning(&warning.to_string());
}

/// Likewise.
fn tell_overlapping(scene: &Scene, overlapping: &[Overlap]) {
    let Some(&Overlap { surfaces: [first, second], area, at }) = overlapping.first() else { return };
    let surface = |object: u32| &scene.surfaces[object as usize];
    let more = match overlapping.len() {
        1 => String::new(),
        2 => "; so does another pair".to_owned(),
        n => format!("; so do {} other pairs", grouped(n - 1)),
    };
    let on = match (first == second, surface(first).place.line) {
        (true, _) => "itself".to_owned(),
        (false, 0) => named(scene, first),
        (false, line) => format!("object {first} of line {line}"),
    };
    let [x, y, z] = at.to_array().map(measure);
    let message = format!(
        "object {second} lies on {on} in one plane, over an area of {} such as at {x} {y} {z}{more}: only one of the two is \
         seen there, so cut one out or lift the other a little",
        measure(area)
    );
    let warning = Warning { file: scene.name.clone(), place: surface(second).place, message };
    diagnostics::warning(&warning.to_string());
}

fn objects(scene: &Scene) -> Objects {
    let mut objects = Objects::default();
    for surface in &scene.surfaces {
        match &surface.shape {
            Shape::Parallelogram(_) => objects.parallelograms += 1,
            Shape::Quadrilateral(_) => objects.quadrilaterals += 1,
            Shape::Polygon(_) => objects.polygons += 1,
            Shape::Sphere(_) => objects.spheres += 1,
            Shape::Cylinder(_) => objects.cylinders += 1,
            Shape::Fractal(mesh) => {
                objects.fractals += 1;
                objects.fractal_triangles += mesh.triangles.len();
            }
            Shape::Mesh(mesh) => {
                objects.meshes += 1;
                objects.mesh_triangles += mesh.triangles.len();
            }
        }
    }
    objects
}

fn meshes(scene: &Scene) -> Option<Meshes> {
    let found = check_meshes(scene);
    let fault = |Found { count, example }: Found| Fault {
        count,
        at: example.map(|(place, _)| place.to_array()),
        surface: example.map(|(_, surface)| named(scene, surface)),
    };
    (found.triangles > 0).then(|| Meshes {
        triangles: found.triangles,
        open_edges: fault(found.open),
        crowded_edges: fault(found.crowded),
        turned_edges: fault(found.turned),
        without_area: found.left_out.flat,
        repeated: found.left_out.repeated,
    })
}

fn view(scene: &Scene, camera: &Camera) -> View {
    View {
        from: if scene.camera.is_some() { "scene" } else { "framed" },
        eye: camera.eye.to_array(),
        forward: camera.forward.to_array(),
        up: camera.up.to_array(),
    }
}

fn reflectance_range(patches: &Patches) -> [f64; 2] {
    let channels = patches.reflectance.iter().flat_map(|reflectance| reflectance.to_array());
    channels
        .map(|channel| [channel; 2])
        .reduce(|[low, high], [channel, _]| [low.min(channel), high.max(channel)])
        .unwrap_or_default()
}

fn bounding_box(scene: &Scene) -> Option<[[f64; 3]; 2]> {
    let vertices = scene.surfaces.iter().flat_map(|surface| surface.shape.vertices());
    let [low, high] = vertices
        .map(|vertex| [vertex; 2])
        .reduce(|[low, high], [vertex, _]| [low.min(vertex), high.max(vertex)])?;
    Some([low.to_array(), high.to_array()])
}

fn print(out: &mut impl Write, facts: &Facts) -> io::Result<()> {
    let mut line = |label: &str, text: String| writeln!(out, "{label:<13} {text}");
    let triple = |[x, y, z]: [f64; 3]| format!("{} {} {}", measure(x), measure(y), measure(z));

    line("scene", facts.scene.clone())?;
    line("objects", told(&facts.objects))?;
    line("lights", grouped(facts.lights))?;
    line(
        "patches",
        match (facts.subdivision, facts.patch_size) {
            (Some(factor), _) if factor != 1.0 => {
                format!("{} at subdivision {}", grouped(facts.patches), measure(factor))
            }
            (_, Some(size)) => {
                format!("{}, no edge longer than {}", grouped(facts.patches), measure(size))
            }
            _ => grouped(facts.patches),
        },
    )?;
    if let Some(more) = facts.split.filter(|&more| more > 0) {
        line("", format!("of which {} for surfaces split where others meet them", grouped(more)))?;
    }
    line("area", measure(facts.total_area))?;
    let power = Rgb::from(facts.emitted_power);
    line("power", format!("{} (red, green, blue)", triple(power.to_array())))?;
    let [low, high] = facts.reflectance;
    line(
        "reflectance",
        match high >= 1.0 {
            false => format!("{} to {}", measure(low), measure(high)),
            true => format!("{} to {}: at 1 or more, light need not settle", measure(low), measure(high)),
        },
    )?;
    if let Some([low, high]) = facts.bounding_box {
        line("from", triple(low))?;
        line("to", triple(high))?;
    }
    if let Some(meshes) = &facts.meshes {
        let mut label = "meshes";
        for told in meshes.told() {
            line(label, told)?;
            label = "";
        }
    }
    line("back faces", facts.back_faces.into())?;
    line(
        "camera",
        format!(
            "at {}, looking along {} ({})",
            triple(facts.camera.eye),
            triple(facts.camera.forward),
            match facts.camera.from {
                "scene" => "the scene's own",
                _ => "chosen: there is no .vsn",
            }
        ),
    )?;
    if let Some(backs) = &facts.seen_from_behind {
        line("", backs.told())?;
    }
    if facts.warnings > 0 {
        line("warnings", grouped(facts.warnings))?;
    }
    if let Some(need) = &facts.need {
        let of = facts.machine_memory_bytes.map_or(String::new(), |all| format!(" of {}", bytes(all)));
        line(
            "memory",
            format!("about {}{of}, for {} form factors", bytes(need.bytes), grouped(need.nonzeros)),
        )?;
        if need.recomputed {
            let how = "above the memory limit: rows are recomputed for every step of the solver, which takes longer";
            line("", how.into())?;
        }
    }
    if let Some(refused) = &facts.refused {
        line("refused", refused.clone())?;
    }
    Ok(())
}

impl Meshes {
    /// A line on each thing that is wrong, or one that nothing is.
    fn told(&self) -> Vec<String> {
        let triples = |[x, y, z]: [f64; 3]| format!("{} {} {}", measure(x), measure(y), measure(z));
        let fault = |fault: &Fault, what: [&str; 2], so: &str| {
            let (at, surface) = (fault.at?, fault.surface.as_ref()?);
            let what = what[usize::from(fault.count > 1)];
            Some(format!("{} {what}, such as at {} of {surface}: {so}", grouped(fault.count), triples(at)))
        };
        let left_out = |count: u64, what: [&str; 2]| {
            (count > 0).then(|| format!("{} {} left out", grouped(count), what[usize::from(count > 1)]))
        };
        let faults = [
            fault(&self.open_edges, ["open edge", "open edges"], "a hole or a rim, where light passes"),
            fault(
                &self.crowded_edges,
                ["edge of more than two triangles", "edges of more than two triangles"],
                "walls inside a solid, or sheets that meet",
            ),
            fault(
                &self.turned_edges,
                ["edge between fronts that disagree", "edges between fronts that disagree"],
                "a triangle is turned the wrong way round, and black",
            ),
            left_out(self.without_area, ["triangle without area is", "triangles without area are"]),
            left_out(
                self.repeated,
                ["triangle that was there already is", "triangles that were there already are"],
            ),
        ];
        let told: Vec<String> = faults.into_iter().flatten().collect();
        match told.is_empty() {
            true => vec![format!(
                "{} triangles, closed, and of one mind which side is out",
                grouped(self.triangles)
            )],
            false => told,
        }
    }
}

fn told(objects: &Objects) -> String {
    let many = |number: usize, one: &str, more: &str| match number {
        0 => None,
        1 => Some(format!("1 {one}")),
        n => Some(format!("{} {more}", grouped(n))),
    };
    let of_triangles = |things: Option<String>, triangles: usize| {
        let triangles = many(triangles, "triangle", "triangles").unwrap_or_else(|| "no triangle".into());
        things.map(|things| format!("{things} of {triangles}"))
    };
    let kinds = [
        many(objects.parallelograms, "parallelogram", "parallelograms"),
        many(objects.quadrilaterals, "quadrilateral", "quadrilaterals"),
        many(objects.polygons, "polygon", "polygons"),
        many(objects.spheres, "sphere", "spheres"),
        many(objects.cylinders, "cylinder", "cylinders"),
        of_triangles(many(objects.fractals, "fractal", "fractals"), objects.fractal_triangles),
        of_triangles(many(objects.meshes, "mesh", "meshes"), objects.mesh_triangles),
    ];
    let kinds: Vec<_> = kinds.into_iter().flatten().collect();
    if kinds.is_empty() { "none".into() } else { kinds.join(", ") }
}
