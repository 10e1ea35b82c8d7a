//! Traced references on disk: a later study goes on where an earlier one stopped.
//!
//! A file holds all batches of a tracer in sums. It is named by a hash of everything that decides the image; a file that is
//! damaged, or that another version wrote, is left alone until it is overwritten.

use crate::math::hash::{FNV_START, fnv1a};
use crate::measure::reference::{Reference, closed_form};
use crate::measure::tracer::batches::Batches;
use crate::measure::tracer::{Method, ReferenceSettings, TRACER_VERSION, Tracer, Until};
use crate::scene::Scene;
use crate::trace::Intersector;
use glam::DVec3;
use std::fmt::Write as _;
use std::io::Write as _;
use std::path::{Path, PathBuf};

/// First bytes of a file: what it is, and the version of its layout.
const MAGIC: &[u8; 16] = b"cusp reference 1";
/// Bytes before the pixels: magic, key, size, batches, seconds.
const HEAD: usize = 16 + 8 + 8 + 4 + 8;
/// Bytes of a pixel: two sums of three channels in 64 bits.
const PIXEL: usize = 48;

/// Where references are kept: `CUSP_CACHE`, else `cusp` in `XDG_CACHE_HOME`, else `.cache/cusp` in `HOME`. None without
/// any of them.
pub fn default_folder() -> Option<PathBuf> {
    folder_by(|name| std::env::var_os(name).filter(|v| !v.is_empty()).map(PathBuf::from))
}

fn folder_by(variable: impl Fn(&str) -> Option<PathBuf>) -> Option<PathBuf> {
    variable("CUSP_CACHE")
        .or_else(|| variable("XDG_CACHE_HOME").map(|f| f.join("cusp")))
        .or_else(|| variable("HOME").map(|f| f.join(".cache").join("cusp")))
}

/// Hash of all that decides a tracer's batches: the files of the scene, camera, materials and lights as they are, the
/// settings, the method, and the tracers' version.
pub fn key(scene: &Scene, settings: &ReferenceSettings, method: Method) -> u64 {
    struct Hash(u64);
    impl std::fmt::Write for Hash {
        fn write_str(&mut self, s: &str) -> std::fmt::Result {
            self.0 = fnv1a(self.0, s.as_bytes());
            Ok(())
        }
    }
    let g = &scene.geometry;
    let camera = crate::scene::Camera { resolution: [0, 0], ..scene.camera };
    let mut hash = Hash(FNV_START);
    // Writing into a hash does not fail.
    let _ = write!(
        hash,
        "{TRACER_VERSION} {:x} {} {} {} {camera:?} {:?} {:?} {settings:?} {method:?}",
        scene.hash,
        scene.radius,
        g.triangles.len(),
        g.spheres.len(),
        scene.materials,
        scene.lights
    );
    hash.0
}

fn file_of(folder: &Path, key: u64) -> PathBuf {
    folder.join(format!("reference-{key:016x}.bin"))
}

/// Brings back the batches that were kept for a tracer; false if there are none.
///
/// # Errors
/// A file that cannot be read or used, in one line; the tracer is as it was.
pub fn load(folder: &Path, tracer: &mut Tracer) -> Result<bool, String> {
    let key = key(tracer.scene(), tracer.settings(), tracer.method());
    let path = file_of(folder, key);
    let wrong = |why: &str| format!("{}: {why}; the reference is traced anew", path.display());
    let bytes = match std::fs::read(&path) {
        Ok(bytes) => bytes,
        Err(e) if e.kind() == std::io::ErrorKind::NotFound => return Ok(false),
        Err(e) => return Err(wrong(&format!("cannot be read: {e}"))),
    };
    let (batches, seconds) = decode(&bytes, key).map_err(wrong)?;
    if tracer.resume(batches, seconds) { Ok(true) } else { Err(wrong("holds an image of another size")) }
}

/// Keeps the batches of a tracer, whole or not at all.
///
/// # Errors
/// Anything that the system refuses, in one line.
pub fn save(folder: &Path, tracer: &Tracer) -> Result<(), String> {
    let key = key(tracer.scene(), tracer.settings(), tracer.method());
    let path = file_of(folder, key);
    let wrong = |e: &dyn std::fmt::Display| format!("{}: cannot be written: {e}", path.display());
    std::fs::create_dir_all(folder).map_err(|e| wrong(&e))?;
    let mut file = tempfile::Builder::new().prefix(".cusp-").tempfile_in(folder).map_err(|e| wrong(&e))?;
    file.write_all(&encode(tracer.batches(), tracer.seconds(), key)).map_err(|e| wrong(&e))?;
    file.as_file().sync_all().map_err(|e| wrong(&e))?;
    file.persist(&path).map_err(|e| wrong(&e.error))?;
    Ok(())
}

