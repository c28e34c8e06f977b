//! English.

use radiosity::bake::BakeError;
use radiosity::patches::SubdivideError;
use radiosity::solve::SolveError;

use super::{Language, Named, Texts};
use crate::action::Action;
use crate::quantities::{Quantity, Unit};

pub(super) const TEXTS: Texts = Texts {
    action,
    quantity,
    unit: |unit| match unit {
        Unit::Light => "in the unit of CE",
        Unit::Area => "scene unit²",
        Unit::None => "no unit",
    },
    bake_error,

    menu_file: "File",
    menu_recent: "Open recent",
    no_recent: "Nothing yet",
    menu_radiosity: "Radiosity",
    menu_method: "Method",
    menu_precision: "Hemicube precision",
    menu_subdivision: "Subdivision",
    menu_view: "View",
    menu_show: "Show",
    menu_exposure: "Exposure",
    menu_tone: "Tone curve",
    menu_panels: "Panels",
    menu_language: "Language",
    menu_help: "Help",
    stop: "Stop",
    resume: "Resume",

    welcome: "Open a scene",
    welcome_how: "Drop a scene (.scn, .obj, .gltf, .glb) here, or press Ctrl+O.\nThen right-click and choose Radiosity (Gauss-Seidel).",
    ready: |patches| format!("{patches} patches. Right-click and choose Radiosity (Gauss-Seidel)."),
    reading: |file| format!("Reading {file}"),
    rows: |done, total| format!("Form factors: {done} of {total} rows"),
    sweeps: |done, residual| format!("Gauss-Seidel: sweep {done}, residual {residual}"),
    shots: |done, residual, rows, total| {
        format!("Progressive: shot {done}, unshot {residual}, {rows} of {total} rows")
    },
    looks: |done, total| format!("Error estimate: {done} of {total} looks"),
    correction: |done, total| format!("Correction: {done} of {total} places"),
    left: |time| format!("{time} left"),
    paused: "Stopped; Space goes on",
    done: |patches, sweeps, time| {
        format!("{patches} patches, {sweeps} {}, {time}", if sweeps == "1" { "sweep" } else { "sweeps" })
    },
    done_shots: |patches, shots, time| format!("{patches} patches, {shots} shots, {time}"),
    within: |percent| format!("within {percent} %"),
    seconds: |number| format!("{number} s"),

    trouble_scene: "This scene cannot be opened",
    trouble_kept: "The last good scene is kept.",
    trouble_solve: "The radiosity cannot be found",
    trouble_bug: "This is a fault of the program, not of the scene; please report it",
    trouble_save: "It could not be saved",
    what_to_do: "What to do",
    close: "Close",
    cancel: "Cancel",
    ok: "OK",
    warnings: "Warnings",
    saved: |file| format!("Saved {file}"),
    saving: "Saving",
    not_solved: "There is no solution to save yet: right-click and choose Radiosity (Gauss-Seidel) first.",
    no_scene: "There is no scene yet: press Ctrl+O.",

    panel_display: "What is shown",
    panel_materials: "Lights and materials",
    panel_patch: "Patch",
    panel_hemicube: "Hemicube",
    panel_residual: "Residual",

    quantity_label: "Quantity",
    colour_map: "Colours",
    colour_map_name: |name| name,
    logarithmic: "Logarithmic",
    fixed_range: "Fixed range",
    from: "from",
    to: "to",
    exposure: "Exposure",
    stops: "EV",
    tone: "Tone curve",
    back_faces: "Back faces",
    back_faces_lit: "lit",
    back_faces_black: "black",
    back_faces_marked: "marked",
    back_faces_hidden: "hidden",
    field_of_view: "Field of view",
    only_false_colours: "This quantity is a number: it is shown in false colours.",

    click_a_patch: "Click on a surface.",
    patch: "Patch",
    object: "Object",
    place: "In the file",
    line_column: |line, column| format!("line {line}, column {column}"),
    centre: "Centre",
    normal: "Normal",
    area: "Area",
    row_sum: "Row sum",
    unknown: "not yet known",
    sees_most: "Sees most",
    sees_nothing: "Sees nothing.",
    seen_from_behind: "seen from behind",

    cells_see: "What each cell sees",
    cells_weigh: "What each cell weighs",
    cell: |patch, weight| format!("patch {patch}, weight {weight}"),
    cell_empty: |weight| format!("nothing, weight {weight}"),

    sweep: "sweep",
    round: "round of shots",
    residual: "residual",
    no_residual: "No solution yet.",

    lights: "Lights",
    surfaces: "Surfaces",
    one_by_one: "One by one",
    one_by_one_hint: "List every surface; else surfaces of the same material stand together",
    on_off: "Switch this light on or off",
    emission: "Emission",
    intensity: "Intensity: the largest channel of the emission, in the unit of CE",
    reflectance: "Reflectance",
    group: |surfaces, _first, place| match surfaces {
        1 => format!("line {place}"),
        _ => format!("{surfaces} × line {place}…"),
    },

    picture_size: "Size",
    picture_samples: "Samples a pixel",
    as_on_screen: "As in the window",
    save: "Save…",
    path_prompt: "The system has no file dialog. Type the path:",
    path_hint: "path of the file",
    other_precision: "Hemicube precision",
    other_subdivision: "Subdivision factor",
    precision_even: "An even number of cells, from 2 to 4096",

    keys: "Keys and mouse",
    mouse: &[
        ("Drag", "turn about the scene"),
        ("Middle or right drag", "move the view"),
        ("Wheel", "come nearer, towards the pointer"),
        ("W A S D, Q E", "fly"),
        ("Right click", "the radiosity menu"),
        ("Click", "choose a patch"),
    ],
    scenes: "Scenes",
    pictures: "Pictures",
    solutions: "Solutions",
};

