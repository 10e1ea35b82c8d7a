//! What must hold for any photon and any view: invariance, symmetry, monotony, bounds, linearity, order.

use crate::estimate::clip::{self, ClippedPolygon, HalfPlane};
use crate::estimate::coplanar::Coplanar;
use crate::estimate::registry::{ESTIMATORS, estimator};
use crate::estimate::{Estimator, Gathered, Lookup, View};
use crate::math::rgb::Rgb;
use crate::photons::map::{FootprintLimits, MapParts, Query};
use crate::photons::{MapPhoton, Photon, PhotonMap};
use glam::{DVec2, Quat, Vec3};
use proptest::prelude::*;

/// Every estimator with the settings that change its arithmetic.
fn all() -> Vec<Box<dyn Estimator>> {
    let more = ["coplanar:weight=mean", "coplanar:shape=ellipse:20,weight=mean", "multi_sampled:n=5,grid=cells"];
    let names = ESTIMATORS.iter().map(|e| e.id).chain(more);
    names.map(|n| estimator(n).expect("registered")).collect()
}

fn map_of(photons: &[Photon], unit: f32) -> PhotonMap {
    let limits = FootprintLimits { scale: 1.0, floor: 1e-6 * unit, ceiling: 100.0 * unit };
    PhotonMap::new(photons, limits, MapParts { kd_tree: true, overlap: true })
}

fn mapped(photon: Photon, unit: f32) -> MapPhoton {
    map_of(&[photon], unit).photons()[0]
}

/// A photon and a view in planes up to 50° apart, of sizes that differ by 30 at most.
#[derive(Clone, Copy, Debug)]
struct Pair {
    photon: Photon,
    view: View,
    radius: f32,
}

fn vector() -> impl Strategy<Value = Vec3> {
    prop::array::uniform3(-1.0f32..1.0).prop_map(Vec3::from)
}

fn in_plane(v: Vec3, n: Vec3) -> Vec3 {
    v - n * n.dot(v)
}

fn pair() -> impl Strategy<Value = Pair> {
    (vector(), [vector(), vector()], [vector(), vector()], vector(), vector(), -1.5f32..1.5, 0.05f32..2.0)
        .prop_filter_map("footprints that are too thin", |(n, [a, b], [c, d], tilt, direction, size, radius)| {
            let n = n.try_normalize()?;
            let m = (n + tilt * 0.6).normalize();
            let grow = 10f32.powf(size);
            let [a, b] = [a, b].map(|v| in_plane(v, n));
            let [c, d] = [c, d].map(|v| in_plane(v, m) * grow);
            let thin = |p: Vec3, q: Vec3| p.cross(q).length() < 0.05 * p.length().max(q.length()).powi(2);
            let direction = (direction * 0.7 - m).normalize();
            if thin(a, b) || thin(c, d) || direction.dot(n) > -0.2 {
                return None;
            }
            let position = Vec3::new(0.3, -0.2, 0.4);
            let photon =
                Photon { position, direction: -n, normal: n, power: Rgb::new(0.5, 1.0, 2.0), footprint: [a, b] };
            // A place near both.
            let center = position + a * tilt.x + c * tilt.y + d * tilt.z;
            Some(Pair { photon, view: View { query: Query { center, normal: m, axes: [c, d] }, direction }, radius })
        })
}

/// The peak of an estimator's weight.
fn peak(e: &dyn Estimator, photon: &MapPhoton, radius: f32) -> f64 {
    match e.lookup() {
        Lookup::Disc => 3.0 / (std::f64::consts::PI * f64::from(radius).powi(2)),
        _ => 3.0 * f64::from(photon.inverse_area),
    }
}

