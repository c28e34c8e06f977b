//! N3D's scene files (.scn) and views (.vsn).
//!
//! N3D is the graphics kernel of Université de Sherbrooke's courses; its radiosity assignment is what this
//! project grew from. A scene is a list of objects, each a keyword, its numbers, its attributes and `ID`:
//!
//! ```text
//! QD 4 8                       # a rectangle of 4 x 8 patches, facing +z
//!   0 0 0  1 0 0  1 2 0  0 2 0
//! CE 20 20 20                  // it shines
//! ID
//! ```
//!
//! # What is read
//! `QD`, `PG`, `TI`, `SP`, `CL`, `FR`, `VO`, and `OC` around any of them; `PT` and `SG`, which have no area, are
//! left out with a warning, and `PL`, which has no end, is refused by name. All attributes are read. Several objects may
//! stand side by side; N3D itself reads one.
//!
//! Words are separated by white space; `#` and `//` begin comments that end with the line. Files may be
//! UTF-8 or Latin-1, with lines ended by LF, CR LF or CR; a byte-order mark at the beginning and a Ctrl-Z at the
//! end are left out.
//!
//! # Conventions
//! Where N3D's rule is known it is kept. What follows is inferred from its files, or our own choice:
//!
//! - **Coefficients.** A child's own definition goes before its composite's, a later one before an earlier.
//!   `GD g` is `CD g g g`. `CD`, `GD` and `CE` must not be negative; reflectances above 1 are kept for the solver
//!   to judge.
//! - **Transforms** act in file order, those of a composite after those of its parts. `RT` is in radians and
//!   right-handed. `HO` multiplies distances from the point along the vector, and only along it. `CZ point u
//!   w` moves x by ((x - point) · u/|u|) w. `AV` is the smallest turn about the origin; between opposite
//!   vectors it is half a turn about the first x the coordinate axis farthest from it. `MA` is three rows
//!   of three coefficients and an offset, acting on columns; its second half, the inverse, is only compared.
//!   What would flatten an object is refused.
//! - **Mirrors** keep the author's front the front: polygons and meshes are wound the other way (their first
//!   corner stays the first), a parallelogram keeps u and v, and with them the numbers of its patches, and
//!   turns its normal.
//! - **`HD`** (hidden) is an editor's flag: the object takes part, and a warning says so. **`LK`** means nothing here.
//! - **`PG`** ends when its first point comes again, equal as numbers.
//! - **`QD`** takes its third point at its word, where N3D ignores it: four corners that are no parallelogram's, flat or
//!   not, are joined by straight lines between opposite sides (bilinear). They must be convex.
//! - **`SP`** and **`CL`** are the unit shapes, and the front is their outside, also where a mirror acts. Two attributes are
//!   ours, not N3D's: **`NM n m`** cuts them into n patches once around by m from pole to pole (the poles at -y and +y),
//!   or along the axis, 24 by 12 and 24 by 4 without it; **`IN`** makes the inside the front, as of a room.
//! - **`FR depth roughness seed`** and three points: the meaning of the three numbers is ours. As often as `depth`, 0 to 8,
//!   each triangle becomes four over the middles of its edges; a middle is moved any way by up to `roughness`, 0 to .5,
//!   of its edge's length, as the edge's ends and `seed` have it. So two `FR` of one seed that share an edge, as written,
//!   share all of it.
//! - **`VO`**'s first three numbers must be numbers, and are not used.
//!
//! # Limits
//! Files of 1 GiB; numbers up to 1e15, and surfaces of a size from 1e-15 to 1e15; 10,000 patches a side of a
//! `QD`, `SP` or `CL`; 2,000 points of a `PG`; composites 1,000 deep. A `PG` is flat within 1e-4 of its diameter. A `QD`
//! whose third point is that of a parallelogram within 1e-4 of the longest side is that parallelogram. Reading takes time
//! linear in the file's length, but for `FR`, which may make 4,000,000 triangles in all.

mod check;
mod fractal;
mod keywords;
mod lexer;
mod parser;
mod resolve;
mod transform;
mod view;

use std::path::Path;

use super::{Camera, Scene, SceneError, Warning, file, number, source, suggest};
use source::Source;

/// Read NAME.scn, and NAME.vsn where it stands beside it.
///
/// The two names may differ in upper and lower case, as in archives from Windows.
///
/// # Errors
/// The first thing wrong in either file, with its place and the cure.
pub fn read(path: &Path) -> Result<Scene, SceneError> {
    let mut scene = parse_scene(&path.display().to_string(), &file::bytes(path, "scn")?)?;
    add_view_beside(path, &mut scene)?;
    Ok(scene)
}

/// Give a scene the camera of the .vsn that stands beside its file, where one does.
pub(super) fn add_view_beside(path: &Path, scene: &mut Scene) -> Result<(), SceneError> {
    if let Some(beside) = file::view_beside(path) {
        let (camera, warnings) = view(&beside.display().to_string(), &file::bytes(&beside, "vsn")?)?;
        scene.camera = Some(camera);
        scene.warnings.extend(warnings);
    }
    Ok(())
}

/// Read a .vsn file: the camera alone.
///
/// # Errors
/// The first thing wrong in it, with its place and the cure.
pub fn read_view(path: &Path) -> Result<Camera, SceneError> {
    parse_view(&path.display().to_string(), &file::bytes(path, "vsn")?)
}

/// The scene that the bytes of a .scn file describe, without a camera. `name` is what messages call the file.
///
/// # Errors
/// The first thing wrong in it, with its place and the cure: always [`SceneError::Syntax`].
///
/// ```
/// use radiosity::scene::n3d::parse_scene;
///
/// let scene = parse_scene("lamp.scn", b"QD 4 8  0 0 0  1 0 0  1 2 0  0 2 0  CE 20 20 20 ID").unwrap();
/// assert_eq!(scene.surfaces[0].material.emission.r, 20.0);
///
/// let error = parse_scene("lamp.scn", b"QD 4 8  0 0 0  1 0 0  1 2 0").unwrap_err();
/// assert_eq!(error.to_string(), "lamp.scn:1:1: QD needs 4 points, the file ends after 3");
/// ```
pub fn parse_scene(name: &str, bytes: &[u8]) -> Result<Scene, SceneError> {
    parser::parse(&Source::new(name, bytes)?)
}

/// The camera that the bytes of a .vsn file describe. `name` is what messages call the file.
///
/// # Errors
/// The first thing wrong in it, with its place and the cure: always [`SceneError::Syntax`].
pub fn parse_view(name: &str, bytes: &[u8]) -> Result<Camera, SceneError> {
    view(name, bytes).map(|(camera, _)| camera)
}

/// A view's camera, and what of it plays no part.
fn view(name: &str, bytes: &[u8]) -> Result<(Camera, Option<Warning>), SceneError> {
    let view = view::parse(&Source::new(name, bytes)?)?;
    let warning = view.lights.map(|(spot, count)| Warning {
        file: name.to_owned(),
        place: spot.place,
        message: format!(
            "{count} point light{} left out: in radiosity, light comes from objects with CE",
            if count == 1 { " is" } else { "s are" }
        ),
    });
    Ok((view.camera, warning))
}
