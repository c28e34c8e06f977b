//! What was typed. Each value is checked by itself here; what the values mean together is [`crate::job`]'s.

use std::ffi::OsString;
use std::path::PathBuf;

use clap::{Args, Parser, Subcommand, ValueEnum};
use radiosity::form_factors::hemicube::PRECISIONS;
use radiosity::form_factors::shares::{DEFAULT_EYES, EYES};
use radiosity::form_factors::visible::{ACCURACIES, DEFAULT_ACCURACY};
use radiosity::light::Rgb;
use radiosity::patches::MOST_GRADING;
use radiosity::shade::{MAX_ATLAS_SIDE, MAX_PICTURE_PIXELS, MAX_PICTURE_SIDE, MIN_ATLAS_SIDE};

/// Radiosity of diffuse scenes: light that bounces between matt surfaces until it settles
#[derive(Debug, Parser)]
#[command(name = "radiosity", version, propagate_version = true)]
#[command(after_help = "Example: radiosity render scenes/cornell.scn -o cornell.png\n\
    'radiosity help COMMAND' tells each command's options.\n\
    Exit code: 0 done, 1 failed, 2 wrong usage, 130 interrupted.")]
pub(crate) struct Typed {
    #[command(subcommand)]
    pub(crate) command: Command,
}

#[derive(Debug, Subcommand)]
pub(crate) enum Command {
    Render(Render),
    Solve(Solve),
    Factors(Factors),
    Info(Info),
    Check(Check),
    Validate(Validate),
    View(View),
}

/// Solve a scene and make a picture of it
#[derive(Debug, Args)]
#[command(after_help = "\
Examples:
  radiosity render cornell.scn -o cornell.png
  radiosity render cornell.scn -o cornell.exr --size 1920x1080 --precision 200 --subdivision 2

A .png is tone-mapped to 8 bits; a .exr holds the light itself, linear and in the scene's own unit.
Without --camera the view is NAME.vsn beside NAME.scn (or .obj, .gltf, .glb), else the camera in a .gltf or .glb or,
where there is none, one that shows the whole scene.")]
pub(crate) struct Render {
    /// Also estimate by how much the light may be off, for the summary and --report; takes about as long again as
    /// the form factors, by exact less
    #[arg(long, help_heading = "Computation")]
    pub(crate) error: bool,

    #[command(flatten)]
    pub(crate) target: Target,

    /// The picture to write; its ending, .png or .exr, tells the format
    #[arg(short, long, value_name = "PICTURE")]
    pub(crate) output: PathBuf,

    /// Width and height in pixels
    #[arg(long, value_name = "WxH", default_value = "800x600", value_parser = size)]
    #[arg(help_heading = "Picture")]
    pub(crate) size: Size,

    /// View to look from, in place of the scene's own
    #[arg(long, value_name = "FILE.vsn", help_heading = "Picture")]
    pub(crate) camera: Option<PathBuf>,

    /// smooth: blended between patches; flat: each patch in its one colour; gather: found anew at every point, the
    /// lamps' light exactly and past what hides it (slower; crisp shadows however coarse the patches)
    #[arg(long, value_enum, default_value_t, help_heading = "Picture")]
    pub(crate) shading: Shading,

    /// Exposure in stops: +1 doubles the brightness of a .png [default: chosen from the picture]
    #[arg(long, value_name = "EV", value_parser = finite, allow_negative_numbers = true)]
    #[arg(help_heading = "Picture")]
    pub(crate) exposure: Option<f64>,

    /// How light is brought into the range of a .png: neutral keeps colours and rolls off highlights,
    /// reinhard is L/(1+L), linear clips what is too bright [default: neutral]
    #[arg(long, value_name = "CURVE", value_enum, help_heading = "Picture")]
    pub(crate) tone_curve: Option<ToneCurve>,

    #[command(flatten)]
    pub(crate) common: Common,
}

