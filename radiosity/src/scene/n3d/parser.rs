//! The grammar of .scn files: from tokens to objects.
//!
//! Composites are kept on a stack of our own, so no depth of nesting can exhaust the machine's; each
//! top-level object is placed and forgotten before the next is read, and every step of the reading is paid
//! for by a token of the file.

use glam::{DAffine3, DVec3};

use super::check::{self, BadShape};
use super::fractal;
use super::keywords::{self, ATTRIBUTES, OBJECTS};
use super::lexer::{Lexer, Token};
use super::number;
use super::resolve::{Coefficients, Geometry, Object, place_objects};
use super::source::{Source, Spot};
use super::transform::{self, BadTransform, Transform};
use crate::light::Rgb;
use crate::scene::{
    BackFaces, Curved, Mesh, Parallelogram, Place, Polygon, Quadrilateral, Scene, SceneError, Shape, Warning,
};

/// The most triangles of all FR together: a few words of a file make tens of thousands.
const MOST_FRACTAL: u64 = 4_000_000;
/// How deep composites may stand in one another. Editors nest a dozen deep; beyond this a program went wild.
const DEEPEST: usize = 1_000;
/// The most patches along one side of a QD, SP or CL. A side of 10,000 already makes rows of form factors no memory holds.
const FINEST: i64 = 10_000;
/// The most corners of a PG. Cutting into triangles is quadratic in them, and one patch has no use for more.
const MOST_CORNERS: usize = 2_000;
/// How far from the parallelogram's a QD's third corner may lie, relative to its longest side, to be taken for it: what
/// files of few decimals round.
const PARALLEL: f64 = 1e-4;
/// The patches of an SP and of a CL without an NM: about square, on the unit shape.
const SPHERE: [u32; 2] = [24, 12];
const CYLINDER: [u32; 2] = [24, 4];

/// Read all of `source`.
pub(super) fn parse(source: &Source<'_>) -> Result<Scene, SceneError> {
    let mut parser = Parser {
        source,
        lexer: Lexer::new(source),
        objects: Vec::new(),
        open: Vec::new(),
        notes: Vec::new(),
        fractal: 0,
        scene: Scene {
            name: source.file.clone(),
            surfaces: Vec::new(),
            camera: None,
            back_faces: BackFaces::Lit,
            warnings: Vec::new(),
        },
    };
    parser.scene()?;
    let warning = |note: Note| {
        let more = match note.more {
            0 => String::new(),
            1 => " (and once more)".to_owned(),
            more => format!(" (and {more} times more)"),
        };
        Warning { file: source.file.clone(), place: note.place, message: note.message + &more }
    };
    Ok(Scene { warnings: parser.notes.into_iter().map(warning).collect(), ..parser.scene })
}

struct Parser<'a> {
    source: &'a Source<'a>,
    lexer: Lexer<'a>,
    /// The top-level object being read and all within it, a composite before its parts.
    objects: Vec<Object>,
    /// The composites whose FI is still to come.
    open: Vec<usize>,
    notes: Vec<Note>,
    /// The triangles that FR have made so far.
    fractal: u64,
    scene: Scene,
}

/// A warning to be: one for all the places that call for the same words.
struct Note {
    place: Place,
    message: String,
    more: usize,
}

impl<'a> Parser<'a> {
    fn error(&self, spot: Spot, message: impl Into<String>, help: impl Into<String>) -> SceneError {
        self.source.error(spot, message, help)
    }

    fn note(&mut self, place: Place, message: String) {
        match self.notes.iter_mut().find(|note| note.message == message) {
            Some(note) => note.more += 1,
            None => self.notes.push(Note { place, message, more: 0 }),
        }
    }

