//! The scene in front of the station: surfaces intersected by rays, moved by the stage.

use std::sync::Arc;

use nalgebra::{Matrix3, Rotation3, Vector3};
use optics::rotation::completing_frame;
use optics::{Motion, PointMm, RotaryAxis};
use rand::{Rng, SeedableRng};
use rand_pcg::Pcg64;
use vision::LineDirection;

use crate::model::random::derived_seed;
use crate::model::station::StationModel;
use crate::params::{PART_REFLECTANCE, SAME_HIT_MM};
use crate::part::board::Board;
use crate::part::freeform::Freeform;
use crate::part::mesh::{Mesh, Solid};

/// Half-sizes of the gauge block's top at a field of ±100 mm.
const BLOCK_HALF_MM: [f64; 2] = [11.0, 7.0];

/// Greatest tilt of plates against the camera axis, radians: a plate placed on a table by hand.
const PLATE_LEAN_RAD: f64 = 0.03;

/// Greatest sideways offset of a ball, mm per radian of [`PLATE_LEAN_RAD`]; on a turntable large enough for a visible
/// rotation.
const ASIDE_MM: (f64, f64) = (30.0, 200.0);

/// Intersection of a ray with a scene.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct SceneHit {
    /// The hit is origin + `ray_length` · direction.
    pub ray_length: f64,
    /// Unit normal of the surface, out of the material.
    pub normal: Vector3<f64>,
    /// Fraction of the light that a white, matt surface would reflect, 0–1.
    pub reflectance: f64,
}

/// A hit that serves as the initial guess for a neighbouring ray.
#[derive(Debug, Clone, Copy)]
pub(crate) struct NearHit {
    pub point_mm: Vector3<f64>,
    pub normal: Vector3<f64>,
}

impl NearHit {
    /// Ray length to the tangent plane.
    pub(crate) fn ray_length_to(&self, origin: &Vector3<f64>, direction: &Vector3<f64>) -> f64 {
        self.normal.dot(&(self.point_mm - origin)) / self.normal.dot(direction)
    }
}

/// A bounding sphere.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(crate) struct Ball {
    pub centre_mm: Vector3<f64>,
    pub radius_mm: f64,
}

impl Ball {
    /// Whether the line of a ray may intersect the content.
    #[inline]
    pub(crate) fn is_near(&self, origin: &Vector3<f64>, direction: &Vector3<f64>) -> bool {
        let beside = (self.centre_mm - origin).cross(direction).norm_squared();
        beside <= self.radius_mm * self.radius_mm * direction.norm_squared() * (1.0 + SAME_HIT_MM)
    }
}

/// The scene of the camera, in the camera frame at stage position 0.
#[derive(Debug, Clone, PartialEq)]
pub enum Scene {
    /// A chessboard in front of a backdrop.
    Board(Board),
    /// A plane.
    Plate(Plate),
    /// A block on a plate.
    Gauge(Gauge),
    /// A ball on a plate.
    Sphere(Sphere),
    /// Smooth hills on a plate.
    Freeform(Freeform),
    /// A triangle mesh on a plate.
    Mesh(Mesh),
}

/// An unbounded plane.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Plate {
    /// Columns: two directions in the plane, and its normal towards the camera.
    pub axes: Matrix3<f64>,
    /// A point of the plane; the origin of the part on it.
    pub point_mm: Vector3<f64>,
}

/// A block on a plate, its top parallel to it.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Gauge {
    /// The plate.
    pub plate: Plate,
    /// Height of the top above the plate.
    pub height_mm: f64,
    /// Half-sizes along the plate's first two axes.
    pub half_mm: [f64; 2],
}

/// A ball that touches a plate.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Sphere {
    /// The plate.
    pub plate: Plate,
    /// Radius.
    pub radius_mm: f64,
    /// Centre, in the camera frame.
    pub centre_mm: Vector3<f64>,
}

/// Kind of part on the stage.
#[derive(Debug, Clone, Copy, PartialEq)]
pub enum SceneKind {
    /// The bare plate.
    Plate,
    /// A gauge block.
    Gauge {
        /// Nominal height.
        height_mm: f64,
    },
    /// A ball.
    Sphere {
        /// Nominal radius.
        radius_mm: f64,
    },
    /// Smooth hills.
    Freeform,
}