proptest! {
    /// Turned, moved and scaled by s, every weight is 1/s² of what it was.
    #[test]
    fn weights_do_not_depend_on_place_direction_or_unit(
        p in pair(), turn in prop::array::uniform4(-1.0f32..1.0), shift in vector(), unit in -12.0f32..12.0,
    ) {
        let q = Quat::from_array(turn);
        prop_assume!(q.length() > 0.1);
        let (q, s) = (q.normalize(), 10f32.powf(unit / 2.0));
        let point = |x: Vec3| (q * x + shift) * s;
        let photon = Photon {
            position: point(p.photon.position),
            direction: q * p.photon.direction,
            normal: q * p.photon.normal,
            footprint: p.photon.footprint.map(|v| q * v * s),
            ..p.photon
        };
        let Query { center, normal, axes } = p.view.query;
        let query = Query { center: point(center), normal: q * normal, axes: axes.map(|v| q * v * s) };
        let view = View { query, direction: q * p.view.direction };
        let (before, after) = (mapped(p.photon, 1.0), mapped(photon, s));
        let size = axes[0].length() + axes[1].length() + (center - p.photon.position).length() + 2.0;
        // Places keep a few units in the last place; a weight changes by that over the footprint's shortest axis.
        let shortest = f64::from(before.reach()) / before.condition();
        let slack = 64.0 * f64::from(f32::EPSILON) * f64::from(size) / shortest;
        for e in all() {
            let (w, v) = (e.weight(&before, &p.view, p.radius), e.weight(&after, &view, p.radius * s));
            let scaled = v * f64::from(s) * f64::from(s);
            let most = peak(e.as_ref(), &before, p.radius);
            // A sampling point that rounding moves over the rim, and a disc's rim, where some kernels jump, are no more
            // than continuous: the kernel vanishes there.
            prop_assert!((scaled - w).abs() <= slack * most, "{}: {w:e} {scaled:e} of {most:e}", e.name());
        }
    }

    /// Scaled by a power of two, nothing is rounded: the same bits.
    #[test]
    fn weights_scale_exactly_with_powers_of_two(p in pair(), exponent in -20i32..20) {
        let s = (exponent as f32).exp2();
        let photon =
            Photon { position: p.photon.position * s, footprint: p.photon.footprint.map(|v| v * s), ..p.photon };
        let Query { center, normal, axes } = p.view.query;
        let view = View { query: Query { center: center * s, normal, axes: axes.map(|v| v * s) }, ..p.view };
        let (before, after) = (mapped(p.photon, 1.0), mapped(photon, s));
        for e in all() {
            let (w, v) = (e.weight(&before, &p.view, p.radius), e.weight(&after, &view, p.radius * s));
            prop_assert_eq!(v * f64::from(s) * f64::from(s), w, "{}", e.name());
        }
    }

    /// Axes may change places and signs.
    #[test]
    fn weights_do_not_depend_on_the_order_of_axes(p in pair()) {
        let photon = mapped(p.photon, 1.0);
        let [a, b] = p.view.query.axes;
        for axes in [[b, a], [-a, b], [b, -a]] {
            let view = View { query: Query { axes, ..p.view.query }, ..p.view };
            for e in all() {
                let (w, v) = (e.weight(&photon, &p.view, p.radius), e.weight(&photon, &view, p.radius));
                let most = peak(e.as_ref(), &photon, p.radius);
                prop_assert!((w - v).abs() <= 1e-5 * most, "{}: {w:e} {v:e}", e.name());
            }
        }
    }

    /// Weights are not negative and not above the kernel's peak; irradiance is linear in power, and the same in any order.
    #[test]
    fn weights_are_bounded_and_sums_are_linear(
        pairs in prop::collection::vec(pair(), 1..40), factor in -30i32..30, seed in any::<u64>(),
    ) {
        let view = &pairs[0].view;
        let radius = pairs[0].radius;
        let photons: Vec<Photon> = pairs.iter().map(|p| p.photon).collect();
        let f = (factor as f32).exp2();
        let brighter: Vec<Photon> = photons.iter().map(|p| Photon { power: p.power * f, ..*p }).collect();
        let (map, bright) = (map_of(&photons, 1.0), map_of(&brighter, 1.0));
        let indices: Vec<u32> = (0..photons.len() as u32).collect();
        let mut shuffled = indices.clone();
        shuffled.sort_by_key(|&i| crate::math::hash::mix(seed, u64::from(i)));
        for e in all() {
            for photon in map.photons() {
                let share = e.weight(photon, view, radius) / peak(e.as_ref(), photon, radius);
                prop_assert!((0.0..=1.0 + 1e-6).contains(&share), "{}: {share}", e.name());
            }
            let found = Gathered { photons: map.photons(), indices: &indices, radius };
            let sum = e.irradiance(&found, view);
            // A power of two scales without rounding.
            let scaled = e.irradiance(&Gathered { photons: bright.photons(), ..found }, view);
            prop_assert_eq!(scaled, sum * f64::from(f), "{}", e.name());
            let other = e.irradiance(&Gathered { indices: &shuffled, ..found }, view);
            prop_assert!((other - sum).length() <= 1e-13 * sum.length(), "{}: {sum} {other}", e.name());
            // Each photon for itself, added up.
            let each: glam::DVec3 = indices.iter().map(|i| e.irradiance(&Gathered { indices: &[*i], ..found }, view)).sum();
            prop_assert!((each - sum).length() <= 1e-13 * sum.length(), "{}: {sum} {each}", e.name());
        }
    }

    /// Hits together are each alone, to the bit: with all photons, with some and with none.
    #[test]
    fn hits_together_are_each_alone(pairs in prop::collection::vec(pair(), 1..40), cuts in prop::collection::vec(0usize..80, 1..90)) {
        let photons: Vec<Photon> = pairs.iter().map(|p| p.photon).collect();
        let map = map_of(&photons, 1.0);
        let indices: Vec<u32> = (0..photons.len() as u32).collect();
        let hits: Vec<(Gathered, View)> = cuts
            .iter()
            .zip(pairs.iter().cycle())
            .map(|(cut, p)| {
                let indices = &indices[..(*cut).min(indices.len())];
                (Gathered { photons: map.photons(), indices, radius: p.radius }, p.view)
            })
            .collect();
        for e in all() {
            let mut together = Vec::new();
            e.irradiances(&mut hits.iter().copied(), &mut |sum| together.push(sum));
            let alone: Vec<glam::DVec3> = hits.iter().map(|(found, view)| e.irradiance(found, view)).collect();
            prop_assert_eq!(&together, &alone, "{}", e.name());
            for ((found, view), sum) in hits.iter().zip(alone) {
                let own = found.indices.iter().map(|&i| &found.photons[i as usize]);
                let weighed = own.map(|p| p.power.as_dvec3() * e.weight(p, view, found.radius)).sum::<glam::DVec3>();
                prop_assert!((weighed - sum).length() <= 1e-13 * sum.length(), "{}: {weighed} {sum}", e.name());
            }
        }
    }

    /// The view footprint's part in the photon's parallelogram is the photon's part in the view's.
    #[test]
    fn clipping_is_symmetric(
        c in prop::array::uniform2(-1.5f64..1.5), a in prop::array::uniform2(-2.0f64..2.0),
        b in prop::array::uniform2(-2.0f64..2.0),
    ) {
        let (c, a, b) = (DVec2::from(c), DVec2::from(a), DVec2::from(b));
        let det = a.perp_dot(b);
        prop_assume!(det.abs() > 0.01);
        let clipped = |c, a, b, planes: &[HalfPlane]| {
            let mut p = ClippedPolygon::<{ clip::MAX_VERTICES }>::whole(c, a, b);
            planes.iter().for_each(|h| p.clip(h));
            p.coverage_and_centroid()
        };
        let (share, centroid) = clipped(c, a, b, &clip::square());
        // In the view's own coordinates the view is the square, and the photon a parallelogram.
        let own = |x: DVec2| DVec2::new(x.perp_dot(b), a.perp_dot(x)) / det;
        let (other, back) = clipped(own(-c), own(DVec2::X), own(DVec2::Y), &clip::square());
        prop_assert!((share * det.abs() - other).abs() < 1e-10, "{share} {other}");
        if share > 1e-3 {
            // The same place, seen from both.
            let here = c + a * centroid.x + b * centroid.y;
            prop_assert!((here - back).length() < 1e-6, "{here} {back}");
        }
    }

    /// A photon that grows about its centre, and a view that shrinks to its own, never cover less.
    #[test]
    fn coverage_is_monotone(p in pair(), growth in 1.0f32..4.0) {
        let wide = Photon { footprint: p.photon.footprint.map(|v| v * growth), ..p.photon };
        for name in ["coplanar", "coplanar:shape=ellipse:9"] {
            let e = estimator(name).expect("registered");
            let small = e.construction(&mapped(p.photon, 1.0), &p.view).coverage;
            let large = e.construction(&mapped(wide, 1.0), &p.view).coverage;
            prop_assert!(large >= small - 1e-6, "{name}: {small} grows to {large}");
        }
        // More corners of the inscribed polygon cover more, up to the parallelogram of the square around it.
        let corners = [4, 8, 16, 32].map(|n| {
            let e = estimator(&format!("coplanar:shape=ellipse:{n}")).expect("registered");
            e.construction(&mapped(p.photon, 1.0), &p.view).coverage
        });
        prop_assert!(corners.windows(2).all(|w| w[1] >= w[0] - 1e-9), "{corners:?}");
        let square = estimator("coplanar").expect("registered").construction(&mapped(p.photon, 1.0), &p.view).coverage;
        prop_assert!(square >= corners[3] - 1e-9, "{square} {corners:?}");
    }

    /// What `knn` and `overlap` find is what is there, for any map and any k.
    #[test]
    fn gathers_agree_with_brute_force(
        pairs in prop::collection::vec(pair(), 1..60), places in prop::collection::vec(vector(), 60), k in 1usize..80,
    ) {
        let photons: Vec<Photon> =
            pairs.iter().zip(&places).map(|(p, x)| Photon { position: *x * 3.0, ..p.photon }).collect();
        let map = map_of(&photons, 1.0);
        let query = Query { center: Vec3::ZERO, ..pairs[0].view.query };
        let view = View { query, ..pairs[0].view };
        let lit: Vec<u32> =
            (0..photons.len() as u32).filter(|i| map.photons()[*i as usize].lights(query.normal)).collect();
        let mut heap = crate::photons::kd_tree::Nearest::new();
        map.nearest_anywhere(&query, k, &mut heap);
        let mut found: Vec<u32> = heap.iter().map(|(_, i)| i).collect();
        let mut nearest = lit.clone();
        let distance = |i: u32| map.photons()[i as usize].position.length_squared();
        nearest.sort_by(|i, j| distance(*i).total_cmp(&distance(*j)).then(i.cmp(j)));
        nearest.truncate(k);
        found.sort_unstable();
        nearest.sort_unstable();
        prop_assert_eq!(found, nearest);
        let mut overlapping = Vec::new();
        map.overlapping_parallelogram(&query, &mut overlapping);
        let integrated = estimator("integrated").expect("registered");
        for i in &lit {
            let photon = &map.photons()[*i as usize];
            // What has weight is found; what is found is near.
            if integrated.weight(photon, &view, 0.0) > 1e-9 * f64::from(photon.inverse_area) {
                prop_assert!(overlapping.contains(i), "photon {i} has weight and is not found");
            }
        }
        let reach = |i: u32| map.photons()[i as usize].reach() + query.axes[0].length() + query.axes[1].length();
        prop_assert!(overlapping.iter().all(|&i| lit.contains(&i) && distance(i).sqrt() <= 1.001 * reach(i)));
    }
}

/// A photon that is projected along a ray far off, or seen edge-on, is none.
#[test]
fn a_photon_seen_edge_on_covers_nothing() {
    let photon = Photon {
        position: Vec3::ZERO,
        direction: Vec3::NEG_Y,
        normal: Vec3::Y,
        power: Rgb::ONE,
        footprint: [Vec3::X, Vec3::Z],
    };
    let query = Query { center: Vec3::ZERO, normal: Vec3::Y, axes: [Vec3::X, Vec3::Z] };
    assert!(Coplanar::projected(&mapped(photon, 1.0), &View { query, direction: Vec3::X }).is_none());
}
