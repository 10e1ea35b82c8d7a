//! The photon's power comes back when an estimate is integrated over the plane; how estimators tend to each other.

use crate::estimate::registry::estimator;
use crate::estimate::{Estimator, View};
use crate::math::rgb::Rgb;
use crate::math::sequence::{Sampling, Sequence};
use crate::photons::map::{FootprintLimits, MapParts, Query};
use crate::photons::{MapPhoton, Photon, PhotonMap};
use glam::Vec3;

fn photon(footprint: [Vec3; 2]) -> MapPhoton {
    let p = Photon {
        position: Vec3::new(0.1, 0.0, -0.2),
        direction: Vec3::NEG_Y,
        normal: Vec3::Y,
        power: Rgb::ONE,
        footprint,
    };
    let limits = FootprintLimits { scale: 1.0, floor: 1e-7, ceiling: 1e3 };
    let map = PhotonMap::new(&[p], limits, MapParts { kd_tree: false, overlap: false });
    map.photons()[0]
}

fn view(center: Vec3, axes: [Vec3; 2]) -> View {
    View { query: Query { center, normal: Vec3::Y, axes }, direction: Vec3::new(0.3, -0.9, 0.2).normalize() }
}

/// Integral of the estimate of one photon of unit power over the plane, on a grid around it.
fn energy(e: &dyn Estimator, p: &MapPhoton, axes: [Vec3; 2], n: i32) -> f64 {
    let half = 1.05 * (f64::from(p.reach()) * 1.5 + axes.iter().map(|a| f64::from(a.length())).sum::<f64>());
    let cell = 2.0 * half / f64::from(n);
    let mut sum = 0.0;
    for i in 0..n {
        for j in 0..n {
            let at = |k: i32| ((f64::from(k) + 0.5) * cell - half) as f32;
            let x = p.position + Vec3::new(at(i), 0.0, at(j));
            sum += e.weight(p, &view(x, axes), 0.0);
        }
    }
    sum * cell * cell
}

/// Random footprints in the plane y = 0.
fn footprints(count: u64) -> impl Iterator<Item = ([Vec3; 2], [Vec3; 2])> {
    let sequence = Sequence::new(Sampling::Random, 12);
    let pair = move |i: u64, set: u32| {
        let x = sequence.four(i, set).map(|x| 2.0 * x - 1.0);
        [Vec3::new(x[0], 0.0, x[1]), Vec3::new(x[2], 0.0, x[3])]
    };
    (0..count).map(move |i| (pair(i, 0), pair(i, 1))).filter(|(p, v)| {
        // Slivers need a finer grid than this test affords; they are tested in `polygon`.
        let round = |f: &[Vec3; 2]| {
            let size = f[0].length().max(f[1].length());
            f[0].cross(f[1]).length() > 0.2 * size * size && size > 0.3
        };
        round(p) && round(v)
    })
}

#[test]
fn normalised_estimators_return_the_photons_power() {
    let names = [
        "regular",
        "multi_sampled:n=4,grid=closed",
        "multi_sampled:n=8,grid=closed",
        "multi_sampled:n=8,grid=cells",
        "integrated",
        "coplanar:weight=mean",
        "coplanar:weight=mean,shape=ellipse:64",
    ];
    for (p, v) in footprints(40) {
        let p = photon(p);
        for name in names {
            let e = estimator(name).expect(name);
            let got = energy(e.as_ref(), &p, v, 160);
            assert!((got - 1.0).abs() < 0.01, "{name}: {got}");
        }
    }
}

/// Far smaller than the view footprint, a photon under published `coplanar` brings 12/π (parallelogram) or 3 n/(2π)
/// sin(2π/n) (inscribed polygon) times its power; far larger, its own. The `mean` weight mends both.
#[test]
fn published_coplanar_has_the_predicted_excess() {
    let small = photon([Vec3::X * 0.01, Vec3::Z * 0.01]);
    let large = photon([Vec3::X, Vec3::Z]);
    let wide = [Vec3::X, Vec3::Z * 0.8];
    let narrow = [Vec3::X * 0.01, Vec3::Z * 0.01];
    let polygon = 3.0 * 20.0 / std::f64::consts::TAU * (std::f64::consts::TAU / 20.0).sin();
    for (name, excess) in [
        ("coplanar", 12.0 / std::f64::consts::PI),
        ("coplanar:shape=ellipse:20", polygon),
        ("coplanar:weight=mean", 1.0),
    ] {
        let e = estimator(name).expect(name);
        // The value at the middle of the view footprint times its area is the photon's power, or its excess.
        let w = e.weight(&small, &view(small.position, wide), 0.0) * 4.0 * 0.8;
        assert!((w / excess - 1.0).abs() < 1e-4, "{name}: {w}");
        let tiny = energy(e.as_ref(), &large, narrow, 200);
        assert!((tiny - 1.0).abs() < 0.01, "{name}: {tiny}");
    }
}