    fn scene(&mut self) -> Result<(), SceneError> {
        let first = self.lexer.peek();
        while let Some(token) = self.lexer.next() {
            self.object_or_end(token)?;
            if self.open.is_empty() {
                place_objects(self.source, &mut self.objects, &mut self.scene.surfaces)?;
                self.objects.clear();
            }
        }
        if let Some(&composite) = self.open.last() {
            let depth = self.open.len();
            let others = if depth > 1 { format!(" ({depth} composites are open)") } else { String::new() };
            return Err(self.error(
                self.objects[composite].spot,
                format!("this OC is not closed: the file ends before its FI{others}"),
                "write FI after the last object in it, then its attributes and ID",
            ));
        }
        let Some(first) = first else {
            return Err(match self.source.text.is_empty() {
                true => {
                    self.error(Spot::START, "the file is empty", "write at least one object, such as a QD")
                }
                false => self.error(
                    Spot::START,
                    "the file holds no object, only white space or comments",
                    "write at least one object, such as a QD",
                ),
            });
        };
        if self.scene.surfaces.is_empty() {
            return Err(self.error(
                first.spot,
                "the scene has no surface, so there is nothing to light",
                "write at least one QD, PG, TI, SP, CL, FR or VO",
            ));
        }
        Ok(())
    }

    /// An object with its attributes; or the beginning of a composite; or its FI and attributes.
    fn object_or_end(&mut self, token: Token<'a>) -> Result<(), SceneError> {
        let geometry = match token.text {
            "OC" => return self.open_composite(token),
            "FI" => {
                let Some(composite) = self.open.pop() else {
                    return Err(self.error(
                        token.spot,
                        "FI closes no composite: none is open here",
                        "take it out, or write OC before the objects that belong together",
                    ));
                };
                return self.attributes(composite, "OC");
            }
            "PG" => self.polygon(token)?,
            "TI" => self.triangle(token)?,
            "QD" => self.quadrilateral(token)?,
            "VO" => self.mesh(token)?,
            "PT" | "SG" => {
                let count = if token.text == "PT" { 1 } else { 2 };
                for k in 0..count {
                    self.point(&token, if count == 1 { "1 point" } else { "2 points" }, k)?;
                }
                let name = if count == 1 { "PT is a point" } else { "SG is a segment" };
                self.note(token.spot.place, format!("{name}, which carries no patch: left out"));
                Geometry::Nothing
            }
            "SP" => Geometry::Shape(Shape::Sphere(unit(SPHERE))),
            "CL" => Geometry::Shape(Shape::Cylinder(unit(CYLINDER))),
            "FR" => self.fractal(token)?,
            "PL" => {
                return Err(self.error(
                    token.spot,
                    "PL is an infinite plane, which cannot be cut into patches",
                    "write the part of it that matters as a QD",
                ));
            }
            _ => return Err(self.not_an_object(token)),
        };
        let index = self.push(token, geometry);
        self.attributes(index, token.text)
    }

    fn open_composite(&mut self, token: Token<'a>) -> Result<(), SceneError> {
        if self.open.len() == DEEPEST {
            return Err(self.error(
                token.spot,
                format!("more than {DEEPEST} composites stand in one another"),
                "close some with FI and ID, or put the parts of a composite directly into the one around it",
            ));
        }
        let index = self.push(token, Geometry::Composite);
        self.open.push(index);
        Ok(())
    }

    fn push(&mut self, token: Token<'a>, geometry: Geometry) -> usize {
        self.objects.push(Object {
            parent: self.open.last().copied(),
            spot: token.spot,
            geometry,
            transform: Transform::IDENTITY,
            transformed: false,
            coefficients: Coefficients::default(),
        });
        self.objects.len() - 1
    }

    // Objects.

