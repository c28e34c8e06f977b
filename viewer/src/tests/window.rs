//! The window itself: its menus, panels and messages.

use std::path::PathBuf;
use std::time::{Duration, Instant};

use eframe::egui::{self, PointerButton, Pos2, Vec2};
use egui_kittest::Harness;
use egui_kittest::kittest::{NodeT, Queryable};
use radiosity::bake::Solver;

use super::{rooms, sample};
use crate::action::Action;
use crate::app::{App, Start};
use crate::language::Language;
use crate::quantities::Quantity;
use crate::session::Activity;
use crate::settings::Settings;

type Window = Harness<'static, Option<App>>;

fn window(language: Language, scene: Option<PathBuf>) -> Window {
    window_of(language, scene, Vec2::new(1200.0, 900.0))
}

fn window_of(language: Language, scene: Option<PathBuf>, size: Vec2) -> Window {
    let start = Start { scene, precision: Some(30), language: Some(language), ..Start::default() };
    let mut window = Harness::builder().with_size(size).build_ui_state(
        move |ui, app: &mut Option<App>| {
            let app = app.get_or_insert_with(|| App::new(&start, Settings::default(), ui.ctx()));
            app.show(ui);
        },
        None,
    );
    window.step();
    window
}

fn app(window: &mut Window) -> &mut App {
    window.state_mut().as_mut().unwrap()
}

/// Frame after frame until `enough`.
fn until(window: &mut Window, enough: impl Fn(&App) -> bool) {
    let begun = Instant::now();
    while !enough(app(window)) {
        assert!(begun.elapsed() < Duration::from_secs(120), "{:?}", app(window).session.activity);
        std::thread::sleep(Duration::from_millis(5));
        window.step();
    }
    window.run_steps(3);
}

fn with_cube(language: Language) -> Window {
    let mut window = window(language, None);
    app(&mut window).session.show(rooms::cube(4));
    until(&mut window, |app| app.session.loaded.is_some());
    window
}

fn click(window: &mut Window, at: Pos2, button: PointerButton) {
    for pressed in [true, false] {
        window.hover_at(at);
        window.step();
        window.event(egui::Event::PointerButton {
            pos: at,
            button,
            pressed,
            modifiers: egui::Modifiers::NONE,
        });
        window.step();
    }
    window.run_steps(2);
}

/// A button or menu item, as against a text that mentions it.
fn button<'a>(window: &'a Window, name: &'a str) -> Option<egui_kittest::Node<'a>> {
    let mut named = window.query_all_by_label_contains(name);
    named.find(|node| node.accesskit_node().role() == egui::accesskit::Role::Button)
}

const MIDDLE: Pos2 = Pos2::new(560.0, 450.0);

#[test]
fn the_menu_under_the_right_button_solves_in_both_languages() {
    for (language, names, solver) in [
        (Language::French, ["Radiosité (Gauss-Seidel)", "Radiosité (Propagation)"], Solver::GaussSeidel),
        (Language::English, ["Radiosity (Gauss-Seidel)", "Radiosity (progressive)"], Solver::Progressive),
    ] {
        let mut window = with_cube(language);
        assert!(button(&window, names[0]).is_none(), "not before the click");
        click(&mut window, MIDDLE, PointerButton::Secondary);
        for name in names {
            assert!(button(&window, name).is_some(), "{name}");
        }
        button(&window, names[usize::from(solver == Solver::Progressive)]).unwrap().click();
        window.run_steps(2);
        until(&mut window, |app| app.session.activity == Activity::Done);
        let app = app(&mut window);
        assert_eq!(app.session.solver, solver);
        assert!(app.session.light.complete && app.shown.column.is_some());
        assert!(button(&window, names[0]).is_none(), "the menu has closed");
    }
}

