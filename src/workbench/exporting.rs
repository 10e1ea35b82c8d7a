//! The window's export: what is shown, gathered in a frame and written on the analysis thread.

use super::app::Workbench;
use super::desk::{Finding, Kind};
use super::gallery::tiled::TiledImage;
use super::gallery::values::Values;
use super::inspector::{Inspected, rays, summary};
use super::theme::panel_color;
use super::views::{self, shows_difference};
use super::worker::messages::{Job, Progress};
use crate::estimate::registry::short_name;
use crate::export::false_color::ValueRange;
use crate::export::panel_files::{Cut, Picture};
use crate::export::session::{Mode, Panel, Session};
use crate::export::sheet::{self, Column, Sheet};
use crate::export::timings::{EstimatorTimings, PassSeconds, Timings};
use crate::export::tone::{Look, ToneMap, color_map};
use crate::export::{Provenance, false_color, names, png_file, whole_file};
use crate::measure::{ErrorMetrics, Reference};
use crate::render::film::{Image, Rect};
use crate::render::{LightPart, Pass};
use glam::Vec3;
use std::collections::BTreeMap;
use std::path::{Path, PathBuf};
use std::sync::Arc;

/// Makes a panel's numbers, or says why there are none.
type MakeValues = Box<dyn FnOnce() -> Result<Values, String> + Send>;

/// A panel as it is shown in this frame.
struct Shown {
    panel: Panel,
    color: [u8; 3],
    image: TiledImage,
    passes: u32,
    fresh: bool,
    values: Option<MakeValues>,
    /// Range of their colours, that of all panels that show the same; their own if it is not known yet.
    range: Option<ValueRange>,
}

/// All that an export needs: a copy, so that the window goes on while it is written.
struct Export {
    folder: PathBuf,
    session: Session,
    job: Job,
    progress: Option<Progress>,
    panels: Vec<Shown>,
    /// Stops.
    exposure: f32,
    reference: Option<Arc<Reference>>,
    /// Errors of the estimators whose images have been written.
    errors: BTreeMap<String, ErrorMetrics>,
    /// The pass that the inspector looks at.
    pass: Option<Arc<Pass>>,
}

impl Workbench {
    /// Writes what is shown to `folder`, on the analysis thread; a message says when it is done.
    pub(super) fn export_to(&mut self, folder: &Path) {
        match self.gather_export(folder) {
            Ok(export) => self.analysis.ask(Kind::Export, move || Finding::Exported(export.write())),
            Err(why) => self.messages.error(why),
        }
    }

    fn gather_export(&self, folder: &Path) -> Result<Export, String> {
        let job = self.render.job().ok_or("export: nothing has been rendered yet")?.clone();
        let mut session = self.document.session.clone();
        session.layout = super::layout::to_text(&self.tree);
        let estimators: Vec<&str> = session.panels.iter().map(|p| p.estimator.as_str()).collect();
        let mut panels = Vec::new();
        for (index, panel) in session.panels.iter().enumerate() {
            let Some(live) = self.gallery.of(panel).filter(|i| i.has_pixels()) else { continue };
            let [r, g, b, _] = panel_color(&estimators, index).to_array();
            panels.push(Shown {
                panel: panel.clone(),
                color: [r, g, b],
                image: live.pixels().clone(),
                passes: live.passes,
                fresh: live.is_fresh(),
                values: self.values_of(&session, index),
                range: self.gallery.range_of(index),
            });
        }
        if panels.is_empty() {
            return Err("export: no panel has an image yet; try again when the first tiles are there".into());
        }
        let inspector = &self.desk.inspector;
        let pass = if inspector.latest { &self.render.pass } else { &self.render.first_pass };
        Ok(Export {
            folder: folder.to_owned(),
            exposure: if session.tone.auto { self.desk.auto_exposure } else { session.tone.exposure },
            reference: self.desk.reference.clone(),
            pass: pass.clone().filter(|_| !(self.render.draft && inspector.latest)),
            progress: self.render.progress.clone(),
            panels,
            errors: BTreeMap::new(),
            session,
            job,
        })
    }

    /// The numbers that panel `index` shows. A difference is taken anew, from the images as they are exported.
    fn values_of(&self, session: &Session, index: usize) -> Option<MakeValues> {
        let panel = session.panels.get(index)?;
        match views::heatmap_of(panel) {
            Some(kind) => {
                let (origin, work) = views::heatmap_work(&self.render, panel, kind)?;
                match self.gallery.values.get(&index).filter(|v| v.origin == origin) {
                    Some(values) => {
                        let values = values.clone();
                        Some(Box::new(move || Ok(values)))
                    }
                    None => Some(work),
                }
            }
            None if shows_difference(session, index) => {
                let stops = if session.tone.auto { self.desk.auto_exposure } else { session.tone.exposure };
                let reference = self.desk.reference.as_ref();
                views::difference_work(session, &self.gallery, reference, panel, stops, self.render.passes_seen)
                    .map(|(_, work)| work)
            }
            None => None,
        }
    }
}

