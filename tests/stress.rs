//! The stability cases hold, `cusp stress` says so, and the documents list them all.

#![allow(clippy::expect_used, missing_docs, reason = "a failed expectation is how this program reports")]

use cusp::export::stability::all_cases;
use cusp::measure::stability::{Case, Verdict};
use std::process::{Command, Output};

fn stress(args: &[&str]) -> Output {
    Command::new(env!("CARGO_BIN_EXE_cusp")).arg("stress").args(args).output().expect("the binary runs")
}

fn text(bytes: &[u8]) -> String {
    String::from_utf8_lossy(bytes).into_owned()
}

/// All cases, one after the other: each has both cores.
#[test]
fn every_case_holds() {
    let mut failed = Vec::new();
    for case in all_cases() {
        let judged = case.judge();
        if judged.verdict() != Verdict::Holds {
            failed.push(format!("{}: {:?}", case.name, judged.outcome));
        }
    }
    assert!(failed.is_empty(), "{failed:#?}");
}

#[test]
fn a_run_prints_a_table_and_writes_it() {
    let folder = tempfile::tempdir().expect("a folder");
    let out = folder.path().join("made");
    let path = out.to_str().expect("a plain path");
    let run = stress(&["ellipse", "film-sums", "--out", path]);
    assert_eq!(run.status.code(), Some(0), "{}", text(&run.stderr));
    let table = text(&run.stdout);
    assert!(table.contains("  ellipse ") && table.contains("passes\n  film-sums "), "{table}");
    assert!(table.contains("2 of 2 cases hold"), "{table}");
    let json: serde_json::Value =
        serde_json::from_slice(&std::fs::read(out.join("stress.json")).expect("written")).expect("JSON");
    let cases = json["cases"].as_array().expect("a list");
    assert_eq!(cases.len(), 2);
    for case in cases {
        assert_eq!(case["verdict"], "holds");
        assert!(case["worst"].as_f64().expect("a number") <= case["limit"].as_f64().expect("a number"));
    }
    let markdown = std::fs::read_to_string(out.join("stress.md")).expect("written");
    assert!(markdown.contains("### passes") && markdown.contains("| `film-sums` |"), "{markdown}");
}

/// The same numbers whatever the threads.
#[test]
fn outcomes_do_not_depend_on_threads() {
    let worst = |threads: &str| {
        let run = stress(&["ellipse", "coverage", "linear-in-power", "--json", "--threads", threads]);
        assert_eq!(run.status.code(), Some(0), "{}", text(&run.stderr));
        let json: serde_json::Value = serde_json::from_slice(&run.stdout).expect("JSON");
        let of =
            |c: &serde_json::Value| (c["worst"].clone(), c["at"].clone(), c["tried"].clone(), c["bounded"].clone());
        json["cases"].as_array().expect("a list").iter().map(of).collect::<Vec<_>>()
    };
    assert_eq!(worst("1"), worst("3"));
}

#[test]
fn an_unknown_case_is_named() {
    let run = stress(&["ellipsis"]);
    assert_eq!(run.status.code(), Some(2));
    let error = text(&run.stderr);
    assert!(error.contains("`ellipsis`") && error.contains("--list") && error.lines().count() == 1, "{error}");
    let list = stress(&["--list"]);
    assert!(all_cases().iter().all(|c| text(&list.stdout).contains(c.name)));
}

/// The table in `docs/stability.md` is that of the cases, with their limits.
#[test]
fn the_document_lists_every_case() {
    let document = include_str!("../docs/stability.md");
    let row = |c: &Case| format!("| `{}` | {} | {} | {} |", c.name, c.what, c.range, c.oracle);
    for case in all_cases() {
        let line = document.lines().find(|l| l.starts_with(&row(&case)));
        let line = line.unwrap_or_else(|| panic!("no row `{}`; `cusp stress --out DIR` writes the table", row(&case)));
        assert!(line.ends_with("| holds |"), "{line}");
        let limit = if case.limit == 0.0 { "0".into() } else { format!("{:.1e}", case.limit) };
        assert!(line.contains(&format!("| {limit} | holds |")), "{line}");
    }
}