#[test]
fn coplanar_mean_equals_integrated() {
    let integrated = estimator("integrated").expect("registered");
    let parallelogram = estimator("coplanar:weight=mean").expect("registered");
    let mut worst = [0.0f64; 3];
    for (i, (p, v)) in footprints(300).enumerate() {
        let p = photon(p);
        let x = p.position + Vec3::new(0.4, 0.0, -0.3) * (i % 5) as f32 / 4.0;
        let view = view(x, v);
        let exact = integrated.weight(&p, &view, 0.0);
        let scale = f64::from(p.inverse_area);
        assert!((parallelogram.weight(&p, &view, 0.0) - exact).abs() < 1e-5 * scale);
        for (k, corners) in [8, 16, 32].into_iter().enumerate() {
            let e = estimator(&format!("coplanar:weight=mean,shape=ellipse:{corners}")).expect("registered");
            worst[k] = worst[k].max((e.weight(&p, &view, 0.0) - exact).abs() / scale);
        }
    }
    assert!(worst[1] < worst[0] / 3.0 && worst[2] < worst[1] / 3.0, "{worst:?}");
}

/// All but `density` tend to `regular` as the view footprint vanishes.
#[test]
fn small_view_footprints_give_regular() {
    let regular = estimator("regular").expect("registered");
    for (i, (p, v)) in footprints(200).enumerate() {
        let p = photon(p);
        let x = p.position + Vec3::new(0.3, 0.0, 0.2) * (i % 7) as f32 / 7.0;
        let exact = regular.weight(&p, &view(x, [Vec3::ZERO; 2]), 0.0);
        for name in ["multi_sampled", "multi_sampled:grid=cells", "integrated", "coplanar", "coplanar:weight=mean"] {
            let e = estimator(name).expect(name);
            for size in [1e-3f32, 0.0] {
                let w = e.weight(&p, &view(x, v.map(|a| a * size)), 0.0);
                assert!(
                    (w - exact).abs() <= (0.02 * f64::from(size).sqrt() + 2e-5) * f64::from(p.inverse_area),
                    "{name} {size}"
                );
            }
        }
    }
}

/// A photon footprint that vanishes gives Φ/A_vd inside the view footprint and nothing outside.
#[test]
fn vanishing_photons_keep_their_power() {
    let p = photon([Vec3::ZERO; 2]);
    let axes = [Vec3::new(0.1, 0.0, 0.02), Vec3::new(0.0, 0.0, 0.2)];
    let area = 4.0 * f64::from(axes[0].cross(axes[1]).length());
    for name in ["integrated", "coplanar:weight=mean"] {
        let e = estimator(name).expect(name);
        let inside = e.weight(&p, &view(p.position + axes[0] * 0.5, axes), 0.0);
        assert!((inside * area - 1.0).abs() < 1e-3, "{name} {}", inside * area);
        let outside = e.weight(&p, &view(p.position + axes[0] * 1.5, axes), 0.0);
        assert!(outside * area < 1e-12, "{name} {outside}");
    }
}

/// Off the photon's plane the kernel is cut from the unit ball, as `multi_sampled` sees it with many points.
#[test]
fn tilted_planes_agree_with_many_points() {
    let p = photon([Vec3::X * 0.5, Vec3::Z * 0.3]);
    let many = estimator("multi_sampled:n=256,grid=cells").expect("registered");
    let exact = estimator("integrated").expect("registered");
    for tilt in [0.1f32, 0.6, 1.2, 1.57] {
        let a = Vec3::new(tilt.cos(), tilt.sin(), 0.0) * 0.4;
        let v = view(p.position + Vec3::new(0.1, 0.05, -0.05), [a, Vec3::Z * 0.5]);
        let (w, m) = (exact.weight(&p, &v, 0.0), many.weight(&p, &v, 0.0));
        assert!((w - m).abs() < 1e-3 * m, "{tilt}: {w} {m}");
    }
}
