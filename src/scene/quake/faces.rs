//! What is drawn: polygons, patches and meshes of the world and of the models that stand in it.

use super::entities::Entity;
use super::lumps::{FaceRecord, Lumps, TextureRecord, VertexRecord};
use super::{MapError, UNITS_PER_METRE, patch, turned};
use crate::scene::geometry::NONE;
use crate::scene::shapes::Mesh;
use glam::{DVec2, DVec3};
use std::collections::BTreeMap;

const POLYGON: i32 = 1;
const PATCH: i32 = 2;
const MESH: i32 = 3;
const BILLBOARD: i32 = 4;

const SKY: u32 = 0x4;
const NODRAW: u32 = 0x80;
const HINT_OR_SKIP: u32 = 0x100 | 0x200;
const WATER_OR_SLIME: u32 = 0x20 | 0x10;
const FOG: u32 = 0x40;
/// Some lava is said to be water too; it stays, for nothing is seen through it.
const LAVA: u32 = 0x8;

/// Why a face is left out, if it is.
fn left_out(t: &TextureRecord) -> Option<&'static str> {
    let name = t.name.to_ascii_lowercase();
    // Tools of the editor, which mark what players cannot see.
    let tool = name.strip_prefix("textures/common/").is_some_and(|n| !n.contains("mirror") && !n.contains("black"));
    if t.flags & SKY != 0 || name.contains("skies/") {
        Some("sky")
    } else if t.flags & (NODRAW | HINT_OR_SKIP) != 0 || tool {
        Some("not drawn")
    } else if t.contents & FOG != 0 {
        Some("fog")
    } else if t.contents & WATER_OR_SLIME != 0 && t.contents & LAVA == 0 {
        Some("water")
    } else {
        None
    }
}

/// Where a model stands: moved by an entity's origin, metres; None if it is left out.
struct Standing {
    offset: DVec3,
    reason: Option<&'static str>,
}

struct Builder<'a> {
    lumps: &'a Lumps<'a>,
    mesh: Mesh,
    triangles_in: u64,
    /// Triangles left out for each reason.
    out: BTreeMap<&'static str, u64>,
    billboards: u64,
}

/// The mesh of a map in metres, y up, and what is to be said of it.
pub(super) fn mesh(
    lumps: &Lumps,
    textures: &[TextureRecord],
    entities: &[Entity],
) -> Result<(Mesh, Vec<String>), MapError> {
    let models = lumps.models()?;
    let mut of_model: Vec<Option<Standing>> = models.iter().map(|_| None).collect();
    for e in entities {
        let number = e.get("model").and_then(|m| m.strip_prefix('*')).and_then(|n| n.parse::<usize>().ok());
        let Some(slot) = number.filter(|n| *n > 0).and_then(|n| of_model.get_mut(n)) else { continue };
        let reason = e.class().starts_with("trigger_").then_some("trigger");
        *slot = Some(Standing { offset: e.origin().unwrap_or(DVec3::ZERO), reason });
    }
    let mut b = Builder { lumps, mesh: Mesh::default(), triangles_in: 0, out: BTreeMap::new(), billboards: 0 };
    let mut model_of = vec![None; lumps.face_count()];
    for (m, model) in models.iter().enumerate() {
        model_of[model.first_face..model.first_face + model.faces].fill(Some(m));
    }
    for (i, model) in model_of.iter().enumerate() {
        let face = lumps.face(i)?;
        let standing = model.and_then(|m| of_model[m].as_ref());
        let reason = left_out(&textures[face.texture]).or_else(|| standing.and_then(|s| s.reason));
        b.face(i, &face, standing.map_or(DVec3::ZERO, |s| s.offset), reason)?;
    }
    let notes = b.notes();
    Ok((b.mesh, notes))
}

