//! URDFs made from numbers, and the kinematics of these numbers computed independently of romc: one transform per
//! joint.

use std::collections::BTreeMap;

use nalgebra::{Isometry3, Translation3, UnitQuaternion, Vector3};

#[derive(Clone)]
pub struct Joint {
    pub name: String,
    pub kind: String,
    pub parent: String,
    pub child: String,
    pub xyz: [f64; 3],
    pub rpy: [f64; 3],
    pub axis: [f64; 3],
    /// Lower, upper, effort, velocity.
    pub limit: Option<[f64; 4]>,
    pub inside: String,
}

/// A robot in the form of its URDF: one link or joint per line, links first.
#[derive(Clone)]
pub struct Made {
    pub links: Vec<(String, Option<f64>)>,
    pub joints: Vec<Joint>,
}

/// A joint that fixes a link.
pub fn fixed(name: &str, parent: &str, child: &str, xyz: [f64; 3], rpy: [f64; 3]) -> Joint {
    let [name, parent, child] = [name, parent, child].map(str::to_owned);
    let (kind, inside) = ("fixed".to_owned(), String::new());
    Joint {
        name,
        kind,
        parent,
        child,
        xyz,
        rpy,
        axis: [1.0, 0.0, 0.0],
        limit: None,
        inside,
    }
}

pub const LEGS: [&str; 4] = ["FR", "FL", "RR", "RL"];

impl Made {
    /// A `trunk` of 5 kg with legs of thigh and calf of 0.2 m.
    pub fn quadruped() -> Self {
        let mut made = Self {
            links: vec![("trunk".to_owned(), Some(5.0))],
            joints: Vec::new(),
        };
        for leg in LEGS {
            let (x, y) = (
                if leg.starts_with('F') { 1.0 } else { -1.0 },
                if leg.ends_with('L') { 1.0 } else { -1.0 },
            );
            let mut parent = "trunk".to_owned();
            for (part, xyz, axis, mass) in [
                ("hip", [0.2 * x, 0.05 * y, 0.0], [1.0, 0.0, 0.0], 0.5),
                ("thigh", [0.0, 0.08 * y, 0.0], [0.0, 1.0, 0.0], 0.8),
                ("calf", [0.0, 0.0, -0.2], [0.0, 1.0, 0.0], 0.2),
            ] {
                let child = format!("{leg}_{part}");
                let joint = fixed(&format!("{child}_joint"), &parent, &child, xyz, [0.0; 3]);
                let (kind, limit) = ("revolute".to_owned(), Some([-2.0, 2.5, 20.0, 30.0]));
                made.joints.push(Joint {
                    kind,
                    axis,
                    limit,
                    ..joint
                });
                made.links.push((child.clone(), Some(mass)));
                parent = child;
            }
            let foot = format!("{leg}_foot");
            made.joints.push(fixed(
                &format!("{foot}_fixed"),
                &parent,
                &foot,
                [0.0, 0.0, -0.2],
                [0.0; 3],
            ));
            made.links.push((foot, Some(0.06)));
        }
        made
    }

    /// The same robot below a chain of massless links, each on a joint of the given kind.
    pub fn below(mut self, above: &[(&str, &str, [f64; 3], [f64; 3])]) -> Self {
        let parents = above.iter().map(|(link, ..)| *link);
        let children = parents.clone().skip(1).chain(["trunk"]).collect::<Vec<_>>();
        for ((link, kind, xyz, rpy), child) in above.iter().zip(children) {
            let joint = fixed(&format!("above_{child}"), link, child, *xyz, *rpy);
            let kind = (*kind).to_owned();
            self.joints.push(Joint {
                kind,
                limit: Some([-9.0, 9.0, 0.0, 0.0]),
                ..joint
            });
            self.links.push(((*link).to_owned(), None));
        }
        self
    }

    pub fn joint(&mut self, name: &str) -> &mut Joint {
        let joint = self.joints.iter_mut().find(|joint| joint.name == name);
        joint.expect("a joint")
    }

    pub fn urdf(&self) -> String {
        let three = |[x, y, z]: [f64; 3]| format!("{x:?} {y:?} {z:?}");
        let mut text = "<robot name=\"made\">\n".to_owned();
        for (name, mass) in &self.links {
            let inertial = mass.map_or(String::new(), |mass| {
                format!("<inertial><mass value=\"{mass:?}\"/><inertia ixx=\"0.1\" iyy=\"0.1\" izz=\"0.1\"/></inertial>")
            });
            text += &format!("<link name=\"{name}\">{inertial}</link>\n");
        }
        for joint in &self.joints {
            let Joint {
                name,
                kind,
                parent,
                child,
                inside,
                ..
            } = joint;
            let limit = joint.limit.map_or(String::new(), |[lower, upper, effort, velocity]| {
                format!("<limit lower=\"{lower:?}\" upper=\"{upper:?}\" effort=\"{effort:?}\" velocity=\"{velocity:?}\"/>")
            });
            text += &format!(
                "<joint name=\"{name}\" type=\"{kind}\"><parent link=\"{parent}\"/><child link=\"{child}\"/>\
                 <origin xyz=\"{}\" rpy=\"{}\"/><axis xyz=\"{}\"/>{limit}{inside}</joint>\n",
                three(joint.xyz),
                three(joint.rpy),
                three(joint.axis)
            );
        }
        text + "</robot>\n"
    }

    /// Links from the root to `link`, each with the joint above it.
    pub fn path<'a>(&'a self, link: &'a str) -> Vec<(&'a str, Option<&'a Joint>)> {
        let mut path = Vec::new();
        let mut at = Some(link);
        while let Some(link) = at {
            let above = self.joints.iter().find(|joint| joint.child == link);
            path.push((link, above));
            at = above.map(|joint| joint.parent.as_str());
        }
        path.reverse();
        path
    }

    /// The frame of a link relative to one above it, at joint angles by name.
    pub fn frame(&self, above: &str, link: &str, angles: &BTreeMap<&str, f64>) -> Isometry3<f64> {
        let path = self
            .path(link)
            .into_iter()
            .skip_while(|(link, _)| *link != above)
            .skip(1);
        let about = |axis: Vector3<f64>, angle: f64| UnitQuaternion::from_scaled_axis(axis * angle);
        path.fold(Isometry3::identity(), |frame, (_, joint)| {
            let joint = joint.expect("below");
            let [roll, pitch, yaw] = joint.rpy;
            let turn =
                about(Vector3::z(), yaw) * about(Vector3::y(), pitch) * about(Vector3::x(), roll);
            let angle = angles.get(joint.name.as_str()).copied().unwrap_or(0.0);
            let own = match joint.kind.as_str() {
                "fixed" => UnitQuaternion::identity(),
                _ => about(Vector3::from(joint.axis).normalize(), angle),
            };
            frame * Translation3::from(joint.xyz) * turn * own
        })
    }
}
