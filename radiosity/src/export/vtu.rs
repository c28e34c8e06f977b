//! VTK's unstructured grids (.vtu): the patches as cells, for ParaView and its kin.
//!
//! \[VTK\] Kitware, VTK File Formats, XML formats (docs.vtk.org): arrays inline, base64, little-endian, each after its
//! length in bytes as UInt64.

use std::collections::HashMap;
use std::io::{self, Write};
use std::path::Path;

use base64::prelude::BASE64_STANDARD;
use base64::write::EncoderWriter;
use glam::DVec3;

use super::{ExportError, whole_file};
use crate::estimate::ErrorEstimate;
use crate::light::Rgb;
use crate::patches::Patches;
use crate::scene::{Scene, Shape};
use crate::solve::Solution;
use crate::visibility::{Cells, FacetShape, Facets};

/// Kinds of cells \[VTK\].
const TRIANGLE: u8 = 5;
const POLYGON: u8 = 7;
const QUADRILATERAL: u8 = 9;

/// Write the solution as an unstructured grid: a cell a patch, in patch order, with the arrays `radiosity`,
/// `irradiance`, `emission`, `reflectance`, `normal` (3 a cell), `area`, `object` and `patch` (float64, int64). Powers
/// per area are in the scene's own unit. A patch whose surface visibility sees as several facets, and is no flat
/// polygon, is as many cells, each with all its values: `patch` tells. Where it was estimated the radiosity's error is there too, as
/// `error` and its parts `error_discretisation`, `error_form_factors` and `error_residual`.
///
/// # Errors
/// [`ExportError`].
///
/// # Panics
/// Where `solution` or `error` is not of these `patches`.
pub fn write_vtu(
    path: &Path,
    scene: &Scene,
    patches: &Patches,
    facets: &Facets,
    solution: &Solution,
    error: Option<&ErrorEstimate>,
) -> Result<(), ExportError> {
    assert_eq!(solution.radiosity.len(), patches.len(), "one radiosity a patch");
    let grid = Grid::new(scene, patches, facets);
    let (points, cells) = (grid.points.len(), grid.patch.len());
    whole_file(path, |writer| {
        writeln!(writer, "<?xml version=\"1.0\"?>")?;
        writeln!(
            writer,
            "<VTKFile type=\"UnstructuredGrid\" version=\"1.0\" byte_order=\"LittleEndian\" header_type=\"UInt64\">"
        )?;
        writeln!(writer, "<UnstructuredGrid>")?;
        writeln!(writer, "<Piece NumberOfPoints=\"{points}\" NumberOfCells=\"{cells}\">")?;
        writeln!(writer, "<Points>")?;
        doubles(writer, "Points", 3, grid.points.iter().flat_map(|point| point.to_array()))?;
        writeln!(writer, "</Points>\n<Cells>")?;
        whole(writer, "connectivity", grid.corners.iter().map(|&corner| corner.into()))?;
        whole(writer, "offsets", grid.ends.iter().map(|&end| end as i64))?;
        array(writer, "UInt8", "types", 1, grid.kinds.iter().map(|&kind| [kind]))?;
        writeln!(writer, "</Cells>\n<CellData Scalars=\"radiosity\" Normals=\"normal\">")?;
        let of = |patch: &u32| *patch as usize;
        let columns = [
            ("radiosity", &solution.radiosity),
            ("irradiance", &solution.irradiance),
            ("emission", &patches.emission),
            ("reflectance", &patches.reflectance),
        ];
        for (name, column) in columns.into_iter().chain(error.iter().flat_map(|error| error.columns())) {
            let values = grid.patch.iter().map(|patch| column.get(of(patch)).copied().unwrap_or(Rgb::BLACK));
            doubles(writer, name, 3, values.flat_map(Rgb::to_array))?;
        }
        doubles(
            writer,
            "normal",
            3,
            grid.patch.iter().flat_map(|patch| patches.normal[of(patch)].to_array()),
        )?;
        doubles(writer, "area", 1, grid.patch.iter().map(|patch| patches.area[of(patch)]))?;
        whole(writer, "object", grid.patch.iter().map(|patch| patches.surface[of(patch)].into()))?;
        whole(writer, "patch", grid.patch.iter().map(|&patch| patch.into()))?;
        writeln!(writer, "</CellData>\n</Piece>\n</UnstructuredGrid>\n</VTKFile>")
    })
}

