//! The real window under a test: opened on a small session, run until it rests, used as a user would.

use super::renderer::app;
use cusp::estimate::Estimator;
use cusp::export::session::{Panel, Session};
use cusp::render::film::Image;
use cusp::render::inspect::inspect;
use cusp::render::{RenderSettings, Renderer, Silent};
use cusp::workbench::Workbench;
use cusp::workbench::document::Opened;
use cusp::workbench::layout::{self, Pane};
use cusp::workbench::viewport::Viewport;
use egui::accesskit::Role;
use egui::{Event, Modifiers, PointerButton, Pos2};
use egui_kittest::Harness;
use egui_kittest::kittest::Queryable;
use egui_tiles::{Container, Linear, LinearDir, Tile, Tiles, Tree};
use std::sync::Arc;
use std::time::{Duration, Instant};

/// A window with the workbench in it.
pub type Window = Harness<'static, Workbench>;

/// Longest time that a window may work.
const LIMIT: Duration = Duration::from_secs(60);
/// Frames without work in a row after which it rests: a frame may ask for what the next one shows.
const CALM: u32 = 5;

/// One pass of few photons, the first of so many panels of a first start.
pub fn small(scene: &str, panels: usize) -> Session {
    let mut session = Session { size: Some([96, 96]), passes: 1, ..Session::of(scene) };
    session.render.photons = Some(4000);
    session.panels.truncate(panels);
    session
}

/// A session whose window shows nothing but image panels.
pub fn images_only(session: Session) -> Session {
    let mut tiles = Tiles::default();
    let images = (0..session.panels.len()).map(|i| tiles.insert_pane(Pane::Image(i))).collect();
    let root = tiles.insert_grid_tile(images);
    let tree = Tree::new(egui::Id::unique("parts"), root, tiles);
    Session { layout: layout::to_text(&tree), ..session }
}

/// A session whose window shows its image panels at the left and `pane` at the right.
pub fn beside(session: Session, pane: Pane) -> Session {
    let mut tiles = Tiles::default();
    let images = (0..session.panels.len()).map(|i| tiles.insert_pane(Pane::Image(i))).collect();
    let images = tiles.insert_grid_tile(images);
    let pane = tiles.insert_pane(pane);
    let root = Linear::new(LinearDir::Horizontal, vec![images, pane]);
    let root = tiles.insert_new(Tile::Container(Container::Linear(root)));
    let tree = Tree::new(egui::Id::unique("parts"), root, tiles);
    Session { layout: layout::to_text(&tree), ..session }
}

/// Opens a window of 800×600 points.
pub fn open(session: Session) -> Window {
    open_at(session, [800.0, 600.0], 1.0)
}

/// Opens a window and runs it until it rests. Times are not shown.
pub fn open_at(session: Session, size: [f32; 2], pixels_per_point: f32) -> Window {
    let opened = Opened::new(session).expect("the session opens");
    let mut window = app(size, pixels_per_point, |context| {
        let mut workbench = Workbench::new(context, opened, None).expect("threads");
        workbench.for_pictures();
        workbench
    });
    settle(&mut window);
    window
}

/// Runs frames until all passes are rendered and everything that is shown is up to date.
pub fn settle(window: &mut Window) {
    let (start, mut calm) = (Instant::now(), 0);
    while calm < CALM {
        window.step();
        if window.state().is_idle() {
            calm += 1;
        } else {
            calm = 0;
            std::thread::sleep(Duration::from_millis(1));
        }
        let render = window.state().render();
        assert!(
            start.elapsed() < LIMIT,
            "the window does not come to rest: finished {}, alive {}, messages {:?}",
            render.finished,
            render.is_alive(),
            window.state().messages().all()
        );
    }
    window.check_accessibility();
}

/// Types text to whatever has the keyboard: each letter as a key and as text, as a real keyboard does.
pub fn type_text(window: &mut Window, text: &str) {
    for letter in text.chars() {
        let key = egui::Key::from_name(&letter.to_uppercase().to_string());
        let press = |pressed| key.map(|key| key_event(key, pressed));
        press(true).into_iter().for_each(|e| window.event(e));
        window.event(Event::Text(letter.into()));
        press(false).into_iter().for_each(|e| window.event(e));
    }
    window.step();
}

