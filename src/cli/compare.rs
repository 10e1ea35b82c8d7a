//! `cusp compare`: estimators side by side on the same photons.

use crate::cli::compare_table::text;
use crate::cli::failure::Failure;
use crate::cli::flags::{CommonFlags, check_crop, rect};
use crate::cli::progress::{Collector, ProgressWatch, bar, interrupted, listen_for_interrupts};
use crate::cli::table::percent;
use crate::cli::window::session;
use crate::cli::{print, to_json};
use crate::estimate::Lookup;
use crate::estimate::registry::{self, ESTIMATORS};
use crate::estimate::regular::Regular;
use crate::export::report::{CompareReport, EstimatorReport, EstimatorSeconds, PlanCost, RenderReport, final_gather};
use crate::export::session::Session;
use crate::export::sheet::{self, Column, PALETTE, Sheet};
use crate::export::tone::{Look, ToneMap, auto_exposure, to_srgb};
use crate::export::{Provenance, exr_file, names, png_file, whole_file};
use crate::final_gather::GatherMaps;
use crate::measure::Reference;
use crate::measure::metrics::{Mask, compare};
use crate::measure::truth::{TRUTH_RAYS, truth};
use crate::measure::window::{busiest_window, contours, disagreement};
use crate::render::Step;
use crate::render::evidence::Evidence;
use crate::render::film::{Image, Rect};
use crate::render::memory::check_images;
use crate::render::photon_pass::PhotonMaps;
use crate::render::plan::Slot;
use crate::render::settings::{Gather, LightPart, PlanMode, RenderSettings};
use crate::render::tiles::tiles;
use crate::render::{Plan, Renderer};
use crate::scene::{built_in, memory, open};
use clap::{Args, ValueEnum};
use rayon::prelude::*;
use std::path::{Path, PathBuf};
use std::sync::Arc;
use std::time::Instant;

/// Largest crop that is chosen by default.
const CROP: [u32; 2] = [128, 96];

/// Flags of `compare`.
#[derive(Debug, Args)]
pub struct CompareArgs {
    /// A built-in name, a .toml, an .obj, a Quake 3 map (.bsp, .pk3:NAME) or a session
    scene: String,
    /// Estimators, separated by commas; all with their defaults if left out
    #[arg(long, value_name = "A,B")]
    estimators: Option<String>,
    /// Part to enlarge: x,y,width,height; where the estimators disagree most, if left out
    #[arg(long, value_name = "X,Y,W,H", value_parser = rect)]
    crop: Option<Rect>,
    /// Factor of enlargement, without smoothing; 3 if left out
    #[arg(long, value_name = "N", value_parser = clap::value_parser!(u32).range(1..=32))]
    enlarge: Option<u32>,
    /// Where errors are taken against regular with 16×16 view rays
    #[arg(long, value_enum, default_value = "crop")]
    truth: Truth,
    /// Image to compare with (EXR of linear radiance, or PNG, decoded from sRGB), instead of a built-in scene's own
    #[arg(long, value_name = "R")]
    reference: Option<PathBuf>,
    /// Pixels of the reference that count (PNG, white)
    #[arg(long, value_name = "M.png", requires = "reference")]
    mask: Option<PathBuf>,
    #[command(flatten)]
    flags: CommonFlags,
}

/// `--truth`.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, ValueEnum)]
enum Truth {
    /// In the crop.
    #[default]
    Crop,
    /// In the whole image.
    Full,
    /// Nowhere.
    None,
}

impl CompareArgs {
    /// The comparison of a scene at its defaults.
    pub fn of(scene: String, flags: CommonFlags) -> Self {
        Self {
            scene,
            estimators: None,
            crop: None,
            enlarge: None,
            truth: Truth::Crop,
            reference: None,
            mask: None,
            flags,
        }
    }
}

/// Compares.
///
/// # Errors
/// A wrong call, a file that cannot be written, or an interruption.
pub fn run(args: &CompareArgs) -> Result<(), Failure> {
    listen_for_interrupts();
    args.flags.on_threads(|| Comparison::prepare(args)?.run())
}

