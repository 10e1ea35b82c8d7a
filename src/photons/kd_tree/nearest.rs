//! The nearest entries that a search has met.

use glam::Vec3;

/// The k nearest entries found so far, in no particular order, which is the same for the same search.
///
/// A distance is squared and kept as the bits of a non-negative f32, whose order is that of the numbers; equal distances
/// are told apart by index, so that the set found does not depend on the order of the search. More than k are held while
/// it runs: to drop the farthest of many at once costs less than to keep a few in order.
#[derive(Clone, Debug, Default)]
pub struct Nearest {
    /// Bits of the distance above those of the index.
    entries: Vec<u64>,
    k: usize,
    /// Squared distance beyond which nothing is among the nearest, metres².
    worst: f32,
    /// Centre, radius and k of the last search that found all it was asked for.
    last: Option<(Vec3, f32, usize)>,
}

/// Part by which an expected radius is widened, more than its sum is rounded.
const WIDER: f32 = 1.0 + 1e-5;

impl Nearest {
    /// Nothing yet.
    pub fn new() -> Self {
        Self::default()
    }

    /// Forgets what was found.
    pub fn clear(&mut self) {
        self.entries.clear();
    }

    /// Entries found, at most k.
    pub fn len(&self) -> usize {
        self.entries.len()
    }

    /// Whether nothing was found.
    pub fn is_empty(&self) -> bool {
        self.entries.is_empty()
    }

    /// Each entry: the bits of its squared distance, and its index.
    pub fn iter(&self) -> impl Iterator<Item = (u32, u32)> {
        self.entries.iter().map(|&e| ((e >> 32) as u32, e as u32))
    }

    /// The farthest entry, of those at the same distance the one of the highest index.
    pub fn farthest(&self) -> Option<(u32, u32)> {
        self.entries.iter().max().map(|&e| ((e >> 32) as u32, e as u32))
    }

    /// Squared radius about `center` in which the k nearest are, if those of the last search are still among what is looked
    /// for; None if that was far off or was another search.
    pub(super) fn expected(&self, center: Vec3, k: usize) -> Option<f32> {
        let (last, radius, _) = self.last.filter(|l| l.2 == k)?;
        let away = last.distance(center);
        (away < radius).then(|| ((radius + away) * WIDER).powi(2))
    }

    /// Keeps what [`Nearest::expected`] needs, after a search for `k`, one or more, about `center`.
    pub(super) fn remember(&mut self, center: Vec3, k: usize) {
        // With all k found the farthest of them is what bounds the rest.
        self.last = (self.len() == k).then(|| (center, self.worst.sqrt(), k));
    }

    /// Starts a search for `k`, one or more, up to a squared distance; entries of others that are there compete.
    pub(super) fn begin(&mut self, k: usize, limit: f32) {
        self.k = k;
        self.worst = limit.min(f32::MAX);
        self.finish();
    }

    /// Squared distance beyond which nothing needs to be put in.
    #[inline(always)]
    pub(super) fn worst(&self) -> f32 {
        self.worst
    }

    /// Puts an entry in whose distance is at most [`Nearest::worst`].
    #[inline(always)]
    pub(super) fn put(&mut self, key: u64) {
        self.entries.push(key);
    }

    /// Looks at what was put in since there were `before` entries.
    #[inline(always)]
    pub(super) fn settle(&mut self, before: usize) {
        let len = self.entries.len();
        // Half as many again, and some for small k.
        if len >= self.k.saturating_add(self.k / 2 + 32) {
            self.finish();
        } else if before < self.k && len >= self.k {
            self.bound();
        }
    }

    /// Drops all but the k nearest.
    #[inline(never)]
    pub(super) fn finish(&mut self) {
        if self.entries.len() > self.k {
            self.entries.select_nth_unstable(self.k - 1);
            self.entries.truncate(self.k);
        }
        if self.entries.len() == self.k {
            self.bound();
        }
    }

    /// With k entries or more nothing beyond the farthest is among the nearest.
    #[inline(never)]
    fn bound(&mut self) {
        if let Some((farthest, _)) = self.farthest() {
            self.worst = self.worst.min(f32::from_bits(farthest));
        }
    }
}

impl FromIterator<(u32, u32)> for Nearest {
    fn from_iter<I: IntoIterator<Item = (u32, u32)>>(entries: I) -> Self {
        let entries = entries.into_iter().map(|(bits, index)| u64::from(bits) << 32 | u64::from(index)).collect();
        Self { entries, ..Self::default() }
    }
}
