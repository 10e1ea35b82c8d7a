//! The refined copy of the surfaces, which carries irradiance at its vertices.
//!
//! Rays and photons meet the surfaces as they are (section 4.3); a point of them is found in the copy by its parameters.
//! Spheres have eight triangles of an octahedron, whose new vertices lie on the sphere.

use crate::scene::Geometry;
use crate::scene::geometry::NONE;
use crate::trace::surface::flat_normal;
use glam::Vec3;
use std::cmp::Ordering;
use std::collections::{BinaryHeap, HashMap};

/// Triangles of a sphere before refinement.
const OCTANTS: u32 = 8;

/// A vertex of the refined mesh.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Vertex {
    /// Where it is when nothing has moved, metres.
    pub position: Vec3,
    /// Unit shading normal of the front side.
    pub normal: Vec3,
    /// Which motion moves it; [`NONE`] for none.
    pub motion: u32,
    /// From it to the mean of the centres of its triangles, metres: into its surface, where it lies on an edge.
    pub inward: Vec3,
}

/// A base triangle as it is split: leaves are triangles of the mesh.
#[derive(Clone, Copy, Debug)]
struct Node {
    /// Leaf: the triangle. Else: the first of two nodes that follow each other.
    at: u32,
    /// Corner at which the split edge starts, towards the next corner; [`LEAF`] for a leaf.
    edge: u8,
}

const LEAF: u8 = 3;

/// The refined mesh.
#[derive(Clone, Debug, Default)]
pub struct Mesh {
    /// Its vertices: one for each place and normal.
    pub vertices: Vec<Vertex>,
    /// Corners of its triangles, in the orientation of the surfaces.
    pub triangles: Vec<[u32; 3]>,
    nodes: Vec<Node>,
    /// Triangles of the geometry; the octants of its spheres follow.
    base_triangles: u32,
    longest: f32,
}

/// A place in the mesh.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct MeshPoint {
    /// Triangle.
    pub triangle: u32,
    /// Weights of its second and third corner.
    pub weights: [f32; 2],
}

/// An edge that waits to be split, the longest first; of equal ones the one of lower ends.
#[derive(Clone, Copy, PartialEq)]
struct Edge {
    squared: f32,
    ends: (u32, u32),
}

impl Eq for Edge {}

impl PartialOrd for Edge {
    fn partial_cmp(&self, other: &Self) -> Option<Ordering> {
        Some(self.cmp(other))
    }
}

impl Ord for Edge {
    fn cmp(&self, other: &Self) -> Ordering {
        self.squared.total_cmp(&other.squared).then(other.ends.cmp(&self.ends))
    }
}

/// What is known of a mesh while it is refined.
struct Refinement {
    mesh: Mesh,
    /// Place of each vertex: vertices of one place and several normals share it.
    places: Vec<u32>,
    place_of: HashMap<[u32; 3], u32>,
    positions: Vec<Vec3>,
    /// On a sphere the place of each vertex on the octahedron, so that a direction finds its triangle by weights there.
    flat: Vec<Vec3>,
    vertex_of: HashMap<(u32, [u32; 3], u32), u32>,
    /// Node and sphere of each triangle.
    node_of: Vec<u32>,
    sphere_of: Vec<Option<(Vec3, f32)>>,
    /// Triangles at each edge between two places.
    at_edge: HashMap<(u32, u32), Vec<u32>>,
    waiting: BinaryHeap<Edge>,
}

impl Mesh {
    /// The mesh of `geometry` with at least `added` triangles more than it has, and no edge that is longer than
    /// `max_edge` metres (0 for no such limit): the longest edge of all is split at its middle in all triangles that have
    /// it, until one of both is reached. `motion_of` says what moves a triangle or sphere, by its index among all.
    ///
    /// The paper splits one triangle alone (figure 5.9) and leaves hanging vertices, which crack the shading.
    pub fn new(geometry: &Geometry, added: u32, max_edge: f32, motion_of: impl Fn(u32) -> u32) -> Self {
        let mut r = Refinement::new(geometry, motion_of);
        let wanted = r.mesh.triangles.len() as u64 + u64::from(added);
        while (r.mesh.triangles.len() as u64) < wanted {
            let Some(edge) = r.waiting.pop() else { break };
            if edge.squared <= max_edge * max_edge {
                r.waiting.push(edge);
                break;
            }
            r.split(edge.ends);
        }
        r.mesh.longest = r.waiting.peek().map_or(0.0, |e| e.squared.sqrt());
        r.mesh.point_inward();
        r.mesh
    }