/// Makes sure that a sheet of so many enlarged crops side by side, each with its error below, can be had.
fn check_sheet(crop: Rect, enlarge: u32, columns: usize) -> Result<(), Failure> {
    let [width, height] = [crop.width, crop.height].map(|n| u64::from(n) * u64::from(enlarge));
    // Three bytes for each pixel, once in the sheet and once as it is encoded; images and labels come on top.
    let pixels = width.saturating_mul(2 * height).saturating_mul(columns as u64);
    let asked = format!("a sheet of {columns} crops of {width}x{height} pixels");
    Ok(memory::check(asked, memory::bytes(pixels, 6), "lower --enlarge (enlarge) or --crop (crop)")?)
}

struct Comparison<'a> {
    args: &'a CompareArgs,
    crop: Option<Rect>,
    enlarge: u32,
    renderer: Renderer,
    reference: Option<Reference>,
    /// What was asked for and cannot be, though the rest can.
    notes: Vec<String>,
    start: Instant,
    load: f64,
    has_truth: bool,
}

impl<'a> Comparison<'a> {
    /// Reads and checks everything that can be wrong before any work is done.
    fn prepare(args: &'a CompareArgs) -> Result<Self, Failure> {
        let start = Instant::now();
        let of_session = Session::is_one(args.scene.as_ref());
        // Here `--estimator` may be a list, like `--estimators`.
        let (session, path) = session(&args.scene, &CommonFlags { estimator: None, ..args.flags.clone() })?;
        let (scene, edited) = match path {
            Some(path) => {
                let (source, scene) = session.open_scene().map_err(|e| session.place(e, &path))?;
                let edited = scene.hash != source.scene.hash;
                (scene, edited)
            }
            None => (open(&args.scene)?, false),
        };
        let mut settings = RenderSettings::new(&scene, &session.render, session.size, session.seed)?;
        settings.plan = session.plan;
        if args.estimators.is_some() && args.flags.estimator.is_some() {
            return Err(Failure::Call("--estimator: is in --estimators already; give one of them".into()));
        }
        let estimators = match (&args.estimators, &args.flags.estimator) {
            (Some(list), _) | (None, Some(list)) => registry::estimators(list)?,
            (None, None) if of_session => session.estimators(),
            // Ways of final gathering are compared under one estimator.
            (None, None) if settings.final_gather != "none" => vec![registry::estimator(&settings.estimator)?],
            (None, None) => ESTIMATORS.iter().filter_map(|e| e.default_estimator()).collect(),
        };
        // Panels say themselves how they gather finally, unless flag or session ask for it on top.
        let own = of_session && session.render.final_gather.is_none();
        let estimators = if own { estimators } else { settings.with_final_gathering(&estimators)? };
        if estimators.is_empty() {
            return Err(Failure::Call(format!("{}: no panel has an estimator; give --estimators", args.scene)));
        }
        let crop = args.crop.or(session.crop_rect());
        if let Some(crop) = crop {
            check_crop(crop, settings.size)?;
        }
        let enlarge = args.enlarge.unwrap_or(session.enlarge);
        if let Some(crop) = crop {
            check_sheet(crop, enlarge, estimators.len())?;
        }
        let given = args.reference.clone().or(session.reference.as_ref().map(PathBuf::from));
        let mask = if args.reference.is_some() { args.mask.clone() } else { session.mask.as_ref().map(PathBuf::from) };
        let reference = match &given {
            Some(path) => Some(Reference::from_files(path, mask.as_deref()).map_err(Failure::Call)?),
            None if edited => None,
            None => Reference::built_in(&session.scene).map_err(Failure::Work)?,
        };
        let mut notes = Vec::new();
        if edited && given.is_none() && built_in::find(&session.scene).is_some_and(|b| b.reference.is_some()) {
            notes.push("no error against the built-in reference: the session edits the scene".to_owned());
        }
        let reference = match (reference, &given) {
            // A reference shows all light; of any other there is no error to speak of.
            (Some(_), _) if settings.light != LightPart::All => {
                notes.push("a reference shows all light: no error against it without --light all".to_owned());
                None
            }
            (Some(r), given) => match (r.error_of(&Image::black(settings.size)), given) {
                (Ok(_), _) => Some(r),
                (Err(why), Some(_)) => return Err(Failure::Call(format!("--reference: {why}"))),
                (Err(why), None) => {
                    notes.push(format!("no error against the built-in reference: {why}"));
                    None
                }
            },
            (None, _) => None,
        };
        let load = start.elapsed().as_secs_f64();
        // The truth is made of the same photons, so the plan has to serve it too.
        let regular = Regular::with_rays(TRUTH_RAYS);
        let truth = [Slot { estimator: &regular, gather: settings.gather }];
        // Nor does it hold where light does not come from the photons around a hit.
        let gathers = estimators.iter().any(|e| e.final_gathering().is_some());
        if gathers && args.truth != Truth::None && reference.is_none() {
            notes.push("no truth of the same photons with final gathering: give --reference for an error".to_owned());
        }
        let has_truth = args.truth != Truth::None && !gathers;
        let also: &[Slot] = if has_truth { &truth } else { &[] };
        check_images(&settings, estimators.len())?;
        let mut renderer = Renderer::planned_for(Arc::new(scene), settings, estimators, also);
        renderer.check_memory()?;
        Ok(Self { args, crop, enlarge, renderer, reference, has_truth, notes, start, load })
    }

