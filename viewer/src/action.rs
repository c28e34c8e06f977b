//! Everything a menu offers, each with its key. What each is called stands in `language`.

use eframe::egui::{Key, KeyboardShortcut, Modifiers};

use crate::quantities::Quantity;

/// Something that can be asked for by menu or key.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) enum Action {
    Open,
    OpenLast,
    Reload,
    SavePicture,
    SaveSolution,
    Quit,
    GaussSeidel,
    Progressive,
    StopOrResume,
    MethodHemicube,
    MethodShares,
    MethodExact,
    Correct,
    PrecisionQuick,
    PrecisionHandIn,
    PrecisionFine,
    PrecisionOther,
    SubdivisionHalf,
    SubdivisionOne,
    SubdivisionTwo,
    SubdivisionOther,
    Split,
    ResetMaterials,
    FrameAll,
    ResetCamera,
    Smooth,
    Edges,
    Wireframe,
    Normals,
    BackFaces,
    FalseColours,
    ExposureUp,
    ExposureDown,
    AutoExposure,
    ToneNeutral,
    ToneReinhard,
    ToneLinear,
    Show(Quantity),
    DisplayPanel,
    MaterialsPanel,
    PatchPanel,
    HemicubePanel,
    ResidualPanel,
    English,
    French,
    Help,
}

const CTRL: Modifiers = Modifiers::COMMAND;
const NONE: Modifiers = Modifiers::NONE;
const CTRL_SHIFT: Modifiers = Modifiers::COMMAND.plus(Modifiers::SHIFT);

impl Action {
    pub(crate) const FILE: [Self; 6] =
        [Self::Open, Self::OpenLast, Self::Reload, Self::SavePicture, Self::SaveSolution, Self::Quit];
    pub(crate) const SOLVE: [Self; 3] = [Self::GaussSeidel, Self::Progressive, Self::StopOrResume];
    pub(crate) const METHOD: [Self; 3] = [Self::MethodHemicube, Self::MethodShares, Self::MethodExact];
    pub(crate) const CORRECTION: [Self; 1] = [Self::Correct];
    pub(crate) const PRECISION: [Self; 4] =
        [Self::PrecisionQuick, Self::PrecisionHandIn, Self::PrecisionFine, Self::PrecisionOther];
    pub(crate) const SUBDIVISION: [Self; 5] = [
        Self::SubdivisionHalf,
        Self::SubdivisionOne,
        Self::SubdivisionTwo,
        Self::SubdivisionOther,
        Self::Split,
    ];
    pub(crate) const CAMERA: [Self; 2] = [Self::FrameAll, Self::ResetCamera];
    pub(crate) const DRAWING: [Self; 6] =
        [Self::Smooth, Self::Edges, Self::Wireframe, Self::Normals, Self::BackFaces, Self::FalseColours];
    pub(crate) const EXPOSURE: [Self; 3] = [Self::ExposureUp, Self::ExposureDown, Self::AutoExposure];
    pub(crate) const TONE: [Self; 3] = [Self::ToneNeutral, Self::ToneReinhard, Self::ToneLinear];
    pub(crate) const PANELS: [Self; 5] = [
        Self::DisplayPanel,
        Self::MaterialsPanel,
        Self::PatchPanel,
        Self::HemicubePanel,
        Self::ResidualPanel,
    ];
    pub(crate) const LANGUAGES: [Self; 2] = [Self::English, Self::French];

    /// Every one, in the order of the menus.
    pub(crate) fn all() -> Vec<Self> {
        let mut all = Vec::new();
        all.extend(Self::FILE);
        all.extend(Self::SOLVE);
        all.extend(Self::METHOD);
        all.extend(Self::CORRECTION);
        all.extend(Self::PRECISION);
        all.extend(Self::SUBDIVISION);
        all.push(Self::ResetMaterials);
        all.extend(Self::CAMERA);
        all.extend(Self::DRAWING);
        all.extend(Self::EXPOSURE);
        all.extend(Self::TONE);
        all.extend(Quantity::ALL.map(Self::Show));
        all.extend(Self::PANELS);
        all.extend(Self::LANGUAGES);
        all.push(Self::Help);
        all
    }

