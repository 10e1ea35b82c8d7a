//! `cusp scenes` and `cusp estimators`: what is built in.

use crate::cli::failure::Failure;
use crate::cli::table::Table;
use crate::cli::{print, to_json};
use crate::estimate::FinalGatherMethod;
use crate::estimate::final_gathering::SETTINGS;
use crate::estimate::registry::ESTIMATORS;
use crate::scene::built_in::BUILT_IN;
use crate::scene::source::open_built_in;
use clap::Args;
use serde_json::json;

/// Flags of the lists.
#[derive(Debug, Args)]
pub struct ListArgs {
    /// Print JSON instead of a table
    #[arg(long)]
    json: bool,
}

/// Lists the built-in scenes.
///
/// # Errors
/// A defect of the binary, or a closed output.
pub fn scenes(args: &ListArgs) -> Result<(), Failure> {
    let mut table = Table::new(["scene", "size", "triangles", "spheres", "lights", "reference", "  for"]);
    let mut list = Vec::new();
    for b in BUILT_IN {
        let s = open_built_in(b)?;
        let [w, h] = s.camera.resolution;
        let g = &s.geometry;
        let reference = if b.reference.is_some() { "yes" } else { "no" };
        table.row([
            b.name.to_owned(),
            format!("{w}x{h}"),
            g.triangles.len().to_string(),
            g.spheres.len().to_string(),
            s.lights.len().to_string(),
            reference.to_owned(),
            String::new(),
        ]);
        list.push(json!({
            "name": b.name, "purpose": b.purpose, "size": [w, h], "triangles": g.triangles.len(),
            "spheres": g.spheres.len(), "lights": s.lights.iter().map(|l| l.kind()).collect::<Vec<_>>(),
            "reference": b.reference.is_some(), "hash": format!("{:016x}", s.hash),
        }));
    }
    if args.json {
        return print(&to_json(&json!({ "version": env!("CARGO_PKG_VERSION"), "scenes": list }))?);
    }
    // The purpose is a sentence: it follows its row, aligned left.
    let mut text = String::new();
    for (i, line) in table.text().lines().enumerate() {
        let purpose = if i == 0 { "" } else { BUILT_IN[i - 1].purpose };
        text.push_str(format!("{line:<62}{purpose}").trim_end());
        text.push('\n');
    }
    print(&text)
}

/// Lists the estimators.
///
/// # Errors
/// A closed output.
pub fn estimators(args: &ListArgs) -> Result<(), Failure> {
    if args.json {
        let list: Vec<_> = ESTIMATORS
            .iter()
            .map(|e| {
                json!({
                    "id": e.id, "source": e.source, "summary": e.summary, "settings": e.settings,
                    "default": e.default_estimator().map(|d| d.name()),
                })
            })
            .collect();
        let gathering: Vec<_> = FinalGatherMethod::ALL
            .iter()
            .map(|(name, m)| json!({ "id": name, "source": m.source(), "summary": m.summary(), "settings": SETTINGS }))
            .collect();
        let version = env!("CARGO_PKG_VERSION");
        return print(&to_json(&json!({ "version": version, "estimators": list, "final_gathering": gathering }))?);
    }
    let mut text = String::new();
    for e in ESTIMATORS {
        text.push_str(&format!("{:<14} {}\n{:15}from {}\n", e.id, e.summary, "", e.source));
        if !e.settings.is_empty() {
            text.push_str(&format!("{:15}settings (default first): {}\n", "", e.settings));
        }
    }
    text.push_str("Write settings after a colon, as in multi_sampled:n=8,grid=cells\n\n");
    text.push_str("Global light by final gathering, with --final-gather or after a plus sign:\n");
    for (name, method) in FinalGatherMethod::ALL {
        text.push_str(&format!("{name:<18} {}\n{:19}from {}\n", method.summary(), "", method.source()));
    }
    text.push_str(&format!("settings (default first): {SETTINGS}\n"));
    text.push_str("as in integrated+ray-differentials:rays=800,pattern=sobol\n");
    print(&text)
}
