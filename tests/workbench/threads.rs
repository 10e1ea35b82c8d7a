//! The threads are sound: what is old is never shown, what is shown at last is right, and a defect is survived.

use super::window::{Window, fresh, open, same_as_fresh, same_bits, settle, small};
use cusp::estimate::registry;
use cusp::export::session::{Panel, Session};
use cusp::render::film::{Image, Rect};
use cusp::render::tiles::tiles;
use cusp::render::{RenderSettings, StoppedBy};
use cusp::workbench::actions::Action;
use cusp::workbench::analysis::no_wake;
use cusp::workbench::gallery::Gallery;
use cusp::workbench::gallery::image::Tile;
use cusp::workbench::messages::{Gravity, Messages};
use cusp::workbench::render::Render;
use cusp::workbench::worker::Worker;
use cusp::workbench::worker::messages::{Event, Job};
use rand_core::{Rng, SeedableRng};
use rand_pcg::Pcg32;
use std::sync::Arc;
use std::time::{Duration, Instant};

const LIMIT: Duration = Duration::from_secs(30);

/// The job of rendering a session.
fn job(session: &Session, generation: u64) -> Job {
    let (_, scene) = session.open_scene().expect("opens");
    let settings = RenderSettings::new(&scene, &session.render, session.size, session.seed).expect("valid");
    let estimators = session.panels.iter().map(|p| p.estimator.clone()).collect();
    Job { generation, scene: Arc::new(scene), settings, estimators, stop: session.stop_rule() }
}

/// Runs `step` until it says so.
fn until(what: &str, mut step: impl FnMut() -> bool) {
    let start = Instant::now();
    while !step() {
        assert!(start.elapsed() < LIMIT, "{what}: takes too long");
        std::thread::sleep(Duration::from_micros(200));
    }
}

/// One change that a user could make, by chance.
fn change(window: &mut Window, random: &mut Pcg32) {
    let mut below = |n: u32| random.next_u32() % n;
    let act = below(16);
    let (a, b) = (below(1000), below(1000));
    let workbench = window.state_mut();
    let camera = workbench.document().scene_file().camera;
    let lights = workbench.document().scene_file().lights;
    let session = workbench.session_mut();
    match act {
        0 => session.render.photons = Some(i64::from(500 + 30 * a)),
        1 => session.render.k = Some(i64::from(1 + a % 80)),
        2 => session.render.gather = Some(if a % 2 == 0 { "knn" } else { "overlap" }.into()),
        3 => session.render.footprint_scale = Some(0.5 + f64::from(a) / 200.0),
        4 => {
            if let Some(panel) = session.panels.first_mut() {
                panel.estimator = registry::estimator(["density", "regular", "integrated"][a as usize % 3])
                    .expect("registered")
                    .name();
            }
        }
        5 if session.panels.len() < 4 => {
            let name = format!("multi_sampled:n={}", 2 + a % 5);
            session.panels.push(Panel::of(registry::estimator(&name).expect("valid").name()));
        }
        6 if session.panels.len() > 1 => workbench.run(Action::RemovePanel(a as usize % 2)),
        7 => {
            if let Some(mut camera) = camera {
                camera.position[0] += (f64::from(a) - 500.0) * 1e-3;
                camera.position[1] += f64::from(b) * 1e-3;
                session.camera = Some(camera);
            }
        }
        8 => {
            let mut lights = lights;
            for power in lights.iter_mut().filter_map(|l| l.power.as_mut()) {
                power[a as usize % 3] = f64::from(b) / 10.0;
            }
            session.lights = Some(lights);
        }
        9 => session.size = Some([32 + a % 90, 32 + b % 70]),
        10 => workbench.run(Action::OpenScene(["ring", "plane", "glass_sphere"][a as usize % 3].into())),
        11 => workbench.run(Action::Undo),
        12 => workbench.run(Action::Redo),
        13 => workbench.run(Action::Pause),
        14 => workbench.run(if a % 2 == 0 { Action::StepTile } else { Action::StepPass }),
        _ => session.seed = u64::from(a % 4),
    }
}