    fn point_inward(&mut self) {
        let mut sums = vec![(Vec3::ZERO, 0u32); self.vertices.len()];
        for t in &self.triangles {
            let center = t.iter().map(|&v| self.vertices[v as usize].position / 3.0).sum::<Vec3>();
            for &v in t {
                let (sum, count) = &mut sums[v as usize];
                *sum += center - self.vertices[v as usize].position;
                *count += 1;
            }
        }
        for (v, (sum, count)) in self.vertices.iter_mut().zip(sums) {
            v.inward = sum / count.max(1) as f32;
        }
    }

    /// Length of the longest edge, metres; 0 without any.
    pub fn longest_edge(&self) -> f32 {
        self.longest
    }

    /// Where a hit on a triangle lies, by the weights of its second and third corner.
    pub fn on_triangle(&self, triangle: u32, weights: [f32; 2]) -> MeshPoint {
        self.descend(triangle, weights)
    }

    /// Where a hit on a sphere lies, by the unit vector from its centre.
    pub fn on_sphere(&self, sphere: u32, outward: Vec3) -> MeshPoint {
        let sum = outward.x.abs() + outward.y.abs() + outward.z.abs();
        let octant = u32::from(outward.x < 0.0) | u32::from(outward.y < 0.0) << 1 | u32::from(outward.z < 0.0) << 2;
        let [_, b, c] = octahedron(octant).map(|axis| outward.dot(axis).max(0.0) / sum);
        let weights = if (b + c).is_finite() { [b, c] } else { [0.0; 2] };
        self.descend(self.base_triangles + sphere * OCTANTS + octant, weights)
    }

    #[inline]
    fn descend(&self, base: u32, [wb, wc]: [f32; 2]) -> MeshPoint {
        let mut w = [1.0 - wb - wc, wb, wc];
        let mut node = self.nodes[base as usize];
        while node.edge != LEAF {
            let (from, to) = (node.edge as usize, (node.edge as usize + 1) % 3);
            let (first, second) = (w[from], w[to]);
            if first >= second {
                (w[from], w[to]) = (first - second, 2.0 * second);
                node = self.nodes[node.at as usize];
            } else {
                (w[from], w[to]) = (2.0 * first, second - first);
                node = self.nodes[node.at as usize + 1];
            }
        }
        MeshPoint { triangle: node.at, weights: [w[1], w[2]] }
    }
}

/// Axes at the corners of an octant of the sphere, so that its front is outside.
fn octahedron(octant: u32) -> [Vec3; 3] {
    let side = |bit: u32| if octant >> bit & 1 == 0 { 1.0 } else { -1.0 };
    let (x, y, z) = (Vec3::X * side(0), Vec3::Y * side(1), Vec3::Z * side(2));
    if side(0) * side(1) * side(2) > 0.0 { [x, y, z] } else { [x, z, y] }
}

fn bits(v: Vec3) -> [u32; 3] {
    // Both zeros are one place.
    (v + Vec3::ZERO).to_array().map(f32::to_bits)
}

impl Refinement {
    fn new(g: &Geometry, motion_of: impl Fn(u32) -> u32) -> Self {
        let base = g.triangles.len() as u32;
        let mut r = Self {
            mesh: Mesh { base_triangles: base, ..Mesh::default() },
            places: Vec::new(),
            place_of: HashMap::new(),
            positions: Vec::new(),
            flat: Vec::new(),
            vertex_of: HashMap::new(),
            node_of: Vec::new(),
            sphere_of: Vec::new(),
            at_edge: HashMap::new(),
            waiting: BinaryHeap::new(),
        };
        for t in 0..base {
            let corners = g.corners(t as usize);
            let flat = flat_normal(corners).as_vec3();
            let normals = match g.corner_normals[t as usize] {
                [i, ..] if i == NONE => [flat; 3],
                // A corner's normal may lean to the back of a coarse triangle.
                all => all.map(|i| g.normals[i as usize]).map(|n| if n.dot(flat) < 0.0 { -n } else { n }),
            };
            let motion = motion_of(t);
            let ids = [0, 1, 2].map(|c| r.vertex(corners[c], normals[c], motion, Vec3::ZERO));
            r.add_base(ids, None);
        }
        for (i, s) in g.spheres.iter().enumerate() {
            let motion = motion_of(base + i as u32);
            for octant in 0..OCTANTS {
                let axes = octahedron(octant);
                let ids = axes.map(|a| r.vertex(s.center + a * s.radius, a, motion, a));
                r.add_base(ids, Some((s.center, s.radius)));
            }
        }
        let mut edges: Vec<(u32, u32)> = r.at_edge.keys().copied().collect();
        edges.sort_unstable();
        edges.into_iter().for_each(|e| r.wait(e));
        r
    }