/// Solve a scene and write its light: a row of numbers for each patch, or a model to walk about in
#[derive(Debug, Args)]
#[command(after_help = "\
Examples:
  radiosity solve office.scn -o office.csv
  radiosity solve office.scn -o office.npz --subdivision 2 --report office.json
  radiosity solve cornell.scn -o cornell.csv --error       how far can it be off?
  radiosity solve cornell.scn -o cornell.csv --target-error 5%   finer patches where that is most
  radiosity solve room.gltf -o lit.glb                     the light in it, for any viewer
  radiosity solve room.gltf -o lit.glb --light-map 1024    as a texture of at most 1024 x 1024

A .csv has the columns patch,object,x,y,z,nx,ny,nz,area, then emission, reflectance and radiosity, each
_r,_g,_b, and with --error then error, which the true error of about 95 % of patches is within. With --target-error
there is a last column, parent: the patch it is (part of) where nothing is refined. A .npz has the same as NumPy arrays:
centre, normal, area, emission, reflectance, radiosity, object.
A .vtu has the patches as cells with those and the irradiance, for ParaView. A .glb or .gltf (one file, its numbers
within) shows the light in any viewer: vertex colours as 'render' would have them, unlit, and the radiosities
themselves as _RADIOSITY; read again as a scene it gives the scene that was solved. With --light-map its colours are
those of a texture within the file, on TEXCOORD_1, and --irradiance-map and --radiosity-map write the light on the same
coordinates, for engines that have materials of their own.
Emission and radiosity are power per area, in the scene's own unit; reflectance has none.")]
pub(crate) struct Solve {
    /// Also estimate by how much each radiosity may be off, for the table, the summary and --report; takes about as long
    /// again as the form factors, by exact less
    #[arg(long, help_heading = "Computation")]
    pub(crate) error: bool,

    #[command(flatten)]
    pub(crate) target: Target,

    #[command(flatten)]
    pub(crate) common: Common,

    /// The file to write; its ending, .csv, .npz, .glb, .gltf or .vtu, tells the format
    #[arg(short, long, value_name = "SOLUTION")]
    pub(crate) output: PathBuf,

    /// View to put into a .glb or .gltf, in place of the scene's own
    #[arg(long, value_name = "FILE.vsn", help_heading = "Picture")]
    pub(crate) camera: Option<PathBuf>,

    /// Exposure in stops of the colours of a .glb or .gltf [default: chosen from the light]
    #[arg(long, value_name = "EV", value_parser = finite, allow_negative_numbers = true)]
    #[arg(help_heading = "Picture")]
    pub(crate) exposure: Option<f64>,

    /// Their tone curve, as of render [default: neutral]
    #[arg(long, value_name = "CURVE", value_enum, help_heading = "Picture")]
    pub(crate) tone_curve: Option<ToneCurve>,

    /// In place of vertex colours, a texture of at most so many texels a side, in the .glb or .gltf; every surface has
    /// texels of its own, as many a unit of length as fit
    #[arg(long, value_name = "TEXELS", value_parser = clap::value_parser!(u32).range(ATLAS_SIDES))]
    #[arg(allow_negative_numbers = true, help_heading = "Light map")]
    pub(crate) light_map: Option<u32>,

    /// Also write the irradiance H, all that arrives: linear, in the scene's unit, on the same texels
    #[arg(long, value_name = "FILE.exr", requires = "light_map", help_heading = "Light map")]
    pub(crate) irradiance_map: Option<PathBuf>,

    /// Also write the radiosity B, all that leaves, likewise
    #[arg(long, value_name = "FILE.exr", requires = "light_map", help_heading = "Light map")]
    pub(crate) radiosity_map: Option<PathBuf>,
}

/// Sides of a light map.
const ATLAS_SIDES: std::ops::RangeInclusive<i64> = MIN_ATLAS_SIDE as i64..=MAX_ATLAS_SIDE as i64;

/// Write the form factors themselves, as a sparse matrix
#[derive(Debug, Args)]
#[command(after_help = "\
Example:
  radiosity factors cornell.scn -o F.npz

In Python, F = scipy.sparse.load_npz('F.npz'): F[i, j] is the share of the energy leaving patch i that
arrives at patch j; each row sums to 1 in a closed scene. With --repair it is float64, and sums to 1 and
A[i] F[i, j] = A[j] F[j, i] hold to the last digits.")]
pub(crate) struct Factors {
    #[command(flatten)]
    pub(crate) common: Common,