    fn quadrilateral(&mut self, token: Token<'a>) -> Result<Geometry, SceneError> {
        let mut counts = [0; 2];
        for (count, name) in counts.iter_mut().zip(["n", "m"]) {
            let had = if name == "n" { "it" } else { "n" };
            let (value, spot) = self.whole(&token, "n and m before its 4 points", || had.to_owned())?;
            *count = value;
            if !(1..=FINEST).contains(&value) {
                return Err(self.error(
                    spot,
                    format!("QD is cut into 1 to {FINEST} patches a side, and {name} is {value}"),
                    "n counts the patches from point 1 to point 2, m those from point 1 to point 4",
                ));
            }
        }
        let mut points = [DVec3::ZERO; 4];
        let mut spots = [token.spot; 4];
        for (k, point) in points.iter_mut().enumerate() {
            (*point, spots[k]) = self.point(&token, "4 points", k)?;
        }
        let [s1, s2, s3, s4] = points;
        let shape = Parallelogram {
            origin: s1,
            u: s2 - s1,
            v: s4 - s1,
            normal: (s2 - s1).cross(s4 - s1).normalize_or_zero(),
            columns: counts[0] as u32,
            rows: counts[1] as u32,
        };
        // The sides as written, all four: a third corner far off makes its own sides long.
        let longest = (0..4).map(|k| points[k].distance(points[(k + 1) % 4])).fold(0.0, f64::max);
        let general = s3.distance(s2 + s4 - s1) > PARALLEL * longest;
        let shape = match general {
            false => Shape::Parallelogram(shape),
            true => Shape::Quadrilateral(Quadrilateral {
                corners: points,
                mirrored: false,
                columns: shape.columns,
                rows: shape.rows,
            }),
        };
        self.checked(&token, check::check(&shape), |part| spots[part])?;
        Ok(Geometry::Shape(shape))
    }

    fn fractal(&mut self, token: Token<'a>) -> Result<Geometry, SceneError> {
        const HEAD: &str = "its depth, roughness and seed before its 3 points";
        let (depth, spot) = self.whole(&token, HEAD, || "it".to_owned())?;
        if !(0..=fractal::DEEPEST).contains(&depth) {
            return Err(self.error(
                spot,
                format!("FR is cut 0 to {} times, and its depth is {depth}", fractal::DEEPEST),
                "each time makes four triangles of one",
            ));
        }
        self.fractal += 1 << (2 * depth);
        if self.fractal > MOST_FRACTAL {
            return Err(self.error(
                spot,
                format!("the FR up to this one make more than {MOST_FRACTAL} triangles"),
                "choose smaller depths: each less makes a quarter of the triangles",
            ));
        }
        let (roughness, spot) = self.real(&token, HEAD, || "1 of them".to_owned())?;
        if !(0.0..=fractal::ROUGHEST).contains(&roughness) {
            return Err(self.error(
                spot,
                format!("FR's roughness is 0 to {}, and this is {roughness}", fractal::ROUGHEST),
                "it is how far the middle of an edge may move, as a part of the edge's length",
            ));
        }
        let (seed, _) = self.real(&token, HEAD, || "2 of them".to_owned())?;
        let mut points = [DVec3::ZERO; 3];
        let mut spots = [token.spot; 3];
        for (k, point) in points.iter_mut().enumerate() {
            (*point, spots[k]) = self.point(&token, "3 points", k)?;
        }
        self.checked(&token, check::check(&Shape::Polygon(Polygon { vertices: points.to_vec() })), |part| {
            spots[part]
        })?;
        let mesh = fractal::triangles(points, depth as u32, roughness, seed);
        let shape = Shape::Fractal(mesh);
        self.checked(&token, check::check(&shape), |_| token.spot)?;
        Ok(Geometry::Shape(shape))
    }

    fn triangle(&mut self, token: Token<'a>) -> Result<Geometry, SceneError> {
        let mut vertices = Vec::with_capacity(3);
        let mut spots = [token.spot; 3];
        for (k, spot) in spots.iter_mut().enumerate() {
            let (vertex, at) = self.point(&token, "3 points", k)?;
            vertices.push(vertex);
            *spot = at;
        }
        let shape = Shape::Polygon(Polygon { vertices });
        self.checked(&token, check::check(&shape), |part| spots[part])?;
        Ok(Geometry::Shape(shape))
    }

