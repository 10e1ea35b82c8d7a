//! Maps: what is read, and one clear line for everything that is damaged.

use super::test_map::{Face, TestMap, archive, file};
use super::*;
use crate::math::sequence::{Sampling, Sequence};
use crate::scene::scene_file::SceneFile;
use crate::scene::source::Source;
use crate::scene::{Light, Material, Scene};
use crate::trace::{Intersector, Ray, Surface};
use glam::Vec3;
use proptest::prelude::*;
use std::sync::Arc;

fn written(name: &str, bytes: &[u8]) -> (tempfile::TempDir, String) {
    let folder = tempfile::tempdir().expect("a folder");
    let path = folder.path().join(name);
    std::fs::create_dir_all(path.parent().expect("a parent")).expect("folders");
    std::fs::write(&path, bytes).expect("written");
    let text = path.to_str().expect("a plain path").to_owned();
    (folder, text)
}

fn opened(name: &str, bytes: &[u8]) -> Scene {
    let (_folder, path) = written(name, bytes);
    crate::scene::open(&path).expect("opens")
}

fn error(bytes: &[u8]) -> String {
    let text = read(bytes).map(|_| ()).expect_err("damaged").0;
    assert!(!text.contains('\n'), "{text}");
    text
}

/// A room: counts, units, axes, fronts inside, lights, viewpoint.
#[test]
fn a_room_is_read_as_it_stands() {
    let scene = opened("room.bsp", &TestMap::room().bytes());
    let g = &scene.geometry;
    // Five walls and a floor of two triangles less the sky, a patch of 32, a mesh of one, a door of two.
    assert_eq!(g.triangles.len(), 10 + 32 + 1 + 2);
    let told = &scene.warnings[0];
    assert!(told.contains("51 triangles in the map, 45 of them read"), "{told}");
    assert!(told.contains("2 not drawn, 2 sky, 2 trigger; 1 billboards"), "{told}");
    assert!(scene.warnings.iter().any(|w| w.contains("textures have no image here")));
    // 256 units are 8 metres.
    let (low, high) = g.positions.iter().fold((Vec3::INFINITY, Vec3::NEG_INFINITY), |(l, h), p| (l.min(*p), h.max(*p)));
    assert!((high - low - Vec3::new(8.0, 4.0, 8.0)).length() < 1e-5, "{low} {high}");
    // From the middle every ray down or to the side meets the front of a wall.
    let intersector = Intersector::new(g, scene.radius);
    let numbers = Sequence::new(Sampling::Random, 3);
    let middle = (DVec3::new(0.5, 2.5, 0.5) - scene.origin).as_vec3();
    let mut met = 0;
    for i in 0..500 {
        let x = numbers.four(i, 0);
        let direction = crate::math::frame::uniform_sphere(x[0], x[1]).normalize();
        let ray = Ray { origin: middle, direction };
        if let Some(hit) = intersector.closest(&ray) {
            let front = Surface::new(&scene, &ray, &hit).front;
            // The door stands free, and is seen from both sides.
            met += usize::from(front);
            assert!(front || hit.primitive as usize >= g.triangles.len() - 2);
        } else {
            assert!(direction.y > 0.0, "only the sky is open");
        }
    }
    assert!(met > 300, "{met}");
    // The player starts at (-64, -64, 24) and looks north, which is -z.
    let eye = scene.camera.position.as_dvec3() + scene.origin;
    assert!((eye - DVec3::new(-2.0, 50.0 / 32.0, 2.0)).length() < 1e-5, "{eye}");
    assert!((scene.camera.frame[2] - Vec3::NEG_Z).length() < 1e-6);
    assert_eq!((scene.viewpoints.len(), scene.lights.len()), (1, 2));
    match scene.lights[0] {
        Light::Point { position, power } => {
            assert!((position.as_dvec3() + scene.origin - DVec3::new(0.0, 3.0, 0.0)).length() < 1e-5);
            assert!((power.x / 226.8 - 1.0).abs() < 0.01 && power.y == power.x / 2.0, "{power}");
        }
        _ => panic!("a point light"),
    }
    assert!(matches!(scene.lights[1], Light::Spot { direction, .. } if (direction - Vec3::NEG_Y).length() < 1e-6));
}

/// Cells against a walk by hand, and which sees which.
#[test]
fn places_are_in_their_cells() {
    let scene = opened("room.bsp", &TestMap::room().bytes());
    let cells = scene.cells.as_ref().expect("a map has cells");
    assert_eq!(cells.cluster_count(), 3);
    let numbers = Sequence::new(Sampling::Random, 4);
    for i in 0..300 {
        let x = numbers.four(i, 0);
        let local = Vec3::new(x[0], x[1], x[2]) * 6.0 - 3.0;
        let p = local.as_dvec3() + scene.origin;
        // East is x; north is -z.
        let expected = if p.x >= 0.0 {
            0
        } else if -p.z >= 0.0 {
            1
        } else {
            2
        };
        assert_eq!(cells.cluster(local), Some(expected), "{p}");
    }
    let sees: Vec<bool> = (0..9).map(|i| cells.sees(i / 3, i % 3)).collect();
    assert_eq!(sees, [true, true, false, true, true, false, false, false, true]);
    let blind = TestMap { visdata: Vec::new(), ..TestMap::room() };
    let scene = opened("room.bsp", &blind.bytes());
    assert!(scene.cells.expect("cells").sees(0, 2) && scene.warnings.iter().any(|w| w.contains("tells no visibility")));
}

