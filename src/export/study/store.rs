//! The folder of a study: its plan, and for each finished task a record and the images of its checkpoints.
//!
//! ```text
//! plan.json
//! tasks/0003-1.json          setting 3, seed 1: written last, so what is there is whole
//! tasks/0003-1/16.exr        its image after 16 passes
//! tasks/0003-1/unfinished    what is needed to go on; gone when the task is finished
//! ```

use crate::export::exr_file;
use crate::export::whole_file::{self, WriteError};
use crate::math::hash::{FNV_START, fnv1a};
use crate::measure::image_file;
use crate::measure::study::study_plan::Task;
use crate::measure::study::{StudyPlan, TaskRecord, Unfinished};
use crate::render::film::Image;
use glam::DVec3;
use std::path::{Path, PathBuf};

/// A study's folder.
#[derive(Clone, Debug)]
pub struct Store {
    folder: PathBuf,
}

impl Store {
    /// That folder, which need not be there yet.
    pub fn new(folder: impl Into<PathBuf>) -> Self {
        Self { folder: folder.into() }
    }

    /// The folder.
    pub fn folder(&self) -> &Path {
        &self.folder
    }

    fn plan_path(&self) -> PathBuf {
        self.folder.join("plan.json")
    }

    fn record_path(&self, task: Task) -> PathBuf {
        self.folder.join("tasks").join(format!("{}.json", task.name()))
    }

    fn image_path(&self, task: Task, passes: u32) -> PathBuf {
        self.folder.join("tasks").join(task.name()).join(format!("{passes}.exr"))
    }

    /// The plan of the study that is there; None if there is none.
    ///
    /// # Errors
    /// A file that cannot be read, or is no plan of this version.
    pub fn plan(&self) -> Result<Option<StudyPlan>, String> {
        let path = self.plan_path();
        match std::fs::read(&path) {
            Ok(bytes) => serde_json::from_slice(&bytes)
                .map(Some)
                .map_err(|e| format!("{}: is no plan of a study of this version: {e}", path.display())),
            Err(e) if e.kind() == std::io::ErrorKind::NotFound => Ok(None),
            Err(e) => Err(format!("{}: {e}", path.display())),
        }
    }

    /// Writes the plan.
    ///
    /// # Errors
    /// What the system refuses.
    pub fn write_plan(&self, plan: &StudyPlan) -> Result<(), WriteError> {
        write_json(&self.plan_path(), plan)
    }

    /// The record of a task of that plan, if it is finished. A damaged record, or one of another plan, is none.
    pub fn record(&self, plan_hash: u64, task: Task) -> Option<TaskRecord> {
        let bytes = std::fs::read(self.record_path(task)).ok()?;
        let record: TaskRecord = serde_json::from_slice(&bytes).ok()?;
        let fits =
            record.plan == format!("{plan_hash:016x}") && record.setting == task.setting && record.seed == task.seed;
        fits.then_some(record)
    }

    /// Writes the record of a task whose images are all there.
    ///
    /// # Errors
    /// What the system refuses.
    pub fn write_record(&self, record: &TaskRecord) -> Result<(), WriteError> {
        let task = Task { setting: record.setting, seed: record.seed };
        write_json(&self.record_path(task), record)?;
        remove(self.unfinished_path(task))
    }

    fn unfinished_path(&self, task: Task) -> PathBuf {
        self.folder.join("tasks").join(task.name()).join("unfinished")
    }

    /// What a task of that plan left when it was stopped; None if there is nothing, or nothing whole.
    pub fn unfinished(&self, plan_hash: u64, task: Task) -> Option<Unfinished> {
        decode(plan_hash, &std::fs::read(self.unfinished_path(task)).ok()?)
    }

    /// Keeps how far a task of that plan has got.
    ///
    /// # Errors
    /// What the system refuses.
    pub fn write_unfinished(&self, plan_hash: u64, task: Task, so_far: &Unfinished) -> Result<(), WriteError> {
        let path = self.unfinished_path(task);
        let bytes =
            encode(plan_hash, so_far).map_err(|e| WriteError { path: path.clone(), why: format!("JSON: {e}") })?;
        whole_file::write(&path, &bytes)
    }

    /// Forgets a task, so that it will be done again.
    ///
    /// # Errors
    /// What the system refuses.
    pub fn forget(&self, task: Task) -> Result<(), WriteError> {
        remove(self.record_path(task))?;
        remove(self.unfinished_path(task))
    }

    /// Writes the image of a task after so many passes.
    ///
    /// # Errors
    /// What the system refuses.
    pub fn write_image(
        &self,
        task: Task,
        passes: u32,
        image: &Image,
        facts: &[(&str, String)],
    ) -> Result<(), WriteError> {
        exr_file::write_with(&self.image_path(task, passes), image, facts)
    }

