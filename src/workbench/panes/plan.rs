//! The plan: what the scene needs, what was left out and why.

use super::Panes;
use super::widgets::{fact, rows};
use crate::workbench::theme::mono;
use egui::{RichText, Ui};

pub(super) fn show(panes: &mut Panes, ui: &mut Ui) {
    let Some(pass) = &panes.render.pass else {
        ui.weak("The plan is made with the first pass.");
        return;
    };
    if panes.render.draft {
        ui.weak("A draft leaves nothing out; the plan follows.");
    }
    for item in &pass.plan.items {
        ui.horizontal_wrapped(|ui| {
            ui.label(mono(if item.on { "+" } else { "-" }));
            let name = RichText::new(item.part);
            ui.label(if item.on { name.strong() } else { name.weak() });
            ui.weak(&item.why);
        });
    }
    let Some(p) = &panes.render.progress else { return };
    ui.separator();
    rows(ui, "plan times", |ui| {
        for (label, s) in [
            ("Hierarchy", p.seconds.bvh),
            ("Plan", p.seconds.plan),
            ("Photons", p.seconds.photon_trace),
            ("Maps", p.seconds.map_build),
            ("View rays", p.seconds.view_trace),
            ("Gather", p.seconds.gather),
            ("Estimate", p.seconds.estimate),
        ] {
            fact(ui, label, panes.desk.seconds(s));
        }
        let stored = &pass.photons.stored;
        let photons = stored.direct.len() + stored.caustic.len() + stored.global.len();
        let mib = |n: usize| format!("{:.2} MiB", n as f64 / f64::from(1 << 20));
        fact(ui, "Photons of a pass", mib(photons * size_of::<crate::photons::Photon>()));
        let mapped: usize = pass.maps.all().map(|m| m.photons().len()).sum();
        fact(ui, "Map photons", mib(mapped * size_of::<crate::photons::MapPhoton>()));
        let peak = crate::render::stats::peak_rss_bytes().filter(|_| !panes.desk.untimed);
        fact(ui, "Peak memory", peak.map_or("-".into(), |b| mib(b as usize)));
    });
    let lines = p.bounded.lines();
    if !lines.is_empty() {
        ui.separator();
        lines.iter().for_each(|line| {
            ui.label(line);
        });
    }
}
