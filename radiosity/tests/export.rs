//! What is written is read back, by other people's readers where there are any, and nothing half-written stays.

mod rooms;

use std::fs;
use std::io::{self, Write};
use std::path::Path;

use npyz::NpyFile;
use radiosity::estimate::ErrorEstimate;
use radiosity::export::{
    ExportError, whole_file, write_exchange_npz, write_exr, write_form_factors_npz, write_png,
    write_solution_csv, write_solution_npz,
};
use radiosity::form_factors::{Elsewhere, ExchangeAreas, FormFactors, Row};
use radiosity::light::Rgb;
use radiosity::patches::{self, Patches};
use radiosity::shade::{Picture, ScreenPicture};
use radiosity::solve::Solution;

fn solved() -> (Patches, Solution) {
    let mut scene = rooms::tilted_room();
    rooms::paint(&mut scene, |surface| {
        let s = surface as f64;
        (Rgb::new(20.0 * s, 1e-30, 0.0), Rgb::new(0.1 * s, 1.0 / 3.0, 0.7))
    });
    let patches = patches::subdivide(&scene, 1.0).unwrap();
    let radiosity = patches.centre.iter().map(|c| Rgb::new(c.x.abs(), 1.0 / 3.0, c.y.sin())).collect();
    (patches, Solution { radiosity, ..Solution::default() })
}

/// The names of all files in a folder, hidden ones too.
fn names(folder: &Path) -> Vec<String> {
    let mut names: Vec<_> = fs::read_dir(folder)
        .unwrap()
        .map(|entry| entry.unwrap().file_name().into_string().unwrap())
        .collect();
    names.sort();
    names
}

#[test]
fn csv_reads_back_to_the_bit() {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("solution.csv");
    let (patches, solution) = solved();
    write_solution_csv(&path, &patches, &solution, None).unwrap();

    let text = fs::read_to_string(&path).unwrap();
    let mut lines = text.lines();
    assert_eq!(
        lines.next().unwrap(),
        "patch,object,x,y,z,nx,ny,nz,area,emission_r,emission_g,emission_b,reflectance_r,reflectance_g,\
         reflectance_b,radiosity_r,radiosity_g,radiosity_b"
    );
    for i in 0..patches.len() {
        let line: Vec<f64> = lines.next().unwrap().split(',').map(|field| field.parse().unwrap()).collect();
        let mut expected = vec![i as f64, f64::from(patches.surface[i])];
        expected.extend(patches.centre[i].to_array());
        expected.extend(patches.normal[i].to_array());
        expected.push(patches.area[i]);
        for rgb in [patches.emission[i], patches.reflectance[i], solution.radiosity[i]] {
            expected.extend(rgb.to_array());
        }
        assert_eq!(line, expected);
    }
    assert_eq!(lines.next(), None);
}

#[test]
fn errors_stand_after_the_radiosities() {
    let folder = tempfile::tempdir().unwrap();
    let (patches, solution) = solved();
    let column = |scale: f64| solution.radiosity.iter().map(|&b| b * scale).collect::<Vec<Rgb>>();
    let error = ErrorEstimate {
        radiosity: column(0.5),
        discretisation: column(0.25),
        form_factors: column(0.125),
        residual: column(0.0625),
        alone: 0,
    };
    let path = folder.path().join("solution.csv");
    write_solution_csv(&path, &patches, &solution, Some(&error)).unwrap();
    let text = fs::read_to_string(&path).unwrap();
    let mut lines = text.lines();
    assert!(lines.next().unwrap().ends_with("radiosity_r,radiosity_g,radiosity_b,error_r,error_g,error_b"));
    for (line, error) in lines.zip(&error.radiosity) {
        let line: Vec<f64> = line.split(',').map(|field| field.parse().unwrap()).collect();
        assert_eq!(line[18..], error.to_array());
    }
    let path = folder.path().join("solution.npz");
    write_solution_npz(&path, &patches, &solution, Some(&error)).unwrap();
    for (name, values) in error.columns() {
        let flat: Vec<f64> = values.iter().flat_map(|value| value.to_array()).collect();
        assert_eq!(array::<f64>(&path, name).2, flat, "{name}");
    }
}

