//! The photon pass: all photons of one pass, and the maps made of them.

use crate::estimate::Estimator;
use crate::math::eights::LANES;
use crate::math::hash::mix;
use crate::math::rgb::{Rgb, mean};
use crate::math::sequence::{Sampling, Sequence};
use crate::photons::emission::{Emission, LightShare, emit, share_among, share_photons};
use crate::photons::emission_group::{emit_group, start_cell};
use crate::photons::map::{FootprintLimits, MapParts};
use crate::photons::path::{Flight, PathCounts, PathSettings, PathState, PhotonRecorder, SpecularBounds, Unrecorded};
use crate::photons::projection::{Cells, ProjectionMap};
use crate::photons::wavefront::{Order, Wavefront};
use crate::photons::{PhotonKind, PhotonMap, StoredPhotons};
use crate::render::plan::Plan;
use crate::render::turns::in_turn;
use crate::scene::Scene;
use crate::trace::Intersector;
use std::ops::Range;
use std::time::Instant;

/// Number of the plan's pilot pass, whose photons are not those of any other.
pub const PILOT_PASS: u64 = u64::MAX;
/// Photons that one thread follows at a time, together.
const CHUNK: u64 = 4096;

/// What is needed to trace the photons of a pass.
pub struct Emitter<'a> {
    /// The scene.
    pub scene: &'a Scene,
    /// Its intersector.
    pub intersector: &'a Intersector,
    /// How paths are followed.
    pub path: PathSettings,
    /// Cells that caustic photons are emitted through by themselves, if paths are followed so.
    pub projection: Option<&'a ProjectionMap>,
    /// Numbers that photons are made of.
    pub sampling: Sampling,
    /// Photons to emit.
    pub photons: u64,
    /// Seed of the render.
    pub seed: u64,
}

/// The photons of a pass.
#[derive(Clone, Default)]
pub struct PhotonPass {
    /// Stored photons, in the order of emission.
    pub stored: StoredPhotons,
    /// Photons emitted.
    pub emitted: u64,
    /// What was bounded.
    pub counts: PathCounts,
    /// Power of the photons whose paths the bounce limit ended, the mean of the channels, W.
    pub cut_off: f64,
    /// Photons of each kind that each chunk of emission stored, in the order of [`PhotonKind::ALL`].
    pub chunks: Vec<[u32; 3]>,
}

impl PhotonPass {
    /// What is in it, in lists that are no longer than they need to be; its own lists stay for the next photons.
    fn taken(&mut self) -> Self {
        let taken = Self { chunks: Vec::new(), ..self.clone() };
        self.clear();
        taken
    }

    /// The chunks of a pass in one.
    fn joined(parts: &[Self]) -> Self {
        let stored = StoredPhotons::joined(&parts.iter().map(|part| &part.stored).collect::<Vec<_>>());
        let mut whole = Self { stored, ..Default::default() };
        for part in parts {
            whole.chunks.push(PhotonKind::ALL.map(|kind| part.stored.of(kind).len() as u32));
            whole.emitted += part.emitted;
            whole.counts += part.counts;
            whole.cut_off += part.cut_off;
        }
        whole
    }

    fn clear(&mut self) {
        let mut stored = std::mem::take(&mut self.stored);
        stored.clear();
        *self = Self { stored, ..Self::default() };
    }
}