impl SceneKind {
    /// Name of this kind on command lines and in truth files.
    pub fn name(&self) -> &'static str {
        match self {
            Self::Plate => "plate",
            Self::Gauge { .. } => "gauge",
            Self::Sphere { .. } => "sphere",
            Self::Freeform => "freeform",
        }
    }

    /// The part placed on the stage of `model` by hand: slightly tilted and rotated, according to random stream
    /// `stream` of its seed.
    pub fn placed(&self, model: &StationModel, stream: u64) -> Scene {
        let mut rng = Pcg64::seed_from_u64(derived_seed(model.seed, stream));
        let plate = placed_plate(model, &mut rng);
        let mut lean = || PLATE_LEAN_RAD * (2.0 * rng.random::<f64>() - 1.0);
        let axes = plate.axes;
        match *self {
            Self::Plate => Scene::Plate(plate),
            Self::Gauge { height_mm } => {
                let scale = model.shape.field_scale().min(1.0);
                Scene::Gauge(Gauge { plate, height_mm, half_mm: BLOCK_HALF_MM.map(|half| half * scale) })
            }
            Self::Sphere { radius_mm } => {
                let far = if model.stage.rotary().is_some() { ASIDE_MM.1 } else { ASIDE_MM.0 };
                let aside = axes.column(0) * lean() * far + axes.column(1) * lean() * far;
                let centre_mm = plate.point_mm + aside + axes.column(2) * radius_mm;
                Scene::Sphere(Sphere { plate, radius_mm, centre_mm })
            }
            Self::Freeform => Scene::Freeform(Freeform::seeded(plate, model.shape.field_half_width_mm, &mut rng)),
        }
    }
}

/// A plate placed on the stage by hand.
fn placed_plate(model: &StationModel, rng: &mut Pcg64) -> Plate {
    let mut lean = || PLATE_LEAN_RAD * (2.0 * rng.random::<f64>() - 1.0);
    let turn = Rotation3::from_euler_angles(lean(), lean(), lean());
    if let Some(axis) = model.stage.rotary() {
        return table_top(&axis, model.table_below_mm(), turn.euler_angles().2);
    }
    // x to the left and y downwards make the third axis point at the camera.
    let mut axes = turn * Matrix3::from_diagonal(&Vector3::new(-1.0, 1.0, -1.0));
    if model.shape.line_direction == LineDirection::Columns {
        axes *= Rotation3::from_axis_angle(&Vector3::z_axis(), std::f64::consts::FRAC_PI_2).matrix();
    }
    Plate { axes, point_mm: Vector3::new(0.0, 0.0, model.shape.standoff_mm) }
}

/// The top of a turntable, perpendicular to its axis at any angle; the part on it is rotated by `turn_rad`.
fn table_top(axis: &RotaryAxis, below_mm: f64, turn_rad: f64) -> Plate {
    let up = axis.direction;
    let (first, second) = completing_frame(&up);
    let (sin, cos) = turn_rad.sin_cos();
    let along = first * cos + second * sin;
    Plate { axes: Matrix3::from_columns(&[along, up.cross(&along), up]), point_mm: axis.point_mm - up * below_mm }
}

impl Scene {
    /// The scene rotated by a turntable; a board's backdrop stays in place.
    pub(crate) fn turned(&self, motion: &Motion) -> Self {
        let place = |at: &Vector3<f64>| motion.camera_from_part(&PointMm::new(*at)).xyz;
        let axes = |axes: &Matrix3<f64>| {
            Matrix3::from_columns(&[0, 1, 2].map(|axis| motion.camera_direction(&axes.column(axis).into_owned())))
        };
        let plate = |plate: &Plate| Plate { axes: axes(&plate.axes), point_mm: place(&plate.point_mm) };
        match self {
            Self::Board(board) => Self::Board(board.turned(motion)),
            Self::Plate(of) => Self::Plate(plate(of)),
            Self::Gauge(gauge) => Self::Gauge(Gauge { plate: plate(&gauge.plate), ..*gauge }),
            Self::Sphere(ball) => {
                Self::Sphere(Sphere { plate: plate(&ball.plate), centre_mm: place(&ball.centre_mm), ..*ball })
            }
            Self::Freeform(hills) => Self::Freeform(Freeform { plate: plate(&hills.plate), ..hills.clone() }),
            Self::Mesh(mesh) => Self::Mesh(Mesh { plate: plate(&mesh.plate), solid: mesh.solid.clone() }),
        }
    }