/// The array `name` of an .npz: its dtype and shape as NumPy would show them, and its values.
fn array<T: npyz::Deserialize>(path: &Path, name: &str) -> (String, Vec<u64>, Vec<T>) {
    let mut archive = zip::ZipArchive::new(fs::File::open(path).unwrap()).unwrap();
    let array = NpyFile::new(archive.by_name(&format!("{name}.npy")).unwrap()).unwrap();
    let (dtype, shape) = (array.dtype().descr(), array.shape().to_vec());
    (dtype, shape, array.into_vec().unwrap())
}

#[test]
fn the_solutions_arrays_read_back() {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("solution.npz");
    let (patches, solution) = solved();
    write_solution_npz(&path, &patches, &solution, None).unwrap();

    let n = patches.len() as u64;
    let triples = |name, expected: Vec<[f64; 3]>| {
        let flat = expected.into_flattened();
        assert_eq!(array::<f64>(&path, name), ("'<f8'".into(), vec![n, 3], flat), "{name}");
    };
    let rgb = |values: &[Rgb]| values.iter().map(|value| value.to_array()).collect();
    triples("centre", patches.centre.iter().map(|p| p.to_array()).collect());
    triples("normal", patches.normal.iter().map(|p| p.to_array()).collect());
    triples("emission", rgb(&patches.emission));
    triples("reflectance", rgb(&patches.reflectance));
    triples("radiosity", rgb(&solution.radiosity));
    assert_eq!(array::<f64>(&path, "area"), ("'<f8'".into(), vec![n], patches.area.clone()));
    let objects: Vec<i64> = patches.surface.iter().map(|&surface| i64::from(surface)).collect();
    assert_eq!(array::<i64>(&path, "object"), ("'<i8'".into(), vec![n], objects));
}

#[test]
fn form_factors_are_scipys_csr() {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("f.npz");
    let rows = [&[0.0, 0.25, 0.5], &[0.0, 0.0, 0.0], &[0.125, 0.0, 0.75]];
    let factors = FormFactors::from_rows(rows.iter().map(|row| Row::from_dense(*row)).collect());
    write_form_factors_npz(&path, &factors, false).unwrap();

    assert_eq!(array::<f32>(&path, "data"), ("'<f4'".into(), vec![4], vec![0.25, 0.5, 0.125, 0.75]));
    assert_eq!(array::<i32>(&path, "indices"), ("'<i4'".into(), vec![4], vec![1, 2, 0, 2]));
    assert_eq!(array::<i32>(&path, "indptr"), ("'<i4'".into(), vec![4], vec![0, 2, 2, 4]));
    assert_eq!(array::<i64>(&path, "shape"), ("'<i8'".into(), vec![2], vec![3, 3]));
    assert_eq!(array::<Vec<u8>>(&path, "format"), ("'|S3'".into(), vec![], vec![b"csr".to_vec()]));

    // What leaves the scene, as a column more; repaired, in double precision.
    let elsewhere = Elsewhere { surroundings: 0.125, backs: 0.0 };
    let rows = factors.rows().iter().enumerate().map(|(i, row)| match i {
        2 => row.clone().with_elsewhere(elsewhere),
        _ => row.clone(),
    });
    let factors = FormFactors::from_rows(rows.collect());
    write_form_factors_npz(&path, &factors, true).unwrap();
    assert_eq!(array::<f32>(&path, "data"), ("'<f4'".into(), vec![5], vec![0.25, 0.5, 0.125, 0.75, 0.125]));
    assert_eq!(array::<i32>(&path, "indices"), ("'<i4'".into(), vec![5], vec![1, 2, 0, 2, 3]));
    assert_eq!(array::<i64>(&path, "shape"), ("'<i8'".into(), vec![2], vec![3, 4]));
    let areas = ExchangeAreas::average(&[1.0, 2.0, 4.0], &factors, |_, _| false);
    write_exchange_npz(&path, &areas, true).unwrap();
    // (1·0.25 + 0) / 2 both ways between 0 and 1; (1·0.5 + 4·0.125) / 2 between 0 and 2.
    let data = vec![0.125, 0.5, 0.0625, 0.125, 0.75, 0.125];
    assert_eq!(array::<f64>(&path, "data"), ("'<f8'".into(), vec![6], data));
    assert_eq!(array::<i32>(&path, "indices"), ("'<i4'".into(), vec![6], vec![1, 2, 0, 0, 2, 3]));
    assert_eq!(array::<i32>(&path, "indptr"), ("'<i4'".into(), vec![4], vec![0, 2, 3, 6]));
}

