//! Final gathering in the window: chosen by its widgets, shown as it is, kept in sessions.

use super::window::{Window, beside, click, open, same_as_fresh, settle, small};
use cusp::export::session::{Panel, Session};
use cusp::render::inspect::inspect;
use cusp::workbench::layout::Pane;
use egui::accesskit::Role;
use egui::{Key, Modifiers};
use egui_kittest::kittest::Queryable;

fn estimator(window: &Window) -> &str {
    &window.state().session().panels[0].estimator
}

fn choose(window: &mut Window, label: &str, value: &str) {
    window.get_by_role_and_label(Role::ComboBox, label).click();
    window.step();
    window.step();
    window.get_by_role_and_label(Role::Button, value).click();
    settle(window);
}

fn room(estimator: &str) -> Session {
    Session { panels: vec![Panel::of(estimator)], ..small("two_lights", 1) }
}

#[test]
fn final_gathering_is_chosen_by_widgets_and_taken_back() {
    let mut window = open(beside(room("integrated"), Pane::Estimators));
    assert!(window.state().render().pass.as_ref().is_some_and(|p| !p.plan.gathers()));
    window.state_mut().session_mut().panels[0].estimator = "integrated+precomputed:rays=8".into();
    settle(&mut window);
    choose(&mut window, "Final gathering", "ray-differentials");
    assert_eq!(estimator(&window), "integrated+ray-differentials:rays=8");
    choose(&mut window, "Pattern", "sobol");
    window.get_by_role_and_label(Role::Slider, "Rays").set_value_accesskit(12.0);
    settle(&mut window);
    window.get_by_role_and_label(Role::CheckBox, "Fixed radius").click();
    settle(&mut window);
    let all = estimator(&window).to_owned();
    assert!(all.starts_with("integrated+ray-differentials:rays=12,pattern=sobol,radius=0."), "{all}");
    same_as_fresh(&window);
    // The estimator under it changes by itself.
    choose(&mut window, "Estimator", "regular");
    assert_eq!(estimator(&window), all.replace("integrated", "regular"));
    for expected in [&all, "integrated+ray-differentials:rays=12,pattern=sobol"] {
        window.key_press_modifiers(Modifiers::COMMAND, Key::Z);
        settle(&mut window);
        assert_eq!(estimator(&window), expected);
    }
    choose(&mut window, "Final gathering", "none");
    assert_eq!(estimator(&window), "integrated");
    same_as_fresh(&window);
}

/// The inspector's account is that of the renderer, and a chosen ray stays chosen.
#[test]
fn gather_rays_are_listed_by_what_they_add() {
    let mut session = beside(room("integrated+ray-differentials:rays=16"), Pane::Inspector);
    session.pins = vec![[30, 76]];
    let mut window = open(session);
    let found = window.state().desk().inspector.found.clone().expect("inspected");
    let names = [estimator(&window).to_owned()].map(|n| cusp::estimate::registry::estimator(&n).expect("known"));
    let own = inspect(&found.pass, &names, [30, 76]).expect("inside");
    let (gathering, rays) = found.gathering(0).expect("gathers finally");
    assert_eq!((rays.len(), gathering.hits.len()), (16, 1));
    assert!(rays.is_sorted_by(|a, b| a.adds >= b.adds) && rays.iter().any(|r| r.seen));
    for ray in rays {
        let [here, there] = [gathering, &own.gatherings[0]].map(|g| g.ray(ray.at).expect("listed").contribution);
        assert_eq!(here, there);
    }
    let at = window.get_by_label("gather ray 3").rect().center();
    click(&mut window, at);
    settle(&mut window);
    assert_eq!(window.state().desk().inspector.chosen_ray, Some(2));
    // The photons are a click away, and none are gathered here.
    window.get_by_label("photons").click();
    settle(&mut window);
    assert!(window.query_by_label("gather ray 1").is_none() && window.query_by_label("Tangent plane").is_some());
}

#[test]
fn sessions_keep_final_gathering() {
    let folder = tempfile::tempdir().expect("a folder");
    let name = "multi_sampled:n=2,grid=cells+ray-differentials:rays=6,pattern=sobol,growth=3";
    let session = room(name);
    let path = folder.path().join("gathered.toml");
    std::fs::write(&path, session.to_toml(folder.path()).expect("a text")).expect("writes");
    let read = Session::open(&path).expect("opens");
    assert_eq!(read, session);
    let window = open(read);
    assert_eq!(estimator(&window), name);
    let pass = window.state().render().pass.as_ref().expect("a pass");
    assert_eq!(pass.plan.final_gatherings.len(), 1);
    same_as_fresh(&window);
}