    fn polygon(&mut self, token: Token<'a>) -> Result<Geometry, SceneError> {
        const NEEDS: &str = "its first point again to end it";
        let mut vertices: Vec<DVec3> = Vec::new();
        let mut spots = Vec::new();
        loop {
            let (vertex, spot) = self.point(&token, NEEDS, vertices.len())?;
            if vertices.first() == Some(&vertex) {
                if vertices.len() < 3 {
                    return Err(self.error(
                        spot,
                        format!("PG needs at least 3 points, its first comes again after {}", vertices.len()),
                        "write each corner once, and the first again after the last",
                    ));
                }
                break;
            }
            if vertices.len() == MOST_CORNERS {
                return Err(self.error(
                    token.spot,
                    format!("PG has more than {MOST_CORNERS} points, and its first has not come again"),
                    "repeat the first point after the last; write an outline that large as several PG or a VO",
                ));
            }
            vertices.push(vertex);
            spots.push(spot);
        }
        let shape = Shape::Polygon(Polygon { vertices });
        self.checked(&token, check::check(&shape), |part| spots[part])?;
        Ok(Geometry::Shape(shape))
    }

    fn mesh(&mut self, token: Token<'a>) -> Result<Geometry, SceneError> {
        const HEAD: &str = "a real and 2 whole numbers, then its points";
        // What these three mean is not known; that they are numbers is.
        self.real(&token, HEAD, || "it".to_owned())?;
        self.whole(&token, HEAD, || "1 of them".to_owned())?;
        self.whole(&token, HEAD, || "2 of them".to_owned())?;
        let points = self.count(&token, "points", 3)?;
        let needs = format!("{points} points");
        let mut vertices = Vec::new();
        for k in 0..points {
            vertices.push(self.point(&token, &needs, k)?.0);
        }
        let count = self.count(&token, "triangles", 1)?;
        let needs = format!("{count} triangles of 3 indices");
        let mut triangles = Vec::new();
        for k in 0..count {
            let mut triangle = [0; 3];
            let mut spots = [token.spot; 3];
            for corner in 0..3 {
                let (value, spot) =
                    self.whole(&token, &needs, || in_groups(k, corner, "index", "indices"))?;
                if value < 1 || value > points as i64 {
                    return Err(self.error(
                        spot,
                        format!(
                            "VO has points 1 to {points}, and its triangle {} asks for point {value}",
                            k + 1
                        ),
                        "indices count the points of this VO from 1",
                    ));
                }
                triangle[corner] = (value - 1) as u32;
                spots[corner] = spot;
            }
            // Checked here, one at a time, while its place is at hand.
            let corners = triangle.map(|index| vertices[index as usize]);
            self.checked(&token, check::mesh_triangle(corners, k), |_| spots[0])?;
            triangles.push(triangle);
        }
        Ok(Geometry::Shape(Shape::Mesh(Mesh { vertices, triangles, ..Mesh::default() })))
    }

    /// How many of something a VO says will follow. Nothing is allocated on the strength of it.
    fn count(&mut self, of: &Token<'a>, things: &str, least: i64) -> Result<usize, SceneError> {
        let needs = format!("its number of {things}");
        let had = if things == "points" { "its first 3 numbers" } else { "its points" };
        let (value, spot) = self.whole(of, &needs, || had.to_owned())?;
        if value < least || value > i64::from(u32::MAX) {
            let message = match value < least {
                true => format!(
                    "VO needs at least {least} {}, and this says {value}",
                    things.trim_end_matches(if least == 1 { "s" } else { "-" })
                ),
                false => format!("VO cannot have {value} {things}"),
            };
            return Err(self.error(spot, message, format!("count the {things} that follow")));
        }
        Ok(value as usize)
    }