#[test]
fn the_same_archive_has_the_same_bytes() {
    let folder = tempfile::tempdir().unwrap();
    let (patches, solution) = solved();
    let bytes = ["one.npz", "other.npz"].map(|name| {
        let path = folder.path().join(name);
        write_solution_npz(&path, &patches, &solution, None).unwrap();
        fs::read(path).unwrap()
    });
    assert!(bytes[0] == bytes[1]);
}

#[test]
fn png_decodes_to_the_same_and_says_srgb() {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("picture.png");
    let (width, height) = (301, 47);
    let pixels = (0..width * height).map(|k| [k as u8, (k / 7) as u8, (k * k) as u8]).collect();
    let picture = ScreenPicture { width, height, pixels };
    write_png(&path, &picture).unwrap();

    let mut reader =
        png::Decoder::new(io::BufReader::new(fs::File::open(&path).unwrap())).read_info().unwrap();
    assert_eq!(reader.info().srgb, Some(png::SrgbRenderingIntent::Perceptual));
    let mut bytes = vec![0; reader.output_buffer_size().unwrap()];
    let frame = reader.next_frame(&mut bytes).unwrap();
    assert_eq!((frame.width, frame.height), (301, 47));
    assert_eq!((frame.color_type, frame.bit_depth), (png::ColorType::Rgb, png::BitDepth::Eight));
    assert_eq!(bytes, picture.pixels.as_flattened());
}

#[test]
fn exr_keeps_every_bit() {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("picture.exr");
    let (width, height) = (67, 41);
    let pixels = (0..width * height).map(|k| [(k as f32).sqrt(), 1e-30 * k as f32, 1e30 / (1.0 + k as f32)]);
    let picture = Picture { width, height, pixels: pixels.collect() };
    write_exr(&path, &picture).unwrap();

    let image = exr::prelude::read_first_rgba_layer_from_file(
        &path,
        |size, _| Picture { width: size.x(), height: size.y(), pixels: vec![[0.0; 3]; size.x() * size.y()] },
        |picture, at, (r, g, b, _): (f32, f32, f32, f32)| {
            picture.pixels[at.y() * picture.width + at.x()] = [r, g, b];
        },
    )
    .unwrap();
    assert!(image.layer_data.channel_data.pixels == picture);
}

#[test]
fn a_failure_leaves_nothing_behind() {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("new.csv");
    let failed = whole_file(&path, |writer| {
        writer.write_all(b"half")?;
        Err(io::Error::other("the pen broke"))
    });
    let message = failed.unwrap_err().to_string();
    assert!(message.contains("new.csv") && message.contains("the pen broke"), "{message}");
    assert_eq!(names(folder.path()), [""; 0]);

    // And what was there before is there still.
    fs::write(&path, "old").unwrap();
    whole_file(&path, |_| Err(io::Error::other("again"))).unwrap_err();
    assert_eq!(fs::read_to_string(&path).unwrap(), "old");
    assert_eq!(names(folder.path()), ["new.csv"]);
}

