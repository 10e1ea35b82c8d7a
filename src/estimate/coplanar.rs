//! `coplanar`: coverage and centroid of the clipped footprints (Pedersen 2011, eq. 50 to 67).
//!
//! The thesis projects the photon along the view ray into the view plane. Here the view footprint is projected the
//! other way, into the photon's plane and its footprint coordinates: an affine map, so that coverage and centroid are
//! the same, and the photon's polygon is the same square or regular polygon for all photons. The clipped vertices
//! carry their parameters in the view footprint along, which maps the centroid back (eq. 66) without an inverse.
//! With the square and the kernel at the centroid nothing is clipped but narrow view footprints: see `coverage.rs`.

use super::{Construction, Estimator, Gathered, Lookup, SamplingPoint, View, weighted_sum};
use crate::estimate::batch::{self, BATCH, in_filter_space, weight_by_mean};
use crate::estimate::clip::{self, ClippedPolygon, HalfPlane, MAX_CORNERS, MAX_VERTICES, SQUARE_VERTICES};
use crate::estimate::coverage::{Pair, Pairs};
use crate::estimate::parallelogram::mean_over_parallelogram;
use crate::estimate::polygon::mean_over_part;
use crate::estimate::settings::{Spec, SpecError};
use crate::photons::MapPhoton;
use glam::{DVec2, DVec3};

/// How the photon's footprint is drawn.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Shape {
    /// The parallelogram of its two vectors (eq. 61).
    Parallelogram,
    /// A polygon of so many corners on the ellipse (eq. 62).
    Ellipse(u32),
}

/// How the part that overlaps is weighed.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Weight {
    /// The kernel at the part's centroid, as published (eq. 67): too bright, and not normalised.
    Centroid,
    /// The kernel's mean over the part.
    Mean,
}

/// Coplanar intersection-weighted photon differentials.
pub struct Coplanar {
    shape: Shape,
    weight: Weight,
    planes: Vec<HalfPlane>,
}

impl Coplanar {
    /// With that shape and weight.
    pub fn new(shape: Shape, weight: Weight) -> Self {
        let planes = match shape {
            Shape::Parallelogram => clip::square(),
            Shape::Ellipse(n) => clip::inscribed((n as usize).clamp(3, MAX_CORNERS)),
        };
        Self { shape, weight, planes }
    }

    /// `coplanar`, with `shape` and `weight`.
    ///
    /// # Errors
    /// An unknown setting or value.
    pub fn parse(spec: &Spec) -> Result<Box<dyn Estimator>, SpecError> {
        spec.only(&["shape", "weight"])?;
        let weight =
            spec.choice("weight", Weight::Centroid, &[("centroid", Weight::Centroid), ("mean", Weight::Mean)])?;
        let shape = match spec.get("shape") {
            None | Some("parallelogram") => Shape::Parallelogram,
            Some("ellipse") => Shape::Ellipse(20),
            Some(text) => match text.strip_prefix("ellipse:").map(str::parse) {
                Some(Ok(n)) if (3..=MAX_CORNERS as u32).contains(&n) => Shape::Ellipse(n),
                _ => {
                    return Err(spec.error(format!(
                        "`shape` must be parallelogram or ellipse:N with N in 3 to {MAX_CORNERS}, got `{text}`"
                    )));
                }
            },
        };
        Ok(Box::new(Self::new(shape, weight)))
    }

    /// Centre and half-edges of the view footprint in the photon's footprint, along the view ray; None if it is far off.
    pub fn projected(photon: &MapPhoton, view: &View) -> Option<[DVec2; 3]> {
        Pair::new(photon, view).projected()
    }

    /// A view footprint that [`Coplanar::projected`] gave, clipped by the photon's polygon; `N` must hold its vertices.
    #[inline]
    pub fn clipped<const N: usize>(&self, [pc, pa, pb]: [DVec2; 3]) -> ClippedPolygon<N> {
        let mut polygon = ClippedPolygon::whole(pc, pa, pb);
        for plane in &self.planes {
            polygon.clip(plane);
        }
        polygon
    }

    /// Share of a projected view footprint inside the photon's polygon, and the centroid of that part in its parameters.
    fn coverage_and_centroid(&self, projected: [DVec2; 3]) -> (f64, DVec2) {
        match self.shape {
            Shape::Parallelogram => self.clipped::<SQUARE_VERTICES>(projected).coverage_and_centroid(),
            Shape::Ellipse(_) => self.clipped::<MAX_VERTICES>(projected).coverage_and_centroid(),
        }
    }

    /// Whether pairs are computed together, in lanes.
    fn is_in_lanes(&self) -> bool {
        self.shape == Shape::Parallelogram && self.weight == Weight::Centroid
    }

