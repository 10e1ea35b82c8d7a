//! OBJ and MTL through `tobj`: triangulated, in f64, with normals computed where they are missing.

use crate::math::frame::unit;
use crate::scene::geometry::NONE;
use crate::scene::load::MAX_LENGTH;
use crate::scene::scene_file::MaterialFile;
use crate::scene::shapes::Mesh;
use glam::{DVec2, DVec3};
use std::collections::HashMap;
use std::path::Path;

/// An OBJ file's surfaces and materials.
pub struct ObjFile {
    /// All triangles; `materials` index into the list beside it.
    pub mesh: Mesh,
    /// Materials by name, as the scene format writes them.
    pub materials: Vec<(String, MaterialFile)>,
    /// Text of the material files, for the scene's hash.
    pub material_text: String,
    /// What was odd, one line each.
    pub warnings: Vec<String>,
}

/// What is wrong with an OBJ file, on which line (0 if none can be named).
pub struct ObjError {
    /// Line from 1, or 0.
    pub line: usize,
    /// What and what to do.
    pub what: String,
}

/// Edges that bend by more than this stay sharp where normals are missing, degrees.
pub const CREASE_ANGLE: f64 = 30.0;

/// Faces around one vertex beyond which each keeps its own normal: grouping them is quadratic in their number.
const MAX_FAN: usize = 256;

/// Reads an OBJ from its text; `path` names it in warnings, and `read` gives the text of a material file by its name,
/// or None if there is no such file.
///
/// # Errors
/// A line with a number that is none or not finite, an index out of range, or anything `tobj` refuses.
pub fn read(
    path: &Path,
    text: &str,
    crease_angle: f64,
    read: &dyn Fn(&Path) -> Option<String>,
) -> Result<ObjFile, ObjError> {
    let text = &without_comments(text);
    check_lines(text)?;
    let whole = |what: String| ObjError { line: 0, what };
    let options = tobj::LoadOptions { triangulate: true, ignore_points: true, ignore_lines: true, single_index: false };
    let bad_material = std::cell::RefCell::new(None);
    let material_text = std::cell::RefCell::new(String::new());
    let (models, materials) = tobj::load_obj_buf(&mut text.as_bytes(), &options, |name| {
        let read = without_comments(&read(name).ok_or(tobj::LoadError::OpenFileFailed)?);
        material_text.borrow_mut().push_str(&read);
        check_materials(&read).map_err(|line| {
            bad_material.borrow_mut().get_or_insert((name.to_owned(), line));
            tobj::LoadError::MaterialParseError
        })?;
        tobj::load_mtl_buf(&mut read.as_bytes())
    })
    .map_err(|e| whole(format!("cannot be read as OBJ: {e}")))?;

    if let Some((file, line)) = bad_material.into_inner() {
        return Err(whole(format!("{}:{line}: wants finite numbers; is the file cut off?", file.display())));
    }
    let mut warnings = Vec::new();
    let materials = materials.unwrap_or_else(|e| {
        warnings.push(format!("{}: its material file: {e}", path.display()));
        Vec::new()
    });
    let mut mesh = Mesh::default();
    for model in &models {
        append(&mut mesh, &model.mesh);
    }
    if mesh.triangles.is_empty() {
        warnings.push(format!("{}: no faces", path.display()));
    }
    add_missing_normals(&mut mesh, crease_angle);
    Ok(ObjFile {
        mesh,
        materials: materials.iter().map(|m| (m.name.clone(), material_of(m))).collect(),
        material_text: material_text.into_inner(),
        warnings,
    })
}

/// Triangles that the faces of an OBJ make, and its vertices or the corners of smooth faces, the more numerous of the two;
/// for the memory that they need. It looks at words alone, so it may count more than there are.
pub fn count(text: &str) -> (u64, u64) {
    let (mut triangles, mut vertices) = (0u64, 0u64);
    for line in text.lines() {
        let mut words = line.split_whitespace();
        match words.next() {
            Some("v" | "vn" | "vt") => vertices += 1,
            Some("f") => triangles += (words.count() as u64).saturating_sub(2),
            _ => {}
        }
    }
    (triangles, vertices.max(3 * triangles))
}

