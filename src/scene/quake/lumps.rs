//! The header of a map and its lumps, checked before anything is read from them.

use super::MapError;
use glam::{DVec2, DVec3};

/// Version of the format.
const VERSION: i32 = 46;

/// Names and record sizes of the lumps in their order; 1 for bytes.
const LUMPS: [(&str, usize); 17] = [
    ("entities", 1),
    ("textures", 72),
    ("planes", 16),
    ("nodes", 36),
    ("leafs", 48),
    ("leaffaces", 4),
    ("leafbrushes", 4),
    ("models", 40),
    ("brushes", 12),
    ("brushsides", 8),
    ("vertexes", 44),
    ("meshverts", 4),
    ("effects", 72),
    ("faces", 104),
    ("lightmaps", 128 * 128 * 3),
    ("lightvols", 8),
    ("visdata", 1),
];

const HEADER: usize = 8 + 8 * LUMPS.len();

/// The lumps that are read.
pub(super) struct Lumps<'a> {
    pub(super) entities: &'a [u8],
    textures: &'a [u8],
    planes: &'a [u8],
    nodes: &'a [u8],
    leafs: &'a [u8],
    models: &'a [u8],
    pub(super) vertexes: &'a [u8],
    pub(super) meshverts: &'a [u8],
    faces: &'a [u8],
    pub(super) visdata: &'a [u8],
}

/// A texture's name and what it is for.
#[derive(Clone, Debug, PartialEq)]
pub(super) struct TextureRecord {
    pub(super) name: String,
    pub(super) flags: u32,
    pub(super) contents: u32,
}

#[derive(Clone, Copy, Debug)]
pub(super) struct VertexRecord {
    pub(super) position: DVec3,
    pub(super) uv: DVec2,
    pub(super) normal: DVec3,
}

#[derive(Clone, Copy, Debug)]
pub(super) struct FaceRecord {
    pub(super) texture: usize,
    pub(super) kind: i32,
    pub(super) first_vertex: usize,
    pub(super) vertices: usize,
    pub(super) first_meshvert: usize,
    pub(super) meshverts: usize,
    pub(super) size: [i32; 2],
}

#[derive(Clone, Copy, Debug)]
pub(super) struct ModelRecord {
    pub(super) first_face: usize,
    pub(super) faces: usize,
}

/// A plane `normal · p = distance`.
#[derive(Clone, Copy, Debug)]
pub(super) struct PlaneRecord {
    pub(super) normal: DVec3,
    pub(super) distance: f64,
}

#[derive(Clone, Copy, Debug)]
pub(super) struct NodeRecord {
    pub(super) plane: usize,
    /// A node from 0 on, or `-(leaf + 1)`.
    pub(super) children: [i32; 2],
}

/// A row of bits for each cluster, one for each that it may see.
#[derive(Clone, Copy, Debug)]
pub(super) struct Visibility<'a> {
    pub(super) clusters: usize,
    /// Bytes of a row.
    pub(super) row: usize,
    pub(super) rows: &'a [u8],
}

fn wrong<T>(what: impl Into<String>) -> Result<T, MapError> {
    Err(MapError(what.into()))
}

fn int(record: &[u8], at: usize) -> i32 {
    record.get(at..at + 4).and_then(|b| b.try_into().ok()).map_or(0, i32::from_le_bytes)
}

fn float(record: &[u8], at: usize) -> f64 {
    f64::from(f32::from_bits(int(record, at) as u32))
}

fn vector(record: &[u8], at: usize) -> DVec3 {
    DVec3::new(float(record, at), float(record, at + 4), float(record, at + 8))
}

/// A range of another lump that holds `count` entries.
fn range(
    lump: &str,
    index: usize,
    what: &str,
    first: i32,
    length: i32,
    count: usize,
) -> Result<(usize, usize), MapError> {
    let (f, l) = (i64::from(first), i64::from(length));
    if f < 0 || l < 0 || f + l > count as i64 {
        return wrong(format!("{lump}[{index}]: its {what} {f} to {} are not among the {count} that there are", f + l));
    }
    Ok((f as usize, l as usize))
}

