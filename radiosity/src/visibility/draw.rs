//! Drawing what an eye sees: boxes of facets from the nearest to the farthest, sixteen facets at a time.
//!
//! One eye may look through several screens at once, as a hemicube does through its five faces. What lies beyond a screen's
//! sides, below the horizon, between the centres of cells or behind what is drawn already is left out, box by box where
//! it can be, else facet by facet (\[GKM93\] Greene, Kass & Miller, Hierarchical Z-Buffer Visibility, 1993).

#![allow(
    clippy::needless_range_loop,
    reason = "columns are indexed alike; what iterators are adapted by is not compiled for the wide registers"
)]

use super::blocks::{Branch, Inside};
use super::facets::BACK;
use super::item_buffer::{ItemBuffer, NOTHING, Rect};
use super::placed::Placed;
use super::sight::{SLACK, Screen, Sight};
use super::vectors::{add, dot, load, magnitude, splat, splat_axes, turn};
use super::{Facets, View};
use crate::simd::{self, LANES, Level, Simd};

impl ItemBuffer {
    /// Fill the buffer with what `view` sees of `facets`. Of two equally near one that is seen from its front stays, and of
    /// two such the one that comes first.
    pub fn draw(&mut self, facets: &Facets, view: &View) {
        self.draw_at(Level::best(), facets, view);
    }

    /// The same with no more of the processor than `level`; the bits do not depend on it.
    pub fn draw_at(&mut self, level: Level, facets: &Facets, view: &View) {
        let axes = [view.right, view.up, view.forward];
        let (labels, dark_above) = (facets.numbers(), i32::MAX as u32);
        let sight = Sight { eye: view.eye, axes, horizon: None, labels, dark_above };
        let screen = Screen::new(view, [0, 1, 2], 1.0);
        simd::run(level, DrawView { facets, sight: &sight, screen, buffer: &mut *self });
        for label in self.all_labels().filter(|label| **label != NOTHING) {
            *label &= !BACK;
        }
    }
}

/// Draw facets in a view.
struct DrawView<'a> {
    facets: &'a Facets,
    sight: &'a Sight<'a>,
    screen: Screen,
    buffer: &'a mut ItemBuffer,
}

impl simd::Kernel for DrawView<'_> {
    type Output = ();

    #[inline(always)]
    fn run<S: Simd>(self, simd: S) {
        let Self { facets, sight, screen, buffer } = self;
        let buffers = std::slice::from_mut(buffer);
        draw(simd, facets, sight, &[screen], NOTHING, buffers, &mut Canvas::default());
    }
}

/// Memory to draw in.
#[derive(Clone, Debug, Default)]
pub(crate) struct Canvas {
    waiting: Vec<Waiting>,
    placed: Placed,
}

/// The most screens that are drawn at once.
pub(crate) const SCREENS: usize = 5;

/// A box yet to be looked into.
#[derive(Clone, Copy, Debug)]
struct Waiting {
    inside: Inside,
    /// A bit for each screen it may be seen on, and where.
    screens: u32,
    cover: [Rect; SCREENS],
}

/// Fill the screens' buffers with what the sight shows of the facets; `background` stands where it shows none.
#[inline(always)]
pub(crate) fn draw<S: Simd>(
    simd: S,
    facets: &Facets,
    sight: &Sight<'_>,
    screens: &[Screen],
    background: u32,
    buffers: &mut [ItemBuffer],
    canvas: &mut Canvas,
) {
    for (screen, buffer) in screens.iter().zip(buffers.iter_mut()) {
        buffer.clear(screen.cells, background, (1.0 / screen.far) as f32);
    }
    let tree = facets.blocks();
    let Canvas { waiting, placed } = canvas;
    waiting.clear();
    open(simd, &tree.branches[0], sight, screens, u32::MAX, waiting);
    while let Some(mut next) = waiting.pop() {
        let mut left = next.screens;
        while left != 0 {
            let index = left.trailing_zeros() as usize;
            left &= left - 1;
            if buffers[index].hides(simd, &next.cover[index]) {
                next.screens &= !(1 << index);
            }
        }
        if next.screens == 0 {
            continue;
        }
        match next.inside {
            Inside::Branch(branch) => {
                open(simd, &tree.branches[branch as usize], sight, screens, next.screens, waiting);
            }
            Inside::Block(number) => {
                if let Some(Waiting { inside: Inside::Block(soon), .. }) = waiting.last() {
                    simd::fetch(std::slice::from_ref(&tree.blocks[*soon as usize]));
                    simd::fetch(&sight.labels.sides[*soon as usize]);
                }
                let number = number as usize;
                placed.place(simd, &tree.blocks[number], sight);
                placed.label(simd, &sight.labels.sides[number], sight.dark_above);
                let mut left = next.screens;
                while left != 0 && placed.seen != 0 {
                    let index = left.trailing_zeros() as usize;
                    left &= left - 1;
                    placed.project(simd, &screens[index]);
                    placed.fill(simd, &screens[index], &mut buffers[index]);
                    if placed.small | placed.large != 0 {
                        buffers[index].touch(&next.cover[index]);
                    }
                }
            }
        }
    }
}