fn action(action: Action) -> Named {
    match action {
        Action::Open => ("Open…", "Open a scene file (.scn, .obj, .gltf, .glb)"),
        Action::OpenLast => ("Open the last one", "Open the scene that was open before this one"),
        Action::Reload => ("Reload", "Read the file again; the camera stays"),
        Action::SavePicture => ("Save picture…", "Save what is seen as PNG or EXR, in any size"),
        Action::SaveSolution => {
            ("Save solution…", "Save one row a patch (CSV, NumPy), a lit model (glTF) or a grid (VTK)")
        }
        Action::Quit => ("Quit", "Close the window"),
        Action::GaussSeidel => {
            ("Radiosity (Gauss-Seidel)", "Find all form factors, then sweep until nothing changes any more")
        }
        Action::Progressive => {
            ("Radiosity (progressive)", "Shoot the most unshot light first; a first picture comes at once")
        }
        Action::StopOrResume => {
            ("Stop or resume", "Stop the computation and keep what is done; once more goes on")
        }
        Action::MethodHemicube => {
            ("Hemicube", "The assignment's own: one hemicube of cells at the centre of each patch")
        }
        Action::MethodShares => (
            "Hemicube-exact",
            "Exact form factors times the share that four hemicubes see: nearly as accurate as exact",
        ),
        Action::MethodExact => {
            ("Exact", "Exact form factors with partial visibility: slower, and several times as accurate")
        }
        Action::Correct => (
            "Correct for uneven senders",
            "Find what patches hide that send light evenly, and send it after: for exact and hemicube-exact",
        ),
        Action::PrecisionQuick => ("30 × 30, quick", "A coarse hemicube, for a first look"),
        Action::PrecisionHandIn => ("100 × 100, hand-in", "The precision that the assignment asks for"),
        Action::PrecisionFine => ("200 × 200, fine", "Four times the cells of the hand-in precision"),
        Action::PrecisionOther => ("Other precision…", "Any even number of cells"),
        Action::SubdivisionHalf => ("× 0.5", "Half as many patches each way"),
        Action::SubdivisionOne => ("× 1, as written", "As many patches as the file says"),
        Action::SubdivisionTwo => ("× 2", "Twice as many patches each way"),
        Action::SubdivisionOther => ("Other factor…", "Any factor above 0"),
        Action::Split => {
            ("Split where surfaces meet", "Patches end where a wall stands on them: no light leaks past it")
        }
        Action::ResetMaterials => ("Reset materials", "Emission and reflectance as the file has them"),
        Action::FrameAll => ("Frame all", "Bring the whole scene into view"),
        Action::ResetCamera => ("Reset the camera", "The author's view, from the .vsn beside the scene"),
        Action::Smooth => {
            ("Smooth shading", "Blend the light between patches; else each patch shows its own")
        }
        Action::Edges => ("Patch edges", "Draw the edges of the patches"),
        Action::Wireframe => ("Wireframe", "Draw nothing but the edges"),
        Action::Normals => ("Normals", "Draw the normal of each patch"),
        Action::BackFaces => ("Back faces", "Lit like the front, black, marked or hidden, in turn"),
        Action::FalseColours => ("False colours", "Show numbers by a scale of colours, with a legend"),
        Action::ExposureUp => ("Brighter", "Raise the exposure by a third of a stop"),
        Action::ExposureDown => ("Darker", "Lower the exposure by a third of a stop"),
        Action::AutoExposure => ("Automatic exposure", "Find the exposure from the solution"),
        Action::ToneNeutral => ("Neutral tone curve", "True colours, softly compressed above white"),
        Action::ToneReinhard => {
            ("Reinhard tone curve", "Compress all that is bright, as Reinhard's operator does")
        }
        Action::ToneLinear => ("Linear, clipped", "Compress nothing; what is beyond white is clipped"),
        Action::Show(shown) => quantity(shown),
        Action::DisplayPanel => ("Panel: what is shown", "Quantity, scale and exposure"),
        Action::MaterialsPanel => {
            ("Panel: lights and materials", "Change emission and reflectance; the light follows")
        }
        Action::PatchPanel => ("Panel: patch", "All numbers of the patch that was clicked upon"),
        Action::HemicubePanel => {
            ("Panel: hemicube", "What the chosen patch sees, through each cell of its hemicube")
        }
        Action::ResidualPanel => ("Panel: residual", "How the residual shrinks, sweep by sweep"),
        Action::English => ("English", "Speak English"),
        Action::French => ("Français", "Parler français"),
        Action::Help => ("Keys and mouse", "List every key"),
    }
}