#[test]
fn every_action_stands_in_the_menu_bar_and_its_key_does_it() {
    let mut window = with_cube(Language::English);
    for (action, is) in [
        (Action::Edges, (|app: &App| app.settings.drawing.edges) as fn(&App) -> bool),
        (Action::Wireframe, |app| app.settings.drawing.wireframe),
        (Action::FalseColours, |app| app.false_colours()),
        (Action::MaterialsPanel, |app| app.settings.panels.materials),
        (Action::HemicubePanel, |app| app.settings.panels.hemicube),
        (Action::Help, |app| app.help),
        (Action::French, |app| app.language() == Language::French),
    ] {
        assert!(!is(app(&mut window)), "{action:?}");
        let key = action.shortcut();
        window.key_press_modifiers(key.modifiers, key.logical_key);
        window.run_steps(2);
        assert!(is(app(&mut window)), "{action:?}");
    }
}

#[test]
fn the_error_is_found_when_it_is_looked_at() {
    let mut window = with_cube(Language::French);
    app(&mut window).session.solve(Solver::GaussSeidel);
    until(&mut window, |app| app.session.activity == Activity::Done);
    assert!(app(&mut window).session.light.error.is_none(), "nobody has asked");
    window.key_press(Action::Show(Quantity::Error).shortcut().logical_key);
    until(&mut window, |app| app.session.light.error.is_some());
    let scale = app(&mut window).shown.scale.unwrap();
    assert!(scale.range[1] > 0.0);
    assert!(window.query_all_by_label_contains("% près").next().is_some(), "the status bar");
    click(&mut window, MIDDLE, PointerButton::Primary);
    assert!(window.query_all_by_label_contains("± B").next().is_some(), "the patch panel");
}

#[test]
fn a_click_tells_the_patch_in_the_language() {
    let mut window = with_cube(Language::French);
    app(&mut window).session.solve(Solver::GaussSeidel);
    until(&mut window, |app| app.session.activity == Activity::Done);
    click(&mut window, MIDDLE, PointerButton::Primary);
    until(&mut window, |app| app.session.inspection.is_some());
    let app = app(&mut window);
    let patch = app.session.selected.unwrap() as usize;
    let radiosity = app.session.light.radiosity[patch].to_array();
    let text = radiosity.map(|value| app.language().number(value, 4)).join("  ");
    assert!(text.contains(','), "{text}");
    assert!(window.query_all_by_label_contains(&text).next().is_some(), "{text}");
    assert!(window.query_all_by_label_contains("ligne").next().is_some());
    assert!(window.query_all_by_label_contains("0,25").next().is_some(), "the area");
}

#[test]
fn a_drag_with_the_right_button_opens_no_menu() {
    let mut window = with_cube(Language::English);
    let name = "Radiosity (Gauss-Seidel)";
    let right = PointerButton::Secondary;
    let press = |pos, pressed| egui::Event::PointerButton {
        pos,
        button: right,
        pressed,
        modifiers: egui::Modifiers::NONE,
    };
    window.hover_at(MIDDLE);
    window.event(press(MIDDLE, true));
    window.step();
    let mut at = MIDDLE;
    for _ in 0..10 {
        at += Vec2::new(9.0, 4.0);
        window.hover_at(at);
        window.step();
    }
    window.event(press(at, false));
    window.run_steps(3);
    assert!(button(&window, name).is_none());
}

