//! A reference that Cusp makes itself: in closed form where there is one, else by plain tracers, until its noise is a
//! third of the smallest error studied or the time is spent.

use crate::cli::failure::Failure;
use crate::cli::progress::{bar, interrupted};
use crate::cli::study::judged::{JudgeFlags, Study};
use crate::export::{exr_file, png_file};
use crate::measure::Reference;
use crate::measure::reference::{cache, closed_form};
use crate::measure::study::Judge;
use crate::measure::study::evaluate::smallest_error;
use crate::measure::tracer::{ReferenceSettings, Tracer, Until};
use crate::trace::Intersector;
use std::path::Path;

/// Part of the smallest error studied that the reference's noise may be.
const PART: f64 = 1.0 / 3.0;
/// Relative noise at which errors are looked at for the first time.
const FIRST: f64 = 0.25;

/// Makes it, and writes it with its mask to `out`.
///
/// # Errors
/// No scene, an interruption, or a file that cannot be written.
pub fn make(study: &Study, flags: &JudgeFlags, out: &Path, hidden: bool) -> Result<Reference, Failure> {
    let scene = study.scene.as_deref().ok_or_else(|| {
        Failure::Call(format!(
            "{}: the scene of the study is not there, or has changed; give --scene, or a --reference",
            study.plan.scene
        ))
    })?;
    if !(flags.reference_seconds > 0.0 && flags.reference_seconds.is_finite()) {
        return Err(Failure::Call("--reference-seconds: must be positive".into()));
    }
    let base = &study.plan.base;
    let reference = match closed_form::reference(scene, base.size, base.light) {
        Some(exact) => exact,
        None => {
            let intersector = Intersector::new(&scene.geometry, scene.radius);
            let settings = ReferenceSettings { size: base.size, light: base.light, max_depth: base.max_depth, seed: 1 };
            let mut tracer = Tracer::new(scene, &intersector, settings);
            let folder = cache::default_folder();
            let kept = folder.as_ref().map(|f| cache::load(f, &mut tracer));
            warn(kept.and_then(Result::err), hidden);
            let finished = refine(study, flags, &mut tracer, hidden);
            // What was traced is kept, also after an interruption.
            warn(folder.as_ref().and_then(|f| cache::save(f, &tracer).err()), hidden);
            finished?
        }
    };
    let mut facts = vec![("cusp.version", study.plan.version.clone()), ("cusp.scene", study.plan.scene_name.clone())];
    facts.push(("cusp.scene_hash", study.plan.scene_hash.clone()));
    facts.push(("cusp.command", crate::export::provenance::command_line()));
    let mask: Vec<u8> = reference.mask.counts.iter().flat_map(|c| [if *c { 255 } else { 0 }; 3]).collect();
    png_file::write_with(&out.join("reference_mask.png"), reference.mask.size, &mask, &facts)?;
    facts.extend(reference.facts());
    exr_file::write_with(&out.join("reference.exr"), &reference.image, &facts)?;
    Ok(reference)
}

/// Adds batches until the noise is small enough against what the study's images show of their errors.
fn refine(study: &Study, flags: &JudgeFlags, tracer: &mut Tracer, hidden: bool) -> Result<Reference, Failure> {
    let records = study.task_records();
    let mut target = FIRST;
    let progress = bar(100, "reference", hidden);
    loop {
        let until = Until { noise: Some(target), seconds: Some(flags.reference_seconds), batches: None };
        let done = tracer.refine(&until, &interrupted, &mut |seconds, noise| {
            progress.set_position((100.0 * seconds / flags.reference_seconds).min(100.0) as u64);
            let noise = noise.map_or(String::new(), |n| format!(", noise {:.2} %", 100.0 * n));
            progress.set_message(format!("reference{noise}"));
        });
        if !done {
            return Err(Failure::Interrupted("the images are kept; --resume goes on with the reference".into()));
        }
        let reference = tracer.reference();
        let judge = Judge::new(&reference, flags.crop, 0.0).map_err(Failure::Call)?;
        let smallest = smallest_error(&records, &judge, &|t, p| study.image(t, p)).map_err(Failure::Work)?;
        let (Some(noise), Some(smallest)) = (judge.relative_noise(), smallest) else {
            break;
        };
        if noise <= PART * smallest || tracer.seconds() >= flags.reference_seconds {
            break;
        }
        // The smallest error is known better with each round. The mask of the tracer may differ from the crop's, so its
        // own measure of noise is scaled.
        let scale = tracer.relative_noise().unwrap_or(noise) / noise;
        target = scale * (0.98 * PART * smallest).max(noise / 2.0).min(0.9 * noise);
    }
    progress.finish_and_clear();
    Ok(tracer.reference())
}

fn warn(warning: Option<String>, hidden: bool) {
    if let Some(why) = warning.filter(|_| !hidden) {
        eprintln!("warning: {why}");
    }
}