/// The text with all from `#` on cut off each line; lines keep their numbers.
fn without_comments(text: &str) -> String {
    text.lines().map(|l| l.split('#').next().unwrap_or("")).flat_map(|l| [l, "\n"]).collect()
}

/// Line (from 1) of a material file whose numbers are missing or not finite.
fn check_materials(text: &str) -> Result<(), usize> {
    for (index, line) in text.lines().enumerate() {
        let mut words = line.split_whitespace();
        let wanted = match words.next() {
            Some("Ka" | "Kd" | "Ks" | "Ke" | "Tf") => 3,
            Some("Ns" | "Ni" | "d" | "Tr" | "illum") => 1,
            Some("newmtl" | "map_Kd" | "map_Ka" | "map_Ks" | "map_Ns" | "map_d" | "map_Bump" | "bump") => {
                if words.next().is_none() {
                    return Err(index + 1);
                }
                continue;
            }
            _ => continue,
        };
        let numbers = words.take(wanted).filter(|w| w.parse::<f64>().is_ok_and(f64::is_finite)).count();
        if numbers < wanted {
            return Err(index + 1);
        }
    }
    Ok(())
}

/// Finds the first line whose numbers are no numbers, or whose indices point nowhere.
fn check_lines(text: &str) -> Result<(), ObjError> {
    let mut counts: HashMap<&str, i64> = HashMap::new();
    for (index, line) in text.lines().enumerate() {
        let wrong = |what: String| Err(ObjError { line: index + 1, what });
        let mut words = line.split_whitespace();
        match words.next() {
            Some(kind @ ("v" | "vn" | "vt")) => {
                let mut numbers = Vec::new();
                for word in words {
                    match word.parse::<f64>() {
                        Ok(x) if x.abs() <= MAX_LENGTH => numbers.push(x),
                        _ => {
                            let most = format!("finite numbers, {MAX_LENGTH:e} at most");
                            return wrong(format!("`{kind}` wants {most}, got `{word}`"));
                        }
                    }
                }
                let count = numbers.len();
                if count < if kind == "vt" { 1 } else { 3 } {
                    return wrong(format!("`{kind}` has {count} numbers, too few; is the file cut off?"));
                }
                if kind == "v" {
                    if !matches!(count, 3 | 4 | 6) {
                        return wrong(format!("`v` has {count} numbers; give 3, or 4 with w, or 6 with a colour"));
                    }
                    // The fourth number divides the others.
                    let w = if count == 4 { numbers[3] } else { 1.0 };
                    if !numbers[..3].iter().all(|x| (x / w).abs() <= MAX_LENGTH) {
                        return wrong(format!("divided by w = {w:e}, `v` must be {MAX_LENGTH:e} at most; leave w out"));
                    }
                }
                *counts.entry(kind).or_default() += 1;
            }
            Some("f") => {
                let mut corners = 0;
                for word in words {
                    corners += 1;
                    for (part, kind) in word.split('/').zip(["v", "vt", "vn"]) {
                        if part.is_empty() && kind == "vt" {
                            continue;
                        }
                        let count = counts.get(kind).copied().unwrap_or(0);
                        match part.parse::<i64>() {
                            Ok(i) if (1..=count).contains(&i) || (-count..0).contains(&i) => {}
                            Ok(i) => {
                                return wrong(format!("index {i} of `{kind}`, of which there are {count}"));
                            }
                            Err(_) => return wrong(format!("`{word}` is no face corner")),
                        }
                    }
                }
                if corners < 3 {
                    return wrong(format!("a face of {corners} corners; is the file cut off?"));
                }
            }
            _ => {}
        }
    }
    Ok(())
}

