//! The k nearest of a million photons on the walls of a box, beside the crate `kiddo`.

#![allow(clippy::expect_used, missing_docs, reason = "a failed expectation is how this program reports")]

use criterion::{BenchmarkId, Criterion, Throughput, criterion_group, criterion_main};
use cusp::math::frame::tangents;
use cusp::math::sequence::{Sampling, Sequence};
use cusp::photons::kd_tree::{KdTree, Nearest, NearestQuery};
use glam::Vec3;
use kiddo::{ImmutableKdTree, SquaredEuclidean};
use std::num::NonZero;

const PHOTONS: u64 = 1_000_000;
const QUERIES: usize = 20_000;
const K: usize = 50;
/// Half-height of a slice, metres: that of photons' footprints some three times as wide as their distance.
const SLICE: f32 = 0.01;

/// A place on the five walls of an open box with sides of two metres, and the wall's normal.
fn on_walls(x: [f32; 4]) -> (Vec3, Vec3) {
    let (a, b) = (2.0 * x[0], 2.0 * x[1]);
    match (5.0 * x[2]) as u32 {
        0 => (Vec3::new(a, 0.0, b), Vec3::Y),
        1 => (Vec3::new(a, 2.0, b), Vec3::NEG_Y),
        2 => (Vec3::new(0.0, a, b), Vec3::X),
        3 => (Vec3::new(2.0, a, b), Vec3::NEG_X),
        _ => (Vec3::new(a, b, 0.0), Vec3::Z),
    }
}

/// Tiles of 32×32 places four millimetres apart, row by row, as a camera sees a wall.
fn tiles(sequence: &Sequence) -> Vec<(Vec3, Vec3)> {
    let of_tile = |tile: u64| {
        let (corner, normal) = on_walls(sequence.four(tile, 2));
        let (t, b) = tangents(normal);
        (0..1024u32).map(move |i| (corner + t * (0.004 * (i % 32) as f32) + b * (0.004 * (i / 32) as f32), normal))
    };
    (0..).flat_map(of_tile).take(QUERIES).collect()
}

fn nearest(c: &mut Criterion) {
    let sequence = Sequence::new(Sampling::Random, 1);
    let photons: Vec<Vec3> = (0..PHOTONS).map(|i| on_walls(sequence.four(i, 0)).0).collect();
    let points: Vec<[f32; 3]> = photons.iter().map(Vec3::to_array).collect();
    let kiddo: ImmutableKdTree<f32, 3> = ImmutableKdTree::new_from_slice(&points).expect("few share a coordinate");
    let tree = KdTree::new(photons.iter().copied());
    let k = NonZero::new(K).expect("fifty");
    let anywhere: Vec<_> = (0..QUERIES as u64).map(|i| on_walls(sequence.four(i, 1))).collect();
    for (order, places) in [("anywhere", anywhere), ("in_tiles", tiles(&sequence))] {
        let mut group = c.benchmark_group(format!("50_nearest_of_1000000_{order}"));
        group.throughput(Throughput::Elements(QUERIES as u64)).sample_size(20);
        group.bench_function("kiddo (baseline)", |b| {
            b.iter(|| {
                let found = |(p, _): &(Vec3, Vec3)| {
                    kiddo.query(&p.to_array()).nearest_n::<SquaredEuclidean<f32>>(k).execute().len()
                };
                places.iter().map(found).sum::<usize>()
            });
        });
        for (name, slice) in [("sphere", f32::INFINITY), ("slice", SLICE)] {
            group.bench_function(BenchmarkId::new("KdTree", name), |b| {
                let mut found = Nearest::new();
                b.iter(|| {
                    let count = |&(center, normal): &(Vec3, Vec3)| {
                        let query = NearestQuery { center, radius: f32::INFINITY, k: K, normal, slice };
                        tree.nearest(&query, &mut found, |_| true);
                        found.len()
                    };
                    places.iter().map(count).sum::<usize>()
                });
            });
        }
        group.finish();
    }
    let mut group = c.benchmark_group("build_over_1000000");
    group.sample_size(10);
    group.bench_function("kiddo (baseline)", |b| {
        b.iter(|| ImmutableKdTree::<f32, 3>::new_from_slice(&points).expect("as before").size());
    });
    group.bench_function("KdTree", |b| b.iter(|| KdTree::new(photons.iter().copied()).order().len()));
    group.finish();
}

criterion_group!(benches, nearest);
criterion_main!(benches);
