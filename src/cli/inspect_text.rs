//! What `inspect` prints for people.

use crate::cli::inspect_rays;
use crate::cli::table::Table;
use crate::estimate::registry::short_name;
use crate::math::rgb::Rgb;
use crate::render::inspect::{Inspection, PathVertex, PhotonRow, Situation};
use crate::render::pass::Pass;
use glam::Vec3;

/// The whole account; `sort` is the estimator whose weights order the rows, `limit` their number in the table, 0 for
/// all.
pub fn text(pass: &Pass, found: &Inspection, sort: usize, limit: usize) -> String {
    let [w, h] = pass.settings.size;
    let stored = &pass.photons.stored;
    let mut out = format!(
        "{}: pixel {},{} of {w}x{h}, pass {}; {} photons emitted, stored {} direct, {} caustic, {} global; footprint scale {:.4}\n",
        pass.scene.name,
        found.pixel[0],
        found.pixel[1],
        found.pass + 1,
        pass.photons.emitted,
        stored.direct.len(),
        stored.caustic.len(),
        stored.global.len(),
        pass.scale()
    );
    for n in grids(found) {
        out.push_str(&path(pass, found, n));
    }
    out.push_str(&values(found));
    out.push_str(&photons(pass, found, sort, limit));
    for g in &found.gatherings {
        out.push_str(&inspect_rays::text(pass, found, g, limit));
    }
    out.push_str(&plan(pass));
    out
}

fn grids(found: &Inspection) -> Vec<u32> {
    let mut grids: Vec<u32> = std::iter::once(1).chain(found.estimators.iter().map(|e| e.rays_per_axis)).collect();
    grids.sort_unstable();
    grids.dedup();
    grids
}

fn path(pass: &Pass, found: &Inspection, n: u32) -> String {
    let of: Vec<(usize, &PathVertex)> = found.path.iter().enumerate().filter(|(_, v)| v.rays_per_axis == n).collect();
    let title = if n == 1 { "view path".to_owned() } else { format!("view paths of {n}x{n} rays") };
    if of.is_empty() {
        return format!("\n{title}: meets nothing\n");
    }
    let mut table = Table::new([
        "  vertex",
        "from",
        "ray",
        "surface",
        "material",
        "position m",
        "throughput",
        "footprint m",
        "light W/(m² sr)",
        "hit",
    ]);
    for (i, v) in of {
        table.row([
            format!("  {}{i}", "  ".repeat(v.depth as usize)),
            v.parent.map_or("camera".into(), |p| p.to_string()),
            v.cell.to_string(),
            v.surface.name().into(),
            pass.scene.material_names.get(v.material as usize).cloned().unwrap_or_default(),
            place(pass, v.position),
            color(v.throughput),
            format!("{} x {}", number(v.footprint[0].length()), number(v.footprint[1].length())),
            color(v.light),
            v.hit.map_or("-".into(), |h| h.to_string()),
        ]);
    }
    format!("\n{title}\n{}", table.text())
}

fn values(found: &Inspection) -> String {
    let mut table = Table::new([
        "  estimator",
        "rays",
        "gathered",
        "counting",
        "direct and emitted",
        "photons",
        "final gathering",
        "sum",
        "pixel W/(m² sr)",
    ]);
    for (e, of) in found.estimators.iter().enumerate() {
        let counting = found.rows.iter().filter(|r| r.weights[e] != 0.0).count();
        let sum = found.sum(e);
        let photons = found.rows.iter().filter_map(|r| r.contributions.get(e)).fold(Rgb::ZERO, |sum, c| sum + *c);
        let gathered = found.gathering(e).map_or(Rgb::ZERO, |g| g.sum().as_vec3());
        table.row([
            format!("  {}", of.name),
            format!("{0}x{0}", of.rays_per_axis),
            of.gathered.to_string(),
            counting.to_string(),
            color(of.base),
            color(photons),
            found.gathering(e).map_or("-".into(), |_| color(gathered)),
            color(sum),
            color(of.value),
        ]);
    }
    format!(
        "\nvalues: the pixel is that of `cusp render`; the sum is that of the rows and rays below\n{}",
        table.text()
    )
}