    fn run(mut self) -> Result<(), Failure> {
        let hidden = self.args.flags.quiet || self.args.flags.json;
        let steps = tiles(Rect::whole(self.renderer.settings().size)).len() as u64;
        let progress = bar(steps, "estimators", hidden);
        if let Some(need) = self.renderer.memory_need() {
            progress.println(need.text());
        }
        let collector = Collector::new(self.renderer.settings().size, self.renderer.estimators().len(), &progress);
        let step = self.renderer.step(&collector);
        progress.finish_and_clear();
        if step == Step::Cancelled {
            return Err(self.write_part(collector, steps));
        }
        let images: Vec<Image> = self.renderer.films().iter().map(|f| f.image()).collect();
        let crop = self.crop.unwrap_or_else(|| self.default_crop(&images));
        let truth = self.truth(crop, hidden);
        let plan_cost = if interrupted() { None } else { self.plan_cost() };
        let names = names::of_estimators(self.renderer.estimators());
        let report = self.report(&images, crop, truth.as_ref(), plan_cost, &names);
        let folder = self.folder();
        self.write(&folder, &images, crop, truth.as_ref(), &report, &names)?;
        if self.args.flags.json {
            print(&to_json(&report)?)?;
        } else if !self.args.flags.quiet {
            for warning in &report.render.warnings {
                eprintln!("warning: {warning}");
            }
            print(&text(&report, &folder))?;
        }
        if interrupted() {
            return Err(Failure::Interrupted(format!("what was done is in {}", folder.display())));
        }
        Ok(())
    }

    /// Writes the tiles that were done before an interruption, and says so.
    fn write_part(&self, collector: Collector, steps: u64) -> Failure {
        let (images, done) = collector.into_images();
        if done == 0 {
            return Failure::Interrupted("nothing was written".into());
        }
        let folder = self.folder();
        let provenance = Provenance::new(self.renderer.scene(), self.renderer.settings().seed);
        for (name, image) in names::of_estimators(self.renderer.estimators()).iter().zip(&images) {
            if let Err(why) = exr_file::write(&folder.join(format!("{name}.exr")), image, &provenance) {
                return why.into();
            }
        }
        Failure::Interrupted(format!("{done} of {steps} tiles of each image are in {}", folder.display()))
    }

    /// Where files go.
    fn folder(&self) -> PathBuf {
        self.args.flags.out.clone().unwrap_or_else(|| {
            Path::new("cusp-out").join(format!("compare-{}", names::file_stem(&self.renderer.scene().name)))
        })
    }

    /// Where the estimators that use footprints and the same view rays disagree most; where the image changes most if
    /// there is but one.
    fn default_crop(&self, images: &[Image]) -> Rect {
        let by_footprint: Vec<&Image> = images
            .iter()
            .zip(self.renderer.estimators())
            .filter(|(_, e)| e.lookup() != Lookup::Disc && e.rays_per_axis() == 1)
            .map(|(i, _)| i)
            .collect();
        match by_footprint.as_slice() {
            [] | [_] => busiest_window(&contours(self.smoothest(images)), CROP),
            several => busiest_window(&disagreement(several), CROP),
        }
    }

