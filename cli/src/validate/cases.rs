//! The cases: what is known, whence, and the scene that shows it.

use std::f64::consts::{PI, TAU};
use std::fmt::Write;

/// A quantity that is known.
pub(super) struct Case {
    pub(super) name: String,
    /// Where the known value is from.
    pub(super) source: &'static str,
    /// The value, of polygons to twelve digits.
    pub(super) exact: f64,
    /// The scene, in N3D.
    pub(super) scene: String,
    pub(super) asked: Asked,
    /// The longest edge of a patch; none for the scene's own n and m.
    pub(super) patch_size: Option<f64>,
    /// How far, as a share of the value, exact form factors and hemicubes may be off. Flat surfaces leave the former nothing but rounding, or
    /// what is hidden in part; curved ones what their facets lack.
    pub(super) bounds: Bounds,
}

#[derive(Clone, Copy)]
pub(super) struct Bounds {
    pub(super) exact: f64,
    /// The same for the form factor of two polygons that nothing stands between, uncut; none for other cases.
    pub(super) pair: Option<f64>,
    /// To which accuracy exact form factors are found for it.
    pub(super) accuracy: f64,
    pub(super) hemicube: f64,
}

/// What of it is known.
pub(super) enum Asked {
    /// The form factor from one surface to another.
    FormFactor(usize, usize),
    /// The mean radiosity of a surface.
    Radiosity(usize),
    /// The mean irradiance of a surface.
    Irradiance(usize),
    /// The radiosity of whichever patch is farthest off.
    WorstRadiosity,
}

/// Howell, A Catalog of Radiation Heat Transfer Configuration Factors, by the numbers of its third edition.
const C_11: &str = "[Howell] C-11";
const C_14: &str = "[Howell] C-14";

const POLYGONS: Bounds = Bounds { exact: 1e-6, pair: Some(1e-10), accuracy: 1e-6, hemicube: 0.02 };
const HIDDEN: Bounds = Bounds { exact: 1e-5, pair: None, accuracy: 1e-5, hemicube: 0.02 };
const CURVED: Bounds = Bounds { exact: 4e-3, pair: None, accuracy: 1e-3, hemicube: 0.02 };

/// Every case; `small` takes the coarser ones alone, for a quick look.
pub(super) fn all(small: bool) -> Vec<Case> {
    let mut cases = polygons();
    cases.extend(hidden());
    cases.extend(curved());
    cases.extend(radiosities(small));
    cases
}

/// A rectangle of this width and depth from the origin, its front up.
fn floor(width: f64, depth: f64) -> String {
    format!("QD 1 1  0 0 0  {width} 0 0  {width} {depth} 0  0 {depth} 0  ID\n")
}

/// Likewise with its least corner anywhere, its front down.
fn ceiling([x, y, z]: [f64; 3], width: f64, depth: f64) -> String {
    let (far, deep) = (x + width, y + depth);
    format!("QD 1 1  {x} {y} {z}  {x} {deep} {z}  {far} {deep} {z}  {far} {y} {z}  ID\n")
}

/// A unit wide along y, as long as `length`, rising from the y axis at this angle to the floor; its front looks at it.
fn rising(length: f64, degrees: f64) -> String {
    let (sin, cos) = degrees.to_radians().sin_cos();
    // To the last digit where a right angle is meant.
    let [x, z] = [cos, sin].map(|along| if along.abs() < 1e-15 { 0.0 } else { along * length });
    format!("QD 1 1  0 0 0  0 1 0  {x} 1 {z}  {x} 0 {z}  ID\n")
}

/// A polygon of so many corners and a disc's area, across x at `x`; its front is towards +x, or -x.
fn disc(x: f64, radius: f64, corners: u32, front: f64) -> String {
    let angle = TAU / f64::from(corners);
    let radius = radius * (angle / angle.sin()).sqrt();
    let mut text = "PG".to_owned();
    for k in 0..=corners {
        let (sin, cos) = (angle * f64::from(k % corners) * front).sin_cos();
        let _ = write!(text, "  {x} {} {}", radius * cos, radius * sin);
    }
    text + "  ID\n"
}

