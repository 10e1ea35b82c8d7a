//! The inspector against the images, and photon paths against the photons.

use super::*;
use crate::estimate::registry::estimators;
use crate::render::{RenderSettings, Renderer};
use crate::scene::open;
use crate::scene::scene_file::RenderFile;
use std::f64::consts::PI;
use std::sync::Arc;

const ALL: &str = "density,regular,regular_3x3:n=2,coplanar,coplanar:weight=mean,multi_sampled:n=4,integrated";
const SIZE: [u32; 2] = [40, 36];

fn pass(scene: &str, flags: &RenderFile, names: &str, number: u32) -> Arc<Pass> {
    let scene = open(scene).expect("built in");
    let flags = RenderFile { photons: Some(15_000), ..flags.clone() };
    let settings = RenderSettings::new(&scene, &flags, Some(SIZE), 11).expect("valid");
    let mut renderer = Renderer::new(scene.into(), settings, estimators(names).expect("registered"));
    for _ in 0..=number {
        renderer.step(&Silent);
    }
    Arc::clone(renderer.last_pass().expect("a pass"))
}

fn by(gather: &str) -> RenderFile {
    RenderFile { gather: Some(gather.into()), ..Default::default() }
}

/// The image of that pass alone, under each estimator.
fn images(pass: &Pass, list: &[Box<dyn Estimator>]) -> Vec<Vec<Rgb>> {
    let result = pass.view().run(Rect::whole(SIZE), &slots(list, pass.settings.gather), &Silent);
    let mut images = vec![vec![Rgb::ZERO; (SIZE[0] * SIZE[1]) as usize]; list.len()];
    for tile in &result.tiles {
        for (image, part) in images.iter_mut().zip(&tile.images) {
            for (k, p) in part.pixels.iter().enumerate() {
                let (x, y) = (tile.rect.x + k as u32 % tile.rect.width, tile.rect.y + k as u32 / tile.rect.width);
                image[(y * SIZE[0] + x) as usize] = *p;
            }
        }
    }
    images
}

/// Value: the bits of the image. Base and contributions: the value, to the rounding of a few f32 operations.
#[test]
fn contributions_add_up_to_the_pixel_of_the_image() {
    let list = estimators(ALL).expect("registered");
    let mut photons = 0;
    for scene in ["ring", "cornell", "glass_sphere"] {
        for (gather, number) in [("overlap", 0), ("overlap", 3), ("knn", 0), ("knn", 2)] {
            let pass = pass(scene, &by(gather), ALL, number);
            assert_eq!(pass.number, number);
            let images = images(&pass, &list);
            for i in (0..SIZE[0] * SIZE[1]).step_by(53) {
                let pixel = [i % SIZE[0], i / SIZE[0]];
                let found = inspect(&pass, &list, pixel).expect("inside");
                photons += found.rows.len();
                for (e, of) in found.estimators.iter().enumerate() {
                    assert_eq!(
                        of.value.to_array().map(f32::to_bits),
                        images[e][i as usize].to_array().map(f32::to_bits)
                    );
                    let error = (found.sum(e) - of.value).abs();
                    let bound = of.value * 2f32.powi(-21);
                    assert!(error.cmple(bound).all(), "{scene} {gather} {number} {pixel:?} {}: {error}", of.name);
                }
            }
        }
    }
    assert!(photons > 10_000, "{photons}");
}