impl Export {
    /// Writes all files; one line about what was written.
    fn write(mut self) -> Result<String, String> {
        let wrong = |e: whole_file::WriteError| e.to_string();
        let provenance = Provenance::new(&self.job.scene, self.job.settings.seed);
        let size = self.job.settings.size;
        let crop = self.session.crop_rect().map(|c| c.within(size)).filter(|c| c.width > 0 && c.height > 0);
        let crop = crop.unwrap_or(Rect::whole(size));
        let cut = Cut::new(crop, self.session.enlarge, 1);
        let mut files = Vec::new();
        let mut columns = Vec::new();
        let unfinished = self.session.panels.len() - self.panels.iter().filter(|p| p.fresh).count();
        let shown = std::mem::take(&mut self.panels);
        let stems = names::distinct(&shown.iter().map(|s| file_names(&s.panel)).collect::<Vec<_>>());
        for (shown, name) in shown.into_iter().zip(&stems) {
            let (radiance, values, color) = self.pictures(shown)?;
            files.extend(radiance.write(&self.folder, name, cut, &provenance).map_err(wrong)?);
            if let Some(values) = &values {
                let name = format!("{name}_values");
                files.extend(values.write(&self.folder, &name, cut, &provenance).map_err(wrong)?);
            }
            columns.push(column(values.unwrap_or(radiance), color));
        }
        if let Some(reference) = self.shown_reference() {
            // The same numbers would name another part of an image of another size.
            let part = if reference.image.size == size { crop } else { Rect::whole(reference.image.size) };
            let cut = Cut { crop: part, ..cut };
            files.extend(reference.write(&self.folder, "reference", cut, &provenance).map_err(wrong)?);
        }
        let sheet = sheet::draw(&self.sheet(columns, crop));
        png_file::write(&self.folder.join("sheet.png"), sheet.size, &sheet.rgb, &provenance).map_err(wrong)?;
        let mut texts = self.photon_tables()?;
        let timings = self.timings(provenance);
        texts.push(("timings.csv".into(), timings.csv()));
        texts.push(("timings.json".into(), serde_json::to_string_pretty(&timings).map_err(|e| e.to_string())? + "\n"));
        texts.push(("session.toml".into(), self.session.to_toml(&self.folder)?));
        for (name, text) in &texts {
            whole_file::write(&self.folder.join(name), text.as_bytes()).map_err(wrong)?;
        }
        let mut note = format!("exported {} files to {}", files.len() + texts.len() + 1, self.folder.display());
        if unfinished > 0 {
            note += &format!("; {unfinished} panels have tiles that are missing or of older settings");
        }
        Ok(note)
    }

    /// A panel's radiance, the numbers that it shows, and its colour.
    fn pictures(&mut self, shown: Shown) -> Result<(Picture, Option<Picture>, [u8; 3]), String> {
        let Shown { panel, color, image, passes, fresh, values, range } = shown;
        let image = image.to_image();
        let title = panel.image.clone().unwrap_or_else(|| panel.estimator.clone());
        let error = if panel.image.is_none() { self.error_of(&image) } else { None };
        if let Some(error) = error {
            self.errors.insert(panel.estimator.clone(), error);
        }
        let mut facts = vec![("cusp.estimator", title.clone())];
        if panel.image.is_none() {
            facts.push(("cusp.passes", passes.to_string()));
        }
        if !fresh {
            facts.push(("cusp.unfinished", "some tiles are missing or of older settings".into()));
        }
        let passes = Some(format!("{passes} passes")).filter(|_| panel.image.is_none());
        let error = error.map(|e| format!("error {:.2} %", 100.0 * e.relative_rmse));
        let numbers = error.into_iter().chain(passes).collect::<Vec<_>>().join(", ");
        let look = Look::Tone(ToneMap::new(&self.session.tone, self.exposure));
        let values = values.map(|make| make()).transpose()?.map(|v| {
            let unit = if v.unit.is_empty() { String::new() } else { format!(", {}", v.unit) };
            let what = format!("{}{unit}", v.title);
            let pixels = v.values.iter().map(|x| Vec3::splat(*x)).collect();
            let locked = self.session.tone.range.filter(|_| !self.session.tone.auto);
            let range = locked.map(|[low, high]| ValueRange { low, high }).or(range).unwrap_or(v.range);
            Picture {
                label: vec![title.clone(), what.clone(), numbers.clone()],
                image: Image { size: v.size, pixels },
                look: Look::Values(v.scale(color_map(self.session.tone.false_color.as_deref()), range)),
                facts: facts.iter().cloned().chain([("cusp.values", what)]).collect(),
            }
        });
        let what = look.scale().map(|_| "luminance, W/(m² sr)".to_owned());
        let label = [Some(title), what, Some(numbers)].into_iter().flatten().collect();
        Ok((Picture { label, image, look, facts }, values, color))
    }