/// The six sides of a box, their fronts within or without, attributes after each.
fn sides(low: [f64; 3], high: [f64; 3], cells: u32, within: bool, attributes: [&str; 6]) -> String {
    let [a, b, c] = low;
    let [x, y, z] = high;
    let faces = [
        [[a, b, c], [x, b, c], [x, y, c], [a, y, c]],
        [[a, b, z], [a, y, z], [x, y, z], [x, b, z]],
        [[a, b, c], [a, y, c], [a, y, z], [a, b, z]],
        [[x, b, c], [x, b, z], [x, y, z], [x, y, c]],
        [[a, b, c], [a, b, z], [x, b, z], [x, b, c]],
        [[a, y, c], [x, y, c], [x, y, z], [a, y, z]],
    ];
    let mut text = String::new();
    for (mut corners, attributes) in faces.into_iter().zip(attributes) {
        if !within {
            corners.reverse();
        }
        let _ = write!(text, "QD {cells} {cells}");
        for [x, y, z] in corners {
            let _ = write!(text, "  {x} {y} {z}");
        }
        let _ = writeln!(text, "  {attributes} ID");
    }
    text
}

fn form_factor(name: impl Into<String>, source: &'static str, exact: f64, scene: String) -> Case {
    Case {
        name: name.into(),
        source,
        exact,
        scene,
        asked: Asked::FormFactor(0, 1),
        patch_size: Some(0.125),
        bounds: POLYGONS,
    }
}

/// Polygons that nothing stands between.
fn polygons() -> Vec<Case> {
    let mut cases = Vec::new();
    for (gap, exact) in [
        (0.1, 0.826_994_522_397),
        (0.5, 0.415_253_283_577),
        (1.0, 0.199_824_895_698),
        (2.0, 0.068_589_588_818_6),
        (10.0, 0.003_162_056_838_76),
    ] {
        let scene = floor(1.0, 1.0) + &ceiling([0.0, 0.0, gap], 1.0, 1.0);
        let mut case = form_factor(format!("parallel unit squares, gap {gap}"), C_11, exact, scene);
        if gap < 0.2 {
            case.patch_size = Some(0.0625);
        } else if gap > 5.0 {
            // A square that fills twenty cells of a hemicube.
            case.bounds.hemicube = 0.05;
        }
        cases.push(case);
    }
    let wide = floor(2.0, 1.0) + &ceiling([0.0, 0.0, 1.0], 2.0, 1.0);
    cases.push(form_factor("parallel rectangles 2 x 1, gap 1", C_11, 0.285_875_384_851, wide));
    let long = floor(10.0, 1.0) + &ceiling([0.0, 0.0, 1.0], 10.0, 1.0);
    cases.push(form_factor("parallel rectangles 10 x 1, gap 1", C_11, 0.386_382_489_266, long));
    let aside = floor(1.0, 1.0) + &ceiling([1.0, 1.0, 1.0], 1.0, 1.0);
    let name = "parallel unit squares, gap 1, one aside by (1, 1)";
    cases.push(form_factor(name, "C-11 by differences", 0.043_327_409_574_1, aside));
    for (length, exact) in [(1.0, 0.200_043_776_075), (2.0, 0.232_852_602_795), (0.1, 0.043_251_369_400_7)] {
        let name = format!("perpendicular, common edge 1, floor 1, wall {length}");
        let mut case = form_factor(name, C_14, exact, floor(1.0, 1.0) + &rising(length, 90.0));
        if length < 0.5 {
            case.patch_size = Some(0.05);
        }
        cases.push(case);
    }
    for (angle, exact) in [(30.0, 0.619_028_323_091), (60.0, 0.370_905_321_150), (120.0, 0.086_615_001_118_3)]
    {
        let name = format!("unit squares, common edge, {angle} degrees between");
        let scene = floor(1.0, 1.0) + &rising(1.0, angle);
        let mut case = form_factor(name, "[Howell] C-16, integrated", exact, scene);
        if angle < 45.0 {
            case.bounds.hemicube = 0.03;
        }
        cases.push(case);
    }
    let triangles = "TI  0 0 0  1 0 0  0 1 0  ID\nTI  0 0 0  0 1 0  0 0 1  ID\n".to_owned();
    let exact = (3.0 - 3.0_f64.sqrt()) / 6.0;
    cases.push(form_factor("right triangles, perpendicular, common leg", "(3 - √3) / 6", exact, triangles));
    let pentagon = "PG  0 0 0  1 0 0  1 1 0  .5 2 0  0 1 0  0 0 0  ID\n".to_owned() + &rising(1.0, 90.0);
    let source = "contour integral in double precision";
    cases.push(form_factor("pentagon to a perpendicular square", source, 0.154_124_318_249, pentagon));
    let tetrahedron = "TI  1 1 1  -1 1 -1  1 -1 -1  ID\nTI  1 1 1  1 -1 -1  -1 -1 1  ID\n".to_owned();
    let mut case =
        form_factor("regular tetrahedron, face to face", "1/3, by symmetry", 1.0 / 3.0, tetrahedron);
    case.patch_size = Some(0.25);
    cases.push(case);
    cases
}

