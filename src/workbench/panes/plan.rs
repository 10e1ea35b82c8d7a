//! The plan: what the scene needs, what was left out and why.

use super::Panes;
use super::widgets::{fact, rows};
use crate::export::final_gather::FinalGatherReport;
use crate::final_gather::GatherCounts;
use crate::render::Pass;
use crate::scene::memory;
use crate::workbench::theme::mono;
use crate::workbench::theme::{count, number};
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
        if pass.plan.gathers() {
            fact(ui, "Final gathering", panes.desk.seconds(p.seconds.final_gather));
        }
        let stored = &pass.photons.stored;
        let photons = stored.direct.len() + stored.caustic.len() + stored.global.len();
        let mib = |n: usize| format!("{:.2} MiB", n as f64 / f64::from(1 << 20));
        fact(ui, "Photons of a pass", mib(photons * size_of::<crate::photons::StoredPhoton>()));
        let mapped: usize = pass.maps.all().map(|m| m.photons().len()).sum();
        fact(ui, "Map photons", mib(mapped * size_of::<crate::photons::MapPhoton>()));
        let peak = crate::render::stats::peak_rss_bytes().filter(|_| !panes.desk.untimed);
        fact(ui, "Peak memory", peak.map_or("-".into(), |b| mib(b as usize)));
    });
    if pass.plan.gathers() {
        ui.separator();
        gathering(pass, &p.gather_counts, ui);
    }
    let lines = p.bounded.lines();
    if !lines.is_empty() {
        ui.separator();
        lines.iter().for_each(|line| {
            ui.label(line);
        });
    }
}

/// What gather rays met in all passes, and what they looked up in this one.
fn gathering(pass: &Pass, counts: &GatherCounts, ui: &mut Ui) {
    rows(ui, "gather counts", |ui| {
        for (label, n, tip) in [
            ("Gather rays", counts.rays, "of all passes and panels, those of second gathers too"),
            ("Met nothing", counts.open, "left the scene"),
            ("Second gathers", counts.second, "rays that met a surface nearer than `near`"),
            ("Empty footprints", counts.empty_footprints, "held no estimate; the nearest took its place"),
            ("Unknown light", counts.unknown, "no photon or estimate faces the ray where it ends"),
        ] {
            ui.label(label).on_hover_text(tip);
            ui.label(mono(count(n)));
            ui.end_row();
        }
    });
    for f in &pass.plan.final_gatherings {
        let Some(report) = FinalGatherReport::of(pass, f) else { continue };
        ui.label(RichText::new(&report.settings).strong());
        let m = &report.memory;
        rows(ui, &report.settings, |ui| {
            fact(ui, "Photons", memory::text(m.photons));
            if report.layers.is_empty() {
                fact(ui, "First search", format!("{} m", number(f64::from(report.radius))));
            } else {
                fact(ui, "Highest", memory::text(m.peak));
                fact(ui, "Layers", memory::text(m.layers));
            }
        });
        if !report.layers.is_empty() {
            egui::Grid::new(("layers", &report.settings)).num_columns(4).striped(true).show(ui, |ui| {
                for title in ["layer", "radius m", "estimates", "memory"] {
                    ui.weak(title);
                }
                ui.end_row();
                for (i, l) in report.layers.iter().enumerate() {
                    ui.label(mono(i.to_string()));
                    ui.label(mono(number(f64::from(l.radius))));
                    ui.label(mono(l.estimates.to_string()));
                    ui.label(mono(memory::text(l.bytes as u64)));
                    ui.end_row();
                }
            });
        }
    }
}