/// Changes whatever there is while it renders, then lets it finish: every image holds the bits of a fresh render.
#[test]
fn changes_at_random_end_in_the_right_image() {
    for seed in [1, 2] {
        let mut window = open(small("ring", 2));
        window.state_mut().session_mut().passes = 40;
        let mut random = Pcg32::seed_from_u64(seed);
        let start = Instant::now();
        let (mut changes, mut first_tiles) = (0, 0);
        while start.elapsed() < Duration::from_millis(1600) || first_tiles < 20 {
            assert!(start.elapsed() < LIMIT, "{changes} changes, {first_tiles} of them seen");
            change(&mut window, &mut random);
            changes += 1;
            // Most are overtaken by the next.
            for _ in 0..[1, 2, 4, 30][random.next_u32() as usize % 4] {
                window.step();
                std::thread::sleep(Duration::from_micros(u64::from(random.next_u32() % 4000)));
            }
            first_tiles += u32::from(window.state().render().first_tile().is_some());
            // A scene brings its own size; that of a test stays small.
            if window.state().session().size.is_none() {
                window.state_mut().session_mut().size = Some([64, 48]);
                window.state_mut().session_mut().passes = 40;
            }
        }
        // A scene that is on its way may still replace the session.
        let calm = Instant::now();
        while calm.elapsed() < Duration::from_millis(400) {
            window.step();
            std::thread::sleep(Duration::from_millis(2));
        }
        let session = window.state_mut().session_mut();
        session.passes = 2;
        session.size = Some([70, 50]);
        session.render.photons = Some(3000);
        window.step();
        if window.state().render().is_paused() {
            window.state_mut().run(Action::Pause);
        }
        settle(&mut window);
        let errors = window.state().messages().all().iter().filter(|m| m.gravity == Gravity::Error).count();
        assert_eq!(errors, 0, "{:?}", window.state().messages().all());
        assert!(window.state().gallery().of(&window.state().session().panels[0]).is_some());
        same_as_fresh(&window);
    }
}

fn fresh_images(session: &Session) -> Vec<Image> {
    fresh(session).films().iter().map(|f| f.image()).collect()
}

/// The part of `image` in `rect`.
fn part(image: &Image, rect: Rect) -> Image {
    image.crop(rect)
}

/// At any time after a change, tiles that count as fresh hold the new settings' pixels.
#[test]
fn no_tile_of_an_old_setting_is_shown() {
    let wake = no_wake();
    let (mut gallery, mut messages) = (Gallery::default(), Messages::default());
    let mut render = Render::new(wake);
    let sessions: Vec<Session> = (0..8)
        .map(|seed| {
            let mut session = small("ring", 2);
            session.seed = seed;
            session
        })
        .collect();
    let expected: Vec<Vec<Image>> = sessions.iter().map(fresh_images).collect();
    let mut seen = 0;
    for round in 0..24 {
        let which = round % sessions.len();
        let last = round == 23;
        let job = job(&sessions[which], render.next_generation());
        let names = job.estimators.clone();
        render.start(job, &mut gallery, &mut messages);
        // Changed again after a few tiles, at another place each time.
        let (start, mut tiles_now) = (Instant::now(), 0);
        until("a render", || {
            render.poll(&mut gallery, &mut messages);
            for (name, image) in names.iter().zip(&expected[which]) {
                let live = gallery.of_estimator(name).expect("asked for");
                let shown = live.pixels().to_image();
                tiles_now = 0;
                for (rect, tile, _) in live.tiles().filter(|t| t.1 == Tile::Fresh) {
                    assert_eq!(tile, Tile::Fresh);
                    same_bits(&part(&shown, rect), &part(image, rect), name);
                    tiles_now += 1;
                }
            }
            seen = seen.max(tiles_now);
            if last { render.finished } else { tiles_now > round % 7 || start.elapsed().as_millis() > 200 }
        });
    }
    assert!(seen == tiles(Rect::whole([96, 96])).len(), "{seen}");
    assert!(messages.all().iter().all(|m| m.gravity != Gravity::Error), "{:?}", messages.all());
}

