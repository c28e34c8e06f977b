//! Asking for a file: by the system's own dialog, on a thread of its own, or where there is none by typing a path.

use std::path::PathBuf;
use std::sync::mpsc::{Receiver, TryRecvError, channel};
use std::time::{Duration, Instant};

use eframe::egui;

use crate::language::Texts;
use crate::saving::SOLUTION_ENDINGS;

/// A dialog that ends sooner than this was never seen: the system has none.
const NEVER_SEEN: Duration = Duration::from_millis(400);

/// What a file is asked for.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) enum Purpose {
    OpenScene,
    SavePicture,
    SaveSolution,
}

/// A question to the user for a file.
#[derive(Default)]
pub(crate) struct FileQuestion {
    asked: Option<(Purpose, Receiver<Option<PathBuf>>, Instant)>,
    /// What is typed where the system has no dialog.
    typed: Option<(Purpose, String)>,
}

impl FileQuestion {
    /// Ask.
    pub(crate) fn ask(&mut self, purpose: Purpose, name: &str, texts: &Texts, ctx: &egui::Context) {
        if self.asked.is_some() {
            return;
        }
        self.typed = None;
        let dialog = rfd::AsyncFileDialog::new();
        let (dialog, saves) = match purpose {
            Purpose::OpenScene => (dialog.add_filter(texts.scenes, &["scn", "obj", "gltf", "glb"]), false),
            Purpose::SavePicture => (
                dialog.add_filter(texts.pictures, &["png", "exr"]).set_file_name(format!("{name}.png")),
                true,
            ),
            Purpose::SaveSolution => (
                dialog.add_filter(texts.solutions, &SOLUTION_ENDINGS).set_file_name(format!("{name}.csv")),
                true,
            ),
        };
        let (sender, receiver) = channel();
        let ctx = ctx.clone();
        // Begun on this thread, as macOS wants it; waited for on another.
        let answer: std::pin::Pin<Box<dyn Future<Output = Option<rfd::FileHandle>> + Send>> =
            if saves { Box::pin(dialog.save_file()) } else { Box::pin(dialog.pick_file()) };
        let waiting = std::thread::Builder::new().name("file dialog".into()).spawn(move || {
            let file = pollster::block_on(answer).map(|file| file.path().to_owned());
            let _ = sender.send(file);
            ctx.request_repaint();
        });
        if waiting.is_ok() {
            self.asked = Some((purpose, receiver, Instant::now()));
        } else {
            self.typed = Some((purpose, String::new()));
        }
    }

    /// The answer, once there is one. Draws where a path is to be typed.
    pub(crate) fn answer(&mut self, ctx: &egui::Context, texts: &Texts) -> Option<(Purpose, PathBuf)> {
        if let Some((purpose, receiver, since)) = &self.asked {
            let purpose = *purpose;
            let answer = match receiver.try_recv() {
                Ok(answer) => answer,
                Err(TryRecvError::Empty) => return None,
                Err(TryRecvError::Disconnected) => None,
            };
            let never_seen = since.elapsed() < NEVER_SEEN;
            self.asked = None;
            match answer {
                Some(path) => return Some((purpose, path)),
                None if never_seen => self.typed = Some((purpose, String::new())),
                None => {}
            }
        }
        let (purpose, typed) = self.typed.as_mut()?;
        let purpose = *purpose;
        let mut open = None;
        let modal = egui::Modal::new(egui::Id::unique("type a path")).show(ctx, |ui| {
            ui.set_max_width(420.0);
            let label = ui.label(texts.path_prompt).id;
            let field =
                egui::TextEdit::singleline(typed).hint_text(texts.path_hint).desired_width(f32::INFINITY);
            let field = ui.add(field).labelled_by(label);
            if !field.has_focus() && !field.lost_focus() {
                field.request_focus();
            }
            let entered = field.lost_focus() && ui.input(|input| input.key_pressed(egui::Key::Enter));
            ui.horizontal(|ui| {
                if ui.button(texts.ok).clicked() || entered {
                    open = Some(true);
                }
                if ui.button(texts.cancel).clicked() {
                    open = Some(false);
                }
            });
        });
        if modal.should_close() {
            open = open.or(Some(false));
        }
        match open {
            Some(true) if !typed.trim().is_empty() => {
                let path = PathBuf::from(typed.trim());
                self.typed = None;
                Some((purpose, path))
            }
            Some(_) => {
                self.typed = None;
                None
            }
            None => None,
        }
    }
}