fn append(mesh: &mut Mesh, part: &tobj::Mesh) {
    let triples = |v: &[f64]| -> Vec<DVec3> { v.chunks_exact(3).map(|c| DVec3::new(c[0], c[1], c[2])).collect() };
    let (p0, n0, t0) = (mesh.positions.len() as u32, mesh.normals.len() as u32, mesh.uvs.len() as u32);
    mesh.positions.extend(triples(&part.positions));
    mesh.normals.extend(triples(&part.normals));
    mesh.uvs.extend(part.texcoords.chunks_exact(2).map(|c| DVec2::new(c[0], c[1])));
    let material = part.material_id.map_or(NONE, |m| m as u32);
    let corner = |indices: &[u32], base: u32, at: usize| -> [u32; 3] {
        match indices.get(at..at + 3) {
            Some(i) if indices.len() == part.indices.len() => [i[0] + base, i[1] + base, i[2] + base],
            _ => [NONE; 3],
        }
    };
    for at in (0..part.indices.len() / 3 * 3).step_by(3) {
        mesh.triangles.push(corner(&part.indices, p0, at));
        let mut normals = corner(&part.normal_indices, n0, at);
        if normals.iter().any(|&n| n == NONE || mesh.normals[n as usize] == DVec3::ZERO) {
            normals = [NONE; 3];
        }
        mesh.corner_normals.push(normals);
        mesh.corner_uvs.push(corner(&part.texcoord_indices, t0, at));
        mesh.materials.push(material);
    }
}

/// Gives corners without a normal the mean over the faces around their vertex that bend by less than the crease
/// angle, weighted by the angle at the corner. Faces that turn out flat keep no normals.
fn add_missing_normals(mesh: &mut Mesh, crease_angle: f64) {
    let missing: Vec<usize> = (0..mesh.triangles.len()).filter(|&t| mesh.corner_normals[t][0] == NONE).collect();
    if missing.is_empty() || crease_angle <= 0.0 {
        return;
    }
    let key = |p: DVec3| [p.x + 0.0, p.y + 0.0, p.z + 0.0].map(f64::to_bits);
    let mut fans: HashMap<[u64; 3], Vec<(u32, f64)>> = HashMap::new();
    let mut face = vec![DVec3::ZERO; mesh.triangles.len()];
    for &t in &missing {
        let p = mesh.triangles[t].map(|i| mesh.positions[i as usize]);
        face[t] = unit((p[1] - p[0]).cross(p[2] - p[0])).unwrap_or(DVec3::ZERO);
        for c in 0..3 {
            let (a, b) = (p[(c + 1) % 3] - p[c], p[(c + 2) % 3] - p[c]);
            let cos = (a.dot(b) / (a.length() * b.length())).clamp(-1.0, 1.0);
            let angle = if cos.is_finite() { libm::acos(cos) } else { 0.0 };
            fans.entry(key(p[c])).or_default().push((t as u32, angle));
        }
    }
    let cos_crease = libm::cos(crease_angle.to_radians());
    for &t in &missing {
        let own = face[t];
        let mut corners = [own; 3];
        for (c, normal) in corners.iter_mut().enumerate() {
            let fan = &fans[&key(mesh.positions[mesh.triangles[t][c] as usize])];
            if fan.len() > MAX_FAN {
                continue;
            }
            let sum: DVec3 = fan
                .iter()
                .filter(|(other, _)| face[*other as usize].dot(own) >= cos_crease)
                .map(|(other, angle)| face[*other as usize] * *angle)
                .sum();
            *normal = unit(sum).unwrap_or(own);
        }
        if corners.iter().any(|n| n.dot(own) < 1.0 - 1e-12) {
            let base = mesh.normals.len() as u32;
            mesh.normals.extend(corners);
            mesh.corner_normals[t] = [base, base + 1, base + 2];
        }
    }
}