impl<'a> Lumps<'a> {
    /// Finds the lumps of a file.
    ///
    /// # Errors
    /// Another format or version, a file that is cut off, lumps that overlap, overrun the file or hold part of a record.
    pub(super) fn new(file: &'a [u8]) -> Result<Self, MapError> {
        if file.len() < 8 || &file[..4] != b"IBSP" {
            return wrong("no Quake 3 map: it does not start with IBSP");
        }
        let version = int(file, 4);
        if version != VERSION {
            return wrong(format!("a map of version {version}; version {VERSION} (Quake 3) can be read"));
        }
        if file.len() < HEADER {
            return wrong(format!("cut off: the header has {HEADER} bytes, the file {}", file.len()));
        }
        let mut found: [&[u8]; LUMPS.len()] = [&[]; LUMPS.len()];
        let mut spans = Vec::new();
        for (i, (name, record)) in LUMPS.iter().enumerate() {
            let (start, length) = (int(file, 8 + 8 * i), int(file, 12 + 8 * i));
            let (Ok(start), Ok(length)) = (usize::try_from(start), usize::try_from(length)) else {
                return wrong(format!("lump {name}: its place {start} and length {length} must not be negative"));
            };
            if start + length > file.len() {
                let size = file.len();
                return wrong(format!(
                    "lump {name}: ends at byte {}, the file at {size}; is it cut off?",
                    start + length
                ));
            }
            if length % record != 0 {
                return wrong(format!("lump {name}: {length} bytes are no whole number of records of {record}"));
            }
            if length > 0 {
                if start < HEADER {
                    return wrong(format!("lump {name}: lies in the header"));
                }
                spans.push((start, start + length, *name));
            }
            found[i] = &file[start..start + length];
        }
        spans.sort_unstable();
        if let Some(w) = spans.windows(2).find(|w| w[1].0 < w[0].1) {
            return wrong(format!("lumps {} and {} overlap at byte {}", w[0].2, w[1].2, w[1].0));
        }
        let [
            entities,
            textures,
            planes,
            nodes,
            leafs,
            _,
            _,
            models,
            _,
            _,
            vertexes,
            meshverts,
            _,
            faces,
            _,
            _,
            visdata,
        ] = found;
        Ok(Self { entities, textures, planes, nodes, leafs, models, vertexes, meshverts, faces, visdata })
    }

    pub(super) fn textures(&self) -> Result<Vec<TextureRecord>, MapError> {
        let records = self.textures.chunks_exact(72).map(|r| {
            let name = r[..64].split(|b| *b == 0).next().unwrap_or(&[]);
            TextureRecord {
                name: String::from_utf8_lossy(name).into_owned(),
                flags: int(r, 64) as u32,
                contents: int(r, 68) as u32,
            }
        });
        Ok(records.collect())
    }

    pub(super) fn vertex_count(&self) -> usize {
        self.vertexes.len() / 44
    }

    /// A vertex, in the game's axes and units.
    pub(super) fn vertex(&self, index: usize) -> Result<VertexRecord, MapError> {
        let Some(r) = self.vertexes.chunks_exact(44).nth(index) else {
            return wrong(format!("vertexes[{index}]: there are {}", self.vertex_count()));
        };
        let v =
            VertexRecord { position: vector(r, 0), uv: DVec2::new(float(r, 12), float(r, 16)), normal: vector(r, 28) };
        if !(v.position.is_finite() && v.position.abs().max_element() < 1e9) {
            return wrong(format!("vertexes[{index}]: its place {} is no place in a map", v.position));
        }
        let uv = if v.uv.is_finite() && v.uv.abs().max_element() < 1e6 { v.uv } else { DVec2::ZERO };
        let normal = if v.normal.is_finite() { v.normal } else { DVec3::ZERO };
        Ok(VertexRecord { uv, normal, ..v })
    }

