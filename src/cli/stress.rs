//! `cusp stress`: the stability cases.

use crate::cli::failure::Failure;
use crate::cli::progress::bar;
use crate::cli::table::Table;
use crate::cli::{print, to_json};
use crate::export::provenance::command_line;
use crate::export::whole_file;
use crate::measure::stability::{self, Case, Judged, Verdict};
use clap::Args;
use serde::Serialize;
use std::fmt::Write;
use std::path::PathBuf;

/// Flags of `stress`.
#[derive(Debug, Args)]
pub struct StressArgs {
    /// Groups or cases to run; all if none is named
    cases: Vec<String>,
    /// Say what there is, and run nothing
    #[arg(long)]
    list: bool,
    /// Folder for stress.md and stress.json
    #[arg(long, value_name = "DIR")]
    out: Option<PathBuf>,
    /// Threads; all cores if left out. They change no result
    #[arg(long, value_name = "T", value_parser = clap::value_parser!(u16).range(1..))]
    threads: Option<u16>,
    /// Print JSON instead of a table
    #[arg(long)]
    json: bool,
    /// Print nothing but failures
    #[arg(long)]
    quiet: bool,
}

/// One case in JSON.
#[derive(Serialize)]
struct CaseReport {
    group: &'static str,
    name: &'static str,
    what: &'static str,
    range: &'static str,
    oracle: &'static str,
    limit: f64,
    #[serde(flatten)]
    result: Option<ResultReport>,
}

/// What came of it.
#[derive(Serialize)]
struct ResultReport {
    worst: f64,
    at: String,
    tried: u64,
    not_finite: u64,
    bounded: u64,
    failure: Option<String>,
    verdict: &'static str,
    seconds: f64,
}

impl CaseReport {
    fn of(case: &Case, judged: Option<&Judged>) -> Self {
        let result = judged.map(|j| ResultReport {
            worst: j.outcome.worst,
            at: j.outcome.at.clone(),
            tried: j.outcome.tried,
            not_finite: j.outcome.not_finite,
            bounded: j.outcome.bounded,
            failure: j.outcome.failure.clone(),
            verdict: j.verdict().name(),
            seconds: j.seconds,
        });
        let Case { group, name, what, range, oracle, limit, .. } = *case;
        Self { group, name, what, range, oracle, limit, result }
    }
}

/// Runs the cases.
///
/// # Errors
/// An unknown name, a file that cannot be written, or a case that does not hold.
pub fn run(args: &StressArgs) -> Result<(), Failure> {
    let cases = chosen(&stability::cases(), &args.cases)?;
    if let Some(threads) = args.threads {
        // Fails only if there is a pool already, which then has all cores.
        let _ = rayon::ThreadPoolBuilder::new().num_threads(usize::from(threads)).build_global();
    }
    if args.list {
        let reports: Vec<CaseReport> = cases.iter().map(|c| CaseReport::of(c, None)).collect();
        return print(&if args.json { document(&reports)? } else { list(&cases) });
    }
    let progress = bar(cases.len() as u64, "stress", args.quiet || args.json);
    let mut judged = Vec::new();
    for case in &cases {
        progress.set_message(case.name);
        judged.push(case.judge());
        progress.inc(1);
    }
    progress.finish_and_clear();
    let reports: Vec<CaseReport> = judged.iter().map(|j| CaseReport::of(&j.case, Some(j))).collect();
    if let Some(folder) = &args.out {
        whole_file::write(&folder.join("stress.json"), document(&reports)?.as_bytes())?;
        whole_file::write(&folder.join("stress.md"), markdown(&judged).as_bytes())?;
    }
    if args.json {
        print(&document(&reports)?)?;
    } else if !args.quiet {
        print(&text(&judged))?;
    }
    let failed: Vec<&str> = judged.iter().filter(|j| j.verdict() != Verdict::Holds).map(|j| j.case.name).collect();
    match failed.is_empty() {
        true => Ok(()),
        false => Err(Failure::Work(format!(
            "{} of {} cases fail: {}; run `cusp stress {}` for more",
            failed.len(),
            judged.len(),
            failed.join(", "),
            failed.join(" ")
        ))),
    }
}

/// The cases that are named, by group or by name, in their own order.
fn chosen(all: &[Case], names: &[String]) -> Result<Vec<Case>, Failure> {
    let is = |c: &Case, name: &String| c.group == name || c.name == name;
    for name in names {
        if !all.iter().any(|c| is(c, name)) {
            let mut groups: Vec<&str> = all.iter().map(|c| c.group).collect();
            groups.dedup();
            return Err(Failure::Call(format!(
                "`{name}`: there is no case or group of that name; the groups are {}, and --list shows the cases",
                groups.join(", ")
            )));
        }
    }
    Ok(all.iter().filter(|c| names.is_empty() || names.iter().any(|n| is(c, n))).copied().collect())
}