#[test]
fn a_panic_leaves_nothing_behind() {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("new.csv");
    let panicked = std::panic::catch_unwind(|| whole_file(&path, |_| panic!("on purpose")));
    assert!(panicked.is_err());
    assert_eq!(names(folder.path()), [""; 0]);
}

#[test]
fn a_wrong_place_is_named() {
    let folder = tempfile::tempdir().unwrap();
    let nothing = |path: &Path| whole_file(path, |_| Ok(())).unwrap_err();
    let missing = nothing(&folder.path().join("nowhere/f.npz"));
    assert!(matches!(missing, ExportError::NoFolder { .. }), "{missing}");
    assert!(missing.to_string().contains("nowhere"));
    assert!(matches!(nothing(folder.path()), ExportError::IsFolder(_)));

    let protected = folder.path().join("protected");
    fs::write(&protected, "old").unwrap();
    let mut permissions = fs::metadata(&protected).unwrap().permissions();
    permissions.set_readonly(true);
    fs::set_permissions(&protected, permissions).unwrap();
    assert!(matches!(nothing(&protected), ExportError::WriteProtected(_)));
}

#[cfg(unix)]
mod on_unix {
    use super::*;
    use std::os::unix::fs::{PermissionsExt, symlink};

    fn mode(path: &Path) -> u32 {
        fs::metadata(path).unwrap().permissions().mode() & 0o777
    }

    #[test]
    fn permissions_are_those_of_any_new_file() {
        let folder = tempfile::tempdir().unwrap();
        let (ours, usual) = (folder.path().join("ours"), folder.path().join("usual"));
        whole_file(&ours, |writer| writer.write_all(b"1")).unwrap();
        fs::write(&usual, "1").unwrap();
        assert_eq!(mode(&ours), mode(&usual));
        // A file that is replaced keeps its own.
        fs::set_permissions(&ours, fs::Permissions::from_mode(0o640)).unwrap();
        whole_file(&ours, |writer| writer.write_all(b"2")).unwrap();
        assert_eq!(mode(&ours), 0o640);
        assert_eq!(fs::read(&ours).unwrap(), b"2");
    }

    #[test]
    fn a_link_is_followed() {
        let folder = tempfile::tempdir().unwrap();
        fs::create_dir(folder.path().join("there")).unwrap();
        let (link, target) = (folder.path().join("link"), folder.path().join("there/target"));
        fs::write(&target, "old").unwrap();
        symlink(&target, &link).unwrap();
        whole_file(&link, |writer| writer.write_all(b"new")).unwrap();
        assert!(fs::symlink_metadata(&link).unwrap().is_symlink());
        assert_eq!(fs::read(&target).unwrap(), b"new");
        assert_eq!(names(folder.path()), ["link", "there"]);
    }

    #[test]
    fn a_name_may_be_as_long_as_the_file_system_takes() {
        let folder = tempfile::tempdir().unwrap();
        let path = folder.path().join("n".repeat(255));
        whole_file(&path, |writer| writer.write_all(b"1")).unwrap();
        assert_eq!(fs::read(&path).unwrap(), b"1");
    }

    #[test]
    fn a_device_takes_the_bytes_and_stays() {
        let null = Path::new("/dev/null");
        whole_file(null, |writer| writer.write_all(b"gone")).unwrap();
        assert!(!fs::metadata(null).unwrap().is_file());
    }

    /// /dev/full is a disk with no room left.
    #[cfg(target_os = "linux")]
    #[test]
    fn a_full_disk_is_named() {
        let full = Path::new("/dev/full");
        let message = whole_file(full, |writer| writer.write_all(b"much")).unwrap_err().to_string();
        assert!(message.contains("/dev/full") && message.contains("No space left"), "{message}");
    }
}
