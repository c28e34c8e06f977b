//! What the window remembers from one time to the next. Whatever is found in the store, it begins.

use std::path::{Path, PathBuf};

use radiosity::form_factors::hemicube::PRECISIONS;
use serde::{Deserialize, Serialize};

use crate::language::Language;
use crate::quantities::Quantity;

/// More recent files than this are forgotten.
const RECENT: usize = 10;

/// What is remembered.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(default)]
pub(crate) struct Settings {
    /// None: as the system's.
    pub(crate) language: Option<Language>,
    /// The last one first.
    pub(crate) recent: Vec<PathBuf>,
    pub(crate) precision: u32,
    pub(crate) panels: Panels,
    pub(crate) drawing: Drawing,
    pub(crate) picture: PictureSettings,
}

/// Which panels are open.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize)]
#[serde(default)]
pub(crate) struct Panels {
    pub(crate) display: bool,
    pub(crate) materials: bool,
    pub(crate) patch: bool,
    pub(crate) hemicube: bool,
    pub(crate) residual: bool,
}

/// How surfaces are drawn.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
#[serde(default)]
pub(crate) struct Drawing {
    pub(crate) quantity: Quantity,
    pub(crate) smooth: bool,
    pub(crate) edges: bool,
    pub(crate) wireframe: bool,
    pub(crate) normals: bool,
    pub(crate) false_colours: bool,
    pub(crate) logarithmic: bool,
    /// Indices into `ColourMap::ALL` and `ToneCurve::ALL`.
    pub(crate) colour_map: usize,
    pub(crate) tone: usize,
}

/// What size a saved picture has.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize)]
#[serde(default)]
pub(crate) struct PictureSettings {
    pub(crate) width: usize,
    pub(crate) height: usize,
    pub(crate) sampling: u32,
}

impl Default for Settings {
    fn default() -> Self {
        Self {
            language: None,
            recent: Vec::new(),
            precision: 100,
            panels: Panels::default(),
            drawing: Drawing::default(),
            picture: PictureSettings::default(),
        }
    }
}

impl Default for Panels {
    fn default() -> Self {
        Self { display: true, materials: false, patch: true, hemicube: false, residual: true }
    }
}

impl Default for Drawing {
    fn default() -> Self {
        Self {
            quantity: Quantity::Radiosity,
            smooth: true,
            edges: false,
            wireframe: false,
            normals: false,
            false_colours: false,
            logarithmic: false,
            colour_map: 0,
            tone: 0,
        }
    }
}

impl Default for PictureSettings {
    fn default() -> Self {
        Self { width: 1600, height: 1200, sampling: 3 }
    }
}

impl Settings {
    /// With nothing in it that makes no sense, whoever wrote it.
    pub(crate) fn sane(mut self) -> Self {
        if !PRECISIONS.contains(&self.precision) || !self.precision.is_multiple_of(2) {
            self.precision = Self::default().precision;
        }
        let picture = &mut self.picture;
        picture.width = picture.width.clamp(1, 16384);
        picture.height = picture.height.clamp(1, 16384);
        picture.sampling = picture.sampling.clamp(1, 16);
        self.recent.truncate(RECENT);
        // A row of form factors is of a patch that nobody has chosen yet.
        if self.drawing.quantity == Quantity::FormFactors {
            self.drawing.quantity = Quantity::Radiosity;
        }
        self
    }

    /// This file was opened.
    pub(crate) fn opened(&mut self, path: &Path) {
        let path = std::path::absolute(path).unwrap_or_else(|_| path.to_owned());
        self.recent.retain(|other| *other != path);
        self.recent.insert(0, path);
        self.recent.truncate(RECENT);
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn nonsense_is_put_right() {
        let odd = Settings { precision: 31, ..Settings::default() };
        assert_eq!(odd.sane().precision, 100);
        let picture = PictureSettings { width: 0, height: usize::MAX, sampling: 0 };
        let sane = Settings { picture, ..Settings::default() }.sane().picture;
        assert_eq!((sane.width, sane.height, sane.sampling), (1, 16384, 1));
    }

    #[test]
    fn recent_files_stand_once_and_the_last_first() {
        let mut settings = Settings::default();
        for name in ["/a.scn", "/b.scn", "/a.scn"] {
            settings.opened(Path::new(name));
        }
        assert_eq!(settings.recent, [PathBuf::from("/a.scn"), PathBuf::from("/b.scn")]);
        for k in 0..20 {
            settings.opened(Path::new(&format!("/{k}.scn")));
        }
        assert_eq!(settings.recent.len(), RECENT);
    }
}
