//! What a study takes errors against: a given file, the stored reference of a built-in scene, or none yet.

use crate::cli::failure::Failure;
use crate::cli::flags::check_crop;
use crate::cli::study::judged::JudgeFlags;
use crate::measure::Reference;
use crate::measure::study::Judge;
use crate::render::film::Image;
use crate::render::settings::LightPart;

/// A reference that is there before any work.
pub enum Given {
    /// From a file or from the binary.
    Reference(Box<Reference>),
    /// One has to be made.
    None,
}

/// The reference of the flags, or the stored one of the scene `named` if it shows this light.
///
/// # Errors
/// A file that cannot be read.
pub fn given_reference(flags: &JudgeFlags, named: &str, light: LightPart) -> Result<Given, Failure> {
    if let Some(path) = &flags.reference {
        let reference = Reference::from_files(path, flags.mask.as_deref()).map_err(Failure::Call)?;
        return Ok(Given::Reference(reference.into()));
    }
    // A stored reference shows all light.
    if light != LightPart::All || flags.own_reference {
        return Ok(Given::None);
    }
    Ok(Reference::built_in(named).map_err(Failure::Work)?.map_or(Given::None, |r| Given::Reference(r.into())))
}

impl Given {
    /// Whether images of `size` pixels can be compared with it, and the crop lies inside.
    ///
    /// # Errors
    /// What does not fit.
    pub fn check(&self, flags: &JudgeFlags, size: [u32; 2]) -> Result<(), Failure> {
        let compared = match self {
            Self::Reference(r) => {
                let judge = Judge::new(r, flags.crop, 0.0).map_err(|e| Failure::Call(format!("--crop: {e}")))?;
                judge.fitted(&Image::black(size)).map_err(|e| {
                    Failure::Call(format!("--size: {e}; give such a size, another --reference, or --own-reference"))
                })?;
                r.image.size
            }
            Self::None => size,
        };
        flags.crop.map_or(Ok(()), |crop| check_crop(crop, compared))
    }
}