impl Emitter<'_> {
    /// Traces pass number `pass`. The result does not depend on the number of threads; a cancelled pass is short.
    pub fn run(&self, pass: u64, cancelled: &(dyn Fn() -> bool + Sync)) -> PhotonPass {
        let departures = Departures::new(self, pass);
        let chunks = &departures.chunks;
        let parts = in_turn(chunks.len(), Default::default, |(part, scratch): &mut (PhotonPass, Scratch), number| {
            if !cancelled() {
                departures.part(chunks[number], part, scratch);
            }
            part.taken()
        });
        PhotonPass::joined(&parts)
    }

    /// [`Self::run`] on one thread, each photon followed to its end before the next starts: the same photons. What following many
    /// together is measured against, and held to.
    pub fn run_one_by_one(&self, pass: u64) -> PhotonPass {
        let departures = Departures::new(self, pass);
        let of_chunk = |&chunk: &Chunk| {
            let flight = departures.flight(chunk);
            let mut part = PhotonPass::default();
            for number in departures.numbers(chunk) {
                departures.send(&flight, chunk, number, &mut part, &mut Unrecorded);
            }
            part
        };
        PhotonPass::joined(&departures.chunks.iter().map(of_chunk).collect::<Vec<_>>())
    }

    /// Traces pass number `pass` and keeps nothing of it: photons emitted, and stored of each kind.
    pub fn count(&self, pass: u64) -> (u64, [u64; 3]) {
        let departures = Departures::new(self, pass);
        let start = <(PhotonPass, Scratch)>::default;
        let counts = in_turn(departures.chunks.len(), start, |(part, scratch), number| {
            departures.part(departures.chunks[number], part, scratch);
            let counts = (part.emitted, PhotonKind::ALL.map(|kind| part.stored.of(kind).len() as u64));
            part.clear();
            counts
        });
        let add = |a: (u64, [u64; 3]), b: (u64, [u64; 3])| (a.0 + b.0, std::array::from_fn(|i| a.1[i] + b.1[i]));
        counts.into_iter().fold(Default::default(), add)
    }

    /// Traces one photon of `photons`, which this emitter made as pass `pass`, once more: the one whose path stored
    /// number `index` of that kind. `recorder` hears of its whole path.
    ///
    /// It follows again the chunk of emission that the photon came in, which is a few thousand at most. None if there
    /// is no such photon, or if this emitter did not make it.
    pub fn retrace(
        &self,
        pass: u64,
        photons: &PhotonPass,
        kind: PhotonKind,
        index: usize,
        recorder: &mut impl PhotonRecorder,
    ) -> Option<Departure> {
        let stored = photons.stored.of(kind).get(index)?;
        let mut before = 0;
        let at = photons.chunks.iter().position(|counts| {
            let own = counts[kind as usize] as usize;
            let found = index < before + own;
            before += if found { 0 } else { own };
            found
        })?;
        let departures = Departures::new(self, pass);
        let chunk = *departures.chunks.get(at)?;
        let flight = departures.flight(chunk);
        for number in departures.numbers(chunk) {
            let mut part = PhotonPass::default();
            departures.send(&flight, chunk, number, &mut part, &mut Unrecorded);
            let own = part.stored.of(kind);
            if let Some(again) = own.get(index - before) {
                let same = again.position == stored.position && again.power == stored.power;
                return same.then(|| departures.send(&flight, chunk, number, &mut part, recorder)).map(|emission| {
                    let LightShare { light, power, .. } = departures.beams[chunk.beam].share;
                    Departure { light, number, power, emission, nth: index - before }
                });
            }
            before += own.len();
        }
        None
    }
}

/// How a photon left its light.
#[derive(Clone, Copy, Debug)]
pub struct Departure {
    /// Index of the light.
    pub light: usize,
    /// Number of the photon among those of the light.
    pub number: u64,
    /// Power, W.
    pub power: Rgb,
    /// Start, direction and differential.
    pub emission: Emission,
    /// How many photons of the same kind the path stored before the one that was asked for.
    pub nth: usize,
}

/// Photons of one light that are emitted alike.
struct Beam<'a> {
    share: LightShare,
    /// Photons that would share the whole of the light, each with as much of it.
    whole: f64,
    /// The cells that they leave through; None for all.
    cells: Option<&'a Cells>,
    path: PathSettings,
    sequence: Sequence,
}

/// Photons of one beam that one thread follows.
#[derive(Clone, Copy)]
struct Chunk {
    beam: usize,
    first: u64,
}

/// What a thread keeps between chunks.
#[derive(Default)]
struct Scratch {
    wavefront: Wavefront,
    order: Order,
    /// Numbers that the photons of the chunk are made of.
    numbers: Vec<[f32; 4]>,
}