    /// What to say of a word that stands where an object should begin.
    fn not_an_object(&self, token: Token<'a>) -> SceneError {
        let word = token.quoted();
        let attribute = ATTRIBUTES.contains(&token.text);
        let (message, help) = if token.text == "ID" {
            (
                "ID closes no object: none is open here".to_owned(),
                match self.open.is_empty() {
                    true => "take it out: each object has one ID".to_owned(),
                    false => "take it out; to close the composite, write FI first".to_owned(),
                },
            )
        } else if attribute {
            (
                format!("{} stands outside any object", token.text),
                match self.open.is_empty() {
                    true => "attributes stand between an object and its ID".to_owned(),
                    false => {
                        "attributes stand between an object and its ID; those of a composite after its FI"
                            .to_owned()
                    }
                },
            )
        } else if number::real(token.text).is_ok() {
            (
                format!("{word} stands where an object should begin"),
                "objects begin with a keyword, such as QD; is an earlier ID too early?".to_owned(),
            )
        } else {
            let mut expected = OBJECTS.to_vec();
            expected.push("FI");
            (
                format!("{word} begins no object"),
                keywords::cure(&token, &expected, "objects are OC, PG, TI, QD, SP, CL, FR, VO, PT and SG"),
            )
        };
        self.error(token.spot, message, help)
    }

    // Attributes.

    /// Attributes up to ID.
    fn attributes(&mut self, index: usize, name: &str) -> Result<(), SceneError> {
        loop {
            let Some(token) = self.lexer.next() else {
                let after = if name == "OC" { " after its FI" } else { "" };
                return Err(self.error(
                    self.objects[index].spot,
                    format!("this {name} has no ID: the file ends{after} before it"),
                    "write ID after its last attribute",
                ));
            };
            match token.text {
                "ID" => break,
                "TR" | "HO" | "RT" | "CZ" | "AV" | "MA" => self.transform(index, token)?,
                "GD" => {
                    let [grey] = self.numbers(&token, "a grey")?;
                    self.not_negative(&token, [grey; 3])?;
                    self.objects[index].coefficients.set(keywords::Coefficient::Diffuse, Rgb::grey(grey));
                }
                "HD" => self.note(
                    token.spot.place,
                    "HD hides an object in N3D's editor; here it takes part all the same".to_owned(),
                ),
                // An editor's lock against changes.
                "LK" => {}
                "NM" => self.cells(index, name, &token)?,
                "IN" => match self.objects[index].geometry.curved() {
                    Some(curved) => curved.inward = true,
                    None => {
                        return Err(self.error(
                            token.spot,
                            format!("IN turns the front of an SP or a CL inward, and this is the {name} of line {}",
                                self.objects[index].spot.place.line),
                            "take it out; the front of other objects is the side from which their corners run \
                             counter-clockwise",
                        ));
                    }
                },
                keyword => match keywords::coefficient(keyword) {
                    Some((coefficient, words)) => {
                        let value = self.numbers(&token, "r g b")?;
                        if matches!(keyword, "CD" | "CE") {
                            self.not_negative(&token, value)?;
                        } else if value != [0.0; 3] {
                            self.note(
                                token.spot.place,
                                format!("{keyword} ({words}) plays no part in radiosity"),
                            );
                        }
                        self.objects[index].coefficients.set(coefficient, value.into());
                    }
                    None => return Err(self.not_an_attribute(index, name, token)),
                },
            }
        }
        if self.objects[index].geometry == Geometry::Nothing {
            self.objects.pop();
        }
        Ok(())
    }

    /// NM: how an SP or a CL is cut.
    fn cells(&mut self, index: usize, name: &str, token: &Token<'a>) -> Result<(), SceneError> {
        // Three around, and two from pole to pole, are the fewest that enclose anything.
        let fewest = [3, if name == "SP" { 2 } else { 1 }];
        let mut cells = [0; 2];
        for (k, (cells, around)) in cells.iter_mut().zip(["n", "m"]).enumerate() {
            let had = || if k == 0 { "it" } else { "n" }.to_owned();
            let (value, spot) = self.whole(token, "n and m", had)?;
            *cells = value as u32;
            if !(fewest[k]..=FINEST).contains(&value) {
                return Err(self.error(
                    spot,
                    format!("{name} is cut into {} to {FINEST} patches, and {around} is {value}", fewest[k]),
                    "n counts the patches once around, m those from pole to pole of an SP, or along a CL",
                ));
            }
        }
        match self.objects[index].geometry.curved() {
            Some(curved) => {
                [curved.columns, curved.rows] = cells;
                Ok(())
            }
            None => Err(self.error(
                token.spot,
                format!(
                    "NM cuts an SP or a CL into patches, and this is the {name} of line {}",
                    self.objects[index].spot.place.line
                ),
                "take it out: a QD's n and m follow its keyword, and the others are not cut by numbers",
            )),
        }
    }

