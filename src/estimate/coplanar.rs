//! `coplanar`: coverage and centroid of the clipped footprints (Pedersen 2011, eq. 50 to 67).
//!
//! The thesis projects the photon along the view ray into the view plane. Here the view footprint is projected the
//! other way, into the photon's plane and its footprint coordinates: an affine map, so that coverage and centroid are
//! the same, and the photon's polygon is the same square or regular polygon for all photons. The clipped vertices
//! carry their parameters in the view footprint along, which maps the centroid back (eq. 66) without an inverse.

use super::{Construction, Estimator, Gathered, Lookup, SamplingPoint, View, weighted_sum};
use crate::estimate::clip::{self, ClippedPolygon, HalfPlane, MAX_CORNERS, MAX_VERTICES, SQUARE_VERTICES};
use crate::estimate::kernel::silverman;
use crate::estimate::parallelogram::mean_over_parallelogram;
use crate::estimate::polygon::mean_over_part;
use crate::estimate::settings::{Spec, SpecError};
use crate::photons::MapPhoton;
use glam::{DVec2, DVec3, Vec3};

/// Cosine below which a photon's plane seen along the ray has no area that f32 could tell.
const EDGE_ON: f64 = 1e-12;

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
    #[inline]
    pub fn projected(photon: &MapPhoton, view: &View) -> Option<[DVec2; 3]> {
        // In f64: along a grazing ray the projection divides by next to nothing.
        let (v, n) = (view.direction.as_dvec3(), photon.normal.as_dvec3());
        let across = n.dot(v);
        if across.abs() < EDGE_ON {
            return None;
        }
        let rows = [photon.rows[0].as_dvec3(), photon.rows[1].as_dvec3()];
        // The row times the projection, once for all three vectors.
        let rows = rows.map(|r| r - n * (r.dot(v) / across));
        let project = |x: Vec3| {
            let x = x.as_dvec3();
            photon.to_own(DVec2::new(rows[0].dot(x), rows[1].dot(x)))
        };
        let offset = view.query.center - photon.position;
        let [a, b] = view.query.axes;
        let (pc, pa, pb) = (project(offset), project(a), project(b));
        let reach = pa.abs() + pb.abs();
        if pc.x.abs() - reach.x >= 1.0 || pc.y.abs() - reach.y >= 1.0 {
            return None;
        }
        Some([pc, pa, pb])
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

    fn over_area(&self, photon: &MapPhoton, view: &View) -> f64 {
        match self.shape {
            Shape::Parallelogram => self.over_area_with::<SQUARE_VERTICES>(photon, view),
            Shape::Ellipse(_) => self.over_area_with::<MAX_VERTICES>(photon, view),
        }
    }

    #[inline]
    fn over_area_with<const N: usize>(&self, photon: &MapPhoton, view: &View) -> f64 {
        let Some(projected) = Self::projected(photon, view) else {
            return 0.0;
        };
        let polygon = self.clipped::<N>(projected);
        let (coverage, centroid) = polygon.coverage_and_centroid();
        if coverage <= 0.0 {
            return 0.0;
        }
        let offset = view.query.center - photon.position;
        let [a, b] = view.query.axes;
        let filtered = match self.weight {
            Weight::Centroid => {
                let x = offset + a * centroid.x as f32 + b * centroid.y as f32;
                coverage * silverman(f64::from(photon.to_filter(x).length_squared()))
            }
            Weight::Mean => {
                let (fc, fa, fb) = (photon.to_filter(offset), photon.to_filter(a), photon.to_filter(b));
                let mut parameters = [DVec2::ZERO; N];
                let mut buffer = [DVec2::ZERO; N];
                let vertices = polygon.vertices();
                for (p, v) in parameters.iter_mut().zip(vertices) {
                    *p = v.parameter;
                }
                let parts = &parameters[..vertices.len()];
                3.0 * mean_over_part(fc, fa, fb, parts, &mut buffer)
                    .unwrap_or_else(|| mean_over_parallelogram(fc, fa, fb))
            }
        };
        filtered * f64::from(photon.inverse_area)
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
        weighted_sum(gathered, |p| self.over_area(p, view))
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