#[test]
fn parts_of_an_inspection_refer_to_each_other() {
    let list = estimators(ALL).expect("registered");
    let pass = pass("glass_sphere", &by("overlap"), ALL, 1);
    let found = inspect(&pass, &list, [20, 18]).expect("inside");
    assert!(found.path.iter().any(|v| v.surface == SurfaceKind::Dielectric && v.depth > 0));
    let mut light = [Rgb::ZERO; 3];
    for (i, v) in found.path.iter().enumerate() {
        light[v.rays_per_axis as usize] += v.light / (v.rays_per_axis * v.rays_per_axis) as f32;
        match v.parent {
            Some(p) => {
                let from = &found.path[p];
                assert!(p < i && from.depth + 1 == v.depth && from.cell == v.cell);
                assert!(from.rays_per_axis == v.rays_per_axis && from.surface != SurfaceKind::Diffuse);
                let along = v.position - from.position;
                assert!((along - v.direction * v.distance).length() < 1e-4 * pass.scene.radius);
            }
            None => assert_eq!(v.depth, 0),
        }
    }
    for (h, hit) in found.hits.iter().enumerate() {
        let v = &found.path[hit.vertex];
        assert_eq!((v.hit, v.position, v.cell), (Some(h), hit.view.query.center, hit.cell));
        assert_eq!(v.footprint, hit.view.query.axes);
        assert!(hit.discs.iter().all(|d| d.estimator == 0 && hit.rays_per_axis == 1));
    }
    // Rays of the 2×2 grid come after those of the pixel's one ray.
    let grids: Vec<u32> = found.hits.iter().map(|h| h.rays_per_axis).collect();
    assert!(grids.is_sorted() && grids.contains(&1) && grids.contains(&2));
    for e in &found.estimators {
        assert!((light[e.rays_per_axis as usize] - e.base).abs().max_element() < 1e-5 * e.base.max_element().max(1e-3));
    }
    for row in &found.rows {
        let photon = &pass.maps.of(row.kind).expect("a map").photons()[row.index as usize];
        assert_eq!((photon.position, photon.power), (row.position, row.power));
        for (e, of) in found.estimators.iter().enumerate() {
            assert!(row.weights[e] == 0.0 || of.rays_per_axis == found.hits[row.hit].rays_per_axis);
        }
        // Sampling points inside the photon and a weight of the sampled estimators go together.
        let (regular, sampled, exact) = (1, 5, 6);
        assert_eq!(row.samples[regular] > 0 && row.distance < 1.0, row.samples[regular] > 0);
        assert_eq!(row.weights[sampled] > 0.0, row.samples[sampled] > 0);
        if row.weights[exact] > 0.0 {
            assert_ne!(row.situation, Situation::Apart);
        }
    }
}

const GATHERED: &str = "integrated+classic:rays=20,regular_3x3:n=2+precomputed:rays=9,\
    integrated+ray-differentials:rays=40,pattern=sobol,multi_sampled:n=2+ray-differentials:rays=30,near=0.5";

/// Value: the bits of the image. Base, photons and gather rays: the value.
#[test]
fn gather_rays_add_up_to_the_pixel_of_the_image() {
    let list = estimators(GATHERED).expect("registered");
    let mut rays = [0; 4];
    for (scene, number) in [("cornell", 0), ("glass_sphere", 0), ("two_lights", 2)] {
        let pass = pass(scene, &by("overlap"), GATHERED, number);
        let images = images(&pass, &list);
        for i in (0..SIZE[0] * SIZE[1]).step_by(101) {
            let pixel = [i % SIZE[0], i / SIZE[0]];
            let found = inspect(&pass, &list, pixel).expect("inside");
            for (e, of) in found.estimators.iter().enumerate() {
                assert_eq!(of.value.to_array().map(f32::to_bits), images[e][i as usize].to_array().map(f32::to_bits));
                let error = (found.sum(e) - of.value).abs();
                assert!(error.cmple(of.value * 2f32.powi(-21)).all(), "{scene} {pixel:?} {}: {error}", of.name);
                let g = found.gathering(e).expect("gathers finally");
                let own = found.hits.iter().filter(|h| h.rays_per_axis == of.rays_per_axis).count();
                assert_eq!(g.hits.len(), own);
                for h in &g.hits {
                    assert_eq!(h.rays.len(), g.settings.rays as usize);
                    // The rays by themselves: the irradiance, and with the hit's weight the contribution.
                    let sum: DVec3 = h.rays.iter().map(|r| r.contribution.as_dvec3()).sum();
                    assert!((sum - h.irradiance.as_dvec3()).abs().max_element() <= 1e-5 * sum.max_element());
                    let adds = sum * h.weight.as_dvec3();
                    assert!((adds - h.contribution.as_dvec3()).abs().max_element() <= 1e-5 * adds.max_element());
                    rays[e] += h.rays.len();
                }
                // Photons of the global map do not count here: no estimator looks into it.
                assert!(found.rows.iter().all(|r| r.kind != PhotonKind::Global));
            }
        }
    }
    assert!(rays.iter().all(|n| *n > 500), "{rays:?}");
}