/// The photons of a pass before they fly.
struct Departures<'a> {
    emitter: &'a Emitter<'a>,
    beams: Vec<Beam<'a>>,
    chunks: Vec<Chunk>,
    aim: Option<SpecularBounds>,
}

impl<'a> Departures<'a> {
    fn new(emitter: &'a Emitter<'a>, pass: u64) -> Self {
        let Emitter { scene, path, projection, sampling, photons, .. } = *emitter;
        let seed = mix(mix(emitter.seed, 0x70_686f_746f_6e73), pass);
        let projection = projection.filter(|_| path.projected && path.caustic);
        let others = path.direct || path.global;
        let mut beams = Vec::new();
        if let Some(map) = projection {
            let seed = mix(seed, 0x0063_6175_7374_6963);
            let random = Sequence::new(Sampling::Random, seed);
            let path = PathSettings { direct: false, global: false, ..path };
            for share in share_among(scene, photons, &random, |light| map.light(light).share()) {
                let cells = map.light(share.light);
                let sequence = Sequence::new(sampling, mix(seed, share.light as u64));
                beams.push(Beam {
                    share,
                    whole: share.count as f64 / cells.share(),
                    cells: Some(cells),
                    path,
                    sequence,
                });
            }
        }
        if projection.is_none() || others {
            let path = PathSettings { caustic: path.caustic && projection.is_none(), ..path };
            for share in share_photons(scene, photons, &Sequence::new(Sampling::Random, seed)) {
                let sequence = Sequence::new(sampling, mix(seed, share.light as u64));
                beams.push(Beam { share, whole: share.count as f64, cells: None, path, sequence });
            }
        }
        let of = |(beam, b): (usize, &Beam)| {
            (0..b.share.count).step_by(CHUNK as usize).map(move |first| Chunk { beam, first })
        };
        let chunks = beams.iter().enumerate().flat_map(of).collect();
        // Where nothing but caustic photons is kept, those that cannot meet a specular surface need not be followed.
        let aim = if path.caustic && !others { SpecularBounds::of(scene) } else { None };
        Self { emitter, beams, chunks, aim }
    }

    fn flight(&self, chunk: Chunk) -> Flight<'a> {
        let Emitter { scene, intersector, .. } = *self.emitter;
        let Beam { path, sequence, .. } = self.beams[chunk.beam];
        Flight { scene, intersector, settings: path, sequence }
    }

    fn numbers(&self, chunk: Chunk) -> Range<u64> {
        chunk.first..(chunk.first + CHUNK).min(self.beams[chunk.beam].share.count)
    }

    /// Adds all photons of a chunk to `part`.
    fn part(&self, chunk: Chunk, part: &mut PhotonPass, scratch: &mut Scratch) {
        let flight = self.flight(chunk);
        let numbers = self.numbers(chunk);
        let Beam { share: LightShare { light, power, count }, whole, cells, .. } = &self.beams[chunk.beam];
        let (scene, light) = (self.emitter.scene, &self.emitter.scene.lights[*light]);
        let Scratch { wavefront, order, numbers: x } = scratch;
        x.clear();
        x.extend(numbers.clone().map(|number| flight.sequence.four(number, 0)));
        // Those that go about the same way are next to each other.
        for group in order.by(x.iter().map(|x| start_cell(light, *cells, x))).chunks(LANES) {
            let mut rows = [[0.0; LANES]; 4];
            for (lane, &i) in group.iter().enumerate() {
                for (row, x) in rows.iter_mut().zip(x[i as usize]) {
                    row[lane] = x;
                }
            }
            let rows = cells.map_or(rows, |cells| cells.numbers_of_group(&rows));
            part.emitted += group.len() as u64;
            for (&i, emission) in group.iter().zip(&emit_group(scene, light, *whole, &rows)) {
                if self.is_followed(emission) {
                    part.counts.grazing += u64::from(emission.bounded);
                    wavefront.photons.push(PathState::new(numbers.start + u64::from(i), emission, *power));
                }
            }
        }
        let cut_off = |left| part.cut_off += f64::from(mean(left));
        wavefront.trace(&flight, numbers.start, *count, &mut part.stored, &mut part.counts, cut_off);
    }

    /// How a photon leaves its light.
    fn emission(&self, flight: &Flight, chunk: Chunk, number: u64) -> Emission {
        let Beam { share, whole, cells, .. } = &self.beams[chunk.beam];
        let scene = self.emitter.scene;
        let x = flight.sequence.four(number, 0);
        let x = cells.map_or(x, |c| c.numbers(x));
        emit(scene, &scene.lights[share.light], *whole, x)
    }

    /// Whether it may leave anything.
    fn is_followed(&self, emission: &Emission) -> bool {
        self.aim.is_none_or(|a| a.may_meet(emission.origin, emission.direction))
    }

    /// Sends one photon off and follows it.
    fn send(
        &self,
        flight: &Flight,
        chunk: Chunk,
        number: u64,
        part: &mut PhotonPass,
        recorder: &mut impl PhotonRecorder,
    ) -> Emission {
        let LightShare { power, count, .. } = self.beams[chunk.beam].share;
        let emission = self.emission(flight, chunk, number);
        part.emitted += 1;
        if self.is_followed(&emission) {
            let (out, counts) = (&mut part.stored, &mut part.counts);
            let left = flight.trace(number, &emission, power, count, out, counts, recorder);
            part.cut_off += f64::from(mean(left));
        }
        emission
    }
}