/// Put the boxes of a branch that may be seen on `wanted` screens on the stack, the nearest on top.
#[inline(always)]
fn open<S: Simd>(
    simd: S,
    branch: &Branch,
    sight: &Sight<'_>,
    screens: &[Screen],
    wanted: u32,
    waiting: &mut Vec<Waiting>,
) {
    let axes = splat_axes(simd, sight.axes);
    let eye = splat(simd, -sight.eye);
    let centre = turn(simd, &axes, add(simd, load(simd, &branch.centre), eye));
    let half = load(simd, &branch.half);
    let mut widths = half;
    for axis in 0..3 {
        let [x, y, z] = axes[axis];
        let across = [magnitude(simd, x), magnitude(simd, y), magnitude(simd, z)];
        widths[axis] = dot(simd, across, half);
    }
    let mut seen = !0 >> (u32::BITS - branch.count as u32);
    if let Some(horizon) = sight.horizon {
        // The facets are judged exactly; their box may differ by a rounding error.
        let top = simd.add_double(centre[2], widths[2]);
        seen &= simd.lanes(simd.greater_double(top, simd.splat_double(0.5 * horizon)));
    }
    if seen == 0 {
        return;
    }

    // From here in single precision, the boxes taken a little larger.
    let zero = simd.splat(0.0);
    let one = simd.splat(1.0);
    let (mut middle, mut reach) = ([zero; 3], [zero; 3]);
    let (mut far, mut distance) = (zero, zero);
    for axis in 0..3 {
        let (c, w) = (simd.narrow(centre[axis]), simd.narrow(widths[axis]));
        let apart = simd.max(c, simd.mul(c, simd.splat(-1.0)));
        middle[axis] = c;
        reach[axis] = simd.add(w, simd.mul(simd.add(apart, w), simd.splat(SLACK)));
        far = simd.max(far, simd.add(apart, w));
        let gap = simd.max(simd.sub(apart, w), zero);
        distance = simd.add(distance, simd.mul(gap, gap));
    }
    let mut distances = [0.0; LANES];
    simd.store(distance, &mut distances);

    let base = waiting.len();
    for lane in 0..branch.count {
        if seen >> lane & 1 == 1 {
            let waits = Waiting { inside: branch.inside[lane], screens: 0, cover: [Rect::NONE; SCREENS] };
            waiting.push(waits);
        }
    }
    for (index, screen) in screens.iter().enumerate() {
        if wanted >> index & 1 == 0 {
            continue;
        }
        let sign = simd.splat(screen.sign as f32);
        let [right, up, forward] = screen.axes;
        let (z, deep) = (simd.mul(middle[forward], sign), reach[forward]);
        let (least, most) = (simd.sub(z, deep), simd.add(z, deep));
        let mut on = seen & simd.lanes(simd.greater(most, zero));
        if on == 0 {
            continue;
        }
        // A box that reaches beside or behind the eye may be seen anywhere that its sides allow.
        let before = simd.greater(least, simd.mul(far, simd.splat(SLACK)));
        let (nearest, farthest) = (simd.div(one, least), simd.div(one, most));
        let mut cover = [[0_u32; LANES]; 4];
        for (along, axis) in [right, up].into_iter().enumerate() {
            let (low, high) = (simd.sub(middle[axis], reach[axis]), simd.add(middle[axis], reach[axis]));
            // The sides' planes, where the box comes nearest to them.
            let [from, to] = screen.sides(along);
            let spread = simd.mul(deep, simd.splat(from.abs() as f32));
            on &= simd.lanes(simd.greater(high, simd.sub(simd.mul(z, simd.splat(from as f32)), spread)));
            let spread = simd.mul(deep, simd.splat(to.abs() as f32));
            on &= simd.lanes(simd.greater(simd.add(simd.mul(z, simd.splat(to as f32)), spread), low));
            let low = simd.mul(low, simd.select(simd.greater(low, zero), farthest, nearest));
            let high = simd.mul(high, simd.select(simd.greater(high, zero), nearest, farthest));
            let span = screen.cells_between(simd, along, [low, high], before);
            on &= simd.lanes(simd.greater_int(span[1], span[0]));
            simd.store_int(span[0], &mut cover[2 * along]);
            simd.store_int(span[1], &mut cover[2 * along + 1]);
        }
        let mut nearness = [0.0; LANES];
        let nearest = simd.mul(nearest, simd.splat(1.0 + SLACK));
        simd.store(simd.select(before, nearest, simd.splat(f32::INFINITY)), &mut nearness);
        let mut place = base;
        for lane in 0..branch.count {
            if seen >> lane & 1 == 0 {
                continue;
            }
            if on >> lane & 1 == 1 {
                let waits = &mut waiting[place];
                waits.screens |= 1 << index;
                waits.cover[index] = Rect {
                    columns: [cover[0][lane] as i32, cover[1][lane] as i32],
                    rows: [cover[2][lane] as i32, cover[3][lane] as i32],
                    nearest: nearness[lane],
                };
            }
            place += 1;
        }
    }

    // Keep those on a screen, the nearest last; few enough for the plainest sorting.
    let (mut kept, mut place) = (base, base);
    let mut keys = [0.0; LANES];
    for lane in 0..branch.count {
        if seen >> lane & 1 == 0 {
            continue;
        }
        let waits = waiting[place];
        place += 1;
        if waits.screens == 0 {
            continue;
        }
        let mut slot = kept;
        while slot > base && keys[slot - 1 - base] < distances[lane] {
            waiting[slot] = waiting[slot - 1];
            keys[slot - base] = keys[slot - 1 - base];
            slot -= 1;
        }
        waiting[slot] = waits;
        keys[slot - base] = distances[lane];
        kept += 1;
    }
    waiting.truncate(kept);
}