/// Each ray's irradiance from the estimates that it names, by a mean of their own; their discs are where the ray ends.
#[test]
fn gather_rays_name_the_estimates_that_they_average() {
    let names = "integrated+ray-differentials:rays=60,regular+precomputed:rays=60,regular+classic:rays=60";
    let list = estimators(names).expect("registered");
    let pass = pass("cornell", &by("overlap"), names, 0);
    let (mut averaged, mut nearest) = (0, 0);
    for pixel in [[5, 20], [20, 30], [30, 9]] {
        let found = inspect(&pass, &list, pixel).expect("inside");
        for g in &found.gatherings {
            let (mut named, mut recorded) = (0, 0);
            for ray in g.hits.iter().flat_map(|h| &h.rays) {
                recorded += 1;
                let estimates: Vec<_> = ray
                    .estimates
                    .iter()
                    .map(|at| gathering::estimate(&pass.gathering, &g.settings, *at).expect("there").1)
                    .collect();
                let Some(hit) = ray.hit else {
                    assert!(estimates.is_empty() && ray.contribution == Rgb::ZERO && ray.missed.is_some());
                    continue;
                };
                let end = RayEnd::of(ray);
                assert_eq!(end == RayEnd::Photons, g.estimator == 2);
                if estimates.is_empty() {
                    assert!(matches!(end, RayEnd::Photons | RayEnd::Unknown));
                    continue;
                }
                named += 1;
                assert!(ray.estimates.iter().all(|(layer, _)| Some(*layer) == gathering::layer_of(ray)));
                let area: f64 = estimates.iter().map(|e| f64::from(e.area)).sum();
                let mean = estimates.iter().map(|e| e.irradiance.as_dvec3() * f64::from(e.area)).sum::<DVec3>() / area;
                assert!((mean - ray.irradiance.as_dvec3()).abs().max_element() <= 1e-5 * mean.max_element());
                let [long, short] = gathering::semi_axes(&hit, pass.scene.resolution());
                assert!(long >= short && short > 0.0);
                match end {
                    RayEnd::Footprint => {
                        averaged += 1;
                        let inside = |p: Vec3| (p - hit.position).length() <= long * 1.000_1;
                        assert!(estimates.iter().all(|e| inside(e.position)));
                        let ellipse = PI * f64::from(hit.footprint[0].cross(hit.footprint[1]).length());
                        assert!((ellipse / (PI * f64::from(long * short)) - 1.0).abs() < 1e-3);
                    }
                    _ => nearest += 1,
                }
            }
            assert_eq!(g.ends().values().sum::<usize>(), recorded);
            assert_eq!(g.rays_by_layer().iter().sum::<usize>(), named);
            assert!(g.strongest().is_sorted_by(|a, b| g.adds(*a).element_sum() >= g.adds(*b).element_sum()));
            assert_eq!(g.strongest().len(), recorded);
        }
    }
    assert!(averaged > 50 && nearest > 50, "{averaged} {nearest}");
}

/// The discs of directions of all rays have the area that they own: seen along the normal `π r² cos θ`, together π.
#[test]
fn discs_of_directions_fill_the_hemisphere_seen_along_its_normal() {
    let names = "integrated+ray-differentials:rays=400,integrated+classic:rays=5";
    let list = estimators(names).expect("registered");
    let pass = pass("cornell", &by("overlap"), names, 0);
    let found = inspect(&pass, &list, [20, 30]).expect("inside");
    let gathered = &found.gatherings[0].hits[0];
    let normal = found.hits[gathered.hit].view.query.normal;
    let mut area = 0.0;
    for ray in &gathered.rays {
        let disc = gathering::disc_of_directions(normal, ray, 64);
        let next = disc.iter().cycle().skip(1);
        let own: f32 = disc.iter().zip(next).map(|(a, b)| a.perp_dot(*b)).sum::<f32>() / 2.0;
        assert!(own > 0.0 && disc.iter().all(|p| p.length() <= 1.0 + 1e-5));
        area += f64::from(own);
    }
    // Beyond the rim there is nothing to fill, and discs are flat where the sphere is not.
    assert!((area / PI - 1.0).abs() < 0.1, "{area}");
    let point = gathering::disc_of_directions(normal, &found.gatherings[1].hits[0].rays[0], 64);
    assert_eq!(point.len(), 1);
}