/// The maps of a pass; None where the plan leaves one out.
#[derive(Default)]
pub struct PhotonMaps {
    /// Direct photons.
    pub direct: Option<PhotonMap>,
    /// Caustic photons.
    pub caustic: Option<PhotonMap>,
    /// Global photons.
    pub global: Option<PhotonMap>,
    /// Seconds to build each, in the order of [`PhotonKind::ALL`].
    seconds: [f64; 3],
}

impl PhotonMaps {
    /// Builds the maps of the plan. `scale` multiplies all footprints' axes.
    pub fn new(scene: &Scene, plan: &Plan, stored: &StoredPhotons, scale: f32) -> Self {
        Self::with_parts(scene, plan, stored, scale, plan.map_parts())
    }

    /// The same with other structures than the plan's.
    pub fn with_parts(scene: &Scene, plan: &Plan, stored: &StoredPhotons, scale: f32, parts: MapParts) -> Self {
        let limits = FootprintLimits { scale, floor: scene.resolution(), ceiling: scene.radius };
        let mut seconds = [0.0; 3];
        let mut build = |on: bool, kind: PhotonKind| {
            on.then(|| {
                let start = Instant::now();
                let map = PhotonMap::new(stored.of(kind), limits, parts);
                seconds[kind as usize] = start.elapsed().as_secs_f64();
                map
            })
        };
        let direct = build(plan.direct_map, PhotonKind::Direct);
        let caustic = build(plan.caustic_map, PhotonKind::Caustic);
        let global = build(plan.global_map, PhotonKind::Global);
        Self { direct, caustic, global, seconds }
    }

    /// Those that an estimator looks photons up in: not the global one if final gathering takes its place.
    pub fn of_estimator(&self, estimator: &dyn Estimator) -> impl Iterator<Item = (PhotonKind, &PhotonMap)> {
        let global = estimator.final_gathering().is_none();
        self.by_kind().filter(move |(kind, _)| global || *kind != PhotonKind::Global)
    }

    /// Seconds to build those that an estimator looks photons up in.
    pub fn seconds(&self, estimator: &dyn Estimator) -> f64 {
        self.of_estimator(estimator).map(|(kind, _)| self.seconds[kind as usize]).sum()
    }

    /// Those that are there.
    pub fn all(&self) -> impl Iterator<Item = &PhotonMap> {
        self.by_kind().map(|(_, map)| map)
    }

    /// Those that are there, with the kind of their photons.
    pub fn by_kind(&self) -> impl Iterator<Item = (PhotonKind, &PhotonMap)> {
        PhotonKind::ALL.into_iter().filter_map(|kind| Some((kind, self.of(kind)?)))
    }