/// As [`crate::measure::tracer::render_reference`], going on from what `folder` keeps and keeping what is made. Also
/// returns warnings, one line each: a cache that cannot be used is no error.
pub fn cached_reference(
    folder: Option<&Path>,
    scene: &Scene,
    intersector: &Intersector,
    settings: &ReferenceSettings,
    until: &Until,
    cancelled: &(dyn Fn() -> bool + Sync),
    progress: &mut dyn FnMut(f64, Option<f64>),
) -> (Reference, Vec<String>) {
    if let Some(exact) = closed_form::reference(scene, settings.size, settings.light) {
        return (exact, Vec::new());
    }
    let mut tracer = Tracer::new(scene, intersector, *settings);
    let mut warnings = Vec::new();
    if let Some(folder) = folder {
        warnings.extend(load(folder, &mut tracer).err());
    }
    let before = tracer.batches().count();
    tracer.refine(until, cancelled, progress);
    if let Some(folder) = folder
        && tracer.batches().count() > before
    {
        warnings.extend(save(folder, &tracer).err());
    }
    (tracer.reference(), warnings)
}

fn encode(batches: &Batches, seconds: f64, key: u64) -> Vec<u8> {
    let mut bytes = Vec::with_capacity(HEAD + PIXEL * batches.sum.len() + 8);
    bytes.extend_from_slice(MAGIC);
    bytes.extend_from_slice(&key.to_le_bytes());
    batches.size.iter().for_each(|n| bytes.extend_from_slice(&n.to_le_bytes()));
    bytes.extend_from_slice(&batches.count.to_le_bytes());
    bytes.extend_from_slice(&seconds.to_le_bytes());
    for v in batches.sum.iter().chain(&batches.squares) {
        v.to_array().iter().for_each(|c| bytes.extend_from_slice(&c.to_le_bytes()));
    }
    let check = fnv1a(FNV_START, &bytes);
    bytes.extend_from_slice(&check.to_le_bytes());
    bytes
}

