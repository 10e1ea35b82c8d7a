use super::*;
use crate::math::eights::LANES;
use crate::math::rgb::Rgb;
use crate::math::sequence::{Sampling, Sequence};
use crate::photons::emission::emit;
use crate::photons::path::PathSettings;
use crate::photons::spread::DiffuseSpread;
use crate::render::photon_pass::Emitter;
use crate::scene::{Light, open};
use crate::trace::{Intersector, Ray};
use glam::Vec3;

/// One light of each kind, a metre or three from the specular surfaces, some of them looking past them.
fn lights(scene: &Scene) -> Vec<Light> {
    let power = Rgb::new(3.0, 2.0, 1.0);
    let place = Vec3::new(0.9, 1.7, -0.6);
    let quad = |center, u, v| Light::Quad { center, u, v, power };
    let spot = |half: f64, falloff| Light::Spot {
        position: place,
        direction: (Vec3::new(0.1, 0.2, 0.3) - place).normalize(),
        cos_half: half.cos(),
        falloff,
        power,
    };
    let corners = |p: Vec3, s: f32| [p, p + Vec3::new(s, 0.0, 0.1), p + Vec3::new(0.2, -s, s)];
    vec![
        Light::Point { position: place, power },
        Light::Point { position: Vec3::new(0.0, 0.1, 0.0), power },
        spot(0.7, 0.0),
        spot(0.05, 0.0),
        spot(1.5, 8.0),
        Light::Sphere { center: place, radius: 0.2, power },
        Light::Sphere { center: Vec3::ZERO, radius: 1.5, power },
        quad(place, Vec3::X * 0.3, Vec3::Z * 0.2),
        quad(place, Vec3::Z * 0.1, Vec3::X * 0.6),
        Light::mesh(vec![corners(place, 0.2), corners(-place, 0.3), corners(place * 0.5, 0.01)], Rgb::ONE),
        Light::Directional {
            direction: Vec3::new(0.3, -0.9, 0.2).normalize(),
            irradiance: power,
            disc_center: Vec3::new(-0.3, 0.9, -0.2).normalize() * scene.radius,
            disc_radius: scene.radius,
        },
    ]
}

/// Scenes with specular triangles and spheres, small and large, among others.
fn scenes() -> impl Iterator<Item = Scene> {
    ["ring", "glass_sphere", "prism_wall"].into_iter().map(|name| open(name).expect("built in"))
}

/// Every photon that meets a specular surface first leaves through a marked cell: tried with many photons of every kind
/// of light.
#[test]
fn no_photon_is_missed() {
    for scene in scenes() {
        let intersector = Intersector::new(&scene.geometry, scene.radius);
        for (i, light) in lights(&scene).into_iter().enumerate() {
            let scene = Scene { lights: vec![light.clone()], ..scene.clone() };
            let map = ProjectionMap::new(&scene).expect("specular surfaces");
            let cells = map.light(0);
            let sequence = Sequence::new(Sampling::Sobol, i as u64);
            let (mut met, mut marked) = (0, 0);
            let photons = 1 << 15;
            for n in 0..photons {
                let x = sequence.four(n, 0);
                let start = emit(&scene, &light, 1.0, x);
                let ray = Ray { origin: start.origin, direction: start.direction };
                let hit = intersector.closest(&ray);
                let is_specular =
                    hit.is_some_and(|h| scene.materials[scene.geometry.material(h.primitive as usize)].is_specular());
                assert!(!is_specular || cells.holds(x), "{i}: {x:?} towards {}", start.direction);
                met += u32::from(is_specular);
                marked += u32::from(cells.holds(x));
            }
            // What is marked is what the share says, and it is not everything where little is met.
            let share = f64::from(marked) / photons as f64;
            assert!((share - cells.share()).abs() < 0.01, "{i}: {share} {}", cells.share());
            assert!(met <= marked);
        }
    }
}

/// A group's numbers come out as each photon's alone.
#[test]
fn a_group_of_numbers_is_each_alone() {
    for scene in scenes() {
        let map = ProjectionMap::new(&scene).expect("specular surfaces");
        let sequence = Sequence::new(Sampling::Random, 6);
        for light in 0..scene.lights.len() {
            for group in 0..500 {
                let x: [[f32; 4]; LANES] = std::array::from_fn(|lane| sequence.four(group, lane as u32));
                let rows = std::array::from_fn(|d| std::array::from_fn(|lane| x[lane][d]));
                let together = map.light(light).numbers_of_group(&rows);
                for (lane, x) in x.into_iter().enumerate() {
                    assert_eq!(map.light(light).numbers(x), [0, 1, 2, 3].map(|d: usize| together[d][lane]));
                }
            }
        }
    }
}

