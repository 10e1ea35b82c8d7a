//! Error against run time: every combination of settings and seeds is rendered progressively, and its images are judged
//! against a reference afterwards.
//!
//! Rendering and judging are apart. A task renders one setting with one seed and leaves an image for each checkpoint;
//! an evaluation takes those images, wherever they were made, and a reference. So the timer never sees a metric, shards
//! on several machines need no reference, and a better reference needs no new images.

pub mod curve;
pub mod evaluate;
pub mod pareto;
pub mod power_law;
pub mod setting;
pub mod study_plan;
pub mod sweep;
pub mod task;

pub use curve::{Curve, SeedPoint, StudyError, Summary};
pub use evaluate::{Evaluation, Judge};
pub use setting::Setting;
pub use study_plan::{Shard, StudyPlan};
pub use sweep::Sweep;
pub use task::{Checkpoint, Keep, TaskRecord, Unfinished};
