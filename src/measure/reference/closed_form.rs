//! Scenes whose image has a closed form: a diffuse rectangle under point lights.

use crate::measure::Mask;
use crate::measure::reference::{Noise, Reference};
use crate::measure::tracer::pinhole::Pinhole;
use crate::render::LightPart;
use crate::render::film::Image;
use crate::scene::{Light, Material, Scene};
use glam::DVec3;
use rayon::prelude::*;
use std::f64::consts::PI;

/// Gauss-Legendre nodes and weights on [0, 1] with 4 and 8 points (Abramowitz and Stegun 1964, table 25.4).
const FOUR: [(f64, f64); 4] =
    gauss([(-0.861_136_311_594_052_6, 0.347_854_845_137_453_85), (-0.339_981_043_584_856_26, 0.652_145_154_862_546_1)]);
const EIGHT: [(f64, f64); 8] = gauss([
    (-0.960_289_856_497_536_2, 0.101_228_536_290_376_26),
    (-0.796_666_477_413_626_7, 0.222_381_034_453_374_48),
    (-0.525_532_409_916_329, 0.313_706_645_877_887_27),
    (-0.183_434_642_495_649_8, 0.362_683_783_378_361_96),
]);

/// Both signs of the nodes on [-1, 1], moved to [0, 1].
const fn gauss<const HALF: usize, const N: usize>(half: [(f64, f64); HALF]) -> [(f64, f64); N] {
    let mut all = [(0.0, 0.0); N];
    let mut i = 0;
    while i < HALF {
        let (x, w) = half[i];
        all[i] = ((1.0 + x) / 2.0, w / 2.0);
        all[N - 1 - i] = ((1.0 - x) / 2.0, w / 2.0);
        i += 1;
    }
    all
}

/// Largest relative difference between quadratures of 4×4 and of 8×8 points with which a pixel counts as exact.
const QUADRATURE: f64 = 1e-6;

/// A diffuse rectangle or parallelogram, and the point lights before it.
struct LitQuad {
    corner: DVec3,
    edges: [DVec3; 2],
    normal: DVec3,
    reflectance: DVec3,
    /// Position and flux.
    lights: Vec<(DVec3, DVec3)>,
}

/// The exact image of a scene of one diffuse quad without texture and of point lights on its front, where the camera is
/// as well and sees nothing but the quad: `L = Σ ρ/π Φ cos θ/(4π r²)`, box-filtered by quadrature. None for any other scene,
/// and for parts of the light other than `all` and `direct`.
pub fn reference(scene: &Scene, size: [u32; 2], light: LightPart) -> Option<Reference> {
    if !matches!(light, LightPart::All | LightPart::Direct) {
        return None;
    }
    let quad = LitQuad::of(scene)?;
    let camera = Pinhole::new(&scene.camera, size);
    let (w, h) = (f64::from(size[0]), f64::from(size[1]));
    // The quad is convex, so the image sees nothing else if its corners do not.
    let sees = |x: f64, y: f64| quad.meets(camera.eye(), camera.direction(x, y));
    if ![(0.0, 0.0), (w, 0.0), (0.0, h), (w, h)].iter().all(|&(x, y)| sees(x, y)) {
        return None;
    }
    let rows: Option<Vec<Vec<glam::Vec3>>> = (0..size[1])
        .into_par_iter()
        .map(|y| (0..size[0]).map(|x| quad.pixel(&camera, x, y).map(|p| p.as_vec3())).collect())
        .collect();
    Some(Reference {
        source: "closed form of point lights over a plane".into(),
        image: Image { size, pixels: rows?.concat() },
        mask: Mask::all(size),
        noise: Noise::Exact,
    })
}

impl LitQuad {
    fn of(scene: &Scene) -> Option<Self> {
        let g = &scene.geometry;
        if !g.spheres.is_empty() || g.triangles.len() != 2 || g.triangle_materials[0] != g.triangle_materials[1] {
            return None;
        }
        let Material::Diffuse { reflectance, texture: None } = &scene.materials[g.material(0)] else {
            return None;
        };
        let (first, second) = (g.triangles[0], g.triangles[1]);
        let same = |a: u32, b: u32| g.positions[a as usize] == g.positions[b as usize];
        // The corner of each triangle that the other lacks, opposite to the shared diagonal.
        let own = |t: [u32; 3], other: [u32; 3]| {
            let mut apart = (0..3).filter(|&i| !other.iter().any(|&o| same(t[i], o)));
            apart.next().filter(|_| apart.next().is_none())
        };
        let (i, j) = (own(first, second)?, own(second, first)?);
        let at = |t: [u32; 3], i: usize| g.positions[t[i % 3] as usize].as_dvec3();
        let (corner, a, b, far) = (at(first, i), at(first, i + 1), at(first, i + 2), at(second, j));
        let edges = [a - corner, b - corner];
        let area = edges[0].cross(edges[1]);
        let normal = area.try_normalize()?;
        let rounding = 1e-5 * f64::from(scene.radius);
        if (corner + edges[0] + edges[1]).distance(far) > rounding {
            return None;
        }
        // Light that grazes the quad, or is as good as on it, is left to the tracers.
        let before = |p: DVec3| (p - corner).dot(normal) > 1e-3 * f64::from(scene.radius);
        let lights: Option<Vec<_>> = scene
            .lights
            .iter()
            .map(|l| match l {
                Light::Point { position, power } => {
                    before(position.as_dvec3()).then(|| (position.as_dvec3(), power.as_dvec3()))
                }
                _ => None,
            })
            .collect();
        let quad = Self { corner, edges, normal, reflectance: reflectance.as_dvec3(), lights: lights? };
        before(scene.camera.position.as_dvec3()).then_some(quad)
    }