impl Builder<'_> {
    fn face(
        &mut self,
        index: usize,
        face: &FaceRecord,
        offset: DVec3,
        reason: Option<&'static str>,
    ) -> Result<(), MapError> {
        let vertices: Result<Vec<VertexRecord>, MapError> =
            (face.first_vertex..face.first_vertex + face.vertices).map(|v| self.lumps.vertex(v)).collect();
        let vertices = vertices?;
        match face.kind {
            POLYGON | MESH => {
                if !face.meshverts.is_multiple_of(3) {
                    let n = face.meshverts;
                    return Err(MapError(format!("faces[{index}]: {n} meshverts are no whole number of triangles")));
                }
                let corners: Vec<i32> = (face.first_meshvert..face.first_meshvert + face.meshverts)
                    .map(|m| self.lumps.meshvert(m))
                    .collect();
                let bad = corners.iter().find(|c| usize::try_from(**c).map_or(true, |c| c >= vertices.len()));
                if let Some(c) = bad {
                    let n = vertices.len();
                    return Err(MapError(format!("faces[{index}]: a corner is vertex {c} of its {n}")));
                }
                let triangles: Vec<[usize; 3]> =
                    corners.chunks_exact(3).map(|t| [t[0], t[1], t[2]].map(|c| c as usize)).collect();
                self.add(&vertices, &triangles, face, offset, reason, face.kind == MESH);
            }
            PATCH => {
                let grid = patch::tessellate(&vertices, face.size, index)?;
                let triangles: Vec<[usize; 3]> = grid.triangles().collect();
                self.add(&grid.points, &triangles, face, offset, reason, true);
            }
            BILLBOARD => self.billboards += 1,
            other => return Err(MapError(format!("faces[{index}]: kind {other}; there are 1 to 4"))),
        }
        Ok(())
    }

    fn add(
        &mut self,
        vertices: &[VertexRecord],
        triangles: &[[usize; 3]],
        face: &FaceRecord,
        offset: DVec3,
        reason: Option<&'static str>,
        smooth: bool,
    ) {
        self.triangles_in += triangles.len() as u64;
        if let Some(reason) = reason {
            *self.out.entry(reason).or_default() += triangles.len() as u64;
            return;
        }
        let m = &mut self.mesh;
        let (p, n, t) = (m.positions.len() as u32, m.normals.len() as u32, m.uvs.len() as u32);
        m.positions.extend(vertices.iter().map(|v| turned(v.position) / UNITS_PER_METRE + offset));
        // Down the picture in the game, up in ours.
        m.uvs.extend(vertices.iter().map(|v| DVec2::new(v.uv.x, -v.uv.y)));
        if smooth {
            m.normals.extend(vertices.iter().map(|v| turned(v.normal)));
        }
        for corners in triangles {
            let [a, b, c] = corners.map(|i| turned(vertices[i].position));
            let outward = corners.iter().map(|&i| turned(vertices[i].normal)).sum::<DVec3>();
            // Fronts run clockwise in the game; the normals have the last word.
            let turn = (b - a).cross(c - a).dot(outward) < 0.0 || outward == DVec3::ZERO;
            let order = if turn { [0, 2, 1] } else { [0, 1, 2] };
            let at = |first: u32| order.map(|k: usize| first + corners[k] as u32);
            m.triangles.push(at(p));
            m.corner_uvs.push(at(t));
            let normals = smooth && corners.iter().all(|&i| vertices[i].normal.length_squared() > 1e-12);
            m.corner_normals.push(if normals { at(n) } else { [NONE; 3] });
            m.materials.push(face.texture as u32);
        }
    }

    /// What came in and what was left out.
    fn notes(&self) -> Vec<String> {
        let kept = self.mesh.triangles.len();
        let mut line = format!("{} triangles in the map, {kept} of them read", self.triangles_in);
        let reasons: Vec<String> = self.out.iter().map(|(why, n)| format!("{n} {why}")).collect();
        if !reasons.is_empty() {
            line += &format!("; left out: {}", reasons.join(", "));
        }
        if self.billboards > 0 {
            line += &format!("; {} billboards, which have no triangles, left out too", self.billboards);
        }
        vec![line]
    }
}