    /// Reads it.
    ///
    /// # Errors
    /// A file that is missing or damaged.
    pub fn image(&self, task: Task, passes: u32) -> Result<Image, String> {
        image_file::read(&self.image_path(task, passes)).map_err(|e| e.to_string())
    }
}

fn remove(path: PathBuf) -> Result<(), WriteError> {
    match std::fs::remove_file(&path) {
        Err(e) if e.kind() != std::io::ErrorKind::NotFound => Err(WriteError { path, why: e.to_string() }),
        _ => Ok(()),
    }
}

/// Checksum of the rest, hash of the plan, length of the checkpoints as JSON, these, and three numbers for each pixel:
/// all in little-endian order of bytes.
fn encode(plan_hash: u64, so_far: &Unfinished) -> Result<Vec<u8>, serde_json::Error> {
    let points = serde_json::to_vec(&so_far.points)?;
    let mut rest = plan_hash.to_le_bytes().to_vec();
    rest.extend((points.len() as u64).to_le_bytes());
    rest.extend(points);
    rest.extend(so_far.sums.iter().flat_map(|s| s.to_array()).flat_map(f64::to_le_bytes));
    let mut bytes = fnv1a(FNV_START, &rest).to_le_bytes().to_vec();
    bytes.extend(rest);
    Ok(bytes)
}

fn decode(plan_hash: u64, bytes: &[u8]) -> Option<Unfinished> {
    let number = |bytes: &[u8]| Some(u64::from_le_bytes(bytes.try_into().ok()?));
    let (checksum, rest) = bytes.split_at_checked(8)?;
    if number(checksum)? != fnv1a(FNV_START, rest) {
        return None;
    }
    let (hash, rest) = rest.split_at_checked(8)?;
    let (length, rest) = rest.split_at_checked(8)?;
    if number(hash)? != plan_hash {
        return None;
    }
    let (points, sums) = rest.split_at_checked(usize::try_from(number(length)?).ok()?)?;
    let points = serde_json::from_slice(points).ok()?;
    let values: Vec<f64> = sums.chunks_exact(8).filter_map(|c| c.try_into().ok().map(f64::from_le_bytes)).collect();
    let sums = values.chunks_exact(3).map(DVec3::from_slice).collect();
    Some(Unfinished { points, sums })
}

fn write_json<T: serde::Serialize>(path: &Path, value: &T) -> Result<(), WriteError> {
    let text = serde_json::to_string_pretty(value)
        .map_err(|e| WriteError { path: path.to_owned(), why: format!("JSON: {e}") })?;
    whole_file::write(path, (text + "\n").as_bytes())
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::measure::study::Checkpoint;
    use crate::render::stats::{Seconds, StoredCounts};
    use glam::Vec3;

    #[test]
    fn only_whole_records_of_the_same_plan_count() {
        let folder = tempfile::tempdir().expect("a temporary folder");
        let store = Store::new(folder.path().join("study"));
        assert!(store.plan().expect("none").is_none());
        let task = Task { setting: 2, seed: 7 };
        let seconds = Seconds { gather: 0.1 + 0.2, total: 1.0 / 3.0, ..Default::default() };
        let point = Checkpoint { passes: 4, photons: 9, stored: StoredCounts::default(), seconds };
        let record = TaskRecord { plan: format!("{:016x}", 5), setting: 2, seed: 7, threads: 2, points: vec![point] };
        store.write_record(&record).expect("writes");
        assert_eq!(store.record(5, task), Some(record));
        assert_eq!(store.record(6, task), None);
        assert_eq!(store.record(5, Task { setting: 1, ..task }), None);
        let image = Image { size: [2, 1], pixels: vec![Vec3::ONE, Vec3::splat(1e-9)] };
        store.write_image(task, 4, &image, &[]).expect("writes");
        assert_eq!(store.image(task, 4), Ok(image));
        assert!(store.image(task, 8).expect_err("missing").contains("8.exr"));
        let so_far = Unfinished { points: vec![], sums: vec![DVec3::new(0.1, -2.5, 1e300), DVec3::ZERO] };
        store.write_unfinished(5, task, &so_far).expect("writes");
        assert_eq!(store.unfinished(5, task), Some(so_far.clone()));
        assert_eq!(store.unfinished(6, task), None);
        let mut bytes = encode(5, &so_far).expect("JSON");
        assert_eq!(decode(5, &bytes[..bytes.len() - 1]), None);
        bytes[20] ^= 1;
        assert_eq!(decode(5, &bytes), None);
        std::fs::write(store.record_path(task), b"{\"plan\": ").expect("writes");
        assert_eq!(store.record(5, task), None);
        store.forget(task).expect("forgets");
        store.forget(task).expect("forgets what is not there");
        std::fs::write(store.plan_path(), b"{}").expect("writes");
        assert!(store.plan().expect_err("no plan").contains("plan.json"));
    }
}