    /// The map of that kind, if it is there.
    pub fn of(&self, kind: PhotonKind) -> Option<&PhotonMap> {
        match kind {
            PhotonKind::Direct => self.direct.as_ref(),
            PhotonKind::Caustic => self.caustic.as_ref(),
            PhotonKind::Global => self.global.as_ref(),
        }
    }

    /// Footprints raised to the floor and lowered to the ceiling in all maps.
    pub fn limited(&self) -> (u64, u64) {
        self.all().map(PhotonMap::limited).fold((0, 0), |sum, l| (sum.0 + l.0, sum.1 + l.1))
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::photons::spread::DiffuseSpread;
    use crate::scene::{built_in, open};

    /// Photons that go together leave what each leaves alone, to the bit and in that order: through mirrors and glass of flat and
    /// smooth triangles and of spheres, coloured ones, in scenes small and large, from all of a light and from marked cells.
    #[test]
    fn photons_together_are_each_alone() {
        let ring = built_in::find("ring").expect("built in").text;
        let mirror = "kind = \"mirror\"\nreflectance = [1.0, 1.0, 1.0]";
        let coloured = "kind = \"mirror\"\nreflectance = [0.9, 0.6, 0.2]";
        let metal = "kind = \"metal\"\nreflectance = [0.9, 0.6, 0.2]";
        let glass = "kind = \"dielectric\"\nior = 1.5\ntransmittance = [0.9, 0.6, 0.4]";
        assert!(ring.contains(mirror) && ring.contains("segments = 256"));
        let with = |material: &str, segments: usize| {
            ring.replace(mirror, material).replace("segments = 256", &format!("segments = {segments}"))
        };
        let of = |name: &str| built_in::find(name).expect("built in").text.to_string();
        let texts = [
            with(mirror, 256),
            with(coloured, 64),
            with(metal, 64),
            with(glass, 256),
            with(glass, 12_000),
            of("cornell"),
            of("glass_ball"),
            of("ring_soft"),
            of("prism_wall"),
        ];
        let folder = tempfile::tempdir().expect("a folder");
        let mut large = 0;
        for text in &texts {
            let file = folder.path().join("scene.toml");
            std::fs::write(&file, text).expect("written");
            std::fs::write(folder.path().join("prism.obj"), include_str!("../../assets/scenes/prism.obj"))
                .expect("written");
            let scene = open(file.to_str().expect("a path")).expect("opens");
            let intersector = Intersector::new(&scene.geometry, scene.radius);
            let map = ProjectionMap::new(&scene);
            large += u32::from(intersector.is_large());
            let mut stored = 0;
            for (global, projected) in [(false, false), (false, true), (true, false), (true, true)] {
                let path = PathSettings {
                    max_depth: 8,
                    direct: global,
                    caustic: true,
                    global,
                    projected,
                    differentials: true,
                    spread: DiffuseSpread::default(),
                };
                let projection = map.as_ref().filter(|_| projected);
                let (scene, intersector, sampling) = (&scene, &intersector, Sampling::Sobol);
                let emitter = Emitter { scene, intersector, path, projection, sampling, photons: 20_000, seed: 3 };
                let together = emitter.run(0, &|| false);
                assert_same(&together, &emitter.run_one_by_one(0));
                stored += together.chunks.iter().flatten().sum::<u32>();
            }
            assert!(stored > 1000, "{stored}");
        }
        assert_eq!(large, 1);
    }

    fn assert_same(together: &PhotonPass, alone: &PhotonPass) {
        assert_eq!((together.emitted, together.counts, &together.chunks), (alone.emitted, alone.counts, &alone.chunks));
        assert_eq!(together.cut_off.to_bits(), alone.cut_off.to_bits());
        for kind in PhotonKind::ALL {
            let [a, b] = [together, alone].map(|pass| format!("{:?}", pass.stored.of(kind)));
            assert!(a == b, "{kind:?}");
        }
    }
}