    /// The matrix to write, a .npz of compressed sparse rows (CSR)
    #[arg(short, long, value_name = "F.npz")]
    pub(crate) output: PathBuf,

    /// Add a last column: the share of each patch's energy that leaves the scene
    #[arg(long)]
    pub(crate) with_surroundings: bool,
}

/// Tell what is in a scene, and what solving it would need
#[derive(Debug, Args)]
#[command(after_help = "\
Examples:
  radiosity info cornell.scn
  radiosity info cornell.scn --subdivision 4      what would a finer mesh cost?
  radiosity info cornell.scn --patches 10000      how fine would so many patches be?
  radiosity info cornell.scn --json | jq .need")]
pub(crate) struct Info {
    #[command(flatten)]
    pub(crate) common: Common,

    /// Print JSON, for scripts
    #[arg(long)]
    pub(crate) json: bool,
}

/// Tell whether a scene and its light can be trusted: gaps, duplicates, closure, reciprocity, energy
#[derive(Debug, Args)]
#[command(after_help = "\
Examples:
  radiosity check cornell.scn
  radiosity check room.gltf --patches 2000 --json | jq '.findings[] | select(.verdict == \"wrong\")'

Each line is ok, a note, or WRONG with what to do about it. Exit code: 1 when something is wrong.")]
pub(crate) struct Check {
    #[command(flatten)]
    pub(crate) common: Common,

    /// Print JSON, for scripts
    #[arg(long)]
    pub(crate) json: bool,
}

/// Put this program to scenes whose answers are known, and report what it makes of them
#[derive(Debug, Args)]
#[command(after_help = "\
Examples:
  radiosity validate                          to the terminal
  radiosity validate -o validation.md         as a page of Markdown

Form factors of rectangles, polygons, discs, spheres and cylinders, in sight and partly hidden; furnaces, spheres, a cube.
Exit code: 1 when anything is beyond its bound.")]
pub(crate) struct Validate {
    /// The page to write, a .md, and a .svg beside it [default: to the terminal, without the picture]
    #[arg(short, long, value_name = "REPORT.md")]
    pub(crate) output: Option<PathBuf>,

    /// Fewer methods and coarser scenes
    #[arg(long)]
    pub(crate) quick: bool,

    /// Worker threads; the answer does not depend on it [default: one a core]
    #[arg(long, value_name = "N", value_parser = clap::value_parser!(u16).range(1..=1024))]
    #[arg(allow_negative_numbers = true)]
    pub(crate) threads: Option<u16>,

    /// Only errors beside the report
    #[arg(short, long)]
    pub(crate) quiet: bool,
}

/// Open a scene in a window (starts the program radiosity-viewer)
#[derive(Debug, Args)]
#[command(after_help = "\
Example:
  radiosity view cornell.scn --precision 50

The window is a program of its own, radiosity-viewer, looked for beside this one and then on the PATH.
Whatever follows 'view' is passed on to it; 'radiosity-viewer --help' tells its options.")]
pub(crate) struct View {
    /// The scene (.scn, .obj, .gltf, .glb), and options for the window
    #[arg(value_name = "SCENE", required = true, num_args = 1.., trailing_var_arg = true)]
    #[arg(allow_hyphen_values = true)]
    pub(crate) arguments: Vec<OsString>,
}

/// How well the light is to be known, for commands that solve.
#[derive(Clone, Copy, Debug, Args)]
pub(crate) struct Target {
    /// Of --method exact and hemicube-exact: find, from eight places within each patch, what is wrong because patches send light
    /// as if they were equally bright all over, and send it after; for some tenths more time a third or less of the error is left
    #[arg(long, help_heading = "Computation")]
    pub(crate) correct: bool,

    /// Quarter patches where the light is least well known, round by round, until at every point one value a patch is within
    /// this of it, as a root mean square: 2% or 0.02
    #[arg(long, value_name = "ERROR", value_parser = share, help_heading = "Refinement")]
    #[arg(allow_negative_numbers = true)]
    pub(crate) target_error: Option<f64>,