fn document(reports: &[CaseReport]) -> Result<String, Failure> {
    to_json(&serde_json::json!({
        "version": env!("CARGO_PKG_VERSION"), "command": command_line(), "cases": reports,
    }))
}

fn list(cases: &[Case]) -> String {
    let mut out = String::new();
    for (i, c) in cases.iter().enumerate() {
        if i == 0 || cases[i - 1].group != c.group {
            // Writing to a string cannot fail.
            let _ = writeln!(out, "{}", c.group);
        }
        let _ = writeln!(
            out,
            "  {:<22} {}\n{:25}{}\n{:25}against {}; limit {:.1e}",
            c.name, c.what, "", c.range, "", c.oracle, c.limit
        );
    }
    out
}

fn number(x: f64) -> String {
    if x == 0.0 { "0".into() } else { format!("{x:.1e}") }
}

fn text(judged: &[Judged]) -> String {
    let mut table = Table::new(["case", "worst error", "limit", "tried", "bounded", "seconds", "verdict"]);
    let mut group = "";
    for j in judged {
        if j.case.group != group {
            group = j.case.group;
            table.row([group]);
        }
        table.row([
            format!("  {}", j.case.name),
            number(j.outcome.worst),
            number(j.case.limit),
            j.outcome.tried.to_string(),
            j.outcome.bounded.to_string(),
            format!("{:.2}", j.seconds),
            j.verdict().name().to_owned(),
        ]);
    }
    let mut out = table.text();
    for j in judged.iter().filter(|j| j.verdict() != Verdict::Holds) {
        let c = &j.case;
        let why = j.outcome.failure.as_ref().unwrap_or(&j.outcome.at);
        let _ = write!(
            out,
            "\n{} {}: {}\n  range: {}\n  against: {}\n  worst: {:.3e} at {why}\n",
            c.name,
            j.verdict().name(),
            c.what,
            c.range,
            c.oracle,
            j.outcome.worst
        );
    }
    let held = judged.iter().filter(|j| j.verdict() == Verdict::Holds).count();
    let seconds: f64 = judged.iter().map(|j| j.seconds).sum();
    let _ = writeln!(out, "\n{held} of {} cases hold; {seconds:.1} s", judged.len());
    out
}

/// A table for documents: what, how extreme, worst error, limit.
fn markdown(judged: &[Judged]) -> String {
    let mut out = String::new();
    let mut group = "";
    for j in judged {
        let c = &j.case;
        if c.group != group {
            group = c.group;
            let _ = write!(
                out,
                "{}### {group}\n\n| case | what is judged | how extreme | against | worst | limit | verdict |\n| --- | --- | --- | --- | --- | --- | --- |\n",
                if out.is_empty() { "" } else { "\n" }
            );
        }
        let _ = writeln!(
            out,
            "| `{}` | {} | {} | {} | {} | {} | {} |",
            c.name,
            c.what,
            c.range,
            c.oracle,
            number(j.outcome.worst),
            number(c.limit),
            j.verdict().name()
        );
    }
    out
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn names_are_unique_and_groups_are_together() {
        let all = stability::cases();
        for (i, c) in all.iter().enumerate() {
            assert!(all[..i].iter().all(|d| d.name != c.name), "{} is there twice", c.name);
            let first = all.iter().position(|d| d.group == c.group).expect("itself");
            assert!(all[first..=i].iter().all(|d| d.group == c.group), "{} is apart from its group", c.name);
            assert!(!c.name.contains([' ', '|']) && !c.what.contains('|') && !c.range.contains('|'));
        }
    }

    #[test]
    fn cases_are_chosen_by_group_and_name() {
        let all = stability::cases();
        let named = |names: &[&str]| chosen(&all, &names.iter().map(|&n| n.to_owned()).collect::<Vec<_>>());
        assert_eq!(named(&[]).expect("all").len(), all.len());
        let some = named(&["passes", "ellipse"]).expect("known");
        assert!(some.iter().all(|c| c.group == "passes" || c.name == "ellipse") && some[0].name == "ellipse");
        let error = named(&["elipse"]).map(|_| ()).expect_err("unknown").to_string();
        assert!(error.contains("`elipse`") && error.contains("footprints, clipping"), "{error}");
    }
}