/// Illumination models of the MTL format as our kinds: 3 and 8 mirror, 5 metal, 4, 6, 7 and 9 (or `d` below 1)
/// dielectric, `Ke` emissive, all else diffuse.
fn material_of(m: &tobj::Material) -> MaterialFile {
    let emission = m.emissive.unwrap_or([0.0; 3]);
    let kind = match m.illumination_model {
        _ if emission.iter().any(|&e| e > 0.0) => "emissive",
        Some(3 | 8) => "mirror",
        Some(5) => "metal",
        Some(4 | 6 | 7 | 9) => "dielectric",
        _ if m.dissolve.is_some_and(|d| d < 1.0) => "dielectric",
        _ => "diffuse",
    };
    let mut file = MaterialFile { kind: kind.into(), ..Default::default() };
    match kind {
        "emissive" => file.radiance = Some(emission),
        "mirror" | "metal" => file.reflectance = Some(m.specular.unwrap_or([1.0; 3])),
        "dielectric" => file.ior = Some(m.optical_density.unwrap_or(1.5).max(1.0)),
        _ => {
            file.reflectance = Some(m.diffuse.unwrap_or([0.8; 3]));
            file.texture.clone_from(&m.diffuse_texture);
        }
    }
    file
}

#[cfg(test)]
mod tests {
    use super::*;

    fn read_text(text: &str) -> Result<ObjFile, ObjError> {
        read(Path::new("t.obj"), text, CREASE_ANGLE, &|_| None)
    }

    #[test]
    fn polygons_are_triangulated() {
        let text = "v 0 0 0\nv 1 0 0\nv 1 1 0\nv 0 1 0\nf 1 2 3 4\n";
        let obj = read_text(text).map_err(|e| e.what).expect("reads");
        assert_eq!(obj.mesh.triangles.len(), 2);
    }

    #[test]
    fn creases_stay_sharp_and_shallow_edges_become_smooth() {
        // Two faces that share an edge, bent by 90° and by about 11°.
        for (z, smooth) in [(1.0, false), (0.1, true)] {
            let (x, z) = if smooth { (1.5, z) } else { (1.0, z) };
            let text = format!("v 0 0 0\nv 1 0 0\nv 1 1 0\nv {x} 0 {z}\nf 1 2 3\nf 2 4 3\n");
            let obj = read_text(&text).map_err(|e| e.what).expect("reads");
            assert_eq!(obj.mesh.corner_normals[0][0] != NONE, smooth, "{z}");
        }
    }

    #[test]
    fn broken_material_files_are_named() {
        let obj = "mtllib m.mtl\nv 0 0 0 # origin\nv 1 0 0\nv 0 1 0\nf 1 2 3\n";
        for (mtl, line) in
            [("newmtl q\nKd 0.5 0.5\n", 2), ("newmtl q\nKe 1 1", 2), ("newmtl\n", 1), ("newmtl q\nNi nan\n", 2)]
        {
            let files = |name: &Path| (name == Path::new("m.mtl")).then(|| mtl.to_owned());
            let error = read(Path::new("t.obj"), obj, CREASE_ANGLE, &files).err().expect(mtl);
            assert!(error.what.starts_with(&format!("m.mtl:{line}: ")), "{}", error.what);
        }
    }

    #[test]
    fn bad_lines_are_named() {
        for (text, line) in [
            ("v 0 0 0\nv 1 nan 0\n", 2),
            ("v 0 0 0\nv 1 0 0\nv 0 1 0\n\nf 1 2 4\n", 5),
            ("v 0 0\n", 1),
            ("v 1 1 1 0\n", 1),
            ("v 0 0 0 1\nv 1 1 1 5e-324\n", 2),
            ("v 0 0 0 1 1\n", 1),
            ("v 0 0 1e16\n", 1),
            ("v 0 0 0\nf 1 1\n", 2),
            ("v 0 0 0\nf a b c\n", 2),
        ] {
            assert_eq!(read_text(text).err().expect(text).line, line, "{text}");
        }
    }
}
