//! What each method's error costs: solutions of one room, coarse and fine, against one much finer.

use std::fmt::Write as _;

use radiosity::bake::{self, Baked, Method, Request, Run};
use radiosity::light::Rgb;
use radiosity::scene::{BackFaces, n3d};

use super::{cases, stop_asked};
use crate::failure::Failure;
use crate::numbers::{grouped, percent};

/// What n and m are multiplied by for the reference, and its form factors' accuracy.
const REFERENCE: (u32, f64) = (6, 1e-4);
/// What they are multiplied by for what is tried; each divides the reference's.
const FACTORS: [u32; 3] = [1, 2, 3];

/// A solution, what it cost and how far it is off.
pub(super) struct Point {
    /// Which of [`methods`].
    pub(super) method: usize,
    patches: usize,
    /// Of one processor.
    pub(super) seconds: f64,
    /// Area-weighted relative root mean square of the radiosities, lamps left out, all channels together.
    pub(super) error: f64,
}

/// The methods, by name.
pub(super) fn methods() -> [(&'static str, Request); 7] {
    let by = |method| Request { method, ..Request::default() };
    let hemicube = |precision| by(Method::Hemicube { precision });
    let shares = by(Method::HemicubeExact { precision: 100, eyes: 2, accuracy: 1e-3 });
    let exact = by(Method::Exact { accuracy: 1e-3 });
    let corrected = |request| Request { correct: true, ..request };
    [
        ("hemicube 50", hemicube(50)),
        ("hemicube 100", hemicube(100)),
        ("hemicube 400", hemicube(400)),
        ("hemicube-exact", shares),
        ("the same, --correct", corrected(shares)),
        ("exact, 1e-3", exact),
        ("the same, --correct", corrected(exact)),
    ]
}

/// Solve the room by every method, at every fineness.
pub(super) fn points(run: &Run) -> Result<Vec<Point>, Failure> {
    let solved = |factor: u32, request: Request, run: &Run| -> Result<Baked, Failure> {
        let scene = n3d::parse_scene("room", cases::lit_room().as_bytes())?;
        let request = Request {
            subdivision: f64::from(factor).into(),
            epsilon: 1e-7,
            back_faces: Some(BackFaces::Black),
            ..request
        };
        Ok(bake::bake(&scene, &request, run, &mut { stop_asked })?)
    };
    let (factor, accuracy) = REFERENCE;
    let finest = Request { method: Method::Exact { accuracy }, correct: true, ..Request::default() };
    let reference = solved(factor, finest, run)?;
    let mut points = Vec::new();
    for (number, (_, request)) in methods().into_iter().enumerate() {
        for tried in FACTORS {
            let started = cpu_time::ProcessTime::now();
            let baked = solved(tried, request, &Run { threads: Some(1), ..*run })?;
            let seconds = started.elapsed().as_secs_f64();
            let error = error(&baked, &reference, factor / tried);
            points.push(Point { method: number, patches: baked.patches.len(), seconds, error });
        }
    }
    Ok(points)
}

/// How far radiosities are off the reference's means over the same patches, each of which is cut `times` both ways there.
fn error(baked: &Baked, reference: &Baked, times: u32) -> f64 {
    let (mut off, mut all) = (0.0, 0.0);
    let patches = &baked.patches;
    for (block, fine) in patches.blocks.iter().zip(&reference.patches.blocks) {
        for i in block.patches().filter(|&i| patches.emission[i].is_black()) {
            let cell = i as u32 - block.first;
            let (column, row) = (cell % block.columns * times, cell / block.columns * times);
            let within = (0..times).flat_map(|y| (0..times).map(move |x| (column + x, row + y)));
            let of_cell = |(x, y): (u32, u32)| {
                reference.solution.radiosity[(fine.first + y * fine.columns + x) as usize]
            };
            let mean = within.map(of_cell).sum::<Rgb>() * f64::from(times * times).recip();
            off += patches.area[i] * (baked.solution.radiosity[i] - mean).norm_squared();
            all += patches.area[i] * mean.norm_squared();
        }
    }
    (off / all).sqrt()
}

/// The part of the report, with the picture by this name where there is one.
pub(super) fn told(points: &[Point], picture: Option<&str>) -> String {
    let mut text = String::from("\n## Error against time\n\n");
    let (factor, accuracy) = REFERENCE;
    let _ = writeln!(
        text,
        "A room with a box in it and a lamp, cut as written and {} times as finely, against exact form factors (to {accuracy:e}, --correct) on\n\
         patches cut {factor} times as finely both ways. The error is that of the patches' radiosities: relative, root mean square, weighted by\n\
         area, the lamp left out. Seconds are those of one processor, for the whole solution.\n",
        FACTORS.map(|factor| factor.to_string())[1..].join(" and "),
    );
    if let Some(picture) = picture {
        let _ = writeln!(text, "![Error against time]({picture})\n");
    }
    text += "| method | patches | CPU seconds | error |\n|---|---|---|---|\n";
    for point in points {
        let Point { method, patches, seconds, error } = point;
        let name = methods()[*method].0;
        let _ = writeln!(text, "| {name} | {} | {seconds:.2} | {} |", grouped(*patches), percent(*error));
    }
    text
}
