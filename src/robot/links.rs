//! Torques that a leg needs to carry and move its own links, which never reach the ground.

use core::ops::{Add, Mul, Neg, Sub};

use super::geometry::{LegLinks, Robot};
use super::joints::Leg;
use super::leg::Real;

/// First and second moments of the moving parts of one leg, the same for every leg.
#[derive(Debug, Clone, Copy, PartialEq, Default)]
pub struct LegMoments {
    /// Mass times lateral distance from the axis of abduction, kg m.
    pub side_kg_m: f64,
    /// Mass times distance from the hip along the thigh; the calf's mass counts at the knee, kg m.
    pub thigh_kg_m: f64,
    /// Mass times distance from the knee along the calf, kg m.
    pub calf_kg_m: f64,
    /// Second moment of the thigh about the hip, the calf's mass at the knee, kg m^2.
    pub thigh_kg_m2: f64,
    /// Second moment of the calf about the knee, kg m^2.
    pub calf_kg_m2: f64,
}

impl LegMoments {
    /// The moments that are accepted, in words.
    pub const ACCEPTED: &str = "a finite number, of second moments at least 0";

    /// The first moment that is not finite, or second one that is negative: its name and value.
    #[must_use]
    pub fn unusable(&self) -> Option<(&'static str, f64)> {
        let all = [
            ("side_kg_m", self.side_kg_m, f64::NEG_INFINITY),
            ("thigh_kg_m", self.thigh_kg_m, f64::NEG_INFINITY),
            ("calf_kg_m", self.calf_kg_m, f64::NEG_INFINITY),
            ("thigh_kg_m2", self.thigh_kg_m2, 0.0),
            ("calf_kg_m2", self.calf_kg_m2, 0.0),
        ];
        let bad = |(_, value, least): &(_, f64, f64)| !(value.is_finite() && value >= least);
        let found = all.into_iter().find(bad);
        found.map(|(name, value, _)| (name, value))
    }
}

/// Operations that vector formulas require of a scalar: numbers, or values of a program.
pub trait Scalar:
    Copy + Neg<Output = Self> + Add<Output = Self> + Sub<Output = Self> + Mul<Output = Self>
{
}

impl<T: Copy + Neg<Output = T> + Add<Output = T> + Sub<Output = T> + Mul<Output = T>> Scalar for T {}

#[derive(Debug, Clone, Copy)]
struct Vector<T>([T; 3]);

impl<T: Scalar> Vector<T> {
    fn plus(self, Self([d, e, f]): Self) -> Self {
        let [a, b, c] = self.0;
        Self([a + d, b + e, c + f])
    }

    fn times(self, factor: T) -> Self {
        Self(self.0.map(|entry| entry * factor))
    }

    fn cross(self, Self([d, e, f]): Self) -> Self {
        let [a, b, c] = self.0;
        Self([b * f - c * e, c * d - a * f, a * e - b * d])
    }

    fn dot(self, Self([d, e, f]): Self) -> T {
        let [a, b, c] = self.0;
        a * d + b * e + c * f
    }

    /// The vector seen from axes turned about a unit axis: it turns back.
    fn seen(self, axis: Self, sine: T, cosine: T) -> Self {
        let along = axis.times(axis.dot(self));
        let across = axis.cross(self);
        let back = across.cross(axis).times(cosine);
        let [a, b, c] = across.times(sine).0;
        let Vector([d, e, f]) = along.plus(back);
        Self([d - a, e - b, f - c])
    }
}

/// A rigid body's angular velocity (rad/s) and acceleration (rad/s^2).
#[derive(Debug, Clone, Copy)]
struct Spin<T> {
    rate: Vector<T>,
    change: Vector<T>,
}

impl<T: Scalar> Spin<T> {
    /// Of a body that turns about an axis of this one.
    fn with_joint(self, axis: Vector<T>, rate: T, acceleration: T) -> Self {
        let own = axis.times(rate);
        Self {
            rate: self.rate.plus(own),
            change: self
                .change
                .plus(axis.times(acceleration))
                .plus(self.rate.cross(own)),
        }
    }

    /// Acceleration of the end of a vector that is fixed to the body, over that of its beginning.
    fn accelerates(&self, vector: Vector<T>) -> Vector<T> {
        let centripetal = self.rate.cross(self.rate.cross(vector));
        self.change.cross(vector).plus(centripetal)
    }
}

/// How the trunk moves, in its own axes.
#[derive(Debug, Clone, Copy)]
pub struct TrunkMotion<T> {
    spin: Spin<T>,
    lift: Vector<T>, // acceleration of its origin less that of gravity
}

