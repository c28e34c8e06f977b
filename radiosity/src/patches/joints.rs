//! Surfaces that go on smoothly in one another, kept together while their faces are quartered.

use std::collections::BTreeMap;

use super::split::{BorderEdge, Net};

/// Two surfaces that share an edge go on in one another where their normals are within this, as where contacts are looked for:
/// the cosine of 45 degrees.
const BENT: f64 = 0.707_106_781_186_547_5;

/// An edge that two nets have in common, and where it is in either.
pub(super) struct Joint {
    nets: [usize; 2],
    ends: [[u32; 2]; 2],
}

/// Where the borders of nets lie on one another edge by edge, end by end to the bit, and go on smoothly. To be asked before
/// anything is quartered.
pub(super) fn joints(nets: &[Net]) -> Vec<Joint> {
    let mut edges: BTreeMap<[[u64; 3]; 2], Vec<(usize, BorderEdge)>> = BTreeMap::new();
    for (index, net) in nets.iter().enumerate() {
        for edge in net.border() {
            edges.entry(edge.key).or_default().push((index, edge));
        }
    }
    let mut joints = Vec::new();
    for shared in edges.values() {
        for (at, (one, edge)) in shared.iter().enumerate() {
            let onward = shared[at + 1..].iter().find(|(_, other)| edge.normal.dot(other.normal) > BENT);
            if let Some((other, on)) = onward {
                joints.push(Joint { nets: [*one, *other], ends: [edge.ends, on.ends] });
            }
        }
    }
    joints
}

/// Quarter faces until of two that share an edge, be they of one surface or of two that go on in one another, none is more
/// than twice as long as the other; and have every point on a shared edge in both.
pub(super) fn balance(nets: &mut [Net], joints: &[Joint]) {
    loop {
        let mut any = false;
        for net in nets.iter_mut() {
            any |= net.balance();
        }
        for joint in joints {
            any |= share(nets, joint.nets, joint.ends);
        }
        if !any {
            return;
        }
    }
}

/// Give to either net what the other has put on an edge. Returns whether there was anything.
fn share(nets: &mut [Net], of: [usize; 2], ends: [[u32; 2]; 2]) -> bool {
    let found = [0, 1].map(|k| nets[of[k]].middle(ends[k]));
    if found == [None; 2] {
        return false;
    }
    let new = found.contains(&None);
    let middles = [0, 1].map(|k| nets[of[k]].halve(ends[k]));
    let before = share(nets, of, [0, 1].map(|k| [ends[k][0], middles[k]]));
    let after = share(nets, of, [0, 1].map(|k| [middles[k], ends[k][1]]));
    new || before || after
}
