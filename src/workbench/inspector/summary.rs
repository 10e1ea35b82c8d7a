//! What a pixel is made of, in numbers, and the table as text.

use super::Inspected;
use crate::math::rgb::mean;
use crate::photons::PhotonKind;
use crate::render::inspect::Situation;
use glam::Vec3;
use std::fmt::Write;

/// A kind of photon in one word.
pub fn kind_name(kind: PhotonKind) -> &'static str {
    match kind {
        PhotonKind::Direct => "direct",
        PhotonKind::Caustic => "caustic",
        PhotonKind::Global => "global",
    }
}

/// A situation as the thesis's figure 10 names it.
pub fn situation_name(situation: Situation) -> &'static str {
    match situation {
        Situation::Covered => "a",
        Situation::Missed => "b",
        Situation::Partial => "c",
        Situation::Apart => "-",
    }
}

/// What a situation means.
pub fn situation_tip(situation: Situation) -> &'static str {
    match situation {
        Situation::Covered => "figure 10 (a): the view footprint lies wholly inside the photon",
        Situation::Missed => "figure 10 (b): the hit point lies outside, a part of the view footprint inside",
        Situation::Partial => "figure 10 (c): the hit point lies inside, a part of the view footprint outside",
        Situation::Apart => "they do not meet: one of the k nearest alone",
    }
}

/// Centroid of a flat polygon by its triangles; the mean of the corners if it has no area.
pub fn centroid(corners: &[Vec3]) -> Vec3 {
    let Some(&first) = corners.first() else { return Vec3::ZERO };
    let (mut sum, mut area) = (Vec3::ZERO, 0.0);
    for pair in corners.windows(2).skip(1) {
        let a = (pair[0] - first).cross(pair[1] - first).length();
        sum += (first + pair[0] + pair[1]) / 3.0 * a;
        area += a;
    }
    if area > 0.0 { sum / area } else { corners.iter().sum::<Vec3>() / corners.len() as f32 }
}

/// The photon table as CSV, a row for each photon and hit.
pub fn csv(found: &Inspected) -> String {
    let i = &found.inspection;
    let mut text = String::from("hit,kind,index,x,y,z,power_r,power_g,power_b,area_m2,distance,condition,situation");
    for e in &i.estimators {
        // Writing to a string cannot fail.
        let _ = write!(text, ",\"weight {}\",\"contribution {}\"", e.name, e.name);
    }
    text.push('\n');
    for row in &i.rows {
        let [x, y, z] = row.position.to_array();
        let [r, g, b] = row.power.to_array();
        let _ = write!(
            text,
            "{},{},{},{x:e},{y:e},{z:e},{r:e},{g:e},{b:e},{:e},{:e},{:e},{}",
            row.hit,
            kind_name(row.kind),
            row.index,
            row.area,
            row.distance,
            row.condition,
            situation_name(row.situation)
        );
        for (w, c) in row.weights.iter().zip(&row.contributions) {
            let _ = write!(text, ",{w:e},{:e}", mean(*c));
        }
        text.push('\n');
    }
    text
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn centroid_of_a_square_is_its_middle() {
        let square = [Vec3::ZERO, Vec3::X, Vec3::X + Vec3::Y, Vec3::Y];
        assert!((centroid(&square) - Vec3::new(0.5, 0.5, 0.0)).length() < 1e-6);
        assert_eq!(centroid(&[Vec3::X, Vec3::X]), Vec3::X);
        assert_eq!(centroid(&[]), Vec3::ZERO);
    }
}
