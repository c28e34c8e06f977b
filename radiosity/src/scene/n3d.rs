//! N3D's scene files (.scn) and views (.vsn).

use std::path::Path;

use super::{Scene, SceneError};

/// Read NAME.scn, and NAME.vsn where it stands beside it.
pub fn read(path: &Path) -> Result<Scene, SceneError> {
    Err(SceneError::File { file: path.display().to_string(), message: "not yet".into() })
}
