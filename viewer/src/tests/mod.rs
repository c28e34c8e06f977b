//! The window, driven without a screen.

mod light;
mod rooms;
mod window;

use std::path::PathBuf;
use std::time::{Duration, Instant};

use radiosity::bake::{Method, Request, Run};

use crate::session::{Activity, Heard, Session};

/// A scene of the project's own.
fn sample(name: &str) -> PathBuf {
    PathBuf::from(env!("CARGO_MANIFEST_DIR")).join("../scenes").join(name)
}

/// Coarse hemicubes: the tests compare solutions of one and the same equation.
fn request() -> Request {
    Request { method: Method::Hemicube { precision: 30 }, ..Request::default() }
}

fn session() -> Session {
    Session::new(request(), Run::default(), || {})
}

/// Listen until `enough`; panics where that takes too long.
fn until(session: &mut Session, mut enough: impl FnMut(&Session, Heard) -> bool) {
    let begun = Instant::now();
    loop {
        let heard = session.hear();
        if enough(session, heard) {
            return;
        }
        assert!(begun.elapsed() < Duration::from_secs(120), "{:?} {:?}", session.activity, session.trouble);
        std::thread::sleep(Duration::from_millis(1));
    }
}

fn until_done(session: &mut Session) {
    until(session, |session, _| {
        assert!(session.trouble.is_none(), "{:?}", session.trouble);
        session.activity == Activity::Done
    });
}
