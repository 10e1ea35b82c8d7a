//! A small map, written by the tests: a room with a patch, a mesh, a billboard, sky, a door and a trigger.

use std::io::Write;

/// A map as lists, which a test may damage before it is written.
#[derive(Clone)]
pub(crate) struct TestMap {
    pub(crate) entities: String,
    /// Name, flags, contents.
    pub(crate) textures: Vec<(&'static str, i32, i32)>,
    pub(crate) planes: Vec<[f32; 4]>,
    /// Plane and children.
    pub(crate) nodes: Vec<[i32; 3]>,
    pub(crate) clusters: Vec<i32>,
    /// First face and number of faces.
    pub(crate) models: Vec<[i32; 2]>,
    /// Position, texture coordinates, normal.
    pub(crate) vertexes: Vec<[f32; 8]>,
    pub(crate) meshverts: Vec<i32>,
    pub(crate) faces: Vec<Face>,
    pub(crate) visdata: Vec<u8>,
}

#[derive(Clone, Copy)]
pub(crate) struct Face {
    pub(crate) texture: i32,
    pub(crate) kind: i32,
    pub(crate) vertexes: [i32; 2],
    pub(crate) meshverts: [i32; 2],
    pub(crate) size: [i32; 2],
}

/// Half the room's width, and its height, in units of the game.
const HALF: f32 = 128.0;
const HIGH: f32 = 128.0;

impl TestMap {
    fn empty() -> Self {
        Self {
            entities: String::new(),
            textures: Vec::new(),
            planes: vec![[1.0, 0.0, 0.0, 0.0], [0.0, 1.0, 0.0, 0.0]],
            // East of x = 0 leaf 1; west of it north of y = 0 leaf 2, south leaf 3. Leaf 0 is outside.
            nodes: vec![[0, -2, 1], [1, -3, -4]],
            clusters: vec![-1, 0, 1, 2],
            models: Vec::new(),
            vertexes: Vec::new(),
            meshverts: Vec::new(),
            faces: Vec::new(),
            // Clusters 0 and 1 see each other and themselves, 2 itself alone.
            visdata: [&3i32.to_le_bytes()[..], &1i32.to_le_bytes(), &[0b011, 0b011, 0b100]].concat(),
        }
    }

    /// The room: six walls of two triangles (floor, four walls, a ceiling of sky), a patch of 3×3, a mesh of one triangle,
    /// a billboard, a caulked wall; models 1 (a door, moved up) and 2 (a trigger) of two triangles each.
    pub(crate) fn room() -> Self {
        let mut m = Self::empty();
        m.textures = vec![
            ("textures/test/wall", 0, 1),
            ("textures/skies/test", 0x4, 1),
            ("textures/common/caulk", 0x80, 1),
            ("textures/test/painted", 0, 1),
        ];
        m.entities = concat!(
            "{\n\"classname\" \"worldspawn\"\n}\n",
            "{\n\"classname\" \"info_player_deathmatch\"\n\"origin\" \"-64 -64 24\"\n\"angle\" \"90\"\n}\n",
            "{\n\"classname\" \"light\"\n\"origin\" \"0 0 96\"\n\"light\" \"200\"\n\"_color\" \"1 0.5 0.25\"\n}\n",
            "{\n\"classname\" \"light\"\n\"origin\" \"64 0 96\"\n\"target\" \"spot\"\n}\n",
            "{\n\"classname\" \"info_null\"\n\"origin\" \"64 0 0\"\n\"targetname\" \"spot\"\n}\n",
            "{\n\"classname\" \"func_door\"\n\"model\" \"*1\"\n\"origin\" \"0 0 32\"\n}\n",
            "{\n\"classname\" \"trigger_hurt\"\n\"model\" \"*2\"\n}\n",
        )
        .into();
        let (h, z) = (HALF, HIGH);
        m.quad(0, [[-h, -h, 0.0], [h, -h, 0.0], [h, h, 0.0], [-h, h, 0.0]], [0.0, 0.0, 1.0]);
        m.quad(0, [[-h, -h, 0.0], [-h, -h, z], [h, -h, z], [h, -h, 0.0]], [0.0, 1.0, 0.0]);
        m.quad(0, [[-h, h, 0.0], [h, h, 0.0], [h, h, z], [-h, h, z]], [0.0, -1.0, 0.0]);
        m.quad(3, [[-h, -h, 0.0], [-h, h, 0.0], [-h, h, z], [-h, -h, z]], [1.0, 0.0, 0.0]);
        m.quad(0, [[h, -h, 0.0], [h, -h, z], [h, h, z], [h, h, 0.0]], [-1.0, 0.0, 0.0]);
        m.quad(1, [[-h, -h, z], [-h, h, z], [h, h, z], [h, -h, z]], [0.0, 0.0, -1.0]);
        let first = m.vertexes.len() as i32;
        for i in 0..9 {
            let (s, t) = ((i % 3) as f32, (i / 3) as f32);
            let bulge = if i == 4 { 32.0 } else { 0.0 };
            m.vertexes.push([32.0 * s, 32.0 * t, 8.0 + bulge, s, t, 0.0, 0.0, 1.0]);
        }
        m.faces.push(Face { texture: 0, kind: 2, vertexes: [first, 9], meshverts: [0, 0], size: [3, 3] });
        m.polygon(0, 3, &[[-80.0, 60.0, 10.0], [-40.0, 60.0, 10.0], [-60.0, 100.0, 10.0]], [0.0, 0.0, 1.0]);
        m.faces.push(Face { texture: 0, kind: 4, vertexes: [0, 1], meshverts: [0, 0], size: [0, 0] });
        m.quad(2, [[0.0, -h, 0.0], [0.0, h, 0.0], [0.0, h, z], [0.0, -h, z]], [1.0, 0.0, 0.0]);
        m.models.push([0, m.faces.len() as i32]);
        for model in 0..2 {
            let x = -100.0 + 20.0 * model as f32;
            m.models.push([m.faces.len() as i32, 1]);
            m.quad(0, [[x, -9.0, 0.0], [x, 9.0, 0.0], [x, 9.0, 40.0], [x, -9.0, 40.0]], [1.0, 0.0, 0.0]);
        }
        m
    }

