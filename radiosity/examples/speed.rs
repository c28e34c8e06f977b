#[path = "../tests/rooms/mod.rs"]
mod rooms;
use radiosity::form_factors::hemicube::*;
use radiosity::patches::subdivide;
use radiosity::scene::BackFaces;
use radiosity::simd::Level;
use radiosity::visibility::*;
fn main() {
    let read = |n: &str| radiosity::scene::read(std::path::Path::new(n)).unwrap();
    for (name, scene) in [
        ("cube", rooms::cube(18)),
        ("cornell", read("scenes/cornell.scn")),
        ("radio5", read("scenes/radio5.scn")),
        ("office", read("scenes/office.scn")),
        ("radio7", read("scenes/radio7.scn")),
    ] {
        let patches = subdivide(&scene, 1.0).unwrap();
        let facets = Facets::new(&scene, &patches);
        let h = Hemicube::new(&patches, &facets, BackFaces::Lit, CellWeights::new(100).unwrap());
        let mut s = Scratch::default();
        let n = patches.len();
        for level in Level::available() {
            let mut best = f64::INFINITY;
            for _ in 0..5 {
                let t = std::time::Instant::now();
                for p in 0..n {
                    h.row_at(level, p, &mut s);
                }
                best = best.min(t.elapsed().as_secs_f64());
            }
            println!(
                "{name} {level:?}: {n} patches, {:.1} us a row, {:.0} Mrays/s",
                best / n as f64 * 1e6,
                n as f64 * 30000.0 / best / 1e6
            );
        }
    }
}
