//! Shadow tests behind a mesh: neighbouring rays traverse its tree together, with the same arithmetic as a single ray
//! ([`crate::part::scene::Scene::reaches`]) and therefore the same bits.

use multiversion::multiversion;
use nalgebra::Vector3;

use super::{MAX_DEPTH, Mesh, Node, SEAM, Solid, Triangle};
use crate::part::scene::hidden_beyond;

/// Rays traversed together: two vector registers.
const N_RAYS: usize = 8;

/// Rays in the part's frame.
struct Rays {
    origin: [[f64; N_RAYS]; 3],
    direction: [[f64; N_RAYS]; 3],
    inverse: [[f64; N_RAYS]; 3],
    /// Only intersections before this length count; none do once it is negative.
    limit: [f64; N_RAYS],
}

impl Rays {
    const NONE: Self = Self {
        origin: [[0.0; N_RAYS]; 3],
        direction: [[0.0; N_RAYS]; 3],
        inverse: [[0.0; N_RAYS]; 3],
        limit: [f64::NEG_INFINITY; N_RAYS],
    };
}

impl Mesh {
    /// The lanes of `bits` that are lit; `path` returns the start of a lane's light and the point on part or plate
    /// where it ends, with the stage at 0.
    pub(crate) fn lit(&self, mut bits: u64, path: impl Fn(usize) -> [Vector3<f64>; 2]) -> u64 {
        let mut lit = 0;
        while bits != 0 {
            let (mut rays, mut lanes) = (Rays::NONE, [0; N_RAYS]);
            for (ray, lane) in lanes.iter_mut().enumerate() {
                if bits == 0 {
                    break;
                }
                *lane = bits.trailing_zeros();
                bits &= bits - 1;
                let [from, to] = path(*lane as usize);
                let dir = to - from;
                let length_mm = dir.norm();
                let (dir, limit) = (dir / length_mm, hidden_beyond(length_mm));
                if self.plate.hit(&from, &dir).is_some_and(|hit| hit.ray_length <= limit) {
                    continue;
                }
                lit |= 1 << *lane;
                let (from, dir) = (self.plate.local(&(from - self.plate.point_mm)), self.plate.local(&dir));
                for axis in 0..3 {
                    (rays.origin[axis][ray], rays.direction[axis][ray]) = (from[axis], dir[axis]);
                    rays.inverse[axis][ray] = dir[axis].recip();
                }
                rays.limit[ray] = limit;
            }
            let blocked = blocked(&self.solid, &mut rays);
            for (lane, _) in lanes.iter().zip(blocked).filter(|(_, blocked)| *blocked) {
                lit &= !(1 << lane);
            }
        }
        lit
    }
}

/// Which rays hit a triangle before their limit; their limit is then made negative.
#[multiversion(targets("x86_64+avx2"))]
fn blocked(solid: &Solid, rays: &mut Rays) -> [bool; N_RAYS] {
    let mut blocked = [false; N_RAYS];
    let mut stack = [0_u32; MAX_DEPTH + 2];
    let mut waiting = 1;
    while waiting > 0 {
        waiting -= 1;
        let idx = stack[waiting];
        let node = &solid.nodes[idx as usize];
        if !is_entered(node, rays) {
            continue;
        }
        if node.count == 0 {
            (stack[waiting], stack[waiting + 1]) = (idx + 1, node.first);
            waiting += 2;
            continue;
        }
        let first = node.first as usize;
        for triangle in &solid.triangles[first..first + node.count as usize] {
            let met = meets(triangle, rays);
            for ray in 0..N_RAYS {
                blocked[ray] |= met[ray];
                rays.limit[ray] = if met[ray] { f64::NEG_INFINITY } else { rays.limit[ray] };
            }
        }
    }
    blocked
}

/// Whether any ray enters a box before its limit, as `Node::enter`.
#[inline(always)]
fn is_entered(node: &Node, rays: &Rays) -> bool {
    let (mut enter, mut leave) = ([0.0; N_RAYS], [f64::INFINITY; N_RAYS]);
    for axis in 0..3 {
        let (low, high) = (node.low[axis], node.high[axis]);
        let (origin, inverse) = (&rays.origin[axis], &rays.inverse[axis]);
        for ray in 0..N_RAYS {
            let (a, b) = ((low - origin[ray]) * inverse[ray], (high - origin[ray]) * inverse[ray]);
            let (near, far) = (if b < a { b } else { a }, if a > b { a } else { b });
            enter[ray] = if near > enter[ray] { near } else { enter[ray] };
            leave[ray] = if far < leave[ray] { far } else { leave[ray] };
        }
    }
    let mut any = false;
    for ray in 0..N_RAYS {
        any |= (enter[ray] <= leave[ray]) & (enter[ray] < rays.limit[ray]);
    }
    any
}

/// Which rays hit a triangle before their limit, as `Triangle::reach`.
#[inline(always)]
fn meets(triangle: &Triangle, rays: &Rays) -> [bool; N_RAYS] {
    let Triangle { corner, sides: [a, b] } = triangle;
    let Rays { origin: [ox, oy, oz], direction: [dx, dy, dz], limit, .. } = rays;
    let mut met = [false; N_RAYS];
    for ray in 0..N_RAYS {
        let direction = Vector3::new(dx[ray], dy[ray], dz[ray]);
        let from = Vector3::new(ox[ray], oy[ray], oz[ray]) - corner;
        let p = direction.cross(b);
        let scale = a.dot(&p).recip();
        let q = from.cross(a);
        let (u, v, ray_length) = (from.dot(&p) * scale, direction.dot(&q) * scale, b.dot(&q) * scale);
        let inside = (u >= -SEAM) & (v >= -SEAM) & (u + v <= 1.0 + SEAM);
        met[ray] = inside & (ray_length > 0.0) & (ray_length < limit[ray]);
    }
    met
}