    fn error_of(&self, image: &Image) -> Option<ErrorMetrics> {
        // A reference shows all light.
        let reference = self.reference.as_ref().filter(|_| self.job.settings.light == LightPart::All)?;
        reference.error_of(image).ok()
    }

    /// The reference, where panels show their difference to it.
    fn shown_reference(&self) -> Option<Picture> {
        let comparison = &self.session.comparison;
        let shown = comparison.mode == Mode::Difference && comparison.with.is_none();
        let reference = self.reference.as_ref().filter(|_| shown)?;
        Some(Picture {
            label: vec![format!("reference: {}", reference.source)],
            image: reference.image.clone(),
            look: Look::Tone(ToneMap::new(&self.session.tone, self.exposure)),
            facts: vec![("cusp.reference", reference.source.clone())],
        })
    }

    fn sheet(&self, columns: Vec<Column>, crop: Rect) -> Sheet {
        let settings = &self.job.settings;
        let [w, h] = settings.size;
        let emitted = self.progress.as_ref().map_or(0, |p| p.emitted);
        Sheet {
            title: format!("{}: radiance estimators on the same photons", self.job.scene.name),
            subtitle: format!(
                "{w}x{h} pixels, {emitted} photons emitted, footprint scale {}, seed {}",
                settings.footprint_scale, settings.seed
            ),
            // Whole images are large as they are.
            enlarge: if crop == Rect::whole(settings.size) {
                1
            } else {
                Cut::new(crop, self.session.enlarge, columns.len() as u32).enlarge
            },
            columns,
            crop,
        }
    }

    /// Tables for each pinned pixel, with the names of their files: photons, and gather rays where there are any.
    fn photon_tables(&self) -> Result<Vec<(String, String)>, String> {
        let Some(pass) = &self.pass else { return Ok(Vec::new()) };
        let [w, h] = pass.settings.size;
        let pins = self.session.pins.iter().filter(|p| p[0] < w && p[1] < h);
        let mut all = Vec::new();
        for [x, y] in pins {
            let found = Inspected::new(pass, &self.job.estimators, [*x, *y])?;
            all.push((format!("photons-{x}-{y}.csv"), summary::csv(&found)));
            if found.rays.iter().any(|r| !r.is_empty()) {
                all.push((format!("gather-rays-{x}-{y}.csv"), rays::csv(&found)));
            }
        }
        Ok(all)
    }

    fn timings(&self, provenance: Provenance) -> Timings {
        let progress = self.progress.as_ref();
        let estimators = self.job.estimators.iter().enumerate().map(|(i, name)| {
            let seconds = progress.and_then(|p| Some((*p.photon_seconds.get(i)?, *p.estimator_seconds.get(i)?)));
            EstimatorTimings {
                estimator: name.clone(),
                passes: progress.and_then(|p| p.passes.get(i)).copied().unwrap_or(0),
                seconds: seconds.map_or(PassSeconds::default(), |(photons, view)| PassSeconds::new(photons, view)),
                error: self.errors.get(name).copied(),
            }
        });
        Timings {
            size: self.job.settings.size,
            photons_emitted: progress.map_or(0, |p| p.emitted),
            photons_stored: progress.map(|p| p.stored).unwrap_or_default(),
            seconds: progress.map(|p| p.seconds).unwrap_or_default(),
            reference: self.reference.as_ref().map(|r| r.source.clone()),
            settings: self.job.settings.clone(),
            estimators: estimators.collect(),
            provenance,
        }
    }
}

/// A file name for a panel, and one that says more where the first is another's too.
fn file_names(panel: &Panel) -> (String, String) {
    if let Some(path) = &panel.image {
        let stem = Path::new(path).file_stem().map_or(String::new(), |s| s.to_string_lossy().into_owned());
        let name = format!("image-{stem}");
        return (name.clone(), name);
    }
    let id = short_name(&panel.estimator);
    let long = match &panel.heatmap {
        Some(heatmap) => format!("{}-{heatmap}", panel.estimator),
        None => panel.estimator.clone(),
    };
    (id, long)
}

/// A panel's column in the sheet.
fn column(picture: Picture, color: [u8; 3]) -> Column {
    let mut label = picture.label.into_iter();
    let title = label.next().unwrap_or_default();
    let mut lines: Vec<String> = label.collect();
    if let Some(scale) = picture.look.scale() {
        let range = scale.range();
        lines.push(format!("{} to {}", false_color::label(range.low), false_color::label(range.high)));
    }
    Column { title, lines, color, image: picture.image, look: picture.look, error: None }
}