    /// The vertex of that place, normal and motion.
    fn vertex(&mut self, position: Vec3, normal: Vec3, motion: u32, flat: Vec3) -> u32 {
        let next = self.positions.len() as u32;
        let place = *self.place_of.entry(bits(position)).or_insert(next);
        if place == next {
            self.positions.push(position);
        }
        let (mesh, places, flats) = (&mut self.mesh, &mut self.places, &mut self.flat);
        *self.vertex_of.entry((place, bits(normal), motion)).or_insert_with(|| {
            mesh.vertices.push(Vertex { position, normal, motion, inward: Vec3::ZERO });
            places.push(place);
            flats.push(flat);
            mesh.vertices.len() as u32 - 1
        })
    }

    fn add_base(&mut self, corners: [u32; 3], sphere: Option<(Vec3, f32)>) {
        let triangle = self.mesh.triangles.len() as u32;
        self.mesh.triangles.push(corners);
        self.node_of.push(triangle);
        self.sphere_of.push(sphere);
        self.mesh.nodes.push(Node { at: triangle, edge: LEAF });
        for c in 0..3 {
            let e = self.edge_of(corners, c);
            self.at_edge.entry(e).or_default().push(triangle);
        }
    }

    /// Places at the ends of a triangle's edge, the lower first.
    fn edge_of(&self, corners: [u32; 3], c: usize) -> (u32, u32) {
        let [a, b] = [corners[c], corners[(c + 1) % 3]].map(|v| self.places[v as usize]);
        (a.min(b), a.max(b))
    }

    fn wait(&mut self, ends: (u32, u32)) {
        let squared = self.positions[ends.0 as usize].distance_squared(self.positions[ends.1 as usize]);
        // An edge without length has no middle.
        if squared > 0.0 && squared.is_finite() {
            self.waiting.push(Edge { squared, ends });
        }
    }