/// Numbers come out in marked cells, each as often.
#[test]
fn numbers_fill_the_marked_cells_evenly() {
    for scene in scenes() {
        for light in lights(&scene) {
            let scene = Scene { lights: vec![light], ..scene.clone() };
            let map = ProjectionMap::new(&scene).expect("specular surfaces");
            let cells = map.light(0);
            let sequence = Sequence::new(Sampling::Random, 5);
            let mut moments = [0.0f64; 4];
            let n = 20_000;
            let (mut direct, mut kept) = ([0.0f64; 4], 0.0f64);
            for i in 0..n {
                let y = cells.numbers(sequence.four(i, 0));
                assert!(cells.share() == 0.0 || cells.holds(y), "{y:?}");
                assert!(y.iter().all(|y| (0.0..1.0).contains(y)));
                // The same by rejection.
                let x = sequence.four(i, 1);
                if cells.holds(x) {
                    kept += 1.0;
                    direct.iter_mut().zip(x).for_each(|(d, x)| *d += f64::from(x));
                }
                moments.iter_mut().zip(y).for_each(|(m, y)| *m += f64::from(y) / n as f64);
            }
            if kept > 500.0 {
                for (m, d) in moments.iter().zip(direct) {
                    // Four standard deviations of the mean of so many numbers in an interval of length 1.
                    assert!((m - d / kept).abs() < 4.0 * (0.29 / kept.sqrt() + 0.29 / (n as f64).sqrt()), "{m}");
                }
            }
        }
    }
}

/// The power that arrives by specular surfaces, and where, is the same with and without a map, under every kind of light.
#[test]
fn caustics_keep_their_power() {
    for scene in scenes() {
        let intersector = Intersector::new(&scene.geometry, scene.radius);
        for (i, light) in lights(&scene).into_iter().enumerate() {
            let scene = Scene { lights: vec![light], ..scene.clone() };
            let map = ProjectionMap::new(&scene).expect("specular surfaces");
            let arrived = |projected: bool| {
                let path = PathSettings {
                    max_depth: 8,
                    direct: false,
                    caustic: true,
                    global: false,
                    projected,
                    differentials: true,
                    spread: DiffuseSpread::Polar,
                };
                let (projection, sampling, photons) = (Some(&map), Sampling::Random, 60_000);
                let emitter =
                    Emitter { scene: &scene, intersector: &intersector, path, projection, sampling, photons, seed: 3 };
                let pass = emitter.run(0, &|| false);
                // Power, its moment along x, and the power squared, for the spread.
                pass.stored.caustic.iter().fold([0.0f64; 4], |mut sum, p| {
                    let (power, x) = (f64::from(mean(p.power)), f64::from(p.position.x));
                    [power, power * x, power * power, power * power * x * x]
                        .into_iter()
                        .zip(&mut sum)
                        .for_each(|(v, s)| *s += v);
                    sum
                })
            };
            let (with, without) = (arrived(true), arrived(false));
            for m in 0..2 {
                // The variance of a sum over Poisson many is the sum of squares; this is more than four deviations.
                let deviation = (with[m + 2] + without[m + 2]).sqrt();
                let off = (with[m] - without[m]).abs();
                assert!(off <= 4.5 * deviation, "light {i}, moment {m}: {} and {} ± {deviation}", with[m], without[m]);
            }
            // Where the light sees little of them, its photons are put to better use.
            if map.share() > 0.0 && map.share() < 0.2 && without[2] > 0.0 {
                assert!(with[2] / with[0] < 0.5 * without[2] / without[0], "light {i}");
            }
        }
    }
}

/// A map does not depend on the scene's unit or place.
#[test]
fn the_share_of_a_sphere_is_that_of_its_cone() {
    let mut scene = open("glass_ball").expect("built in");
    let ball = scene.geometry.spheres[0];
    for distance in [1.2f32, 3.0, 20.0] {
        let away = Vec3::new(0.48, 0.6, 0.64) * ball.radius * distance;
        scene.lights = vec![Light::Point { position: ball.center + away, power: Rgb::ONE }];
        let share = ProjectionMap::new(&scene).expect("a ball").share();
        let sine = 1.0 / f64::from(distance);
        let cone = (1.0 - (1.0 - sine * sine).sqrt()) / 2.0;
        // Cells along the rim are marked whole: a ring as wide as the diagonal of one, some 0.02 radians.
        let wide = (1.0 - (sine.asin() + 0.02).cos()) / 2.0;
        assert!((cone..wide).contains(&share), "{distance}: {share} for {cone}");
    }
}
