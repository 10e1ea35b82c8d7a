//! What a pixel is made of, in numbers, and the table as text.

use super::Inspected;
use crate::math::rgb::mean;
use crate::render::inspect::Situation;
use std::fmt::Write;

/// What a situation means.
pub fn situation_tip(situation: Situation) -> &'static str {
    match situation {
        Situation::Covered => "figure 10 (a): the view footprint lies wholly inside the photon",
        Situation::Missed => "figure 10 (b): the hit point lies outside, a part of the view footprint inside",
        Situation::Partial => "figure 10 (c): the hit point lies inside, a part of the view footprint outside",
        Situation::Apart => "they do not meet: one of the k nearest alone",
    }
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
            row.kind.name(),
            row.index,
            row.area,
            row.distance,
            row.condition,
            row.situation.letter()
        );
        for (w, c) in row.weights.iter().zip(&row.contributions) {
            let _ = write!(text, ",{w:e},{:e}", mean(*c));
        }
        text.push('\n');
    }
    text
}