    /// Splits all triangles at an edge at its middle.
    fn split(&mut self, ends: (u32, u32)) {
        let Some(triangles) = self.at_edge.remove(&ends) else { return };
        let mut new_edges = Vec::new();
        for t in triangles {
            let corners = self.mesh.triangles[t as usize];
            let Some(c) = (0..3).find(|&c| self.edge_of(corners, c) == ends) else { continue };
            let (from, to) = (c, (c + 1) % 3);
            let [a, b] = [corners[from], corners[to]].map(|v| self.mesh.vertices[v as usize]);
            let sum = a.normal + b.normal;
            let flat = (self.flat[corners[from] as usize] + self.flat[corners[to] as usize]) * 0.5;
            let sphere = self.sphere_of[t as usize];
            let (position, normal) = match sphere {
                Some((center, radius)) => {
                    let n = flat.try_normalize().unwrap_or(a.normal);
                    (center + n * radius, n)
                }
                // By the lower place first, so that both sides of the edge have the same bits.
                None => {
                    let [low, high] = [ends.0, ends.1].map(|p| self.positions[p as usize]);
                    let same = a.normal == b.normal;
                    (low * 0.5 + high * 0.5, if same { a.normal } else { sum.try_normalize().unwrap_or(a.normal) })
                }
            };
            let middle = self.vertex(position, normal, a.motion, flat);
            let (mut first, mut second) = (corners, corners);
            first[to] = middle;
            second[from] = middle;
            let (node, next) = (self.node_of[t as usize], self.mesh.nodes.len() as u32);
            let u = self.mesh.triangles.len() as u32;
            self.mesh.nodes[node as usize] = Node { at: next, edge: c as u8 };
            self.mesh.nodes.extend([Node { at: t, edge: LEAF }, Node { at: u, edge: LEAF }]);
            self.node_of[t as usize] = next;
            self.node_of.push(next + 1);
            self.sphere_of.push(sphere);
            self.mesh.triangles[t as usize] = first;
            self.mesh.triangles.push(second);
            // The edge beyond the split one's end goes to the second triangle, the one before its start stays.
            let beyond = self.edge_of(corners, to);
            if let Some(all) = self.at_edge.get_mut(&beyond) {
                all.iter_mut().filter(|x| **x == t).for_each(|x| *x = u);
            }
            for (triangle, corners, start) in [(t, first, from), (u, second, from), (t, first, to), (u, first, to)] {
                let e = self.edge_of(corners, start);
                let all = self.at_edge.entry(e).or_insert_with(|| {
                    new_edges.push(e);
                    Vec::new()
                });
                all.push(triangle);
            }
        }
        new_edges.into_iter().for_each(|e| self.wait(e));
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::math::frame::uniform_sphere;
    use crate::math::sequence::{Sampling, Sequence};
    use crate::scene::open;

    fn point(mesh: &Mesh, p: MeshPoint) -> Vec3 {
        let [a, b, c] = mesh.triangles[p.triangle as usize].map(|v| mesh.vertices[v as usize].position);
        a + (b - a) * p.weights[0] + (c - a) * p.weights[1]
    }

    /// Every point of a surface is found at its place, in the triangle of the mesh that lies there.
    #[test]
    fn points_are_found_where_they_are() {
        let scene = open("cornell").expect("built in");
        let g = &scene.geometry;
        let mesh = Mesh::new(g, 900, 0.0, |_| NONE);
        assert!((900..1000).contains(&(mesh.triangles.len() - g.triangles.len())));
        let numbers = Sequence::new(Sampling::Random, 3);
        for i in 0..2000 {
            let x = numbers.four(i, 0);
            let t = i as u32 % g.triangles.len() as u32;
            let (b, c) = if x[0] + x[1] > 1.0 { (1.0 - x[0], 1.0 - x[1]) } else { (x[0], x[1]) };
            let [pa, pb, pc] = g.corners(t as usize);
            let there = pa + (pb - pa) * b + (pc - pa) * c;
            let found = mesh.on_triangle(t, [b, c]);
            assert!(found.weights.iter().all(|w| (-1e-5..=1.00001).contains(w)));
            assert!((point(&mesh, found) - there).length() < 1e-5);
        }
    }

    /// No vertex hangs: every edge of a closed surface has two triangles that run through it in opposite directions, and
    /// the area stays the same.
    #[test]
    fn refinement_leaves_no_cracks() {
        let scene = open("cornell").expect("built in");
        let g = &scene.geometry;
        for added in [0, 1, 7, 500] {
            let mesh = Mesh::new(g, added, 0.0, |_| NONE);
            let at = |v: u32| bits(mesh.vertices[v as usize].position);
            let mut edges = HashMap::new();
            let (mut area, mut longest) = (0.0, 0.0f32);
            for t in &mesh.triangles {
                let p = t.map(|v| mesh.vertices[v as usize].position);
                area += f64::from((p[1] - p[0]).cross(p[2] - p[0]).length() / 2.0);
                for c in 0..3 {
                    *edges.entry((at(t[c]), at(t[(c + 1) % 3]))).or_insert(0) += 1;
                    longest = longest.max((p[c] - p[(c + 1) % 3]).length());
                }
            }
            let alone = edges.iter().filter(|((a, b), n)| edges.get(&(*b, *a)) != Some(n)).count();
            let base: f64 = (0..g.triangles.len())
                .map(|t| g.corners(t))
                .map(|[a, b, c]| f64::from((b - a).cross(c - a).length() / 2.0))
                .sum();
            assert!((area - base).abs() < 1e-4 * base, "{area} {base}");
            assert!((mesh.longest_edge() - longest).abs() < 1e-6);
            // The box is open at the front, and the light hangs free: their edges have one triangle.
            assert!(alone < 12 + 8 * (1 + added as usize / 20), "{alone} of {}", edges.len());
        }
    }

    #[test]
    fn the_longest_edge_is_split_first() {
        let scene = open("cornell").expect("built in");
        let coarse = Mesh::new(&scene.geometry, 100, 0.0, |_| NONE);
        let limited = Mesh::new(&scene.geometry, 1_000_000, coarse.longest_edge() / 2.0, |_| NONE);
        assert!(limited.longest_edge() <= coarse.longest_edge() / 2.0);
        assert!(limited.triangles.len() < 20_000);
    }

    #[test]
    fn spheres_become_round() {
        let scene = open("glass_ball").expect("built in");
        let g = &Geometry { spheres: scene.geometry.spheres.clone(), ..Geometry::default() };
        let s = g.spheres[0];
        let mesh = Mesh::new(g, 4000, 0.0, |_| NONE);
        let numbers = Sequence::new(Sampling::Random, 4);
        for i in 0..1000 {
            let x = numbers.four(i, 0);
            let n = uniform_sphere(x[0], x[1]).normalize();
            let found = mesh.on_sphere(0, n);
            let there = point(&mesh, found);
            assert!((there - s.center - n * s.radius).length() < 0.02 * s.radius, "{n}");
            let v = mesh.vertices[mesh.triangles[found.triangle as usize][0] as usize];
            assert!(((v.position - s.center).length() - s.radius).abs() < 1e-5 * s.radius);
            assert!((v.normal - (v.position - s.center) / s.radius).length() < 1e-4);
            let t = mesh.triangles[found.triangle as usize].map(|v| mesh.vertices[v as usize].position);
            assert!((t[1] - t[0]).cross(t[2] - t[0]).dot(n) > 0.0, "inside out");
        }
        for zero in [Vec3::X, Vec3::NEG_Y, Vec3::ZERO, Vec3::splat(f32::NAN)] {
            assert!((mesh.on_sphere(0, zero).triangle as usize) < mesh.triangles.len());
        }
    }
}