    /// Where a ray meets the quad's plane; None if it does not.
    fn plane(&self, eye: DVec3, direction: DVec3) -> Option<DVec3> {
        let t = (self.corner - eye).dot(self.normal) / direction.dot(self.normal);
        (t > 0.0 && t.is_finite()).then(|| eye + direction * t)
    }

    fn meets(&self, eye: DVec3, direction: DVec3) -> bool {
        let Some(p) = self.plane(eye, direction) else {
            return false;
        };
        let d = p - self.corner;
        let [a, b] = self.edges;
        let area = a.cross(b).dot(self.normal);
        let along = [d.cross(b).dot(self.normal) / area, a.cross(d).dot(self.normal) / area];
        along.iter().all(|s| (0.0..=1.0).contains(s))
    }

    fn radiance(&self, p: DVec3) -> DVec3 {
        let irradiance = self.lights.iter().fold(DVec3::ZERO, |sum, (at, power)| {
            let way = *at - p;
            let d2 = way.length_squared();
            sum + *power * (way.dot(self.normal) / (4.0 * PI * d2 * d2.sqrt()))
        });
        self.reflectance / PI * irradiance
    }

    fn mean(&self, camera: &Pinhole, x: u32, y: u32, nodes: &[(f64, f64)]) -> Option<DVec3> {
        let mut sum = DVec3::ZERO;
        for (v, wv) in nodes {
            for (u, wu) in nodes {
                let p = self.plane(camera.eye(), camera.direction(f64::from(x) + u, f64::from(y) + v))?;
                sum += self.radiance(p) * (wu * wv);
            }
        }
        Some(sum)
    }

    /// Mean over a pixel; None if the quadrature can't be trusted.
    fn pixel(&self, camera: &Pinhole, x: u32, y: u32) -> Option<DVec3> {
        let (rough, fine) = (self.mean(camera, x, y, &FOUR)?, self.mean(camera, x, y, &EIGHT)?);
        let exact = (rough - fine).abs().cmple(fine * QUADRATURE).all();
        (exact && fine.is_finite()).then_some(fine)
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::math::rgb::Rgb;
    use crate::scene::open;

    /// Against a brute-force mean of 64×64 points a pixel of the formula as the scene file states it.
    #[test]
    fn plane_is_the_mean_of_its_formula_over_each_pixel() {
        let scene = open("plane").expect("built in");
        let size = [24, 16];
        let exact = reference(&scene, size, LightPart::All).expect("a closed form");
        assert_eq!(exact.noise, Noise::Exact);
        // Camera at (0, 4, 0) looking down, up is -z; light of 50 W at (0.3, 1.5, -0.2); ρ = 0.5.
        let step = 2.0 * libm::tan(20f64.to_radians()) / 16.0;
        let n = 64;
        for (x, y) in [(0, 0), (13, 7), (23, 15), (14, 6)] {
            let mut sum = 0.0;
            for j in 0..n {
                for i in 0..n {
                    let place = |a: u32, k: u32, half: f64| {
                        4.0 * (f64::from(a) + (f64::from(k) + 0.5) / f64::from(n) - half) * step
                    };
                    let (px, pz) = (place(x, i, 12.0), place(y, j, 8.0));
                    let d = DVec3::new(0.3 - px, 1.5, -0.2 - pz);
                    let r2 = d.length_squared();
                    sum += 0.5 / PI * 50.0 * (1.5 / r2.sqrt()) / (4.0 * PI * r2);
                }
            }
            let expected = sum / f64::from(n * n);
            let found = f64::from(exact.image.at(x, y).x);
            assert!((found / expected - 1.0).abs() < 1e-5, "{x},{y}: {found} {expected}");
        }
    }

    #[test]
    fn other_scenes_have_none() {
        for name in ["ring", "ring_soft", "cornell", "glass_ball", "glass_sphere", "two_lights", "prism_wall"] {
            assert!(reference(&open(name).expect("built in"), [8, 8], LightPart::All).is_none(), "{name}");
        }
        let plane = || open("plane").expect("built in");
        assert!(reference(&plane(), [8, 8], LightPart::Caustic).is_none());
        let changed = |change: &dyn Fn(&mut Scene)| {
            let mut scene = plane();
            change(&mut scene);
            reference(&scene, [8, 8], LightPart::All).is_none()
        };
        let spot = Light::Spot {
            position: glam::Vec3::Y,
            direction: -glam::Vec3::Y,
            cos_half: 0.5,
            falloff: 0.0,
            power: Rgb::ONE,
        };
        assert!(changed(&|s| s.lights.push(spot.clone())), "a light of another kind");
        assert!(changed(&|s| s.lights.push(Light::Point { position: -glam::Vec3::Y, power: Rgb::ONE })), "behind");
        assert!(changed(&|s| s.camera.tan_half_fov_y = 3.0), "sees beyond the quad");
        assert!(changed(&|s| s.camera.position = -glam::Vec3::Y), "a camera behind");
        assert!(changed(&|s| s.materials = vec![Material::Mirror { reflectance: Rgb::ONE }]), "a mirror");
        assert!(!changed(&|s| s.lights.push(Light::Point { position: glam::Vec3::Y, power: Rgb::ONE })), "two lights");
    }
}