    /// Offset of a triangle's corner from the first vertex of its face.
    pub(super) fn meshvert(&self, index: usize) -> i32 {
        int(self.meshverts, 4 * index)
    }

    pub(super) fn face_count(&self) -> usize {
        self.faces.len() / 104
    }

    pub(super) fn face(&self, index: usize) -> Result<FaceRecord, MapError> {
        let r = &self.faces[104 * index..104 * (index + 1)];
        let textures = self.textures.len() / 72;
        let texture = int(r, 0);
        let Some(texture) = usize::try_from(texture).ok().filter(|t| *t < textures) else {
            return wrong(format!("faces[{index}]: texture {texture} is not among the {textures} that there are"));
        };
        let (first_vertex, vertices) = range("faces", index, "vertexes", int(r, 12), int(r, 16), self.vertex_count())?;
        let meshverts = self.meshverts.len() / 4;
        let (first_meshvert, meshverts) = range("faces", index, "meshverts", int(r, 20), int(r, 24), meshverts)?;
        let (kind, size) = (int(r, 8), [int(r, 96), int(r, 100)]);
        Ok(FaceRecord { texture, kind, first_vertex, vertices, first_meshvert, meshverts, size })
    }

    pub(super) fn models(&self) -> Result<Vec<ModelRecord>, MapError> {
        let count = self.face_count();
        self.models
            .chunks_exact(40)
            .enumerate()
            .map(|(i, r)| {
                let (first_face, faces) = range("models", i, "faces", int(r, 24), int(r, 28), count)?;
                Ok(ModelRecord { first_face, faces })
            })
            .collect()
    }

    pub(super) fn planes(&self) -> Vec<PlaneRecord> {
        self.planes.chunks_exact(16).map(|r| PlaneRecord { normal: vector(r, 0), distance: float(r, 12) }).collect()
    }

    pub(super) fn nodes(&self) -> Result<Vec<NodeRecord>, MapError> {
        let (planes, nodes, leafs) = (self.planes.len() / 16, self.nodes.len() / 36, self.leafs.len() / 48);
        self.nodes
            .chunks_exact(36)
            .enumerate()
            .map(|(i, r)| {
                let plane = int(r, 0);
                let Some(plane) = usize::try_from(plane).ok().filter(|p| *p < planes) else {
                    return wrong(format!("nodes[{i}]: plane {plane} is not among the {planes} that there are"));
                };
                let children = [int(r, 4), int(r, 8)];
                for c in children {
                    // Nodes come before their children, or a walk might never end.
                    let fine = if c >= 0 {
                        (c as usize) < nodes && c as usize > i
                    } else {
                        (-(i64::from(c) + 1)) < leafs as i64
                    };
                    if !fine {
                        return wrong(format!("nodes[{i}]: its child {c} is neither a later node nor a leaf"));
                    }
                }
                Ok(NodeRecord { plane, children })
            })
            .collect()
    }

    /// Cluster of each leaf; negative outside of the map.
    pub(super) fn clusters(&self) -> Vec<i32> {
        self.leafs.chunks_exact(48).map(|r| int(r, 0)).collect()
    }

    /// Which clusters see which; None if the map does not tell.
    pub(super) fn visibility(&self) -> Result<Option<Visibility<'a>>, MapError> {
        if self.visdata.len() < 8 {
            return Ok(None);
        }
        let (clusters, row) = (int(self.visdata, 0), int(self.visdata, 4));
        let rows = &self.visdata[8..];
        let (Ok(clusters), Ok(row)) = (usize::try_from(clusters), usize::try_from(row)) else {
            return wrong(format!("lump visdata: {clusters} clusters of {row} bytes"));
        };
        if clusters.checked_mul(row).is_none_or(|n| n > rows.len()) || row * 8 < clusters {
            return wrong(format!("lump visdata: {clusters} rows of {row} bytes are not in its {} bytes", rows.len()));
        }
        Ok(Some(Visibility { clusters, row, rows }))
    }
}