/// Batches and seconds from the bytes of a file.
fn decode(bytes: &[u8], key: u64) -> Result<(Batches, f64), &'static str> {
    const DAMAGED: &str = "is damaged";
    let at = |start: usize| bytes.get(start..start + 8).and_then(|b| b.try_into().ok()).map(u64::from_le_bytes);
    let half = |start: usize| bytes.get(start..start + 4).and_then(|b| b.try_into().ok()).map(u32::from_le_bytes);
    if bytes.get(..MAGIC.len()) != Some(MAGIC.as_slice()) {
        return Err("is no kept reference of this version");
    }
    let content = bytes.len().checked_sub(8).ok_or(DAMAGED)?;
    if at(content) != Some(fnv1a(FNV_START, &bytes[..content])) {
        return Err(DAMAGED);
    }
    if at(16) != Some(key) {
        return Err("belongs to another scene or other settings");
    }
    let (Some(w), Some(h), Some(count), Some(seconds)) = (half(24), half(28), half(32), at(36)) else {
        return Err(DAMAGED);
    };
    let pixels = u64::from(w) * u64::from(h);
    if content.checked_sub(HEAD).map(|n| n as u64) != pixels.checked_mul(PIXEL as u64) {
        return Err(DAMAGED);
    }
    let mut values = bytes[HEAD..content].as_chunks::<8>().0.iter().map(|b| f64::from_le_bytes(*b));
    let mut image = || -> Vec<DVec3> {
        (0..pixels).filter_map(|_| Some(DVec3::new(values.next()?, values.next()?, values.next()?))).collect()
    };
    let (sum, squares) = (image(), image());
    let seconds = f64::from_bits(seconds);
    let sound = |v: &[DVec3]| v.iter().all(|p| p.is_finite());
    if !(seconds.is_finite() && seconds >= 0.0 && sound(&sum) && sound(&squares)) {
        return Err(DAMAGED);
    }
    Ok((Batches { size: [w, h], count, sum, squares }, seconds))
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::render::LightPart;
    use crate::scene::open;

    const SETTINGS: ReferenceSettings =
        ReferenceSettings { size: [8, 6], light: LightPart::All, max_depth: 6, seed: 5 };

    fn until(batches: u32) -> Until {
        Until { batches: Some(batches), ..Default::default() }
    }

    #[test]
    fn the_folder_is_where_the_environment_says() {
        let with = |set: &'static [(&str, &str)]| {
            folder_by(move |name| set.iter().find(|(n, _)| *n == name).map(|(_, v)| PathBuf::from(v)))
        };
        let all = &[("CUSP_CACHE", "/a"), ("XDG_CACHE_HOME", "/b"), ("HOME", "/c")];
        assert_eq!(with(all), Some("/a".into()));
        assert_eq!(with(&all[1..]), Some("/b/cusp".into()));
        assert_eq!(with(&all[2..]), Some("/c/.cache/cusp".into()));
        assert_eq!(with(&[]), None);
    }

    /// A second run makes no batch, a longer one goes on, and both equal a run without a cache.
    #[test]
    fn what_is_kept_is_not_traced_again() {
        let folder = tempfile::tempdir().expect("a temporary folder");
        let scene = open("cornell").expect("built in");
        let intersector = Intersector::new(&scene.geometry, scene.radius);
        let run = |folder: Option<&Path>, n: u32| {
            let mut made = 0;
            let mut count = |_: f64, _: Option<f64>| made += 1;
            let (reference, warnings) =
                cached_reference(folder, &scene, &intersector, &SETTINGS, &until(n), &|| false, &mut count);
            assert!(warnings.is_empty(), "{warnings:?}");
            (reference, made)
        };
        let kept = Some(folder.path());
        let (first, made) = run(kept, 2);
        assert_eq!(made, 2);
        let (second, made) = run(kept, 2);
        assert_eq!((made, &second.image, &second.noise), (0, &first.image, &first.noise));
        let (longer, made) = run(kept, 4);
        assert_eq!(made, 2);
        let (once, made) = run(None, 4);
        assert_eq!((made, &once.image, &once.noise), (4, &longer.image, &longer.noise));
        assert_ne!(first.image, longer.image);
        assert_eq!(std::fs::read_dir(folder.path()).expect("reads").count(), 1, "no temporary file is left");
    }

    #[test]
    fn a_damaged_or_foreign_file_is_ignored_with_a_warning() {
        let folder = tempfile::tempdir().expect("a temporary folder");
        let scene = open("cornell").expect("built in");
        let intersector = Intersector::new(&scene.geometry, scene.radius);
        let mut tracer = Tracer::new(&scene, &intersector, SETTINGS);
        assert!(tracer.step(&|| false));
        save(folder.path(), &tracer).expect("writes");
        let path = file_of(folder.path(), key(&scene, &SETTINGS, tracer.method()));
        let sound = std::fs::read(&path).expect("reads");
        let mut foreign = Tracer::new(&scene, &intersector, ReferenceSettings { seed: 6, ..SETTINGS });
        assert_eq!(load(folder.path(), &mut foreign), Ok(false), "another seed has another file");

        let mut cases: Vec<Vec<u8>> =
            [0, 7, 16, HEAD, sound.len() / 2, sound.len() - 1].map(|n| sound[..n].to_vec()).into();
        for at in [0, 15, 20, 26, 33, 40, HEAD + 5, sound.len() - 3] {
            let mut bytes = sound.clone();
            bytes[at] ^= 0x40;
            cases.push(bytes);
        }
        // Sound in itself, but of another scene.
        cases.push(encode(tracer.batches(), 1.0, 1));
        // A checksum that fits does not make an infinity a number.
        let mut odd = tracer.batches().clone();
        odd.sum[3].y = f64::INFINITY;
        cases.push(encode(&odd, 1.0, key(&scene, &SETTINGS, tracer.method())));
        for (i, bytes) in cases.iter().enumerate() {
            std::fs::write(&path, bytes).expect("writes");
            let mut fresh = Tracer::new(&scene, &intersector, SETTINGS);
            let why = load(folder.path(), &mut fresh).expect_err("not usable");
            assert!(!why.contains('\n') && fresh.batches().count() == 0, "{i}: {why}");
        }
        // A run with such a file says so, and mends it.
        let run = || {
            cached_reference(Some(folder.path()), &scene, &intersector, &SETTINGS, &until(1), &|| false, &mut |_, _| {})
        };
        assert_eq!(run().1.len(), 1);
        assert!(run().1.is_empty());
        assert_eq!(std::fs::read(&path).expect("reads")[HEAD..sound.len() - 8], sound[HEAD..sound.len() - 8]);
    }

    #[test]
    fn everything_that_decides_the_image_is_in_the_key() {
        let scene = open("glass_ball").expect("built in");
        let own = key(&scene, &SETTINGS, Method::Paths);
        let mut keys = vec![
            own,
            key(&scene, &ReferenceSettings { size: [8, 7], ..SETTINGS }, Method::Paths),
            key(&scene, &ReferenceSettings { light: LightPart::Caustic, ..SETTINGS }, Method::Paths),
            key(&scene, &ReferenceSettings { max_depth: 7, ..SETTINGS }, Method::Paths),
            key(&scene, &ReferenceSettings { seed: 6, ..SETTINGS }, Method::Paths),
            key(&scene, &SETTINGS, Method::PathsAndPhotons),
        ];
        let mut changed = |change: &dyn Fn(&mut Scene)| {
            let mut scene = scene.clone();
            change(&mut scene);
            keys.push(key(&scene, &SETTINGS, Method::Paths));
        };
        changed(&|s| s.hash += 1);
        changed(&|s| s.camera.position.x += 0.5);
        changed(&|s| s.materials.reverse());
        changed(&|s| s.lights.clear());
        let mut resized = scene.clone();
        resized.camera.resolution = [9, 9];
        assert_eq!(key(&resized, &SETTINGS, Method::Paths), own, "the size is the settings'");
        let n = keys.len();
        keys.sort_unstable();
        keys.dedup();
        assert_eq!(keys.len(), n);
    }
}
