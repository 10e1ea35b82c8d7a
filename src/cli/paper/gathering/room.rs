//! The rooms of the paper: the one of its figures, with two small lights, and the one of its benchmark, "with a single
//! large light".

use crate::cli::failure::Failure;
use crate::cli::paper::PaperFlags;
use crate::render::settings::RenderSettings;
use crate::scene::scene_file::{RenderFile, SceneFile};
use crate::scene::{Scene, Source};
use std::sync::Arc;

/// The built-in room with two lights, which stands for the paper's.
pub const TWO_LIGHTS: &str = "two_lights";
/// Name of the room of the benchmark.
pub const ONE_LARGE_LIGHT: &str = "two_lights with one large light";
/// Factor on the edges of the light that stays: it fills the screen below it, and no more, so that it stays hidden.
const LARGER: f64 = 1.5;

/// Shadow rays to the light from each view hit: so many that the noise of direct light does not hide that of the gather.
/// They cost little beside hundreds of gather rays.
const SHADOW_RAYS: i64 = 64;

/// The built-in room.
///
/// # Errors
/// None but a defect of the binary.
pub fn two_lights() -> Result<Arc<Scene>, Failure> {
    Ok(Source::open(TWO_LIGHTS)?.scene)
}

/// The room of the benchmark: the built-in one without its second light, whose flux the first one gets, [`LARGER`].
///
/// # Errors
/// None but a defect of the binary.
pub fn one_large_light() -> Result<Arc<Scene>, Failure> {
    let source = Source::open(TWO_LIGHTS)?;
    Ok(Arc::new(source.edited(&with_one_light(&source.file), &source.scene)?))
}

fn with_one_light(file: &SceneFile) -> SceneFile {
    let mut one = file.clone();
    one.name = Some(ONE_LARGE_LIGHT.into());
    one.lights.truncate(1);
    for light in &mut one.lights {
        for edge in [&mut light.u, &mut light.v].into_iter().flatten() {
            *edge = edge.map(|x| x * LARGER);
        }
        let channel = |c: usize| file.lights.iter().filter_map(|l| l.power).map(|p| p[c]).sum::<f64>();
        light.power = Some([channel(0), channel(1), channel(2)]);
    }
    one
}

/// Settings of an item: those of the room with `flags` on top, `photons` emitted, and `size` where no flag has one.
///
/// # Errors
/// A flag out of range.
pub fn settings(scene: &Scene, flags: &PaperFlags, photons: i64, size: [u32; 2]) -> Result<RenderSettings, Failure> {
    let common = flags.common();
    let mut render = RenderFile::default();
    common.onto(&mut render);
    render.photons = Some(photons);
    render.shadow_rays = Some(SHADOW_RAYS);
    let size = Some(common.size.unwrap_or(size));
    Ok(RenderSettings::new(scene, &render, size, common.seed.unwrap_or(1))?)
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::scene::{Light, Material};
    use crate::trace::{Intersector, Ray, Surface};

    /// One light of the flux of two, which lies wholly over its screen.
    #[test]
    fn one_light_has_the_flux_of_two_and_fits_its_screen() {
        let (two, one) = (two_lights().expect("opens"), one_large_light().expect("opens"));
        assert_eq!((two.lights.len(), one.lights.len()), (2, 1));
        assert!((one.total_flux() / two.total_flux() - 1.0).abs() < 1e-6);
        assert!((one.lights[0].area() / two.lights[0].area() - 2.25).abs() < 1e-5);
        assert_ne!(one.hash, two.hash);
        let Light::Quad { u, v, .. } = &one.lights[0] else { panic!("a quad") };
        assert!(u.x.abs() <= 0.35 && v.z.abs() <= 0.5, "{u} {v}");
    }

    /// No ray of the camera meets the bright side of the light.
    #[test]
    fn the_light_is_hidden() {
        let scene = one_large_light().expect("opens");
        let intersector = Intersector::new(&scene.geometry, scene.radius);
        let rays = scene.camera.rays([96, 96]);
        for i in 0..96 * 96 {
            let (direction, _) = rays.ray((i % 96) as f32 + 0.5, (i / 96) as f32 + 0.5, 0.5);
            let ray = Ray { origin: scene.camera.position, direction };
            let hit = intersector.closest(&ray).expect("a closed room");
            let surface = Surface::new(&scene, &ray, &hit);
            let light = matches!(scene.materials[surface.material as usize], Material::Emitter { .. });
            assert!(!(light && surface.front), "pixel {i}");
        }
    }
}