fn quantity(quantity: Quantity) -> Named {
    match quantity {
        Quantity::Radiosity => ("Radiosity", "B: all the light that leaves a patch"),
        Quantity::Irradiance => ("Irradiance", "H: all the light that arrives at a patch"),
        Quantity::Emission => ("Emission", "E: the light that a patch sends out by itself"),
        Quantity::Reflectance => ("Reflectance", "ρ: the share that a patch sends back"),
        Quantity::Direct => ("Direct light", "E + ρ Σ F E: what one would see without interreflection"),
        Quantity::Indirect => ("Indirect light", "What interreflection adds to the direct light"),
        Quantity::Area => ("Patch area", "The area of each patch"),
        Quantity::Closure => {
            ("Closure error", "Row sum − 1: zero where the scene is closed and nothing leaks")
        }
        Quantity::FormFactors => {
            ("Form factors", "F of the patch that was clicked upon: the share it sends to each other")
        }
        Quantity::Error => {
            ("Error", "How far B may be off, at 19 patches of 20; takes as long as the form factors did")
        }
    }
}

fn bake_error(error: &BakeError, language: Language) -> String {
    match error {
        BakeError::Subdivide(SubdivideError::TooMany { patches }) => format!(
            "{} patches are more than can be numbered. Choose a smaller subdivision factor.",
            language.number(*patches as f64, 3)
        ),
        BakeError::Subdivide(SubdivideError::BadFactor) => {
            "The subdivision factor must be a number above 0.".into()
        }
        BakeError::Subdivide(SubdivideError::BadSize) => {
            "The size of patches must be a number above 0.".into()
        }
        BakeError::Subdivide(SubdivideError::TooFew { asked, least }) => format!(
            "The scene cannot be cut into as few as {} patches: it takes at least {}.",
            language.count(*asked as usize),
            language.count(*least as usize)
        ),
        BakeError::Subdivide(SubdivideError::BadGrading) => "Patches cannot be graded so often.".into(),
        BakeError::Memory { patches, needed_gb, limit_gb } => format!(
            "{} patches would need about {} GB, and the limit is {} GB. Choose a smaller subdivision factor.",
            language.count(*patches as usize),
            language.number(*needed_gb, 3),
            language.number(*limit_gb, 3)
        ),
        BakeError::Solve(SolveError::Diverges { iterations, residual, max_reflectance }) => format!(
            "After {} iterations the residual is {} and no longer shrinks: the scene reflects more than it receives. \
             Make every reflectance less than 1; the largest is {}.",
            language.count(*iterations),
            language.number(*residual, 3),
            language.number(*max_reflectance, 4)
        ),
        BakeError::BadRequest(message) => message.clone(),
        other => other.to_string(),
    }
}