/// Polygons with something between.
fn hidden() -> Vec<Case> {
    let squares = || floor(1.0, 1.0) + &ceiling([0.0, 0.0, 1.0], 1.0, 1.0);
    let blocker = |[x, y]: [f64; 2]| ceiling([x, y, 0.5], 0.5, 0.5);
    let case = |name: &str, source, exact, at| Case {
        bounds: HIDDEN,
        ..form_factor(format!("unit squares, gap 1, {name}"), source, exact, squares() + &blocker(at))
    };
    vec![
        case("a quarter between hidden", "3/4 of C-11, by symmetry", 0.149_868_671_774, [0.0, 0.0]),
        case(
            "a square of .5 in the middle between",
            "quadrature of clipped polygons",
            0.099_506_294_599,
            [0.25, 0.25],
        ),
    ]
}

/// Discs, spheres and cylinders, as facets.
fn curved() -> Vec<Case> {
    let curved = |name: &str, source, exact, scene: String, [from, to]: [usize; 2]| Case {
        asked: Asked::FormFactor(from, to),
        patch_size: None,
        bounds: CURVED,
        ..form_factor(name, source, exact, scene)
    };
    let sized = |size: f64, case: Case| Case { patch_size: Some(size), ..case };
    let discs = |radius: f64| disc(0.0, 1.0, 96, 1.0) + &disc(1.0, radius, 96, -1.0);
    let cans = "HO 0 0 0 0 1 0 2 HO 0 0 0 0 0 1 2 HO 0 0 0 1 0 0 2";
    let closed = format!("CL NM 48 8 IN ID\n{}{}", disc(0.0, 1.0, 48, 1.0), disc(1.0, 1.0, 48, -1.0));
    let coaxial = format!("CL NM 48 8 IN {cans} ID\nCL NM 48 8 HO 0 0 0 1 0 0 2 ID\n");
    let element = |tilt: f64| {
        format!(
            "TI -.0001 -.0001 0  .0002 -.0001 0  -.0001 .0002 0 RT 0 0 0 1 0 0 {tilt} ID\nSP NM 48 24 TR 0 0 2 ID\n"
        )
    };
    let rectangle = "TI -.0001 -.0001 0  .0002 -.0001 0  -.0001 .0002 0 ID\n".to_owned()
        + &ceiling([0.0, 0.0, 1.0], 1.0, 1.0);
    // The pole of a sphere looks along y; turned, along x.
    let sphere_disc = format!("SP NM 32 16 RT 0 0 0 0 0 1 {} ID\n{}", PI / 2.0, disc(2.0, 1.0, 96, -1.0));
    vec![
        sized(
            0.2,
            curved(
                "coaxial discs, radii 1 and 1, gap 1",
                "[Howell] C-41",
                0.381_966_011_250,
                discs(1.0),
                [0, 1],
            ),
        ),
        sized(
            0.2,
            curved(
                "coaxial discs, radii 1 and 2, gap 1",
                "[Howell] C-41",
                0.763_932_022_500,
                discs(2.0),
                [0, 1],
            ),
        ),
        curved(
            "closed cylinder, radius 1, height 1: side to base",
            "[Howell] C-79",
            0.309_016_994_375,
            closed.clone(),
            [0, 1],
        ),
        curved("the same: side to itself", "[Howell] C-78", 0.381_966_011_250, closed, [0, 0]),
        curved(
            "coaxial cylinders, radii 2 and 1, height 2: outer to inner",
            "[Howell] C-91",
            0.337_106_027_519,
            coaxial.clone(),
            [0, 1],
        ),
        curved("the same: outer to itself", "[Howell] C-92", 0.228_481_018_988, coaxial, [0, 0]),
        curved(
            "element to unit square above its corner",
            "[Howell] B-3",
            0.138_531_605_995,
            rectangle,
            [0, 1],
        ),
        curved("element to sphere at 2 radii, facing it", "[Howell] B-29", 0.25, element(0.0), [0, 1]),
        curved("the same, tilted by .5", "[Howell] B-29", 0.5_f64.cos() / 4.0, element(0.5), [0, 1]),
        sized(
            0.25,
            curved(
                "sphere to disc, radii 1, distance 2",
                "[Howell] C-121",
                0.052_786_404_5,
                sphere_disc,
                [0, 1],
            ),
        ),
        curved(
            "spheres that touch",
            "quadrature (no closed form; .067 in some compendia is wrong)",
            0.075_586_818_4,
            "SP NM 40 20 ID\nSP NM 40 20 TR 2 0 0 ID\n".into(),
            [0, 1],
        ),
    ]
}