    /// The last consistent estimator's image.
    fn smoothest<'i>(&self, images: &'i [Image]) -> &'i Image {
        let at = self.renderer.estimators().iter().rposition(|e| e.is_consistent());
        &images[at.unwrap_or(0)]
    }

    /// `regular` with 16×16 view rays and full overlap on the photons of the pass; None if not asked for or stopped.
    fn truth(&self, crop: Rect, hidden: bool) -> Option<(Rect, Image)> {
        if !self.has_truth {
            return None;
        }
        let region = match self.args.truth {
            Truth::None => return None,
            Truth::Crop => crop,
            Truth::Full => Rect::whole(self.renderer.settings().size),
        };
        let pass = self.renderer.last_pass()?;
        let progress = bar(tiles(region).len() as u64, "truth", hidden);
        let image = truth(pass, region, &ProgressWatch { bar: &progress, deadline: None });
        progress.finish_and_clear();
        Some((region, image?))
    }

    /// Photon pass and maps once more, with the plan and with everything forced on.
    fn plan_cost(&self) -> Option<PlanCost> {
        let r = &self.renderer;
        let mut settings = r.settings().clone();
        settings.plan = PlanMode::Full;
        let slots = crate::render::renderer::slots(r.estimators(), settings.gather);
        let evidence = Evidence { pilot: None, projection: r.plan().projection.clone() };
        let full = Plan::new(r.scene(), &settings, &slots, &evidence);
        let timed = |plan: &Plan| {
            let start = Instant::now();
            let photons = if plan.needs_photons() {
                r.emitter(plan, r.settings()).run(0, &interrupted)
            } else {
                Default::default()
            };
            let maps = PhotonMaps::new(r.scene(), plan, &photons.stored, settings.footprint_scale);
            GatherMaps::new(r.scene(), &photons.stored, &plan.final_gatherings, settings.k, 1.0);
            let stored: usize = maps.all().map(|m| m.photons().len()).sum();
            (start.elapsed().as_secs_f64(), stored as u64)
        };
        let (needed_seconds, needed_stored) = timed(r.plan());
        let (full_seconds, full_stored) = timed(&full);
        (!interrupted()).then_some(PlanCost { needed_seconds, full_seconds, needed_stored, full_stored })
    }

    fn report(
        &self,
        images: &[Image],
        crop: Rect,
        truth: Option<&(Rect, Image)>,
        plan_cost: Option<PlanCost>,
        names: &[String],
    ) -> CompareReport {
        let r = &self.renderer;
        let [w, h] = r.settings().size;
        let regular = r.estimators().iter().position(|e| e.id() == "regular").map(|i| r.estimator_seconds()[i].total());
        let estimators = r.estimators().par_iter().enumerate().map(|(i, e)| {
            let parts = r.estimator_seconds()[i];
            EstimatorReport {
                id: e.id().into(),
                settings: e.settings(),
                final_gathering: e.final_gathering().map(ToString::to_string),
                final_gather: final_gather(r, i),
                seconds: EstimatorSeconds { parts, view_pass: parts.total() },
                ratio_to_regular: regular.filter(|&s| s > 0.0).map(|s| parts.total() / s),
                photons_per_pixel: r.gathered()[i] as f64 / (f64::from(w) * f64::from(h)),
                error: truth.and_then(|(region, t)| compare(&images[i].crop(*region), t, &Mask::all(t.size)).ok()),
                reference_error: self.reference.as_ref().and_then(|x| x.error_of(&images[i]).ok()),
                files: [".exr", ".png", "_crop.exr", "_crop.png"].map(|s| format!("{}{s}", names[i])).into(),
            }
        });
        let estimators: Vec<_> = estimators.collect();
        let first = estimators.first().map_or(String::new(), |e| e.id.clone());
        CompareReport {
            render: {
                let mut render = RenderReport::new(r, first, self.load, self.start.elapsed().as_secs_f64());
                render.warnings.extend(self.notes.iter().cloned());
                render
            },
            crop,
            truth: truth.map(|t| t.0),
            reference: self.reference.as_ref().map(|r| r.source.clone()),
            plan_cost,
            estimators,
        }
    }

    fn write(
        &self,
        folder: &Path,
        images: &[Image],
        crop: Rect,
        truth: Option<&(Rect, Image)>,
        report: &CompareReport,
        names: &[String],
    ) -> Result<(), Failure> {
        let provenance = Provenance::new(self.renderer.scene(), self.renderer.settings().seed);
        let exposure = auto_exposure(self.smoothest(images));
        let both = |name: &str, image: &Image, enlarge: u32| -> Result<(), Failure> {
            let path = |extension| folder.join(format!("{name}.{extension}"));
            let exr = || exr_file::write(&path("exr"), image, &provenance);
            let png = || {
                let mut canvas =
                    crate::export::text::Canvas::new([image.size[0] * enlarge, image.size[1] * enlarge], [0; 3]);
                canvas.paste(0, 0, image.size, &to_srgb(image, exposure), enlarge);
                png_file::write(&path("png"), canvas.size, &canvas.rgb, &provenance)
            };
            let (exr, png) = rayon::join(exr, png);
            exr?;
            Ok(png?)
        };
        let enlarge = self.enlarge;
        let of_estimator = |(name, image): (&String, &Image)| -> Result<(), Failure> {
            let part = || both(&format!("{name}_crop"), &image.crop(crop), enlarge);
            let (whole, part) = rayon::join(|| both(name, image, 1), part);
            whole.and(part)
        };
        let sheet = self.sheet(images, crop, truth, report, exposure);
        let whole_sheet = || -> Result<(), Failure> {
            let sheet = sheet::draw(&sheet);
            Ok(png_file::write(&folder.join("sheet.png"), sheet.size, &sheet.rgb, &provenance)?)
        };
        // Packing a PNG takes about as long as a view pass. Of several errors the first is told.
        let (sheet, panels) =
            rayon::join(whole_sheet, || names.par_iter().zip(images).map(of_estimator).collect::<Vec<_>>());
        panels.into_iter().chain([sheet]).collect::<Result<(), Failure>>()?;
        if let Some((_, image)) = truth {
            both("truth", image, if self.args.truth == Truth::Crop { enlarge } else { 1 })?;
        }
        whole_file::write(&folder.join("timings.csv"), report.timings_csv().as_bytes())?;
        whole_file::write(&folder.join("report.json"), to_json(report)?.as_bytes())?;
        Ok(())
    }

    fn sheet(
        &self,
        images: &[Image],
        crop: Rect,
        truth: Option<&(Rect, Image)>,
        report: &CompareReport,
        exposure: f32,
    ) -> Sheet {
        let r = &report.render;
        let columns = report.estimators.iter().zip(images).enumerate().map(|(i, (e, image))| Column {
            title: e.name(),
            lines: vec![
                format!(
                    "{:.3} s{}",
                    e.seconds.view_pass,
                    e.ratio_to_regular.map_or(String::new(), |x| format!(", {x:.2} x regular"))
                ),
                e.error.map_or(String::new(), |m| format!("error {}", percent(Some(m.relative_rmse)))),
                e.reference_error.map_or(String::new(), |m| format!("to reference {}", percent(Some(m.relative_rmse)))),
            ],
            color: PALETTE[i % PALETTE.len()],
            image: image.clone(),
            look: Look::Tone(ToneMap::srgb(exposure)),
            error: truth.map(|(region, t)| {
                // A full truth is cut to the crop.
                let t = if *region == crop { t.clone() } else { t.crop(crop) };
                sheet::signed_error(&image.crop(crop), &t)
            }),
        });
        Sheet {
            title: format!("{}: radiance estimators on the same photons", r.provenance.scene),
            subtitle: format!(
                "{}x{} pixels, {} photons emitted, {} caustic and {} global stored, {}, footprint scale {}, seed {}",
                r.size[0],
                r.size[1],
                r.photons_emitted,
                r.photons_stored.caustic,
                r.photons_stored.global,
                match r.gather {
                    Gather::Knn => format!("the {} nearest gathered", r.settings.k),
                    Gather::Overlap => "gathered by overlap".into(),
                },
                r.settings.footprint_scale,
                r.provenance.seed
            ),
            columns: columns.collect(),
            crop,
            enlarge: self.enlarge,
        }
    }
}
