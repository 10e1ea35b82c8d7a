//! What `inspect` prints of final gathering.

use crate::cli::inspect_text::{color, number, place, vector};
use crate::cli::table::Table;
use crate::math::rgb::{Rgb, mean};
use crate::render::inspect::gathering::{layer_of, semi_axes};
use crate::render::inspect::{Gathering, Inspection, RayEnd};
use crate::render::pass::Pass;
use crate::scene::memory;

/// A summary of the rays under one estimator, and the strongest of them; `limit` is their number, 0 for all.
pub(super) fn text(pass: &Pass, found: &Inspection, g: &Gathering, limit: usize) -> String {
    let name = found.estimators.get(g.estimator).map_or("", |e| e.name.as_str());
    let mut out = format!("\nfinal gathering under {name}\n");
    if g.hits.is_empty() {
        out.push_str("  no view ray meets a diffuse surface\n");
        return out;
    }
    let rays: usize = g.hits.iter().map(|h| h.rays.len()).sum();
    let ends: Vec<String> = g.ends().iter().map(|(end, n)| format!("{n} {}", end.title())).collect();
    out.push_str(&format!("  {rays} rays from {} view hits: {}\n", g.hits.len(), ends.join(", ")));
    if g.counts.second > 0 {
        let second = g.counts.rays - rays as u64 - g.unrecorded;
        out.push_str(&format!("  {} second gathers of {second} more rays\n", g.counts.second));
    }
    if g.unrecorded > 0 {
        out.push_str(&format!("  {} rays more count but were not written down: there are too many\n", g.unrecorded));
    }
    for h in &g.hits {
        out.push_str(&format!(
            "  hit {}: irradiance {} W/m², adds {} W/(m² sr)\n",
            h.hit,
            color(h.irradiance),
            color(h.contribution)
        ));
    }
    out.push_str(&layers(g));
    out.push_str(&strongest(pass, g, limit));
    out
}

fn layers(g: &Gathering) -> String {
    let Some(m) = &g.memory else {
        return format!("  photons are looked up, first within {} m\n", number(g.radius));
    };
    let mut table = Table::new(["  layer", "radius m", "estimates", "memory", "rays"]);
    for (i, (l, rays)) in g.layers.iter().zip(g.rays_by_layer()).enumerate() {
        table.row([
            format!("  {i}"),
            number(l.radius),
            l.estimates.to_string(),
            memory::text(l.bytes as u64),
            rays.to_string(),
        ]);
    }
    let [photons, peak, layers] = [m.photons, m.peak, m.layers].map(memory::text);
    format!("{}  memory: photons {photons}, {peak} at the highest, layers {layers}\n", table.text())
}

fn strongest(pass: &Pass, g: &Gathering, limit: usize) -> String {
    let total = g.hits.iter().fold(Rgb::ZERO, |sum, h| sum + h.contribution);
    let mut all = g.strongest();
    all.retain(|at| g.adds(*at) != Rgb::ZERO);
    let shown = if limit == 0 { all.len() } else { limit.min(all.len()) };
    if shown == 0 {
        return "  no ray brings light\n".into();
    }
    let mut table = Table::new([
        "  end",
        "hit",
        "direction",
        "meets m",
        "distance m",
        "half-axes m",
        "layer",
        "estimates",
        "irradiance W/m²",
        "adds W/(m² sr)",
        "share",
    ]);
    for at in &all[..shown] {
        let Some(ray) = g.ray(*at) else { continue };
        let adds = g.adds(*at);
        let share = if mean(total) > 0.0 { 100.0 * mean(adds) / mean(total) } else { 0.0 };
        let meets = ray.hit.as_ref();
        table.row([
            format!("  {}", RayEnd::of(ray).title()),
            g.hits[at[0]].hit.to_string(),
            vector(ray.direction),
            meets.map_or("-".into(), |h| place(pass, h.position)),
            meets.map_or("-".into(), |h| number(h.distance)),
            meets.filter(|_| ray.radius > 0.0).map_or("-".into(), |h| {
                let [long, short] = semi_axes(h, pass.scene.resolution());
                format!("{} x {}", number(long), number(short))
            }),
            layer_of(ray).map_or("-".into(), |l| l.to_string()),
            ray.estimates.len().to_string(),
            color(ray.irradiance),
            color(adds),
            format!("{share:.2} %"),
        ]);
    }
    let mut out = format!("  rays by what they add to the pixel\n{}", table.text());
    let left = all.len() - shown;
    if left > 0 {
        out.push_str(&format!("  {left} more that bring light are left out; --rows 0 shows all\n"));
    }
    out
}