    /// Of --target-error: stop before there are more patches than this [default: 20000]
    #[arg(long, value_name = "N", requires = "target_error", help_heading = "Refinement")]
    #[arg(value_parser = clap::value_parser!(u64).range(1..), allow_negative_numbers = true)]
    pub(crate) most_patches: Option<u64>,

    /// Of --target-error: quarter no patch into narrower ones, in the scene's unit of length [default: a thousandth of
    /// the scene's longest side]
    #[arg(long, value_name = "LENGTH", requires = "target_error", help_heading = "Refinement")]
    #[arg(value_parser = positive, allow_negative_numbers = true)]
    pub(crate) smallest_patch: Option<f64>,
}

/// What every command that reads a scene understands.
#[derive(Debug, Args)]
pub(crate) struct Common {
    /// The scene to read (.scn, .obj, .gltf, .glb)
    #[arg(value_name = "SCENE")]
    pub(crate) scene: PathBuf,

    /// Cells along a side of the hemicube's top face; an even number
    #[arg(long, value_name = "N", default_value_t = 100, value_parser = even)]
    #[arg(help_heading = "Computation")]
    pub(crate) precision: u32,

    /// Multiply the n and m of every quadrilateral, sphere and cylinder by this
    #[arg(long, value_name = "FACTOR", default_value = "1.0", value_parser = positive)]
    #[arg(allow_negative_numbers = true, help_heading = "Computation")]
    pub(crate) subdivision: f64,

    /// Cut everything, polygons and meshes too, into patches with no edge longer than this, in the
    /// scene's unit of length, whatever n and m the file gives
    #[arg(long, value_name = "LENGTH", value_parser = positive, conflicts_with = "subdivision")]
    #[arg(allow_negative_numbers = true, help_heading = "Computation")]
    pub(crate) patch_size: Option<f64>,

    /// Cut everything into about so many patches of one size, whatever n and m the file gives
    #[arg(long, value_name = "N", value_parser = clap::value_parser!(u64).range(1..))]
    #[arg(conflicts_with_all = ["subdivision", "patch_size"], help_heading = "Computation")]
    #[arg(allow_negative_numbers = true)]
    pub(crate) patches: Option<u64>,

    /// Part patches where a wall stands on them or another surface crosses theirs, so that no light or
    /// shadow leaks to the other side [default: on with --patch-size and --patches, else off]
    #[arg(long, value_name = "HOW", value_enum, help_heading = "Computation")]
    pub(crate) split: Option<Split>,

    /// Where patches are split, also quarter them towards where surfaces meet, so many times over; each is
    /// about twice as long as the next nearer one
    #[arg(long, value_name = "HALVINGS", default_value_t = 0)]
    #[arg(value_parser = clap::value_parser!(u32).range(..=i64::from(MOST_GRADING)))]
    #[arg(allow_negative_numbers = true, help_heading = "Computation")]
    pub(crate) grading: u32,

    /// Stop when a sweep changes the radiosities by no more than this, as the root of the sum of squares
    #[arg(long, value_name = "EPSILON", default_value = "1e-6", value_parser = positive)]
    #[arg(allow_negative_numbers = true, help_heading = "Computation")]
    pub(crate) epsilon: f64,

    /// How form factors are found: hemicube fills its cells by an item buffer, hemicube-rays by a ray
    /// each (slow; a check on the other), exact integrates over both patches and weighs what is seen (reciprocal,
    /// and far more accurate; has --accuracy for --precision), hemicube-exact integrates too, but has several
    /// hemicubes tell what is seen, lamps apart (nearly as accurate, and in furnished rooms two to three times as fast)
    #[arg(long, value_enum, default_value_t, help_heading = "Computation")]
    pub(crate) method: Method,