fn key_event(key: egui::Key, pressed: bool) -> Event {
    Event::Key { key, physical_key: None, pressed, repeat: false, modifiers: Modifiers::NONE }
}

/// Where the middle of a pixel of panel `index` lies on the screen.
pub fn on_screen(window: &Window, index: usize, [x, y]: [u32; 2]) -> Pos2 {
    viewport(window, index).to_screen(x as f32 + 0.5, y as f32 + 0.5)
}

/// The view of panel `index`.
pub fn viewport(window: &Window, index: usize) -> Viewport {
    let session = window.state().session();
    let title = title(&session.panels[index]);
    let rect = window.get_by_role_and_label(Role::Image, &format!("Image of {title}")).rect();
    Viewport::new(session.view, rect, window.state().document().settings().size)
}

fn title(panel: &Panel) -> String {
    match &panel.heatmap {
        Some(heatmap) => format!("{} [{heatmap}]", panel.estimator),
        None => panel.estimator.clone(),
    }
}

/// Clicks with the first button.
pub fn click(window: &mut Window, at: Pos2) {
    window.hover_at(at);
    for pressed in [true, false] {
        window.event(Event::PointerButton {
            pos: at,
            button: PointerButton::Primary,
            pressed,
            modifiers: Modifiers::NONE,
        });
    }
    window.step();
}

/// A renderer that has never rendered anything else, after as many passes as the session asks for.
pub fn fresh(session: &Session) -> Renderer {
    let (_, scene) = session.open_scene().expect("opens");
    let settings = RenderSettings::new(&scene, &session.render, session.size, session.seed).expect("valid");
    let mut estimators: Vec<Box<dyn Estimator>> = Vec::new();
    for estimator in session.estimators() {
        if estimators.iter().all(|e| e.name() != estimator.name()) {
            estimators.push(estimator);
        }
    }
    let mut renderer = Renderer::new(Arc::new(scene), settings, estimators);
    while renderer.passes() < session.passes {
        renderer.step(&Silent);
    }
    renderer
}

/// The pixel of the first pass that the most photons reach, among those that see one of its first caustic photons.
pub fn lit(session: &Session) -> [u32; 2] {
    let renderer = fresh(&Session { passes: 1, ..session.clone() });
    let pass = renderer.last_pass().expect("one pass");
    let photons = pass.maps.caustic.as_ref().expect("a scene with caustics").photons();
    // Of all sizes: a map begins with the smallest.
    let some = photons.iter().step_by((photons.len() / 40).max(1));
    let pixels = some.filter_map(|p| pass.scene.camera.project(p.position, pass.settings.size));
    let pixels =
        pixels.map(|p| p.map(|x| x as u32)).filter(|p| p[0] < pass.settings.size[0] && p[1] < pass.settings.size[1]);
    let reached = |p: &[u32; 2]| inspect(pass, renderer.estimators(), *p).expect("inside").rows.len();
    pixels.max_by_key(reached).expect("a photon is in the image")
}

/// That every panel's image holds the bits of a fresh render of the session.
pub fn same_as_fresh(window: &Window) {
    let session = window.state().session();
    let renderer = fresh(session);
    for (estimator, film) in renderer.estimators().iter().zip(renderer.films()) {
        let name = estimator.name();
        let live = window.state().gallery().of_estimator(&name).expect("it has a panel");
        assert!(live.is_fresh(), "{name}");
        same_bits(&live.pixels().to_image(), &film.image(), &name);
    }
}

/// That two images hold the same bits.
pub fn same_bits(shown: &Image, expected: &Image, what: &str) {
    assert_eq!(shown.size, expected.size, "{what}");
    let bits = |i: &Image| i.pixels.iter().map(|p| p.to_array().map(f32::to_bits)).collect::<Vec<_>>();
    let differing = bits(shown).iter().zip(&bits(expected)).filter(|(a, b)| a != b).count();
    assert_eq!(differing, 0, "{what}: pixels that differ");
}