/// The worker hands over no event of an older job, and its channels do not fill for good when nobody looks.
#[test]
fn old_events_are_dropped() {
    let mut worker = Worker::start(no_wake()).expect("a thread");
    let mut session = small("ring", 2);
    session.passes = 1000;
    session.size = Some([256, 256]);
    session.render.photons = Some(500);
    worker.render(job(&session, 1));
    // Nobody takes events: the channel fills, and the worker waits.
    std::thread::sleep(Duration::from_millis(300));
    for generation in 2..40 {
        session.seed = generation;
        worker.render(job(&session, generation));
    }
    session.passes = 1;
    worker.render(job(&session, 40));
    let (mut tiles_seen, mut finished) = (0, false);
    until("the last job", || {
        let take = |event: Event| {
            assert_eq!(event.generation(), Some(40));
            match event {
                Event::TileDone { .. } => tiles_seen += 1,
                Event::Finished { .. } => finished = true,
                _ => {}
            }
        };
        worker.events(40, take, || false);
        finished
    });
    assert_eq!(tiles_seen, 64);
}

/// The window rests at an error or a time, says which, and goes on when the limit is taken away.
#[test]
fn the_window_rests_at_its_limits() {
    let mut session = small("plane", 1);
    session.render.light = Some("direct".into());
    session.passes = 24;
    // Direct light of a point is without noise, so any error will do.
    session.until_error = Some(0.5);
    let mut window = open(session);
    let passes = |w: &Window| w.state().render().progress.as_ref().expect("done").passes.clone();
    assert_eq!((passes(&window), window.state().render().stopped_by), (vec![16], Some(StoppedBy::Error)));
    let estimates = window.state().desk().estimates.values().next().expect("one panel").clone();
    let seen: Vec<u32> = estimates.iter().map(|e| e.error.passes).collect();
    assert_eq!(seen, [12, 13, 14, 15, 16]);
    window.state_mut().session_mut().until_error = None;
    settle(&mut window);
    assert_eq!((passes(&window), window.state().render().stopped_by), (vec![24], Some(StoppedBy::Passes)));
    same_as_fresh(&window);
    // Taken back, the limit is reached already.
    window.state_mut().run(Action::Undo);
    settle(&mut window);
    assert_eq!(window.state().session().until_error, Some(0.5));
    assert_eq!((passes(&window), window.state().render().stopped_by), (vec![24], Some(StoppedBy::Error)));
    window.state_mut().session_mut().seconds = Some(1e-9);
    window.state_mut().session_mut().until_error = None;
    window.state_mut().session_mut().seed = 7;
    settle(&mut window);
    assert_eq!((passes(&window), window.state().render().stopped_by), (vec![1], Some(StoppedBy::Seconds)));
}

/// A worker ends when its window is gone, however many jobs wait for it and whether or not its events are taken.
#[test]
fn a_busy_worker_ends_with_its_window() {
    let (done, ended) = crossbeam_channel::bounded(1);
    std::thread::spawn(move || {
        let mut session = small("ring", 2);
        session.passes = 1000;
        for round in 0..12u64 {
            let mut worker = Worker::start(no_wake()).expect("a thread");
            let first = job(&session, 1);
            worker.render(first.clone());
            std::thread::sleep(Duration::from_millis(10 * round));
            for generation in 2..12 {
                worker.render(Job { generation, ..first.clone() });
            }
            if round % 3 == 0 {
                worker.gate().pause();
            }
            drop(worker);
        }
        done.send(()).expect("the test waits");
    });
    assert!(ended.recv_timeout(LIMIT).is_ok(), "the thread does not end");
}

/// Tiles that wait at the gate hold up nothing but the render.
#[test]
fn a_heatmap_is_made_while_the_render_is_paused() {
    let mut window = open(small("ring", 1));
    window.state_mut().session_mut().passes = 100_000;
    until("some passes", || {
        window.step();
        window.state().render().passes_seen > 3
    });
    window.state_mut().run(Action::Pause);
    std::thread::sleep(Duration::from_millis(50));
    window.state_mut().session_mut().panels[0].heatmap = Some("photons".into());
    until("the heatmap", || {
        window.step();
        window.state().gallery().values.contains_key(&0)
    });
    assert!(window.state().render().is_paused());
}