#[test]
fn archives_hold_maps_and_images() {
    let map = TestMap::room().bytes();
    let mut png = Vec::new();
    let pixels = image::RgbImage::from_pixel(2, 2, image::Rgb([255, 0, 0]));
    image::DynamicImage::from(pixels.clone())
        .write_to(&mut std::io::Cursor::new(&mut png), image::ImageFormat::Png)
        .expect("a PNG");
    let mut tga = Vec::new();
    image::DynamicImage::from(pixels)
        .write_to(&mut std::io::Cursor::new(&mut tga), image::ImageFormat::Tga)
        .expect("a TGA");
    for (ending, bytes, packed) in [("png", &png, true), ("TGA", &tga, false)] {
        let name = format!("textures/test/Painted.{ending}");
        let one = archive(&[("maps/Room.bsp", &map, packed), (&name, bytes, true)]);
        let scene = opened("one.pk3", &one);
        assert_eq!((scene.geometry.triangles.len(), scene.name.as_str()), (45, "one"));
        let painted = scene.material_names.iter().position(|n| n == "textures/test/painted").expect("there");
        assert!(matches!(scene.materials[painted], Material::Diffuse { texture: Some(_), .. }));
        assert_eq!(scene.materials[painted].average_reflectance(), Vec3::X);
    }
    let two = archive(&[("maps/a.bsp", &map, true), ("maps/b.bsp", &map, false), ("readme.txt", b"x", true)]);
    let (_folder, path) = written("two.pk3", &two);
    let open = |name: &str| crate::scene::open(name).map(|s| s.name).map_err(|e| e.to_string());
    assert_eq!(open(&format!("{path}:b")), Ok("b".into()));
    assert_eq!(open(&format!("{path}:maps/A.bsp")), Ok("A".into()));
    let error = open(&path).expect_err("two maps");
    assert!(error.contains("several maps; name one, as in FILE.pk3:a; there are a, b"), "{error}");
    assert!(open(&format!("{path}:c")).expect_err("none").contains("no map `c` in the archive; there are a, b"));
    let (_folder, path) = written("none.pk3", &archive(&[("x", b"y", true)]));
    assert!(open(&path).expect_err("none").contains("holds no map"));
}

/// An archive that unpacks to more than a map may have, and one that lies about it.
#[test]
fn bombs_do_not_go_off() {
    let zeros = vec![0u8; (256 << 20) + 1];
    let bomb = archive(&[("maps/bomb.bsp", &zeros, true)]);
    assert!(bomb.len() < 2 << 20);
    let error = pk3::Archive::new(bomb).expect("an archive").map(None).expect_err("a bomb").0;
    assert!(error.contains("268 MB unpacked, 268 MB at most; is it a bomb?"), "{error}");
    // The size is in the archive's directory: 100 of 5000 bytes.
    let honest = archive(&[("maps/liar.bsp", &[7; 5000], true)]);
    let mut liar = honest.clone();
    for at in 0..liar.len() - 4 {
        if liar[at..at + 4] == 5000u32.to_le_bytes() {
            liar[at..at + 4].copy_from_slice(&100u32.to_le_bytes());
        }
    }
    assert_ne!(liar, honest);
    let error = pk3::Archive::new(liar).expect("an archive").map(None).expect_err("a lie").0;
    assert!(error.contains("maps/liar.bsp"), "{error}");
}

