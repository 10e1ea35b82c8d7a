//! The ways to gather finally that the paper's tables and figures compare.

use crate::cli::failure::Failure;
use crate::estimate::{Estimator, registry};
use serde::Serialize;

/// What is looked up at the ends of gather rays, and how.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize)]
#[serde(rename_all = "snake_case")]
pub enum Way {
    /// The k nearest photons ("normal photon mapping").
    Classic,
    /// Ray differentials with the paper's own footprints, estimates and reach.
    AsPublished,
    /// Ray differentials with footprints that share the hemisphere and estimates over the surface.
    Corrected,
    /// The same along a spiral, whose footprints tile the hemisphere.
    Spiral,
}

impl Way {
    /// Those of the tables, classic first.
    pub const TIMED: [Self; 3] = [Self::Classic, Self::AsPublished, Self::Corrected];
    /// Those of the figures.
    pub const SHOWN: [Self; 4] = [Self::Classic, Self::AsPublished, Self::Corrected, Self::Spiral];

    /// For tables and pictures.
    pub fn title(self) -> &'static str {
        match self {
            Self::Classic => "classic",
            Self::AsPublished => "ray differentials, as published",
            Self::Corrected => "ray differentials, corrected",
            Self::Spiral => "ray differentials, corrected, spiral",
        }
    }

    /// As in JSON.
    pub fn name(self) -> &'static str {
        match self {
            Self::Classic => "classic",
            Self::AsPublished => "as_published",
            Self::Corrected => "corrected",
            Self::Spiral => "spiral",
        }
    }

    /// An estimator that gathers so, by `rays` rays, with photons looked for within `radius` metres first. What is gathered
    /// does not depend on the estimator beneath: there are no caustics in the room.
    ///
    /// # Errors
    /// None but a defect.
    pub fn estimator(self, rays: u32, radius: f32) -> Result<Box<dyn Estimator>, Failure> {
        let stratified = format!("rays={rays},radius={radius},pattern=stratified");
        let text = match self {
            Self::Classic => format!("classic:{stratified}"),
            Self::AsPublished => {
                format!("ray-differentials:{stratified},differentials=as_published,estimates=as_published,reach=facing")
            }
            Self::Corrected => format!("ray-differentials:{stratified}"),
            Self::Spiral => format!("ray-differentials:rays={rays},radius={radius},pattern=spiral"),
        };
        Ok(registry::estimator(&format!("regular+{text}"))?)
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::estimate::FinalGatherMethod;
    use crate::estimate::final_gathering::{FootprintReach, GatherPattern};

    #[test]
    fn ways_are_what_they_say() {
        for way in Way::SHOWN {
            let estimator = way.estimator(800, 0.05).expect("registered");
            let f = estimator.final_gathering().expect("gathers finally");
            assert_eq!((f.rays, f.radius), (800, Some(0.05)));
            assert_eq!(f.method == FinalGatherMethod::Classic, way == Way::Classic);
            let published = way == Way::AsPublished;
            assert_eq!((f.differentials_as_published, f.estimates_as_published), (published, published));
            assert_eq!(f.reach == FootprintReach::Facing, published);
            assert_eq!(f.pattern == GatherPattern::Spiral, way == Way::Spiral);
        }
    }
}