    /// Of --method hemicube-exact: hemicubes along each side of a patch; they share the cells of --precision
    #[arg(long, value_name = "N", default_value_t = DEFAULT_EYES)]
    #[arg(value_parser = clap::value_parser!(u32).range(i64::from(*EYES.start())..=i64::from(*EYES.end())))]
    #[arg(allow_negative_numbers = true, help_heading = "Computation")]
    pub(crate) eyes: u32,

    /// Of --method exact: by how much the form factors of a patch, together, may be off where others are partly
    /// hidden from it, as a standard deviation (each by about this times its own root); of hemicube-exact, the same of lamps
    #[arg(long, value_name = "SHARE", default_value_t = DEFAULT_ACCURACY, value_parser = accuracy)]
    #[arg(allow_negative_numbers = true, help_heading = "Computation")]
    pub(crate) accuracy: f64,

    /// How the equation is solved: gauss-seidel gathers patch by patch, progressive shoots the most unshot
    /// light first, cg (conjugate gradients, on form factors made symmetric) takes the fewest steps where
    /// much is reflected, jacobi adds a bounce of light a step
    #[arg(long, value_enum, default_value_t, help_heading = "Computation")]
    pub(crate) solver: Solver,

    /// What a patch is from behind: black blocks light and reflects none, lit is the patch itself, as in
    /// N3D [default: what the scene says; a .scn says lit, models say black]
    #[arg(long, value_name = "HOW", value_enum, help_heading = "Computation")]
    pub(crate) back_faces: Option<BackFaces>,

    /// Make form factors keep reciprocity and closure to the last digit: averages of both ways, each then changed
    /// as little as closes every row
    #[arg(long, help_heading = "Computation")]
    pub(crate) repair: bool,

    /// What lies about an open scene, all alike: its radiosity, as one number or as R,G,B, or its temperature as a black
    /// body, as in 293K, in W/m² [default: 0]
    #[arg(long, value_name = "B", value_parser = surroundings, default_value = "0", hide_default_value = true)]
    #[arg(allow_negative_numbers = true, help_heading = "Computation")]
    pub(crate) surroundings: Rgb,

    /// Worker threads; the answer does not depend on it [default: one a core]
    #[arg(long, value_name = "N", value_parser = clap::value_parser!(u16).range(1..=1024))]
    #[arg(allow_negative_numbers = true, help_heading = "Running")]
    pub(crate) threads: Option<u16>,

    /// Memory to keep within, in GB of 10^9 bytes: form factors that do not fit are recomputed for every step
    /// of the solver [default: 3/4 of the machine's]
    #[arg(long, value_name = "GB", value_parser = positive)]
    #[arg(allow_negative_numbers = true, help_heading = "Running")]
    pub(crate) memory_limit: Option<f64>,

    /// Also write what was done, with times and residuals, as JSON
    #[arg(long, value_name = "FILE.json", help_heading = "Running")]
    pub(crate) report: Option<PathBuf>,

    /// No progress bar, summary or warnings: only errors
    #[arg(short, long, help_heading = "Running")]
    pub(crate) quiet: bool,
}

// The values are told in the help of their option, where they stand together: no doc comments here, for clap
// would make a second, longer help of them.

#[derive(Clone, Copy, Debug, Default, ValueEnum)]
pub(crate) enum Method {
    #[default]
    Hemicube,
    HemicubeRays,
    HemicubeExact,
    Exact,
}

#[derive(Clone, Copy, Debug, Default, ValueEnum)]
pub(crate) enum Solver {
    #[default]
    GaussSeidel,
    Progressive,
    Cg,
    Jacobi,
}

#[derive(Clone, Copy, Debug, PartialEq, Eq, ValueEnum)]
pub(crate) enum Split {
    On,
    Off,
}

#[derive(Clone, Copy, Debug, ValueEnum)]
pub(crate) enum BackFaces {
    Black,
    Lit,
}

#[derive(Clone, Copy, Debug, Default, ValueEnum)]
pub(crate) enum Shading {
    #[default]
    Smooth,
    Flat,
    Gather,
}

#[derive(Clone, Copy, Debug, Default, ValueEnum)]
pub(crate) enum ToneCurve {
    #[default]
    Neutral,
    Reinhard,
    Linear,
}