impl<T: Scalar> TrunkMotion<T> {
    /// From sines and cosines of roll, pitch and yaw, their rates (rad/s) and accelerations (rad/s^2), and the
    /// acceleration of the trunk's origin. The last is in world axes, with gravity added upwards (m/s^2).
    pub fn of(
        [[s_r, s_p, s_y], [c_r, c_p, c_y]]: [[T; 3]; 2],
        [roll, pitch, yaw]: [T; 3],
        [ddroll, ddpitch, ddyaw]: [T; 3],
        [x, y, z]: [T; 3],
    ) -> Self {
        // Axes of the rates of pitch and yaw in the trunk's axes: (0, c_r, -s_r) and (-s_p, c_p s_r, c_p c_r).
        let (y_yaw, z_yaw) = (c_p * s_r, c_p * c_r);
        let across = |roll_like: T, pitch_like: T, yaw_like: T| {
            Vector([
                roll_like - s_p * yaw_like,
                c_r * pitch_like + y_yaw * yaw_like,
                z_yaw * yaw_like - s_r * pitch_like,
            ])
        };
        // The rates of these axes times the rates.
        let by_axes = Vector([
            -(c_p * pitch * yaw),
            (z_yaw * roll - s_p * s_r * pitch) * yaw - s_r * roll * pitch,
            -(c_r * roll * pitch) - (y_yaw * roll + s_p * c_r * pitch) * yaw,
        ]);
        // Turned back by the yaw, the pitch and the roll.
        let (along, aside) = (c_y * x + s_y * y, c_y * y - s_y * x);
        let (front, up) = (c_p * along - s_p * z, s_p * along + c_p * z);
        Self {
            spin: Spin {
                rate: across(roll, pitch, yaw),
                change: across(ddroll, ddpitch, ddyaw).plus(by_axes),
            },
            lift: Vector([front, c_r * aside + s_r * up, c_r * up - s_r * aside]),
        }
    }
}

/// A leg whose own torques are asked for.
#[derive(Debug, Clone, Copy)]
pub struct MovingLeg<'a> {
    links: &'a LegLinks,
    hip: [Real; 3], // in the trunk's axes
    knee: Real,     // 1 where the third joint turns as the second does, -1 where against it
    moments: &'a LegMoments,
}

impl<'a> MovingLeg<'a> {
    /// A leg of a robot, with its [`LegGeometry::links`](super::geometry::LegGeometry::links).
    pub fn of(robot: &Robot, leg: Leg, links: &'a LegLinks, moments: &'a LegMoments) -> Self {
        Self {
            links,
            hip: robot.hip_position(leg).into(),
            knee: robot.geometry(leg).shape.knee,
            moments,
        }
    }

    /// Torques of abduction, flexion and knee (N m) that carry and move the links of a leg without a foot on the
    /// ground. Arguments are sines and cosines of the first angle, of the second and of the calf's, with joint
    /// velocities (rad/s) and accelerations (rad/s^2). A mass at `s` from a joint that accelerates by `a` needs the
    /// moment `s x (a + s'')`.
    pub fn torques<T: Scalar>(
        &self,
        trunk: &TrunkMotion<T>,
        [sine, cosine]: [[T; 3]; 2],
        [dq, ddq]: [[T; 3]; 2],
        constant: impl Fn(Real) -> T,
    ) -> [T; 3] {
        let fixed = |vector: [Real; 3]| Vector(vector.map(&constant));
        let length = |vector: &nalgebra::Vector3<Real>| constant(vector.norm());
        let unit = |vector: &nalgebra::Vector3<Real>| {
            // A link without a length has no direction.
            fixed(vector.try_normalize(0.0).unwrap_or_default().into())
        };
        let (links, moments, knee) = (self.links, self.moments, constant(self.knee));
        let abduction = fixed(links.abduction.into());
        let flexion = fixed(links.flexion.into());
        // All in axes that the first joint turns.
        let seen = |vector: Vector<T>| vector.seen(abduction, sine[0], cosine[0]);
        let at_hip = trunk.lift.plus(trunk.spin.accelerates(fixed(self.hip)));
        let start = seen(at_hip);
        let trunk = Spin {
            rate: seen(trunk.spin.rate),
            change: seen(trunk.spin.change),
        };
        let hip = trunk.with_joint(abduction, dq[0], ddq[0]);
        let thigh = hip.with_joint(flexion, dq[1], ddq[1]);
        let calf = thigh.with_joint(flexion, knee * dq[2], knee * ddq[2]);
        // Of links in the plane of the leg.
        let bent = |vector: Vector<T>, k: usize| {
            vector
                .times(cosine[k])
                .plus(flexion.cross(vector).times(sine[k]))
        };
        let along_side = unit(&links.hip);
        let (along_thigh, along_calf) = (bent(unit(&links.thigh), 1), bent(unit(&links.calf), 2));
        let side = along_side.times(length(&links.hip));
        let to_knee = along_thigh.times(length(&links.thigh));
        let plane = start.plus(hip.accelerates(side));
        let at_knee = plane.plus(thigh.accelerates(to_knee));
        let [of_thigh, of_calf] = [thigh.accelerates(along_thigh), calf.accelerates(along_calf)];
        let moment = |factor: Real, direction: Vector<T>, acceleration: Vector<T>| {
            direction.cross(acceleration).times(constant(factor))
        };
        let about_knee = moment(moments.calf_kg_m, along_calf, at_knee).plus(moment(
            moments.calf_kg_m2,
            along_calf,
            of_calf,
        ));
        let calf_force = of_calf.times(constant(moments.calf_kg_m));
        let about_hip = about_knee
            .plus(to_knee.cross(calf_force))
            .plus(moment(moments.thigh_kg_m, along_thigh, plane))
            .plus(moment(moments.thigh_kg_m2, along_thigh, of_thigh));
        let force = calf_force.plus(of_thigh.times(constant(moments.thigh_kg_m)));
        let about_first =
            about_hip
                .plus(side.cross(force))
                .plus(moment(moments.side_kg_m, along_side, plane));
        [
            abduction.dot(about_first),
            flexion.dot(about_hip),
            knee * flexion.dot(about_knee),
        ]
    }
}
