use super::*;
use crate::measure::metrics::{block_average, compare};
use crate::scene::open;

fn never() -> bool {
    false
}

fn settings(size: [u32; 2], light: LightPart) -> ReferenceSettings {
    ReferenceSettings { size, light, max_depth: 20, seed: 1 }
}

fn by(method: Method, scene: &Scene, settings: ReferenceSettings, batches: u32) -> Reference {
    let intersector = Intersector::new(&scene.geometry, scene.radius);
    let mut tracer = Tracer::with_method(scene, &intersector, settings, method);
    let until = Until { batches: Some(batches), ..Default::default() };
    assert!(tracer.refine(&until, &never, &mut |_, _| {}));
    println!(
        "{} {:?}: {batches} batches in {:.1} s, noise {:?}, {} pixels",
        scene.name,
        settings.light,
        tracer.seconds(),
        tracer.relative_noise(),
        tracer.mask().counts.iter().filter(|c| **c).count()
    );
    tracer.reference()
}

#[test]
fn methods() {
    for name in ["ring_soft", "glass_sphere"] {
        let scene = open(name).expect("built in");
        let a = by(Method::PathsAndPhotons, &scene, settings([256, 256], LightPart::All), 8);
        let b = by(Method::Paths, &scene, settings([256, 256], LightPart::All), 16);
        let error = compare(&a.image, &b.image, &a.mask).expect("same size");
        println!("{name} {} {:?} {:?}", error.mean_ratio, a.relative_noise(&a.mask), b.relative_noise(&a.mask));
    }
}