/// The tone curve that was typed, or the default.
pub(crate) fn tone_curve(typed: Option<ToneCurve>) -> radiosity::shade::ToneCurve {
    match typed.unwrap_or_default() {
        ToneCurve::Neutral => radiosity::shade::ToneCurve::Neutral,
        ToneCurve::Reinhard => radiosity::shade::ToneCurve::Reinhard,
        ToneCurve::Linear => radiosity::shade::ToneCurve::Linear,
    }
}

/// What a value is called on the command line.
pub(crate) fn name(value: &impl ValueEnum) -> String {
    value.to_possible_value().map_or_else(String::new, |value| value.get_name().to_owned())
}

/// Width and height in pixels.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) struct Size {
    pub(crate) width: usize,
    pub(crate) height: usize,
}

fn size(typed: &str) -> Result<Size, String> {
    let side = |text: &str, what: &str| match text.parse::<usize>() {
        Ok(0) => Err(format!("the {what} must be at least 1 pixel")),
        Ok(pixels) if pixels <= MAX_PICTURE_SIDE => Ok(pixels),
        _ if !text.is_empty() && text.bytes().all(|b| b.is_ascii_digit()) => {
            Err(format!("the {what} can be at most {MAX_PICTURE_SIDE} pixels"))
        }
        _ => Err(format!("the {what} is no whole number: write both in pixels, as in 800x600")),
    };
    let Some((width, height)) = typed.split_once(['x', 'X', '×']) else {
        return Err("expected a width and a height in pixels, as in 800x600".into());
    };
    let (width, height) = (side(width, "width")?, side(height, "height")?);
    match width * height {
        pixels if pixels <= MAX_PICTURE_PIXELS => Ok(Size { width, height }),
        _ => Err(format!("a picture can have at most {MAX_PICTURE_PIXELS} pixels, as 16384x16384 has")),
    }
}

/// The Stefan-Boltzmann constant, in W/(m² K⁴) (CODATA 2018, exact to the digits given).
const STEFAN_BOLTZMANN: f64 = 5.670_374_419e-8;

fn surroundings(typed: &str) -> Result<Rgb, String> {
    let expected = "expected one number, three as in 0.2,0.3,0.5, or a temperature as in 293K";
    let number = |typed: &str| match finite(typed.trim()).map_err(|_| expected.to_owned())? {
        number if number >= 0.0 => Ok(number),
        _ => Err("must not be below 0".to_owned()),
    };
    if let Some(kelvin) = typed.strip_suffix(['K', 'k']) {
        let radiosity = STEFAN_BOLTZMANN * number(kelvin)?.powi(4);
        return if radiosity.is_finite() {
            Ok(Rgb::grey(radiosity))
        } else {
            Err("is too hot to tell".into())
        };
    }
    match typed.split(',').map(number).collect::<Result<Vec<_>, _>>()?[..] {
        [grey] => Ok(Rgb::grey(grey)),
        [r, g, b] => Ok(Rgb::new(r, g, b)),
        _ => Err(expected.into()),
    }
}

fn even(typed: &str) -> Result<u32, String> {
    match typed.parse::<u32>() {
        Ok(n) if n < *PRECISIONS.start() => Err(format!("must be at least {}", PRECISIONS.start())),
        Ok(n) if n > *PRECISIONS.end() => Err(format!("can be at most {}", PRECISIONS.end())),
        Ok(n) if n % 2 == 1 => {
            let (below, above) = (n - 1, n + 1);
            Err(format!("must be even, for the side faces are half as high: use {below} or {above}"))
        }
        Ok(n) => Ok(n),
        Err(_) => Err("expected an even whole number, as in 100".into()),
    }
}

fn finite(typed: &str) -> Result<f64, String> {
    match typed.parse::<f64>() {
        Ok(number) if number.is_finite() => Ok(number),
        _ => Err("expected a number".into()),
    }
}

fn accuracy(typed: &str) -> Result<f64, String> {
    let (least, most) = (ACCURACIES.start(), ACCURACIES.end());
    match finite(typed)? {
        number if ACCURACIES.contains(&number) => Ok(number),
        _ => Err(format!("must be from {least:e} to {most:e}")),
    }
}

