//! The house plan, held: a module of the engine imports only from those that `lib.rs` lists above it.

use std::fs;
use std::path::{Path, PathBuf};

fn rust_files(folder: &Path, found: &mut Vec<PathBuf>) {
    for entry in fs::read_dir(folder).unwrap() {
        let path = entry.unwrap().path();
        if path.is_dir() {
            rust_files(&path, found);
        } else if path.extension().is_some_and(|ending| ending == "rs") {
            found.push(path);
        }
    }
}

#[test]
fn light_travels_one_way() {
    let source = Path::new(env!("CARGO_MANIFEST_DIR")).join("src");
    let tour = fs::read_to_string(source.join("lib.rs")).unwrap();
    let listed = |line: &str| Some(line.strip_prefix("pub mod ")?.strip_suffix(';')?.to_owned());
    let order: Vec<String> = tour.lines().filter_map(listed).collect();
    assert!(order.len() >= 10, "{order:?}");

    for (rank, module) in order.iter().enumerate() {
        let mut files = vec![source.join(format!("{module}.rs"))];
        files.retain(|file| file.exists());
        if source.join(module).is_dir() {
            rust_files(&source.join(module), &mut files);
        }
        assert!(!files.is_empty(), "{module} has no file");
        for file in files {
            let text = fs::read_to_string(&file).unwrap();
            // Tests at a file's foot may look wherever they like.
            let code = text.split("#[cfg(test)]").next().unwrap();
            for later in &order[rank + 1..] {
                let import = format!("crate::{later}");
                assert!(!code.contains(&import), "{} reaches up to {import}", file.display());
            }
        }
    }
}
