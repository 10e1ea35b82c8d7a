//! Scene files moved, turned and scaled by their own numbers, in f64.

use crate::scene::scene_file::{RotateFile, SceneFile};
use glam::{DQuat, DVec3};

/// Where a scene goes: scaled, then turned, then moved.
#[derive(Clone, Copy, Debug)]
pub struct Place {
    /// Factor on all lengths.
    pub scale: f64,
    /// Axis (unit) and angle (rad) of the turn.
    pub turn: (DVec3, f64),
    /// Offset, metres.
    pub offset: DVec3,
    /// Whether shapes are placed by their `scale` and `translate` keys, where not by their coordinates.
    pub by_keys: bool,
}

impl Place {
    /// The place where a scene is.
    pub const NONE: Self = Self { scale: 1.0, turn: (DVec3::Y, 0.0), offset: DVec3::ZERO, by_keys: false };

    fn rotation(&self) -> DQuat {
        quaternion(self.turn.0, self.turn.1)
    }

    fn point(&self, p: [f64; 3]) -> [f64; 3] {
        (self.rotation() * (DVec3::from_array(p) * self.scale) + self.offset).to_array()
    }

    fn edge(&self, p: [f64; 3]) -> [f64; 3] {
        (self.rotation() * (DVec3::from_array(p) * self.scale)).to_array()
    }

    fn direction(&self, p: [f64; 3]) -> [f64; 3] {
        (self.rotation() * DVec3::from_array(p)).to_array()
    }

    /// The scene there. Lights keep their power, and glass lets as much through from side to side.
    pub fn of(&self, file: &SceneFile) -> SceneFile {
        let mut file = file.clone();
        let k = self.scale;
        if let Some(camera) = &mut file.camera {
            camera.position = self.point(camera.position);
            camera.target = self.point(camera.target);
            camera.up = Some(self.direction(camera.up.unwrap_or([0.0, 1.0, 0.0])));
        }
        for material in file.materials.values_mut() {
            material.transmittance = material.transmittance.map(|c| c.map(|t| libm::pow(t, 1.0 / k)));
        }
        for shape in &mut file.shapes {
            // A shape's own numbers are scaled, or its key is.
            let own = if self.by_keys { 1.0 } else { k };
            let numbers = |v: [f64; 3]| v.map(|x| x * own);
            shape.center = shape.center.map(numbers);
            shape.u = shape.u.map(numbers);
            shape.v = shape.v.map(numbers);
            shape.half_size = shape.half_size.map(numbers);
            for length in [&mut shape.radius, &mut shape.inner, &mut shape.outer, &mut shape.height] {
                *length = length.map(|l| l * own);
            }
            if self.by_keys || shape.file.is_some() {
                shape.scale = Some(shape.scale.unwrap_or(1.0) * k);
            }
            let still = self.turn.1 == 0.0;
            if still && !self.by_keys && shape.center.is_some() && shape.translate.is_none() && shape.rotate.is_none() {
                shape.center = shape.center.map(|c| (DVec3::from_array(c) + self.offset).to_array());
                continue;
            }
            shape.translate = Some(self.point(shape.translate.unwrap_or([0.0; 3])));
            if !still {
                let own = shape.rotate.as_ref().map_or(DQuat::IDENTITY, |r| {
                    quaternion(DVec3::from_array(r.axis).normalize(), r.angle.to_radians())
                });
                shape.rotate = Some(turn_of(self.rotation() * own));
            }
        }
        for light in &mut file.lights {
            light.position = light.position.map(|p| self.point(p));
            light.center = light.center.map(|p| self.point(p));
            light.u = light.u.map(|p| self.edge(p));
            light.v = light.v.map(|p| self.edge(p));
            light.direction = light.direction.map(|d| self.direction(d));
            light.radius = light.radius.map(|r| r * k);
        }
        file
    }
}

fn quaternion(axis: DVec3, angle: f64) -> DQuat {
    let (s, c) = libm::sincos(angle / 2.0);
    let v = axis * s;
    DQuat::from_xyzw(v.x, v.y, v.z, c)
}

fn turn_of(q: DQuat) -> RotateFile {
    let v = DVec3::new(q.x, q.y, q.z);
    let angle = 2.0 * libm::atan2(v.length(), q.w);
    RotateFile { axis: v.normalize_or(DVec3::Y).to_array(), angle: angle.to_degrees() }
}