    fn not_negative(&self, token: &Token<'a>, value: [f64; 3]) -> Result<(), SceneError> {
        if value.iter().all(|&channel| channel >= 0.0) {
            return Ok(());
        }
        let name = token.text;
        let what = if name == "CE" { "emit" } else { "reflect" };
        Err(self.error(
            token.spot,
            format!("{name} is negative: a surface cannot {what} less than nothing"),
            "give 0 or more in each channel",
        ))
    }

    fn transform(&mut self, index: usize, token: Token<'a>) -> Result<(), SceneError> {
        let vector = |n: &[f64], k: usize| DVec3::new(n[k], n[k + 1], n[k + 2]);
        let made = match token.text {
            "TR" => {
                let n: [f64; 3] = self.numbers(&token, "dx dy dz")?;
                Ok(transform::translate(n.into()))
            }
            "HO" => {
                let n: [f64; 7] = self.numbers(&token, "a point, a vector and a factor")?;
                transform::scale_along(vector(&n, 0), vector(&n, 3), n[6])
            }
            "RT" => {
                let n: [f64; 7] = self.numbers(&token, "a point, a vector and an angle")?;
                transform::rotate(vector(&n, 0), vector(&n, 3), n[6])
            }
            "CZ" => {
                let n: [f64; 9] = self.numbers(&token, "a point and two vectors")?;
                self.note(
                    token.spot.place,
                    "CZ is read as: a point moves by the second vector for each unit it lies above the plane \
                     across the first; whether N3D does so is not known"
                        .to_owned(),
                );
                transform::shear(vector(&n, 0), vector(&n, 3), vector(&n, 6))
            }
            "AV" => {
                let n: [f64; 6] = self.numbers(&token, "two vectors")?;
                transform::align(vector(&n, 0), vector(&n, 3))
            }
            _ => {
                let n: [f64; 24] = self.numbers(&token, "a matrix of 3 rows of 4, and its inverse")?;
                transform::matrix(&n).map(|(transform, inverts)| {
                    if !inverts {
                        self.note(
                            token.spot.place,
                            "MA's second matrix is not the inverse of its first; the first is used"
                                .to_owned(),
                        );
                    }
                    transform
                })
            }
        };
        let made = made.map_err(|BadTransform { message, help }| self.error(token.spot, message, help))?;
        let object = &mut self.objects[index];
        let Some(together) = object.transform.then(made) else {
            return Err(self.error(
                token.spot,
                format!("{} and the transforms before it make numbers too large", token.text),
                "scale less",
            ));
        };
        object.transform = together;
        object.transformed = true;
        Ok(())
    }

    /// What to say of a word that stands between an object and its ID.
    fn not_an_attribute(&self, index: usize, name: &str, token: Token<'a>) -> SceneError {
        let line = self.objects[index].spot.place.line;
        let word = token.quoted();
        if OBJECTS.contains(&token.text) || token.text == "FI" {
            let what = if token.text == "FI" { "FI comes" } else { "the next object begins" };
            return self.error(
                token.spot,
                format!("{what} before the ID of the {name} of line {line}"),
                "write ID after the last attribute of every object",
            );
        }
        if number::real(token.text).is_ok() {
            return self.error(
                token.spot,
                format!("{word} is one number too many"),
                format!("an attribute, or the ID of the {name} of line {line}, was to come; count the numbers before"),
            );
        }
        let mut expected = ATTRIBUTES.to_vec();
        expected.push("ID");
        let otherwise = "attributes are CD, CE, GD and the other coefficients, TR HO RT CZ AV MA, NM IN, and ID to end them";
        self.error(
            token.spot,
            format!("{word} is no attribute of the {name} of line {line}"),
            keywords::cure(&token, &expected, otherwise),
        )
    }