#[test]
fn odd_requests_are_refused_in_one_line() {
    let pass = pass("ring", &by("overlap"), "regular", 0);
    let list = estimators("regular").expect("registered");
    for pixel in [[40, 0], [0, 36], [u32::MAX, u32::MAX]] {
        let error = inspect(&pass, &list, pixel).expect_err("outside").to_string();
        assert!(error.contains("40x36") && error.lines().count() == 1, "{error}");
    }
    for (name, part) in [("density", "kd-tree"), ("integrated", "view differentials")] {
        let other = estimators(name).expect("registered");
        assert!(inspect(&pass, &other, [1, 1]).expect_err("not planned").to_string().contains(part));
    }
    let gathering = self::pass("cornell", &by("overlap"), "integrated+classic:rays=4", 0);
    for (name, part) in [("integrated", "global map"), ("integrated+precomputed:rays=4", "its final gathering")] {
        let other = estimators(name).expect("registered");
        let error = inspect(&gathering, &other, [1, 1]).expect_err("not planned").to_string();
        assert!(error.contains(part) && error.contains(name), "{error}");
    }
    // Nothing asked for: the view path alone.
    let path = inspect(&pass, &[], [20, 20]).expect("inside");
    assert!(path.rows.is_empty() && !path.path.is_empty());
}

/// Every photon of a pass can be followed back to its light, and arrives as it was stored.
#[test]
fn photon_paths_end_where_the_photon_was_stored() {
    let direct = RenderFile { direct: Some("photons".into()), ..by("overlap") };
    for (scene, flags, names) in [
        ("ring", by("overlap"), "integrated"),
        ("ring", by("knn"), "regular"),
        ("glass_sphere", direct, "integrated"),
        ("ring_soft", by("overlap"), "integrated"),
    ] {
        let pass = pass(scene, &flags, names, 1);
        let mut followed = 0;
        for (kind, map) in pass.maps.by_kind() {
            for index in (0..map.photons().len() as u32).step_by((map.photons().len() / 20).max(1)) {
                let photon = &map.photons()[index as usize];
                let path = photon_path(&pass, kind, index).expect("it was stored");
                let last = path.vertices.last().expect("a surface");
                assert_eq!(last.position, photon.position);
                // Directions are stored in four bytes.
                assert!((last.direction - photon.direction).length() < 7e-5);
                assert!((last.normal - photon.normal).length() < 7e-5);
                assert_eq!((last.power, last.stored), (photon.power, Some(kind)));
                let bounces = path.vertices.len() - 1;
                let specular = |v: &PhotonVertex| v.surface != SurfaceKind::Diffuse;
                assert!(match kind {
                    PhotonKind::Direct => bounces == 0,
                    PhotonKind::Caustic => bounces > 0 && path.vertices[..bounces].iter().all(specular),
                    PhotonKind::Global => path.vertices[..bounces].iter().any(|v| !specular(v)),
                });
                let start = path.origin + path.direction * path.vertices[0].distance;
                assert!((start - path.vertices[0].position).length() < 1e-4 * pass.scene.radius);
                followed += 1;
            }
            assert!(photon_path(&pass, kind, map.photons().len() as u32).is_none());
        }
        assert!(followed >= 20, "{scene} {followed}");
    }
}

/// A pass made alone is the pass of a render.
#[test]
fn a_pass_alone_is_that_of_a_render() {
    let list = estimators(ALL).expect("registered");
    for number in [0, 2] {
        let rendered = pass("cornell", &by("overlap"), ALL, number);
        let (scene, settings) = (Arc::clone(&rendered.scene), rendered.settings.clone());
        let alone = Pass::alone(scene, settings, &list, number, &|| false).expect("fits").expect("not cancelled");
        assert_eq!(images(&rendered, &list), images(&alone, &list));
        assert_eq!(alone.area_factor.to_bits(), rendered.area_factor.to_bits());
    }
}

/// A pass that is planned without view differentials still tells the view footprint of a pixel.
#[test]
fn view_paths_have_footprints_in_any_plan() {
    let with = pass("ring", &by("overlap"), "integrated", 1);
    let without = pass("ring", &by("overlap"), "regular", 1);
    assert!(with.plan.view_differentials && !without.plan.view_differentials);
    for pixel in [[20, 30], [33, 25], [5, 5]] {
        let (a, b) = (view_path(&with, pixel).expect("inside"), view_path(&without, pixel).expect("inside"));
        let full = inspect(&with, &[], pixel).expect("inside").path;
        assert_eq!(a.len(), full.len());
        for ((a, b), full) in a.iter().zip(&b).zip(&full) {
            assert_eq!((a.position, a.footprint), (full.position, full.footprint));
            assert_eq!((a.position, a.footprint), (b.position, b.footprint));
            assert!(a.footprint[0].length() > 0.0);
        }
    }
    assert!(view_path(&with, [SIZE[0], 0]).is_err());
}
