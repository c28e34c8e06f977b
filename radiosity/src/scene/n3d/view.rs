//! The grammar of .vsn files, and the camera that they describe.
//!
//! N3D's view stands on a line from its reference point PR along VN: the eye at PR + DO VN, the window's
//! plane through PR + DV VN, the clipping planes at DH and DY, all signed distances along VN. The window
//! spans Pmin..Pmax along right = VN x VH and Hmin..Hmax along up.

use glam::DVec3;

use super::keywords;
use super::lexer::{Lexer, Token};
use super::number;
use super::source::{Source, Spot};
use crate::scene::{Camera, SceneError};

/// Numbers of a point light: position, diffuse, ambient.
const LIGHT: usize = 9;
/// N3D's table of lights holds no more.
const MOST_LIGHTS: usize = 8;
/// Below this sine, VN and VH count as parallel.
const PARALLEL: f64 = 1e-6;

/// The quantities of a view in the order they are read: name, and how many numbers.
const QUANTITIES: [(&str, usize); 7] = [
    ("PR, the reference point,", 3),
    ("VN, the direction of view,", 3),
    ("VH, the upward vector,", 3),
    ("DO and DV, the distances of eye and window,", 2),
    ("the window", 4),
    ("the viewport", 4),
    ("DH and DY, the clipping distances,", 2),
];

/// A camera, and where its lights begin and how many there are.
pub(super) struct View {
    pub(super) camera: Camera,
    pub(super) lights: Option<(Spot, usize)>,
}

/// Read all of `source`.
pub(super) fn parse(source: &Source<'_>) -> Result<View, SceneError> {
    let mut reader = Reader { source, lexer: Lexer::new(source), last: None };
    let [pr, vn, vh, distances, window, viewport, clipping] = {
        let mut values = QUANTITIES.map(|_| Quantity { values: [0.0; 4], spots: [Spot::START; 4] });
        for (quantity, (name, count)) in values.iter_mut().zip(QUANTITIES) {
            for k in 0..count {
                (quantity.values[k], quantity.spots[k]) = reader.number(name, count, k)?;
            }
        }
        values
    };
    let lights = reader.lights()?;

    let refuse = |spot: Spot, message: &str, help: &str| Err(source.error(spot, message, help));
    let Some(forward) = vn.vector().try_normalize() else {
        return refuse(
            vn.spots[0],
            "VN, the direction of view, is zero",
            "give the direction in which the eye looks",
        );
    };
    let Some(upward) = vh.vector().try_normalize() else {
        return refuse(
            vh.spots[0],
            "VH, the upward vector, is zero",
            "give the direction that is up in the picture",
        );
    };
    let across = forward.cross(upward);
    if across.length() < PARALLEL {
        return refuse(
            vh.spots[0],
            "VH, the upward vector, is parallel to VN, the direction of view",
            "give an upward vector that points out of the line of sight",
        );
    }
    let right = across.normalize();
    let up = right.cross(forward);

    let [eye_at, window_at, ..] = distances.values;
    let away = window_at - eye_at;
    if away <= 0.0 {
        return refuse(
            distances.spots[1],
            "DV, the distance of the window, is not greater than DO, that of the eye",
            "the eye looks along VN through the window: give DO < DV, such as -1 0",
        );
    }
    let [left, right_edge, bottom, top] = window.values;
    if left >= right_edge || bottom >= top {
        let spot = if left >= right_edge { window.spots[1] } else { window.spots[3] };
        return refuse(
            spot,
            "the window is empty",
            "write it as Pmin Pmax Hmin Hmax, with Pmin < Pmax and Hmin < Hmax",
        );
    }
    const VIEWPORT: &str = "write it as Xmin Xmax Ymin Ymax in 0..1, such as 0 1 0 1";
    if let Some(k) = viewport.values.iter().position(|x| !(0.0..=1.0).contains(x)) {
        return refuse(viewport.spots[k], "the viewport reaches out of 0..1", VIEWPORT);
    }
    let [x_min, x_max, y_min, y_max] = viewport.values;
    if x_min >= x_max || y_min >= y_max {
        let spot = if x_min >= x_max { viewport.spots[1] } else { viewport.spots[3] };
        return refuse(spot, "the viewport is empty", VIEWPORT);
    }
    // Clipping planes behind the eye clip nothing.
    let [near, far] = [clipping.values[0] - eye_at, clipping.values[1] - eye_at];
    let near = near.max(0.0);
    if far <= near {
        let (message, help) = match far <= 0.0 {
            true => (
                "DY, the far clipping plane, lies behind the eye: nothing is seen",
                "distances are measured from PR along VN, as DO is: give DO < DY",
            ),
            false => ("DY, the far clipping plane, does not lie behind DH, the near one", "give DH < DY"),
        };
        return refuse(clipping.spots[1], message, help);
    }
    let camera = Camera {
        eye: pr.vector() + forward * eye_at,
        forward,
        right,
        up,
        horizontal: [left / away, right_edge / away],
        vertical: [bottom / away, top / away],
        near,
        far,
        viewport: viewport.values,
    };
    // Numbers that differ only in their last digits make a distance that nothing can be divided by.
    let extents = [camera.horizontal, camera.vertical];
    if !extents.iter().flatten().all(|x| x.abs() <= number::GREATEST) {
        return refuse(
            distances.spots[1],
            "DV, the distance of the window, is all but DO, that of the eye",
            "move the window away from the eye",
        );
    }
    Ok(View { camera, lights })
}