#[test]
fn a_scene_is_read_again_when_it_is_saved_and_an_error_is_shown() {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("room.scn");
    let room = |emission: &str| {
        format!(
            "QD 3 3\n 0 0 0 1 0 0 1 1 0 0 1 0\nCD 0.5 0.5 0.5\nCE {emission}\nID\nQD 3 3\n 0 0 1 0 1 1 1 1 1 1 0 1\nCD 0.5 0.5 0.5\nID\n"
        )
    };
    std::fs::write(&path, room("1 1 1")).unwrap();
    let mut window = window(Language::English, Some(path.clone()));
    until(&mut window, |app| app.session.loaded.is_some());
    app(&mut window).session.solve(Solver::GaussSeidel);
    until(&mut window, |app| app.session.activity == Activity::Done);
    click(&mut window, Pos2::new(500.0, 300.0), PointerButton::Middle);
    let camera = app(&mut window).view.camera();

    // Saved with more light: it follows, from the same camera.
    std::thread::sleep(Duration::from_millis(20));
    std::fs::write(&path, room("10 10 10")).unwrap();
    until(&mut window, |app| app.session.light.complete && app.session.light.patches.emission[0].r == 10.0);
    assert_eq!(app(&mut window).view.camera(), camera);

    // Saved with a mistake: told with its line, and the last good scene stays.
    std::thread::sleep(Duration::from_millis(20));
    std::fs::write(&path, room("10 oops 10")).unwrap();
    until(&mut window, |app| app.session.trouble.is_some());
    assert!(window.query_by_label_contains("4 │ CE 10 oops 10").is_some());
    assert!(window.query_by_label_contains(":4:").is_some());
    assert!(window.query_by_label_contains("This scene cannot be opened").is_some());
    assert_eq!(app(&mut window).session.loaded.as_ref().unwrap().patches.emission[0].r, 10.0);

    // Mended: the message goes away by itself.
    std::thread::sleep(Duration::from_millis(20));
    std::fs::write(&path, room("2 2 2")).unwrap();
    until(&mut window, |app| app.session.trouble.is_none() && app.session.light.patches.emission[0].r == 2.0);
}

#[test]
fn every_panel_stands_any_size() {
    for language in [Language::English, Language::French] {
        for size in [[1200.0, 900.0], [640.0, 480.0], [300.0, 200.0], [40.0, 30.0], [1.0, 1.0], [0.0, 0.0]] {
            let mut window = window_of(language, Some(sample("cube.scn")), Vec2::from(size));
            until(&mut window, |app| app.session.loaded.is_some());
            let panels = &mut app(&mut window).settings.panels;
            (panels.materials, panels.hemicube) = (true, true);
            let app_ = app(&mut window);
            app_.session.solve(Solver::GaussSeidel);
            app_.session.select(Some(0));
            until(&mut window, |app| app.session.activity == Activity::Done);
            app(&mut window).help = true;
            app(&mut window).warnings_open = true;
            app(&mut window).picture_dialog = true;
            app(&mut window).settings.drawing.false_colours = true;
            window.run_steps(3);
        }
    }
}

#[test]
fn a_picture_and_a_solution_are_saved() {
    let folder = tempfile::tempdir().unwrap();
    let mut window = with_cube(Language::English);
    app(&mut window).session.solve(Solver::GaussSeidel);
    until(&mut window, |app| app.session.activity == Activity::Done);
    for (name, false_colours) in [("a.png", false), ("b.png", true), ("c.exr", false)] {
        let ctx = window.ctx.clone();
        let path = folder.path().join(name);
        let app_ = app(&mut window);
        app_.settings.picture.width = 64;
        app_.settings.picture.height = 48;
        app_.settings.drawing.false_colours = false;
        app_.refresh();
        window.run_steps(2);
        if false_colours {
            app(&mut window).act(Action::FalseColours, &ctx);
            window.run_steps(2);
        }
        app(&mut window).save_picture(&path, &ctx);
        let begun = Instant::now();
        while !path.exists() && begun.elapsed() < Duration::from_secs(20) {
            std::thread::sleep(Duration::from_millis(5));
            window.step();
        }
        assert!(path.metadata().unwrap().len() > 100, "{name}");
    }
    let light = app(&mut window).session.solution().unwrap();
    for name in ["a.csv", "a.npz", "a.glb", "a.gltf", "a.vtu"] {
        let ctx = window.ctx.clone();
        let path = folder.path().join(name);
        app(&mut window).save_solution(&path, &ctx);
        let begun = Instant::now();
        while !path.exists() && begun.elapsed() < Duration::from_secs(20) {
            std::thread::sleep(Duration::from_millis(5));
            window.step();
        }
        assert!(path.metadata().unwrap().len() > 100, "{name}");
        if name.starts_with("a.gl") {
            // The model is the scene again: the same patches, and so the same light.
            let scene = radiosity::scene::read(&path).unwrap();
            assert_eq!(radiosity::patches::count(&scene, 1.0).unwrap(), light.radiosity.len() as u64);
        }
    }
}
