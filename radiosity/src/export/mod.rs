//! Files out: pictures as PNG and EXR, solutions and form factors as numbers, solved scenes as glTF and VTK. Each file
//! is written whole or not at all.

mod csv;
mod exr;
mod gltf;
mod npz;
mod png;
mod vtu;
mod whole_file;

pub use self::csv::write_solution_csv;
pub use self::exr::write_exr;
pub use self::gltf::{GltfForm, LightMap, SolvedScene, write_gltf};
pub use self::npz::{write_exchange_npz, write_form_factors_npz, write_solution_npz};
pub use self::png::write_png;
pub use self::vtu::write_vtu;
pub use self::whole_file::{ExportError, whole_file};