    /// A mesh placed on the stage of `model` by hand, as [`SceneKind::placed`] places the other parts.
    pub fn mesh(solid: Arc<Solid>, model: &StationModel, stream: u64) -> Self {
        let mut rng = Pcg64::seed_from_u64(derived_seed(model.seed, stream));
        Self::Mesh(Mesh { plate: placed_plate(model, &mut rng), solid })
    }

    /// The first surface hit by a ray; `direction` need not be a unit vector.
    pub fn hit(&self, origin: &Vector3<f64>, direction: &Vector3<f64>) -> Option<SceneHit> {
        match self {
            Self::Board(board) => board.hit(origin, direction),
            Self::Plate(plate) => plate.hit(origin, direction),
            Self::Gauge(gauge) => nearer(gauge.block_hit(origin, direction), gauge.plate.hit(origin, direction)),
            Self::Sphere(ball) => nearer(ball.ball_hit(origin, direction), ball.plate.hit(origin, direction)),
            Self::Freeform(freeform) => freeform.hit(origin, direction),
            Self::Mesh(mesh) => nearer(mesh.solid_hit(origin, direction), mesh.plate.hit(origin, direction)),
        }
    }

    /// A bounding sphere of the part on a plate, if rays outside of it can hit only the plate.
    pub(crate) fn part_ball(&self) -> Option<Ball> {
        match self {
            Self::Gauge(Gauge { plate, height_mm, half_mm }) => {
                let half = Vector3::new(half_mm[0], half_mm[1], height_mm / 2.0);
                let centre_mm = plate.point_mm + plate.axes.column(2) * half.z;
                Some(Ball { centre_mm, radius_mm: half.norm() })
            }
            Self::Sphere(ball) => Some(Ball { centre_mm: ball.centre_mm, radius_mm: ball.radius_mm }),
            Self::Mesh(mesh) => Some(mesh.ball()),
            Self::Board(_) | Self::Plate(_) | Self::Freeform(_) => None,
        }
    }

    /// Whether light from `from` reaches `to`, a point on the surface with this normal.
    pub(crate) fn lights(&self, from: &Vector3<f64>, to: &Vector3<f64>, normal: &Vector3<f64>) -> bool {
        match self {
            Self::Plate(_) => true,
            Self::Freeform(part) if part.is_proven_lit(from, to, normal) => true,
            _ => self.reaches(from, to),
        }
    }

    /// A number that identifies this scene, the same on every machine.
    pub fn fingerprint(&self) -> u64 {
        let of_plate = |plate: &Plate| plate.axes.iter().chain(&plate.point_mm).copied().collect::<Vec<f64>>();
        let (kind, numbers) = match self {
            Self::Board(board) => {
                let place = board.axes.iter().chain(&board.centre_mm).copied();
                (1, place.chain(board.pattern_numbers()).chain([board.backdrop_z_mm]).collect())
            }
            Self::Plate(plate) => (2, of_plate(plate)),
            Self::Gauge(gauge) => (3, [&of_plate(&gauge.plate), &[gauge.height_mm][..], &gauge.half_mm].concat()),
            Self::Sphere(ball) => {
                (4, [&of_plate(&ball.plate), ball.centre_mm.as_slice(), &[ball.radius_mm]].concat())
            }
            Self::Freeform(part) => {
                let hills = part.hills.iter();
                let hills = hills.flat_map(|hill| [hill.at_mm[0], hill.at_mm[1], hill.sigma_mm, hill.height_mm]);
                (5, of_plate(&part.plate).into_iter().chain(hills).collect())
            }
            Self::Mesh(mesh) => (mesh.solid.fingerprint(), of_plate(&mesh.plate)),
        };
        numbers.into_iter().map(f64::to_bits).fold(kind, derived_seed)
    }