    /// What [`weight_by_mean`] takes of each pair of a batch.
    fn weigh(&self, pairs: &Pairs, means: &mut [f64; BATCH]) {
        pairs.weighed(means, |projected| self.coverage_and_centroid(projected));
    }

    fn over_area(&self, photon: &MapPhoton, view: &View) -> f64 {
        let pair = Pair::new(photon, view);
        let mean = match (self.weight, self.shape) {
            (Weight::Centroid, Shape::Parallelogram) => pair.weighed(|p| self.coverage_and_centroid(p)),
            (Weight::Centroid, Shape::Ellipse(_)) => {
                let Some(projected) = pair.projected() else { return 0.0 };
                let (coverage, centroid) = self.coverage_and_centroid(projected);
                if coverage > 0.0 { coverage * pair.kernel_at(centroid) } else { 0.0 }
            }
            (Weight::Mean, Shape::Parallelogram) => self.mean::<SQUARE_VERTICES>(&pair, photon, view),
            (Weight::Mean, Shape::Ellipse(_)) => self.mean::<MAX_VERTICES>(&pair, photon, view),
        };
        weight_by_mean(mean, photon)
    }

    /// Mean of `(1 - u)²` over the covered part, times its share of the view footprint.
    fn mean<const N: usize>(&self, pair: &Pair, photon: &MapPhoton, view: &View) -> f64 {
        let Some(projected) = pair.projected() else { return 0.0 };
        let polygon = self.clipped::<N>(projected);
        let vertices = polygon.vertices();
        if polygon.coverage_and_centroid().0 <= 0.0 {
            return 0.0;
        }
        let [c, a, b] = in_filter_space(photon, view);
        let mut parameters = [DVec2::ZERO; N];
        let mut buffer = [DVec2::ZERO; N];
        for (p, v) in parameters.iter_mut().zip(vertices) {
            *p = v.parameter;
        }
        let parts = &parameters[..vertices.len()];
        mean_over_part(c, a, b, parts, &mut buffer).unwrap_or_else(|| mean_over_parallelogram(c, a, b))
    }
}

impl Estimator for Coplanar {
    fn id(&self) -> &'static str {
        "coplanar"
    }

    fn settings(&self) -> String {
        let shape = match self.shape {
            Shape::Parallelogram => "parallelogram".to_owned(),
            Shape::Ellipse(n) => format!("ellipse:{n}"),
        };
        let weight = match self.weight {
            Weight::Centroid => "centroid",
            Weight::Mean => "mean",
        };
        format!("shape={shape},weight={weight}")
    }

    fn lookup(&self) -> Lookup {
        Lookup::Parallelogram
    }

    fn is_consistent(&self) -> bool {
        self.weight == Weight::Mean
    }

    /// With the kernel's mean, where the photon's polygon holds all of its disc.
    fn is_exact_mean(&self) -> bool {
        self.weight == Weight::Mean && self.shape == Shape::Parallelogram
    }

    fn weight(&self, photon: &MapPhoton, view: &View, _radius: f32) -> f64 {
        self.over_area(photon, view)
    }

    fn irradiance(&self, gathered: &Gathered, view: &View) -> DVec3 {
        if self.is_in_lanes() {
            return batch::irradiance(gathered, view, |of, means| self.weigh(of, means));
        }
        weighted_sum(gathered, |p| self.over_area(p, view))
    }

    fn irradiances<'a>(&self, hits: &mut dyn Iterator<Item = (Gathered<'a>, View)>, put: &mut dyn FnMut(DVec3)) {
        if self.is_in_lanes() {
            return batch::irradiances(hits, put, |of, means| self.weigh(of, means));
        }
        for (gathered, view) in hits {
            put(self.irradiance(&gathered, &view));
        }
    }

    /// The covered part, and as its only point the centroid at which `weight=centroid` evaluates the kernel.
    fn construction(&self, photon: &MapPhoton, view: &View) -> Construction {
        let Some(projected) = Self::projected(photon, view) else {
            return Construction::default();
        };
        let polygon = self.clipped::<MAX_VERTICES>(projected);
        let (coverage, centroid) = polygon.coverage_and_centroid();
        let [a, b] = view.query.axes;
        let at = |p: DVec2| view.query.center + a * p.x as f32 + b * p.y as f32;
        if coverage <= 0.0 {
            return Construction::default();
        }
        let position = at(centroid);
        let inside = photon.to_filter(position - photon.position).length_squared() < 1.0;
        let points = match self.weight {
            Weight::Centroid => vec![SamplingPoint { position, inside }],
            Weight::Mean => Vec::new(),
        };
        let covered = polygon.vertices().iter().map(|v| at(v.parameter)).collect();
        Construction { points, covered, coverage, centroid: Some(position) }
    }
}
