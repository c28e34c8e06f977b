//! Watches the open scene's file, to read it again when it is saved.

use std::path::{Path, PathBuf};
use std::sync::mpsc::{Receiver, channel};
use std::time::{Duration, Instant, SystemTime};

use notify::{RecommendedWatcher, RecursiveMode, Watcher};

/// Editors write in several strokes: this long after the last one the file is read.
const SETTLE: Duration = Duration::from_millis(150);
/// Where the system tells nothing (some network disks), the file is looked at this often.
const LOOK_EVERY: Duration = Duration::from_secs(2);

/// The file and its view, as they stood when last read: when written, and how long.
type Stand = [Option<(SystemTime, u64)>; 2];

/// Watches one file.
pub(crate) struct SceneFile {
    path: PathBuf,
    stand: Stand,
    /// Kept, for it ends when dropped.
    _watcher: Option<RecommendedWatcher>,
    touched: Receiver<()>,
    since: Option<Instant>,
    looked: Instant,
}

impl SceneFile {
    /// Watch `path` (and the .vsn beside it) from now on; `wake` is called when something happens to it. The folder is
    /// watched, not the file: many editors write a new file and give it the old one's name.
    pub(crate) fn watch(path: &Path, wake: impl Fn() + Send + 'static) -> Self {
        let (sender, touched) = channel();
        let names = [path.file_name(), path.with_extension("vsn").file_name()]
            .map(|name| name.map(ToOwned::to_owned));
        let watcher = notify::recommended_watcher(move |event: notify::Result<notify::Event>| {
            let Ok(event) = event else { return };
            let ours =
                event.paths.iter().any(|path| names.iter().any(|name| path.file_name() == name.as_deref()));
            if ours && !event.kind.is_access() {
                let _ = sender.send(());
                wake();
            }
        });
        let folder = path.parent().filter(|folder| !folder.as_os_str().is_empty()).unwrap_or(Path::new("."));
        let watcher = watcher.ok().and_then(|mut watcher| {
            watcher.watch(folder, RecursiveMode::NonRecursive).ok()?;
            Some(watcher)
        });
        let now = Instant::now();
        Self {
            path: path.to_owned(),
            stand: stand(path),
            _watcher: watcher,
            touched,
            since: None,
            looked: now,
        }
    }

    /// The file that is watched.
    pub(crate) fn path(&self) -> &Path {
        &self.path
    }

    /// Whether it was saved since last time this said so, and has come to rest. Else, when to ask again.
    pub(crate) fn saved(&mut self) -> Result<(), Duration> {
        while self.touched.try_recv().is_ok() {
            self.since = Some(Instant::now());
        }
        match self.since {
            Some(since) if since.elapsed() < SETTLE => return Err(SETTLE - since.elapsed()),
            None if self.looked.elapsed() < LOOK_EVERY => return Err(LOOK_EVERY - self.looked.elapsed()),
            _ => {}
        }
        (self.since, self.looked) = (None, Instant::now());
        let stand = stand(&self.path);
        // A file that is gone for a moment is being replaced.
        if stand[0].is_some() && stand != self.stand {
            self.stand = stand;
            return Ok(());
        }
        Err(LOOK_EVERY)
    }
}

fn stand(path: &Path) -> Stand {
    let of = |path: &Path| {
        let file = path.metadata().ok()?;
        Some((file.modified().ok()?, file.len()))
    };
    [of(path), of(&path.with_extension("vsn"))]
}

#[cfg(test)]
mod tests {
    use super::*;

    fn wait(file: &mut SceneFile) -> bool {
        let begun = Instant::now();
        while begun.elapsed() < Duration::from_secs(5) {
            if file.saved().is_ok() {
                return true;
            }
            std::thread::sleep(Duration::from_millis(20));
        }
        false
    }

    #[test]
    fn a_save_is_told_once_however_it_is_made() {
        let folder = tempfile::tempdir().unwrap();
        let path = folder.path().join("a.scn");
        std::fs::write(&path, "one").unwrap();
        let mut file = SceneFile::watch(&path, || {});
        assert!(file.saved().is_err(), "nothing has happened");
        std::fs::write(&path, "written over").unwrap();
        assert!(wait(&mut file));
        std::thread::sleep(SETTLE * 2);
        assert!(file.saved().is_err(), "told already");
        // As vim, Emacs and most others do it.
        let other = folder.path().join("a.scn.tmp");
        std::fs::write(&other, "replaced, a third length").unwrap();
        std::fs::rename(&other, &path).unwrap();
        assert!(wait(&mut file));
        // The view beside it.
        std::fs::write(path.with_extension("vsn"), "0").unwrap();
        assert!(wait(&mut file));
    }
}