/// Up to four numbers that mean something together.
struct Quantity {
    values: [f64; 4],
    spots: [Spot; 4],
}

impl Quantity {
    fn vector(&self) -> DVec3 {
        DVec3::from_slice(&self.values[..3])
    }
}

struct Reader<'a> {
    source: &'a Source<'a>,
    lexer: Lexer<'a>,
    last: Option<Token<'a>>,
}

impl Reader<'_> {
    /// The number after `had` others of the quantity's `count`.
    fn number(&mut self, name: &str, count: usize, had: usize) -> Result<(f64, Spot), SceneError> {
        let Some(token) = self.lexer.next() else {
            // A view has no keywords; what there was last is what breaks off.
            let spot = self.last.map_or(Spot::START, |token| token.spot);
            let had = if had == 0 { "before them".to_owned() } else { format!("after {had}") };
            let message = match self.last {
                None => "the view holds no numbers: it begins with PR, the reference point".to_owned(),
                Some(_) => {
                    format!("{name} needs {count} numbers, the file ends {had}")
                }
            };
            let help =
                "a view is PR VN VH DO DV, window, viewport, DH DY: 21 numbers; then 0 to 8 lights of 9";
            return Err(self.source.error(spot, message, help));
        };
        let value = number::real(token.text).map_err(|bad| match keywords::is_keyword(token.text) {
            true => self.source.error(
                token.spot,
                format!("{} is not a number: views have no keywords", token.text),
                "is this a scene? Views are .vsn files, scenes .scn",
            ),
            false => self.source.error(token.spot, bad.message, bad.help),
        })?;
        self.last = Some(token);
        Ok((value, token.spot))
    }

    /// What follows the camera: whole lights, to the end of the file.
    fn lights(&mut self) -> Result<Option<(Spot, usize)>, SceneError> {
        let Some(first) = self.lexer.peek() else { return Ok(None) };
        let mut count = 0;
        while let Some(next) = self.lexer.peek() {
            if count == MOST_LIGHTS {
                return Err(self.source.error(
                    next.spot,
                    format!("{} after {MOST_LIGHTS} lights: a view has no more", next.quoted()),
                    "end the file here; radiosity takes its light from objects with CE",
                ));
            }
            count += 1;
            let name = format!("light {count}");
            for k in 0..LIGHT {
                self.number(&name, LIGHT, k)?;
            }
        }
        Ok(Some((first.spot, count)))
    }
}