    // Numbers.

    /// The arguments of an attribute.
    fn numbers<const N: usize>(&mut self, of: &Token<'a>, names: &str) -> Result<[f64; N], SceneError> {
        let mut values = [0.0; N];
        for (k, value) in values.iter_mut().enumerate() {
            let needs = || format!("{N} number{} ({names})", if N == 1 { "" } else { "s" });
            let had = || if k == 0 { "it".to_owned() } else { k.to_string() };
            (*value, _) = self.number(of, number::real, needs, had)?;
        }
        Ok(values)
    }

    /// The point after `index` others, and where it begins.
    fn point(&mut self, of: &Token<'a>, needs: &str, index: usize) -> Result<(DVec3, Spot), SceneError> {
        let mut values = [0.0; 3];
        let mut at = of.spot;
        for (k, value) in values.iter_mut().enumerate() {
            let (read, spot) = self.real(of, needs, || in_groups(index, k, "number", "numbers"))?;
            *value = read;
            if k == 0 {
                at = spot;
            }
        }
        Ok((values.into(), at))
    }

    fn real(
        &mut self,
        of: &Token<'a>,
        needs: &str,
        had: impl FnOnce() -> String,
    ) -> Result<(f64, Spot), SceneError> {
        self.number(of, number::real, || needs.to_owned(), had)
    }

    fn whole(
        &mut self,
        of: &Token<'a>,
        needs: &str,
        had: impl FnOnce() -> String,
    ) -> Result<(i64, Spot), SceneError> {
        self.number(of, number::whole, || needs.to_owned(), had)
    }

    /// A number of `of`, which needs `needs` and so far `had` some.
    fn number<T>(
        &mut self,
        of: &Token<'a>,
        read: impl FnOnce(&str) -> Result<T, number::BadNumber>,
        needs: impl FnOnce() -> String,
        had: impl FnOnce() -> String,
    ) -> Result<(T, Spot), SceneError> {
        let Some(token) = self.lexer.peek() else {
            // The file has no more to point at, so it is the keyword that is left wanting.
            return Err(self.error(
                of.spot,
                format!("{} needs {}, the file ends after {}", of.text, needs(), had()),
                "write the rest of it; is the file whole?",
            ));
        };
        if keywords::is_keyword(token.text) {
            return Err(self.error(
                token.spot,
                format!("{} needs {}, but {} comes after {}", of.text, needs(), token.text, had()),
                format!("write the missing numbers before {}", token.text),
            ));
        }
        let value = read(token.text).map_err(|bad| self.error(token.spot, bad.message, bad.help))?;
        self.lexer.next();
        Ok((value, token.spot))
    }

    /// A shape's fault, if any, told at the part it lies in, else at the object's keyword.
    fn checked(
        &self,
        token: &Token<'a>,
        fault: Result<(), BadShape>,
        part: impl Fn(usize) -> Spot,
    ) -> Result<(), SceneError> {
        fault.map_err(|fault| {
            let spot = fault.part.map_or(token.spot, part);
            self.error(spot, format!("{} {}", token.text, fault.message), fault.help)
        })
    }
}

/// A unit sphere or cylinder, as it stands before its attributes.
fn unit([columns, rows]: [u32; 2]) -> Curved {
    Curved { map: DAffine3::IDENTITY, inward: false, columns, rows }
}

/// How far a list of groups of three was read: `2`, or `2 and 1 number`.
fn in_groups(groups: usize, rest: usize, one: &str, many: &str) -> String {
    match rest {
        0 if groups == 0 => "it".to_owned(),
        0 => groups.to_string(),
        1 if groups == 0 => format!("1 {one}"),
        1 => format!("{groups} and 1 {one}"),
        _ if groups == 0 => format!("{rest} {many}"),
        _ => format!("{groups} and {rest} {many}"),
    }
}
