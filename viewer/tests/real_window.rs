//! The real program in a real window: right-click, « Radiosité (Gauss-Seidel) », and what is then on the screen
//! against the picture that `radiosity render` makes from the same camera.
//!
//! It needs Xvfb, xdotool and scrot, and Mesa's OpenGL (Debian: xvfb xdotool scrot libgl1-mesa-dri). Where they are missing
//! it says so and passes, but not under CI.

use std::fs;
use std::io::{BufRead, BufReader};
use std::path::{Path, PathBuf};
use std::process::{Child, Command, Stdio};
use std::thread::sleep;
use std::time::{Duration, Instant};

use radiosity::bake::{Request, Run, bake};
use radiosity::scene;
use radiosity::shade::{
    PictureRequest, ScreenPicture, ShadedSurfaces, Shading, ToneCurve, ToneMap, automatic_exposure,
    screen_picture,
};
use radiosity::watch::ignore;

/// Killed when dropped, so that no test leaves a server behind.
struct Running(Child);

impl Drop for Running {
    fn drop(&mut self) {
        let _ = self.0.kill();
        let _ = self.0.wait();
    }
}

/// A screen of its own, and the folder that is home to the program on it.
struct Screen {
    display: String,
    home: tempfile::TempDir,
    _server: Running,
}

impl Screen {
    /// `None` where the programs it takes are not installed.
    fn new() -> Option<Self> {
        let there = |program: &str| {
            let paths = std::env::var_os("PATH").unwrap_or_default();
            std::env::split_paths(&paths).any(|folder| folder.join(program).is_file())
        };
        if let Some(missing) = ["Xvfb", "xdotool", "scrot"].into_iter().find(|program| !there(program)) {
            assert!(std::env::var_os("CI").is_none(), "{missing} is not installed");
            eprintln!("skipped: {missing} is not installed");
            return None;
        }
        // The server picks a free display and tells its number.
        let mut server = Command::new("Xvfb")
            .args(["-displayfd", "1", "-screen", "0", "1280x960x24", "-nolisten", "tcp"])
            .stdout(Stdio::piped())
            .stderr(Stdio::null())
            .spawn()
            .unwrap();
        let mut number = String::new();
        BufReader::new(server.stdout.take().unwrap()).read_line(&mut number).unwrap();
        let display = format!(":{}", number.trim());
        Some(Self { display, home: tempfile::tempdir().unwrap(), _server: Running(server) })
    }

    fn command(&self, program: impl AsRef<std::ffi::OsStr>) -> Command {
        let mut command = Command::new(program);
        command
            .env("DISPLAY", &self.display)
            .env("HOME", self.home.path())
            .env_remove("WAYLAND_DISPLAY")
            .env_remove("XDG_DATA_HOME")
            .env_remove("XDG_CONFIG_HOME")
            .env("LANG", "fr_CA.UTF-8")
            .env_remove("LC_ALL")
            .env_remove("LC_MESSAGES")
            .env("LIBGL_ALWAYS_SOFTWARE", "1");
        command
    }

    fn start(&self, arguments: &[&str]) -> Running {
        let mut command = self.command(env!("CARGO_BIN_EXE_radiosity-viewer"));
        Running(command.args(arguments).stdout(Stdio::null()).stderr(Stdio::inherit()).spawn().unwrap())
    }

    fn xdotool(&self, arguments: &[&str]) {
        assert!(self.command("xdotool").args(arguments).status().unwrap().success(), "{arguments:?}");
    }

    fn shot(&self) -> ScreenPicture {
        let path = self.home.path().join("shot.png");
        assert!(self.command("scrot").arg("-o").arg(&path).status().unwrap().success());
        let mut reader =
            png::Decoder::new(BufReader::new(fs::File::open(&path).unwrap())).read_info().unwrap();
        let mut bytes = vec![0; reader.output_buffer_size().unwrap()];
        let info = reader.next_frame(&mut bytes).unwrap();
        let samples = info.color_type.samples();
        let pixels = bytes[..info.buffer_size()].chunks(samples).map(|p| [p[0], p[1], p[2]]).collect();
        ScreenPicture { width: info.width as usize, height: info.height as usize, pixels }
    }

    /// The screen when it has come to rest: `ready`, and the same twice, a second apart.
    fn at_rest(&self, what: &str, ready: impl Fn(&ScreenPicture) -> bool) -> ScreenPicture {
        let begun = Instant::now();
        let mut last = self.shot();
        loop {
            sleep(Duration::from_secs(1));
            let shot = self.shot();
            if shot == last && ready(&shot) {
                return shot;
            }
            last = shot;
            assert!(begun.elapsed() < Duration::from_secs(150), "{what}: not in two minutes and a half");
        }
    }
}

