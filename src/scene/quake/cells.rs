//! Cells of visibility: convex parts of the map, grouped into clusters that see or do not see each other.

use super::lumps::Lumps;
use super::{MapError, UNITS_PER_METRE, turned};
use glam::{DVec3, Vec3};

#[derive(Clone, Debug, PartialEq)]
struct Node {
    normal: DVec3,
    distance: f64,
    children: [i32; 2],
}

/// The tree of planes that tells the cell of a place, in metres, y up.
#[derive(Clone, Debug, PartialEq)]
pub struct Cells {
    nodes: Vec<Node>,
    /// Cluster of each leaf; negative outside of the map.
    leaves: Vec<i32>,
    clusters: u32,
    row: usize,
    /// A bit for each pair of clusters; empty if all see all.
    visible: Vec<u8>,
    /// Where the local origin lies.
    origin: DVec3,
}

impl Cells {
    /// Reads them, and says so if the map has no visibility.
    pub(super) fn read(lumps: &Lumps) -> Result<(Self, Option<String>), MapError> {
        let planes = lumps.planes();
        let nodes = lumps.nodes()?;
        let nodes = nodes.iter().map(|n| {
            let p = planes[n.plane];
            Node { normal: turned(p.normal), distance: p.distance / UNITS_PER_METRE, children: n.children }
        });
        let leaves = lumps.clusters();
        let visibility = lumps.visibility()?;
        let note = visibility.is_none().then(|| "the map tells no visibility; all of its cells see all".to_owned());
        let most = leaves.iter().copied().max().unwrap_or(-1);
        let (clusters, row, visible) = match visibility {
            Some(v) => (v.clusters as u32, v.row, v.rows[..v.clusters * v.row].to_vec()),
            None => ((most + 1).max(0) as u32, 0, Vec::new()),
        };
        if i64::from(most) >= i64::from(clusters) {
            return Err(MapError(format!("leafs: cluster {most} is not among the {clusters} of lump visdata")));
        }
        Ok((Self { nodes: nodes.collect(), leaves, clusters, row, visible, origin: DVec3::ZERO }, note))
    }

    /// The same about a local origin.
    pub fn about(mut self, origin: DVec3) -> Self {
        self.origin = origin;
        self
    }

    /// Number of clusters.
    pub fn cluster_count(&self) -> u32 {
        self.clusters
    }

    /// Cluster of a place, local metres; None outside of the map.
    pub fn cluster(&self, place: Vec3) -> Option<u32> {
        let p = place.as_dvec3() + self.origin;
        let mut at = 0i32;
        // Children come after their node: a reader has looked.
        while at >= 0 {
            let node = self.nodes.get(at as usize)?;
            let behind = node.normal.dot(p) < node.distance;
            at = node.children[usize::from(behind)];
        }
        let cluster = *self.leaves.get((-(i64::from(at) + 1)) as usize)?;
        u32::try_from(cluster).ok()
    }

    /// Whether anything in one cluster may be seen from the other.
    pub fn sees(&self, from: u32, to: u32) -> bool {
        if self.visible.is_empty() {
            return true;
        }
        let byte = self.visible.get(from as usize * self.row + to as usize / 8);
        byte.is_none_or(|b| b >> (to % 8) & 1 == 1)
    }
}