/// A share below 1, in per cent or as it is.
fn share(typed: &str) -> Result<f64, String> {
    let share = match typed.strip_suffix('%') {
        Some(percent) => positive(percent.trim_end())? / 100.0,
        None => positive(typed)?,
    };
    match share {
        share if share < 1.0 => Ok(share),
        _ if typed.ends_with('%') => Err("must be below 100%".into()),
        _ => Err(format!("must be below 1: for {typed} per cent write {typed}%")),
    }
}

fn positive(typed: &str) -> Result<f64, String> {
    match finite(typed)? {
        number if number > 0.0 => Ok(number),
        _ => Err("must be above 0".into()),
    }
}

#[cfg(test)]
mod tests {
    use clap::CommandFactory;

    use super::*;

    #[test]
    fn the_arguments_are_consistent() {
        Typed::command().debug_assert();
    }

    #[test]
    fn sizes() {
        assert_eq!(size("800x600"), Ok(Size { width: 800, height: 600 }));
        assert_eq!(size("1X16384"), Ok(Size { width: 1, height: 16_384 }));
        for (typed, told) in [
            ("800", "a width and a height"),
            ("800x", "the height is no whole number"),
            ("x600", "the width is no whole number"),
            ("0x600", "the width must be at least 1"),
            ("800x0", "the height must be at least 1"),
            ("800x-600", "the height is no whole number"),
            ("8.5x6", "the width is no whole number"),
            ("800x600x3", "the height is no whole number"),
            ("99999x600", "the width can be at most 65535"),
            ("65535x65535", "at most 268435456 pixels"),
            ("800x99999999999999999999", "the height can be at most 65535"),
        ] {
            let message = size(typed).expect_err(typed);
            assert!(message.contains(told), "{typed}: {message}");
        }
    }

    #[test]
    fn precision_is_even() {
        assert_eq!(even("2"), Ok(2));
        assert!(even("101").is_err_and(|message| message.contains("100 or 102")));
        for typed in ["0", "1", "-2", "1e2", "", "5000", "99999999999"] {
            assert!(even(typed).is_err(), "{typed}");
        }
    }

    #[test]
    fn accuracies_make_sense() {
        assert_eq!(accuracy("1e-5"), Ok(1e-5));
        for typed in ["0", "-1e-5", "1", "nan"] {
            assert!(accuracy(typed).is_err(), "{typed}");
        }
    }

    #[test]
    fn a_share_is_told_either_way() {
        for typed in ["2%", "2 %", "0.02", "2e-2", "200e-2%"] {
            assert_eq!(share(typed), Ok(0.02), "{typed}");
        }
        assert!(share("2").is_err_and(|message| message.contains("2%")));
        for typed in ["", "%", "0", "0%", "-1%", "100%", "nan%", "two"] {
            assert!(share(typed).is_err(), "{typed}");
        }
    }

    #[test]
    fn surroundings_are_a_radiosity_or_a_temperature() {
        assert_eq!(surroundings("0.25"), Ok(Rgb::grey(0.25)));
        assert_eq!(surroundings("1, 2,3.5"), Ok(Rgb::new(1.0, 2.0, 3.5)));
        // A black body at 300 K: 459.3 W/m² by any table.
        assert!((surroundings("300K").unwrap().g - 459.300_327_939).abs() < 1e-6);
        assert_eq!(surroundings("0K"), Ok(Rgb::BLACK));
        for typed in ["", "-1", "-3K", "1,2", "1,2,3,4", "nan", "warm", "1,inf,2", "K", "1e99K"] {
            assert!(surroundings(typed).is_err(), "{typed}");
        }
    }

    #[test]
    fn numbers_are_finite() {
        assert_eq!(positive("1e-6"), Ok(1e-6));
        for typed in ["0", "-1", "nan", "inf", "1e999", "one"] {
            assert!(positive(typed).is_err(), "{typed}");
        }
        assert_eq!(finite("-2.5"), Ok(-2.5));
    }
}