    /// Whether light from `from` reaches `to`, a point on one of the surfaces.
    pub fn reaches(&self, from: &Vector3<f64>, to: &Vector3<f64>) -> bool {
        let dir = to - from;
        let length = dir.norm();
        let (dir, limit) = (dir / length, hidden_beyond(length));
        let beyond = |hit: Option<SceneHit>| hit.is_none_or(|hit| hit.ray_length > limit);
        match self {
            Self::Mesh(mesh) => beyond(mesh.plate.hit(from, &dir)) && !mesh.is_in_the_way(from, &dir, limit),
            _ => beyond(self.hit(from, &dir)),
        }
    }
}

/// Path length beyond which an intersection is the end of the path itself.
pub(crate) fn hidden_beyond(length_mm: f64) -> f64 {
    length_mm - SAME_HIT_MM * length_mm.max(1.0)
}

fn nearer(a: Option<SceneHit>, b: Option<SceneHit>) -> Option<SceneHit> {
    match (a, b) {
        (Some(a), Some(b)) => Some(if a.ray_length <= b.ray_length { a } else { b }),
        (a, b) => a.or(b),
    }
}

impl Plate {
    /// The normal, towards the camera.
    pub fn normal(&self) -> Vector3<f64> {
        self.axes.column(2).into_owned()
    }

    /// A point or vector of the camera frame along the plate's axes.
    pub(crate) fn local(&self, vector: &Vector3<f64>) -> Vector3<f64> {
        self.axes.tr_mul(vector)
    }

    /// Intersection of a ray with the plane.
    pub fn hit(&self, origin: &Vector3<f64>, direction: &Vector3<f64>) -> Option<SceneHit> {
        let normal = self.normal();
        let ray_length = normal.dot(&(self.point_mm - origin)) / normal.dot(direction);
        (ray_length.is_finite() && ray_length > 0.0).then_some(SceneHit {
            ray_length,
            normal,
            reflectance: PART_REFLECTANCE,
        })
    }
}

impl Gauge {
    /// Ray length at which the block is entered (slab by slab, Kay & Kajiya 1986).
    fn block_hit(&self, origin: &Vector3<f64>, direction: &Vector3<f64>) -> Option<SceneHit> {
        let from = self.plate.local(&(origin - self.plate.point_mm));
        let dir = self.plate.local(direction);
        let low = [-self.half_mm[0], -self.half_mm[1], 0.0];
        let high = [self.half_mm[0], self.half_mm[1], self.height_mm];
        let (mut enter, mut leave, mut face) = (f64::NEG_INFINITY, f64::INFINITY, 0);
        for axis in 0..3 {
            let a = (low[axis] - from[axis]) / dir[axis];
            let b = (high[axis] - from[axis]) / dir[axis];
            if a.min(b) > enter {
                (enter, face) = (a.min(b), axis);
            }
            leave = leave.min(a.max(b));
        }
        if !(enter > 0.0 && enter <= leave) {
            return None;
        }
        let normal = self.plate.axes.column(face) * -dir[face].signum();
        Some(SceneHit { ray_length: enter, normal, reflectance: PART_REFLECTANCE })
    }
}

impl Sphere {
    fn ball_hit(&self, origin: &Vector3<f64>, direction: &Vector3<f64>) -> Option<SceneHit> {
        let to_centre = self.centre_mm - origin;
        let square = direction.norm_squared();
        let along = to_centre.dot(direction) / square;
        let beside = (to_centre - direction * along).norm_squared();
        let inside = self.radius_mm * self.radius_mm - beside;
        if inside < 0.0 {
            return None;
        }
        let ray_length = along - (inside / square).sqrt();
        let normal = (direction * ray_length - to_centre) / self.radius_mm;
        (ray_length > 0.0).then_some(SceneHit { ray_length, normal, reflectance: PART_REFLECTANCE })
    }
}