/// Closed scenes: every row sums to 1.
pub(super) fn closed(small: bool) -> [(&'static str, String); 2] {
    let none = [""; 6];
    let room = |cells| sides([0.0; 3], [1.0; 3], cells, true, none);
    let (cells, inner, empty) = if small { (4, 2, 8) } else { (8, 4, 16) };
    let with_box = room(cells) + &sides([0.3, 0.2, 0.4], [0.7, 0.6, 0.9], inner, false, none);
    [("empty cube", room(empty)), ("cube with a box in it", with_box)]
}

/// A closed room of two colours with a box in the air and a lamp below its ceiling, for what errors cost.
pub(super) fn lit_room() -> String {
    let [white, red, green] = ["CD .7 .7 .7", "CD .6 .1 .1", "CD .15 .5 .15"];
    let room = sides([0.0; 3], [1.0; 3], 8, true, [white, white, red, green, white, white]);
    let lamp = "QD 3 3  .35 .35 .98  .35 .65 .98  .65 .65 .98  .65 .35 .98  CE 20 20 20  ID\n\
        QD 1 1  .35 .35 .98  .65 .35 .98  .65 .65 .98  .35 .65 .98  ID\n";
    room + lamp + &sides([0.3, 0.2, 0.2], [0.7, 0.6, 0.5], 4, false, [white; 6])
}

/// Solutions that are known.
fn radiosities(small: bool) -> Vec<Case> {
    let known = |name: &str, source, exact, scene: String, asked| Case {
        asked,
        patch_size: None,
        bounds: Bounds { exact: 1e-4, pair: None, accuracy: 3e-5, hemicube: 1e-4 },
        ..form_factor(name, source, exact, scene)
    };
    let mut cases = Vec::new();
    let (outer_cells, inner_cells) = if small { (3, 1) } else { (6, 3) };
    let inner =
        |attributes: &str| sides([0.3, 0.2, 0.4], [0.6, 0.7, 0.7], inner_cells, false, [attributes; 6]);
    for (reflectance, exact) in [(0.5, 2.0), (0.9, 10.0), (0.99, 100.0)] {
        let attributes = format!("CE 1 1 1 CD {reflectance} {reflectance} {reflectance}");
        let scene = sides([0.0; 3], [1.0; 3], outer_cells, true, [&attributes; 6]) + &inner(&attributes);
        let name = format!("furnace with a box in it, ρ = {reflectance}");
        let mut case = known(&name, "E / (1 - ρ)", exact, scene, Asked::WorstRadiosity);
        // A cell of a hemicube now and then sees past a silhouette; what a row lacks comes back so many times.
        case.bounds = Bounds {
            exact: 1e-4 / (1.0 - reflectance),
            pair: None,
            accuracy: 3e-5,
            hemicube: 1e-4 / (1.0 - reflectance),
        };
        cases.push(case);
    }
    let greys = [0.1, 0.3, 0.5, 0.7, 0.8, 0.9].map(|rho: f64| {
        let left = 1.0 - rho;
        format!("CE {left} {left} {left} CD {rho} {rho} {rho}")
    });
    let scene = sides([0.0; 3], [1.0; 3], outer_cells, true, greys.each_ref().map(String::as_str))
        + &inner(&greys[4]);
    let mut case =
        known("white furnace, E = 1 - ρ, with a box in it", "B = 1", 1.0, scene, Asked::WorstRadiosity);
    case.bounds.exact = 1e-3;
    cases.push(case);

    // Half of it bright, half dark, by one sphere's rows: two halves, joined at the equator.
    let half = "SP IN NM 32 16 CE 1 1 1 CD .5 .5 .5 ID\n".to_owned();
    cases.push(known("inside a sphere, E = 1, ρ = .5", "H = E / (1 - ρ)", 2.0, half, Asked::Irradiance(0)));

    let cells = if small { 12 } else { 24 };
    let bright =
        ["CE 1 1 1 CD .5 .5 .5", "CD .5 .5 .5", "CD .5 .5 .5", "CD .5 .5 .5", "CD .5 .5 .5", "CD .5 .5 .5"];
    let cube = sides([0.0; 3], [1.0; 3], cells, true, bright);
    for (name, surface, exact) in
        [("the floor", 0, 1.104_362), ("the ceiling", 1, 0.171_216), ("a wall", 2, 0.181_106)]
    {
        let mut case = known(
            &format!("cube with a bright floor, ρ = .5: {name}"),
            "converged in the mesh",
            exact,
            cube.clone(),
            Asked::Radiosity(surface),
        );
        case.bounds = Bounds { exact: 2e-3, pair: None, accuracy: 1e-6, hemicube: 1e-2 };
        cases.push(case);
    }
    cases
}