/// A scene that no file can hold: its surfaces name a material that there is not.
fn broken(session: &Session, generation: u64) -> Job {
    let job = job(session, generation);
    let mut scene = (*job.scene).clone();
    scene.materials.clear();
    Job { scene: Arc::new(scene), ..job }
}

#[test]
fn a_defect_of_the_worker_is_reported_once_and_survived() {
    let (mut gallery, mut messages) = (Gallery::default(), Messages::default());
    let mut render = Render::new(no_wake());
    let session = small("ring", 1);
    render.start(broken(&session, 1), &mut gallery, &mut messages);
    until("the defect", || {
        render.poll(&mut gallery, &mut messages);
        !render.is_alive()
    });
    for _ in 0..10 {
        render.poll(&mut gallery, &mut messages);
    }
    let errors: Vec<_> = messages.all().iter().filter(|m| m.gravity == Gravity::Error).collect();
    assert!(errors.len() == 1 && errors[0].times == 1, "{errors:?}");
    assert!(errors[0].text.contains("Restart the render thread") && !errors[0].text.contains('\n'), "{errors:?}");
    assert!(!render.finished && render.gate().is_none());
    // The same again is the same message; another scene is rendered.
    render.restart(&mut gallery, &mut messages);
    until("the defect again", || {
        render.poll(&mut gallery, &mut messages);
        !render.is_alive()
    });
    assert_eq!(messages.all().iter().map(|m| m.times).collect::<Vec<_>>(), [2]);
    let next = job(&session, render.next_generation());
    render.start(next, &mut gallery, &mut messages);
    until("the render", || {
        render.poll(&mut gallery, &mut messages);
        render.finished
    });
    let name = &session.panels[0].estimator;
    same_bits(&gallery.of_estimator(name).expect("rendered").pixels().to_image(), &fresh_images(&session)[0], name);
}

/// Events of generation 1 that came: tiles, passes, whether it rests.
#[derive(Default, Debug, PartialEq)]
struct Counts {
    tiles: usize,
    passes: usize,
    finished: bool,
}

fn count(worker: &mut Worker, counts: &mut Counts) {
    let take = |event| match event {
        Event::TileDone { .. } => counts.tiles += 1,
        Event::PassDone { .. } => counts.passes += 1,
        Event::Finished { .. } => counts.finished = true,
        _ => {}
    };
    worker.events(1, take, || false);
}

/// Waits until `expected` has come, and that nothing more comes.
fn comes(worker: &mut Worker, counts: &mut Counts, expected: &Counts) {
    until(&format!("{expected:?}"), || {
        count(worker, counts);
        counts.tiles >= expected.tiles && counts.passes >= expected.passes
    });
    std::thread::sleep(Duration::from_millis(40));
    count(worker, counts);
    assert_eq!(counts, expected);
}

#[test]
fn steps_make_so_many_tiles() {
    let mut worker = Worker::start(no_wake()).expect("a thread");
    let mut session = small("ring", 1);
    session.passes = 4;
    let mut counts = Counts::default();
    let expected = |tiles, passes, finished| Counts { tiles, passes, finished };
    worker.gate().pause();
    worker.render(job(&session, 1));
    // A paused worker does one pass of what is new.
    comes(&mut worker, &mut counts, &expected(9, 1, false));
    for tile in 1..=3 {
        worker.gate().step_tile();
        comes(&mut worker, &mut counts, &expected(9 + tile, 1, false));
    }
    worker.gate().step_pass();
    comes(&mut worker, &mut counts, &expected(18, 2, false));
    worker.gate().step_pass();
    comes(&mut worker, &mut counts, &expected(27, 3, false));
    assert!(worker.gate().is_paused());
    worker.gate().resume();
    comes(&mut worker, &mut counts, &expected(36, 4, true));
}