/// The rows of the window, 800 wide, that show the view: those between the menu's bar and the status bar, whose own
/// colour fills most of their rows, and the lines of one colour that part them from the view.
fn view_rows(shot: &ScreenPicture) -> std::ops::Range<usize> {
    let bar = shot.pixels[2 * shot.width + 700];
    let is_bar = |y: &usize| {
        let row = &shot.pixels[y * shot.width..][..800];
        let is_line = row[0] != [0; 3] && row.iter().all(|pixel| pixel == &row[0]);
        is_line || row.iter().filter(|pixel| **pixel == bar).count() > 200
    };
    let top = (0..shot.height).find(|y| !is_bar(y) && !is_bar(&(y + 1)) && !is_bar(&(y + 2)));
    let top = top.expect("a view below the menu");
    let bottom = (top..shot.height).find(is_bar).expect("a status bar");
    top..bottom
}

fn crop(shot: &ScreenPicture, rows: std::ops::Range<usize>) -> ScreenPicture {
    let height = rows.len();
    let pixels = rows.flat_map(|y| shot.pixels[y * shot.width..][..800].to_vec()).collect();
    ScreenPicture { width: 800, height, pixels }
}

fn mean_difference(a: &ScreenPicture, b: &ScreenPicture) -> f64 {
    assert_eq!((a.width, a.height), (b.width, b.height));
    let pairs = a.pixels.iter().flatten().zip(b.pixels.iter().flatten());
    pairs.map(|(a, b)| f64::from(a.abs_diff(*b))).sum::<f64>() / (3 * a.pixels.len()) as f64
}

/// What `radiosity render` makes of the scene in this size, with all its defaults.
fn rendered(path: &Path, width: usize, height: usize) -> ScreenPicture {
    let scene = scene::read(path).unwrap();
    let baked = bake(&scene, &Request::default(), &Run::default(), &mut ignore).unwrap();
    let light = &baked.solution.radiosity;
    let surfaces = ShadedSurfaces::new(&scene, &baked.patches, &baked.facets, light, Shading::Smooth);
    let exposure = automatic_exposure(&baked.patches, light);
    let request = PictureRequest { width, height, ..PictureRequest::default() };
    let tone = ToneMap { exposure, curve: ToneCurve::default() };
    screen_picture(&surfaces, &scene.camera.unwrap(), &request, tone).unwrap()
}

#[test]
fn right_click_radiosity_and_what_is_seen_is_what_is_rendered() {
    let Some(screen) = Screen::new() else { return };
    let scene: PathBuf = Path::new(env!("CARGO_MANIFEST_DIR")).join("../scenes/radio2.scn");
    let _window = screen.start(&[scene.to_str().unwrap(), "--size", "800x700"]);
    screen.at_rest("the window opens", |shot| shot.pixels.iter().any(|pixel| pixel != &shot.pixels[0]));

    // Nothing beside the view: each panel has its key. There is no window manager to give the window the keys.
    screen.xdotool(&["search", "--onlyvisible", "--name", "radio", "windowfocus"]);
    sleep(Duration::from_millis(500));
    screen.xdotool(&["mousemove", "400", "350"]);
    for key in ["F6", "F8", "r"] {
        screen.xdotool(&["key", key]);
        sleep(Duration::from_millis(500));
    }
    let before = screen.at_rest("the panels close", |_| true);
    let rows = view_rows(&before);
    assert!(rows.len() > 550, "{rows:?}");

    // The first entry of the context menu, just beside the pointer.
    screen.xdotool(&["mousemove", "300", "300", "click", "3"]);
    sleep(Duration::from_secs(1));
    screen.xdotool(&["mousemove", "340", "317"]);
    sleep(Duration::from_millis(500));
    screen.xdotool(&["click", "1"]);
    sleep(Duration::from_millis(500));
    // Out of the way: nothing is lit up under it.
    screen.xdotool(&["mousemove", "790", "690"]);

    let expected = rendered(&scene, 800, rows.len());
    let near = |shot: &ScreenPicture| mean_difference(&crop(shot, rows.clone()), &expected) < 6.0;
    let after = screen.at_rest("the radiosity arrives", near);
    let difference = mean_difference(&crop(&after, rows.clone()), &expected);
    println!("mean difference {difference:.2} of 255");
    assert!(difference < 2.0, "{difference}");
    assert!(mean_difference(&crop(&before, rows), &expected) > 20.0, "it was lit before it was asked to be");
}

#[test]
fn without_a_display_it_says_so_in_a_sentence() {
    let told = Command::new(env!("CARGO_BIN_EXE_radiosity-viewer"))
        .env_remove("DISPLAY")
        .env_remove("WAYLAND_DISPLAY")
        .env_remove("WAYLAND_SOCKET")
        .output()
        .unwrap();
    assert_eq!(told.status.code(), Some(1));
    let message = String::from_utf8(told.stderr).unwrap();
    assert!(message.contains("radiosity render") && message.trim().lines().count() == 1, "{message}");
}