    fn quad(&mut self, texture: i32, corners: [[f32; 3]; 4], normal: [f32; 3]) {
        self.polygon(texture, 1, &corners, normal);
    }

    fn polygon(&mut self, texture: i32, kind: i32, corners: &[[f32; 3]], normal: [f32; 3]) {
        let (first, n) = (self.vertexes.len() as i32, corners.len() as i32);
        let [nx, ny, nz] = normal;
        for (i, [x, y, z]) in corners.iter().enumerate() {
            self.vertexes.push([*x, *y, *z, (i % 2) as f32, (i / 2) as f32, nx, ny, nz]);
        }
        let meshverts = [self.meshverts.len() as i32, 3 * (n - 2)];
        for i in 1..n - 1 {
            // Clockwise from the front, if the corners are counter-clockwise: either way the normals decide.
            self.meshverts.extend([0, i + 1, i]);
        }
        self.faces.push(Face { texture, kind, vertexes: [first, n], meshverts, size: [0, 0] });
    }

    /// The lumps in their order.
    pub(crate) fn lumps(&self) -> Vec<Vec<u8>> {
        let ints = |v: &[i32]| v.iter().flat_map(|x| x.to_le_bytes()).collect::<Vec<u8>>();
        let floats = |v: &[f32]| v.iter().flat_map(|x| x.to_le_bytes()).collect::<Vec<u8>>();
        let mut lumps = vec![Vec::new(); 17];
        lumps[0] = self.entities.clone().into_bytes();
        for (name, flags, contents) in &self.textures {
            let mut record = name.as_bytes().to_vec();
            record.resize(64, 0);
            lumps[1].extend(record);
            lumps[1].extend(ints(&[*flags, *contents]));
        }
        lumps[2] = floats(&self.planes.concat());
        for [plane, front, back] in &self.nodes {
            lumps[3].extend(ints(&[*plane, *front, *back, 0, 0, 0, 0, 0, 0]));
        }
        for cluster in &self.clusters {
            lumps[4].extend(ints(&[*cluster, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0]));
        }
        for [first, count] in &self.models {
            lumps[7].extend(floats(&[0.0; 6]));
            lumps[7].extend(ints(&[*first, *count, 0, 0]));
        }
        for [x, y, z, u, v, nx, ny, nz] in &self.vertexes {
            lumps[10].extend(floats(&[*x, *y, *z, *u, *v, 0.0, 0.0, *nx, *ny, *nz]));
            lumps[10].extend([255; 4]);
        }
        lumps[11] = ints(&self.meshverts);
        for f in &self.faces {
            lumps[13].extend(ints(&[
                f.texture,
                -1,
                f.kind,
                f.vertexes[0],
                f.vertexes[1],
                f.meshverts[0],
                f.meshverts[1],
            ]));
            lumps[13].extend(ints(&[0; 17]));
            lumps[13].extend(ints(&f.size));
        }
        lumps[16].clone_from(&self.visdata);
        lumps
    }

    /// The file.
    pub(crate) fn bytes(&self) -> Vec<u8> {
        file(&self.lumps())
    }
}

/// A file of these lumps.
pub(crate) fn file(lumps: &[Vec<u8>]) -> Vec<u8> {
    let mut out = b"IBSP".to_vec();
    out.extend(46i32.to_le_bytes());
    let mut at = 8 + 8 * lumps.len();
    for l in lumps {
        out.extend((at as i32).to_le_bytes());
        out.extend((l.len() as i32).to_le_bytes());
        at += l.len();
    }
    out.extend(lumps.concat());
    out
}

/// An archive of these files, each packed or as it is.
pub(crate) fn archive(files: &[(&str, &[u8], bool)]) -> Vec<u8> {
    let mut zip = zip::ZipWriter::new(std::io::Cursor::new(Vec::new()));
    for (name, bytes, packed) in files {
        let how = if *packed { zip::CompressionMethod::Deflated } else { zip::CompressionMethod::Stored };
        let options = zip::write::SimpleFileOptions::default().compression_method(how);
        zip.start_file(*name, options).expect("a file");
        zip.write_all(bytes).expect("written");
    }
    zip.finish().expect("an archive").into_inner()
}