fn photons(pass: &Pass, found: &Inspection, sort: usize, limit: usize) -> String {
    if found.rows.is_empty() {
        return "\nno photon was gathered\n".into();
    }
    let shown = if limit == 0 { found.rows.len() } else { limit.min(found.rows.len()) };
    let mut heading: Vec<String> =
        ["  photon", "hit", "position m", "power W", "half-axes m", "condition", "distance", "fig. 10"]
            .map(Into::into)
            .into();
    heading.extend(found.estimators.iter().map(|e| short_name(&e.name)));
    let mut table = Table::new(heading);
    for r in &found.rows[..shown] {
        table.row(row(pass, r));
    }
    let by = found.estimators.get(sort).map_or("", |e| e.name.as_str());
    let mut out = format!("\nphotons by weight under {by}; the last columns are weights, 1/m²\n{}", table.text());
    let left = found.rows.len() - shown;
    if left > 0 {
        out.push_str(&format!("  {left} more are left out; --rows 0 shows all\n"));
    }
    let count = |s: Situation| found.rows.iter().filter(|r| r.situation == s).count();
    let [a, b, c, apart] = Situation::ALL.map(count);
    out.push_str(&format!(
        "  figure 10: {a} hold the view footprint (a), {b} meet it but not the hit point (b), {c} hold the hit point but not all of it (c), {apart} miss it\n"
    ));
    out
}

fn row(pass: &Pass, r: &PhotonRow) -> Vec<String> {
    let long = (f64::from(r.area) * r.condition / std::f64::consts::PI).sqrt();
    let mut cells = vec![
        format!("  {} {}", r.kind.name(), r.index),
        r.hit.to_string(),
        place(pass, r.position),
        color(r.power),
        format!("{} x {}", number(long as f32), number((long / r.condition) as f32)),
        number(r.condition as f32),
        number(r.distance),
        r.situation.letter().into(),
    ];
    cells.extend(r.weights.iter().map(|w| if *w == 0.0 { "0".into() } else { number(*w as f32) }));
    cells
}

fn plan(pass: &Pass) -> String {
    let width = pass.plan.items.iter().map(|i| i.part.len()).max().unwrap_or(0);
    let line = |i: &crate::render::plan::PlanItem| {
        format!("  {:<width$}  {:<8}  {}\n", i.part, if i.on { "on" } else { "left out" }, i.why)
    };
    format!("\nplan\n{}", pass.plan.items.iter().map(line).collect::<String>())
}

/// Four digits, with an exponent where they would not fit.
pub(super) fn number(x: f32) -> String {
    match x.abs() {
        0.0 => "0".into(),
        a if !(1e-3..1e5).contains(&a) => format!("{x:.3e}"),
        a if a < 1.0 => format!("{x:.4}"),
        a if a < 10.0 => format!("{x:.3}"),
        a if a < 100.0 => format!("{x:.2}"),
        _ => format!("{x:.1}"),
    }
}

/// One number where the channels are the same.
pub(super) fn color(c: Rgb) -> String {
    if c.x == c.y && c.y == c.z { number(c.x) } else { vector(c) }
}

/// A position in the coordinates of the scene file.
pub(super) fn place(pass: &Pass, position: Vec3) -> String {
    let p = position.as_dvec3() + pass.scene.origin;
    vector(p.as_vec3())
}

pub(super) fn vector(v: Vec3) -> String {
    v.to_array().map(number).join(" ")
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn numbers_keep_four_digits() {
        let shown = [0.0, 0.12345, -2.5, 42.196, 1234.5, 1e-5, 3.2e7].map(number);
        assert_eq!(shown, ["0", "0.1235", "-2.500", "42.20", "1234.5", "1.000e-5", "3.200e7"]);
        assert_eq!(color(Rgb::splat(0.5)), "0.5000");
        assert_eq!(color(Rgb::new(1.0, 0.0, 0.0)), "1.000 0 0");
    }
}