    /// Its key. Letters that fly (W A S D Q E) are the view's.
    pub(crate) fn shortcut(self) -> KeyboardShortcut {
        let (modifiers, key) = match self {
            Self::Open => (CTRL, Key::O),
            Self::OpenLast => (CTRL_SHIFT, Key::O),
            Self::Reload => (NONE, Key::F5),
            Self::SavePicture => (CTRL, Key::S),
            Self::SaveSolution => (CTRL_SHIFT, Key::S),
            Self::Quit => (CTRL, Key::Q),
            Self::GaussSeidel => (CTRL, Key::G),
            Self::Progressive => (CTRL, Key::P),
            Self::StopOrResume => (NONE, Key::Space),
            Self::MethodHemicube => (CTRL, Key::H),
            Self::MethodShares => (CTRL_SHIFT, Key::H),
            Self::MethodExact => (CTRL, Key::E),
            Self::Correct => (CTRL_SHIFT, Key::E),
            Self::PrecisionQuick => (CTRL, Key::Num1),
            Self::PrecisionHandIn => (CTRL, Key::Num2),
            Self::PrecisionFine => (CTRL, Key::Num3),
            Self::PrecisionOther => (CTRL, Key::Num4),
            Self::SubdivisionHalf => (CTRL, Key::Num5),
            Self::SubdivisionOne => (CTRL, Key::Num6),
            Self::SubdivisionTwo => (CTRL, Key::Num7),
            Self::SubdivisionOther => (CTRL, Key::Num8),
            Self::Split => (CTRL, Key::Num9),
            Self::ResetMaterials => (CTRL, Key::R),
            Self::FrameAll => (NONE, Key::F),
            Self::ResetCamera => (NONE, Key::Home),
            Self::Smooth => (NONE, Key::M),
            Self::Edges => (NONE, Key::L),
            Self::Wireframe => (NONE, Key::X),
            Self::Normals => (NONE, Key::N),
            Self::BackFaces => (NONE, Key::B),
            Self::FalseColours => (NONE, Key::C),
            Self::ExposureUp => (NONE, Key::PageUp),
            Self::ExposureDown => (NONE, Key::PageDown),
            Self::AutoExposure => (NONE, Key::Num0),
            Self::ToneNeutral => (NONE, Key::F2),
            Self::ToneReinhard => (NONE, Key::F3),
            Self::ToneLinear => (NONE, Key::F4),
            Self::Show(quantity) => (NONE, quantity.key()),
            Self::DisplayPanel => (NONE, Key::F6),
            Self::MaterialsPanel => (NONE, Key::F7),
            Self::PatchPanel => (NONE, Key::F8),
            Self::HemicubePanel => (NONE, Key::H),
            Self::ResidualPanel => (NONE, Key::R),
            Self::English => (NONE, Key::F9),
            Self::French => (NONE, Key::F10),
            Self::Help => (NONE, Key::F1),
        };
        KeyboardShortcut::new(modifiers, key)
    }

    /// Whether holding the key down repeats it.
    pub(crate) fn repeats(self) -> bool {
        matches!(self, Self::ExposureUp | Self::ExposureDown)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn every_action_has_a_key_of_its_own() {
        let all = Action::all();
        for (index, one) in all.iter().enumerate() {
            for other in &all[..index] {
                assert_ne!(one.shortcut(), other.shortcut(), "{one:?} and {other:?}");
            }
            let key = one.shortcut();
            let flies = [Key::W, Key::A, Key::S, Key::D, Key::Q, Key::E].contains(&key.logical_key);
            assert!(!flies || key.modifiers != NONE, "{one:?} is the view's");
        }
    }
}