#[test]
fn damage_is_told_in_one_line() {
    let room = TestMap::room();
    let bytes = room.bytes();
    assert!(error(b"PK").contains("does not start with IBSP"));
    assert!(error(&[b"VBSP", &bytes[4..]].concat()).contains("does not start with IBSP"));
    assert!(error(&[b"IBSP\x2f\0\0\0", &bytes[8..]].concat()).contains("version 47; version 46"));
    assert!(error(&bytes[..40]).contains("the header has 144 bytes, the file 40"));
    assert!(error(&bytes[..bytes.len() - 1]).contains("lump visdata: ends at byte"));
    let with = |at: usize, value: i32| {
        let mut b = bytes.clone();
        b[at..at + 4].copy_from_slice(&value.to_le_bytes());
        error(&b)
    };
    assert!(with(8 + 8 * 13, -4).contains("lump faces: its place -4"));
    assert!(with(12 + 8 * 10, 1 << 30).contains("lump vertexes: ends at byte"));
    assert!(with(12 + 8 * 2, 17).contains("lump planes: 17 bytes are no whole number of records of 16"));
    let textures_at = i32::from_le_bytes(bytes[16..20].try_into().expect("four bytes"));
    assert!(with(8 + 8 * 2, textures_at).contains("overlap at byte"));
    assert!(with(8, 4).contains("lies in the header"));
    let face = |change: fn(&mut Face)| {
        let mut m = room.clone();
        change(&mut m.faces[0]);
        error(&m.bytes())
    };
    assert!(face(|f| f.texture = 9).contains("faces[0]: texture 9 is not among the 4"));
    assert!(face(|f| f.vertexes = [0, 4000]).contains("faces[0]: its vertexes 0 to 4000"));
    assert!(face(|f| f.vertexes = [-1, 2]).contains("faces[0]: its vertexes -1 to 1"));
    assert!(face(|f| f.meshverts[1] = 5).contains("faces[0]: 5 meshverts are no whole number"));
    assert!(face(|f| f.meshverts = [1 << 20, 3]).contains("faces[0]: its meshverts"));
    assert!(face(|f| f.vertexes[1] = 2).contains("faces[0]: a corner is vertex"));
    assert!(face(|f| f.kind = 7).contains("faces[0]: kind 7; there are 1 to 4"));
    assert!(face(|f| f.kind = 2).contains("faces[0]: a patch of 0x0"));
    let map = |change: fn(&mut TestMap)| {
        let mut m = room.clone();
        change(&mut m);
        error(&m.bytes())
    };
    assert!(map(|m| m.vertexes[3][1] = f32::NAN).contains("vertexes[3]: its place"));
    assert!(map(|m| m.vertexes[3][1] = 1e12).contains("vertexes[3]: its place"));
    assert!(map(|m| m.nodes[0][0] = 5).contains("nodes[0]: plane 5 is not among the 2"));
    assert!(map(|m| m.nodes[1][1] = 0).contains("nodes[1]: its child 0 is neither a later node nor a leaf"));
    assert!(map(|m| m.nodes[1][1] = -6).contains("nodes[1]: its child -6"));
    assert!(map(|m| m.models[1] = [0, 99]).contains("models[1]: its faces 0 to 99"));
    assert!(map(|m| m.visdata[0] = 200).contains("lump visdata: 200 rows"));
    assert!(map(|m| m.visdata[0] = 2).contains("cluster 2 is not among the 2"));
    assert!(map(|m| m.entities.push('{')).contains("lump entities, line"));
}

/// A map that holds nothing is a scene of nothing.
#[test]
fn an_empty_map_is_an_empty_scene() {
    let scene = opened("empty.bsp", &file(&vec![Vec::new(); 17]));
    assert_eq!(scene.geometry.triangles.len(), 0);
    assert!(scene.warnings.iter().any(|w| w == "the scene has no surfaces"));
}

/// A map in a scene file: with its own lights, a material, and edits that keep the surfaces.
#[test]
fn a_map_is_a_shape_too() {
    let (folder, _) = written("maps/room.bsp", &TestMap::room().bytes());
    let text = "[camera]\nposition = [0, 2, 3]\ntarget = [0, 1, 0]\nfov_y = 60\n\n[materials.m]\nkind = \"diffuse\"\n\n\
                [[shapes]]\nkind = \"mesh\"\nfile = \"maps/room.bsp\"\nmaterial = \"m\"\n\n\
                [[lights]]\nkind = \"point\"\nposition = [0, 2, 0]\npower = [9, 9, 9]\n";
    let path = folder.path().join("scene.toml");
    std::fs::write(&path, text).expect("written");
    let source = Source::open(path.to_str().expect("a plain path")).expect("opens");
    assert_eq!((source.scene.geometry.triangles.len(), source.scene.lights.len()), (45, 1));
    assert!(source.scene.cells.is_some() && source.scene.viewpoints.len() == 1);
    let mut file: SceneFile = source.file.clone();
    file.lights[0].power = Some([1.0; 3]);
    let edited = source.edited(&file, &source.scene).expect("valid");
    assert!(Arc::ptr_eq(&edited.geometry, &source.scene.geometry));
    let missing = text.replace("room.bsp", "no.bsp");
    std::fs::write(&path, missing).expect("written");
    let error = Source::open(path.to_str().expect("a plain path")).map(|_| ()).expect_err("no such map").to_string();
    assert!(error.contains("scene.toml:11: shapes[0].file") && error.contains("no.bsp"), "{error}");
}

proptest! {
    /// Whatever is flipped or cut off, reading ends in a map or in one line.
    #[test]
    fn damaged_maps_never_panic(flips in proptest::collection::vec((0usize..3000, any::<u8>()), 1..12), keep in 0usize..6000) {
        let mut bytes = TestMap::room().bytes();
        let n = bytes.len();
        for (at, value) in flips {
            bytes[at % n] = value;
        }
        bytes.truncate(keep.max(8));
        if let Err(e) = read(&bytes) {
            prop_assert!(!e.0.is_empty() && !e.0.contains('\n'));
        }
    }
}