/// Points, and cells over them.
#[derive(Default)]
struct Grid {
    points: Vec<DVec3>,
    /// The corners of one cell after the other, as numbers of points.
    corners: Vec<u32>,
    /// Where in `corners` each cell ends.
    ends: Vec<usize>,
    kinds: Vec<u8>,
    /// The patch of each cell.
    patch: Vec<u32>,
}

impl Grid {
    fn new(scene: &Scene, patches: &Patches, facets: &Facets) -> Self {
        let mut grid = Self::default();
        for (index, surface) in scene.surfaces.iter().enumerate() {
            let mut known = HashMap::new();
            if let (Shape::Polygon(polygon), 1) = (&surface.shape, patches.blocks[index].patches().len()) {
                grid.cell(&mut known, &polygon.vertices, patches.blocks[index].first);
                continue;
            }
            for number in facets.of_surface(index as u32) {
                let facet = &facets[number];
                let at = |u: f64, v: f64| facet.origin + facet.u * u + facet.v * v;
                // Counter-clockwise about the patch's own normal.
                let turned = facet.u.cross(facet.v).dot(facet.normal) < 0.0;
                let mut put = |grid: &mut Self, mut corners: Vec<DVec3>, patch| {
                    if turned {
                        corners[1..].reverse();
                    }
                    grid.cell(&mut known, &corners, patch);
                };
                match (facet.cells, facet.shape) {
                    (Cells::Grid { first, columns, rows }, _) => {
                        let (across, upward) = (f64::from(columns), f64::from(rows));
                        for row in 0..rows {
                            for column in 0..columns {
                                let corners = [[0, 0], [1, 0], [1, 1], [0, 1]].map(|[right, up]| {
                                    at(f64::from(column + right) / across, f64::from(row + up) / upward)
                                });
                                put(&mut grid, corners.to_vec(), first + row * columns + column);
                            }
                        }
                    }
                    (Cells::One(patch), FacetShape::Triangle) => {
                        put(&mut grid, vec![at(0.0, 0.0), at(1.0, 0.0), at(0.0, 1.0)], patch);
                    }
                    (Cells::One(patch), FacetShape::Parallelogram) => {
                        put(&mut grid, vec![at(0.0, 0.0), at(1.0, 0.0), at(1.0, 1.0), at(0.0, 1.0)], patch);
                    }
                }
            }
        }
        grid
    }

    /// Add a cell; points of its surface at the very same position are one, so that ParaView can smooth across cells.
    fn cell(&mut self, known: &mut HashMap<[u64; 3], u32>, corners: &[DVec3], patch: u32) {
        for &corner in corners {
            let point =
                *known.entry((corner + DVec3::ZERO).to_array().map(f64::to_bits)).or_insert_with(|| {
                    self.points.push(corner);
                    self.points.len() as u32 - 1
                });
            self.corners.push(point);
        }
        self.ends.push(self.corners.len());
        self.kinds.push(match corners.len() {
            3 => TRIANGLE,
            4 => QUADRILATERAL,
            _ => POLYGON,
        });
        self.patch.push(patch);
    }
}

fn doubles(
    writer: &mut impl Write,
    name: &str,
    components: usize,
    values: impl Iterator<Item = f64> + Clone,
) -> io::Result<()> {
    array(writer, "Float64", name, components, values.map(f64::to_le_bytes))
}

fn whole(writer: &mut impl Write, name: &str, values: impl Iterator<Item = i64> + Clone) -> io::Result<()> {
    array(writer, "Int64", name, 1, values.map(i64::to_le_bytes))
}

/// An array of numbers of `N` bytes, `components` of them a point or cell.
fn array<const N: usize>(
    writer: &mut impl Write,
    kind: &str,
    name: &str,
    components: usize,
    values: impl Iterator<Item = [u8; N]> + Clone,
) -> io::Result<()> {
    write!(
        writer,
        "<DataArray type=\"{kind}\" Name=\"{name}\" NumberOfComponents=\"{components}\" format=\"binary\">"
    )?;
    let length = (values.clone().count() * N) as u64;
    let mut encoder = EncoderWriter::new(&mut *writer, &BASE64_STANDARD);
    encoder.write_all(&length.to_le_bytes())?;
    for value in values {
        encoder.write_all(&value)?;
    }
    encoder.finish()?;
    drop(encoder);
    writeln!(writer, "</DataArray>")
}
