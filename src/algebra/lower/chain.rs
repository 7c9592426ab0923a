//! Force and moment of a leg with any axes, see [`crate::robot::ChainLeg`].

use super::wrench::Steps;
use crate::ir::{Binary, Unary, ValueId};
use crate::robot::kinematics::least_levers;
use crate::robot::{BODY_DIM, ChainLeg};

/// A number that is known, or a value of the program; what is known costs no operation.
#[derive(Clone, Copy)]
enum Scalar {
    Known(f64),
    Value(ValueId),
}

type Vector = [Scalar; 3];

/// Sine and cosine of each joint's angle.
pub(super) type JointAngles = [(ValueId, ValueId); 3];

impl Steps<'_> {
    /// Force and moment of one leg about its first joint, in axes parallel to the body's.
    pub(super) fn chain_wrench(
        &mut self,
        leg: &ChainLeg,
        angles: JointAngles,
        torques: [ValueId; 3],
        foot: ValueId,
    ) -> [ValueId; BODY_DIM] {
        let known = |vector: [f64; 3]| vector.map(Scalar::Known);
        let [first, second, third] = leg.axes.map(known);
        let [hip, thigh, calf] = leg.links.map(known);
        let calf = self.turned_about(leg, angles, 2, calf);
        let calf = self.turned_about(leg, angles, 1, calf);
        let beyond_knee = self.turned_about(leg, angles, 0, calf);
        let thigh = self.turned_about(leg, angles, 1, thigh);
        let thigh = self.turned_about(leg, angles, 0, thigh);
        let beyond_second = self.vector_sum(thigh, beyond_knee);
        let hip = self.turned_about(leg, angles, 0, hip);
        let position = self.vector_sum(hip, beyond_second);
        let normal = self.turned_about(leg, angles, 0, second);
        let knee_axis = self.turned_about(leg, angles, 1, third);
        let knee_axis = self.turned_about(leg, angles, 0, knee_axis);
        let columns = [
            self.cross(first, position),
            self.cross(normal, beyond_second),
            self.cross(knee_axis, beyond_knee),
        ];
        // F = -J^-T tau by area and lever, as ChainLeg::damped_force_map.
        let across = self.cross(columns[1], columns[2]);
        let (area, lever) = (self.dot(across, normal), self.dot(columns[0], normal));
        let [area, lever] = [area, lever].map(|scalar| self.value(scalar));
        let [least_area, least_lever] = least_levers(leg.lengths());
        let one = self.0.constant(1.0);
        let of_area = Scalar::Value(self.damped(one, area, least_area));
        let of_lever = Scalar::Value(self.damped(one, lever, least_lever));
        let torques = torques.map(|torque| Scalar::Value(self.0.mul(foot, torque)));
        // In the plane: (c_2 x n) tau_1 + (n x c_1) tau_2 over the area.
        let of_second = self.cross(columns[2], normal);
        let of_third = self.cross(normal, columns[1]);
        let of_second = self.vector_times(torques[1], of_second);
        let of_third = self.vector_times(torques[2], of_third);
        let in_plane = self.vector_sum(of_second, of_third);
        let in_plane = self.vector_times(of_area, in_plane);
        // Along the normal: tau_0 - c_0 . (the force in the plane, reversed) over the lever.
        let levered = self.dot(columns[0], in_plane);
        let rest = self.difference(torques[0], levered);
        let along = self.product(rest, of_lever);
        let along = self.vector_times(along, normal);
        let force = self.vector_sum(in_plane, along);
        let force = force.map(|component| self.product(Scalar::Known(-1.0), component));
        let moment = self.cross(position, force);
        let [f_x, f_y, f_z] = force.map(|component| self.value(component));
        let [m_x, m_y, m_z] = moment.map(|component| self.value(component));
        [f_x, f_y, f_z, m_x, m_y, m_z]
    }

    fn value(&mut self, scalar: Scalar) -> ValueId {
        match scalar {
            Scalar::Known(number) => self.0.constant(number),
            Scalar::Value(value) => value,
        }
    }

    fn binary(&mut self, op: Binary, a: Scalar, b: Scalar) -> Scalar {
        let (a, b) = (self.value(a), self.value(b));
        Scalar::Value(self.0.binary(op, a, b))
    }

    fn total(&mut self, a: Scalar, b: Scalar) -> Scalar {
        match (a, b) {
            (Scalar::Known(a), Scalar::Known(b)) => Scalar::Known(a + b),
            (Scalar::Known(0.0), other) | (other, Scalar::Known(0.0)) => other,
            _ => self.binary(Binary::Add, a, b),
        }
    }

    fn difference(&mut self, a: Scalar, b: Scalar) -> Scalar {
        match (a, b) {
            (Scalar::Known(a), Scalar::Known(b)) => Scalar::Known(a - b),
            (_, Scalar::Known(0.0)) => a,
            (Scalar::Known(0.0), Scalar::Value(b)) => Scalar::Value(self.0.unary(Unary::Neg, b)),
            _ => self.binary(Binary::Sub, a, b),
        }
    }

    fn product(&mut self, a: Scalar, b: Scalar) -> Scalar {
        match (a, b) {
            (Scalar::Known(a), Scalar::Known(b)) => Scalar::Known(a * b),
            (Scalar::Known(0.0), _) | (_, Scalar::Known(0.0)) => Scalar::Known(0.0),
            (Scalar::Known(1.0), other) | (other, Scalar::Known(1.0)) => other,
            (Scalar::Known(-1.0), Scalar::Value(b)) | (Scalar::Value(b), Scalar::Known(-1.0)) => {
                Scalar::Value(self.0.unary(Unary::Neg, b))
            }
            _ => self.binary(Binary::Mul, a, b),
        }
    }

    fn vector_sum(&mut self, a: Vector, b: Vector) -> Vector {
        std::array::from_fn(|i| self.total(a[i], b[i]))
    }

    fn vector_times(&mut self, factor: Scalar, vector: Vector) -> Vector {
        vector.map(|component| self.product(factor, component))
    }

    fn dot(&mut self, a: Vector, b: Vector) -> Scalar {
        let mut sum = Scalar::Known(0.0);
        for (a, b) in a.into_iter().zip(b) {
            let product = self.product(a, b);
            sum = self.total(sum, product);
        }
        sum
    }

    fn cross(&mut self, a: Vector, b: Vector) -> Vector {
        std::array::from_fn(|i| {
            let (j, k) = ((i + 1) % 3, (i + 2) % 3);
            let (left, right) = (self.product(a[j], b[k]), self.product(a[k], b[j]));
            self.difference(left, right)
        })
    }

    /// `v cos + (a x v) sin + a (a . v) (1 - cos)` about the axis of a joint.
    fn turned_about(
        &mut self,
        leg: &ChainLeg,
        angles: JointAngles,
        joint: usize,
        vector: Vector,
    ) -> Vector {
        let axis = leg.axes[joint].map(Scalar::Known);
        let (sin, cos) = (
            Scalar::Value(angles[joint].0),
            Scalar::Value(angles[joint].1),
        );
        let across = self.cross(axis, vector);
        let along = self.dot(axis, vector);
        let versine = self.difference(Scalar::Known(1.0), cos);
        let along = self.product(along, versine);
        std::array::from_fn(|i| {
            let (kept, turned) = (self.product(vector[i], cos), self.product(across[i], sin));
            let sum = self.total(kept, turned);
            let along = self.product(axis[i], along);
            self.total(sum, along)
        })
    }
}
