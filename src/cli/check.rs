//! `gearlash check`.

use super::digits::number;
use super::{CheckArguments, kinematics, numbers, print};
use crate::analysis::cost::Cost;
use crate::analysis::frequencies_at_rest;
use crate::assembly::summary;
use crate::error::Error;
use crate::interrupt::Interrupt;
use crate::machine;
use crate::model::ReportUnits;
use crate::output;
use crate::solve::equilibrium::{Equilibrium, equilibrium};
use crate::solve::galerkin::stored_blocks;
use crate::solve::integrate::{IntegratorChoice, automatic};
use crate::solve::support::{self, Reach, Support};
use crate::study::Study;
use comfy_table::{Table, presets};
use nalgebra::DMatrix;
use serde_json::{Value, json};
use std::f64::consts::TAU;
use std::fmt::Write;

/// Loads and validates everything, analyses included, and prints the system.
pub fn check(arguments: &CheckArguments) -> Result<(), Error> {
    let study = Study::load(&arguments.file, &arguments.set, &[])?;
    if arguments.numbers && !arguments.json {
        return print(&numbers::text(&study.model)).map(|_| ());
    }
    let state = AtRest::of(&study);
    let mut warnings = warnings(&study, &state);
    let costs = study.costs(&Interrupt::default())?;
    warnings.extend(study.forewarnings(&Interrupt::default())?);
    let text = if arguments.json {
        let mut value = as_value(&study, &state, &warnings);
        let costs = costs.iter().map(|(name, cost)| (name.clone(), json!(cost)));
        value["costs"] = Value::Object(costs.collect());
        format!("{value:#}\n")
    } else {
        as_text(&study, &state, &warnings) + &estimates(&costs)
    };
    if let Some(path) = &arguments.figure {
        let stem = arguments.file.file_stem().unwrap_or_default();
        let usual = || std::path::Path::new(stem).with_extension("svg");
        let path = path.clone().unwrap_or_else(usual);
        output::write_schematic(&path, &study.describe())?;
    }
    print(&text).map(|_| ())
}

/// Where the train rests and its natural frequencies there, or why they are not known.
struct AtRest {
    rest: Result<Equilibrium, String>,
    /// Over omega_c, ascending, n values: 0 for motions that meet no stiffness.
    frequencies: Result<Vec<f64>, String>,
}

impl AtRest {
    fn of(study: &Study) -> AtRest {
        let (system, names) = (&study.assembly.system, &study.assembly.connections);
        let rest = equilibrium(system).map_err(|none| none.describe(names));
        AtRest {
            frequencies: (rest.as_ref().map_err(String::clone))
                .and_then(|rest| frequencies_at_rest(system, rest, names)),
            rest,
        }
    }

    /// The frequencies where they are others than those of full contact.
    fn own_frequencies(&self, study: &Study) -> Option<&[f64]> {
        let own = self.frequencies.as_ref().ok()?;
        let contact = &study.assembly.natural_frequencies;
        let is_same = own.len() == contact.len()
            && own
                .iter()
                .zip(contact.iter())
                .all(|(a, b)| (a - b).abs() <= SAME * b.abs());
        (!is_same).then_some(own)
    }
}

/// Natural frequencies that differ by less are those of full contact.
const SAME: f64 = 1e-9;

fn warnings(study: &Study, state: &AtRest) -> Vec<String> {
    // The assembly hands on the warnings of the model.
    let mut list = study.assembly.warnings.clone();
    match &state.rest {
        Err(reason) => list.push(reason.clone()),
        Ok(rest) if !rest.is_unique => list.push(
            "the static equilibrium is not unique (no load decides where in its gap a connection rests): the middle of \
             the gap is used"
                .into(),
        ),
        Ok(_) => {}
    }
    list
}

/// Deformations at rest in the units of the report.
fn at_rest(study: &Study, rest: &Equilibrium) -> Vec<f64> {
    let is_si = study.model.report_units == ReportUnits::Si;
    let scales = study
        .assembly
        .scales
        .displacement
        .iter()
        .map(|l| if is_si { *l } else { 1.0 });
    rest.deformation
        .iter()
        .zip(scales)
        .map(|(x, l)| x * l)
        .collect()
}

fn as_value(study: &Study, state: &AtRest, warnings: &[String]) -> Value {
    let mut value = summary(&study.model, &study.assembly);
    let is_block = stored_blocks(&study.assembly.system).is_some();
    value["jacobian"] = json!(if is_block { "blocks" } else { "dense" });
    let rest = state.rest.as_ref();
    value["static_displacement"] = json!(rest.ok().map(|r| at_rest(study, r)));
    value["static_flank"] = json!(rest.ok().map(|r| r.flank.clone()));
    value["static_reason"] = json!(rest.err());
    let frequencies = state.frequencies.as_ref();
    value["natural_frequencies_at_rest"] = json!(frequencies.ok());
    let w_c = study.assembly.scales.frequency;
    let is_train = study.assembly.coupling.is_some();
    value["natural_frequencies_at_rest_rad_s"] = json!(
        (frequencies.ok().filter(|_| is_train))
            .map(|list| list.iter().map(|w| w * w_c).collect::<Vec<_>>())
    );
    value["natural_frequencies_at_rest_reason"] = json!(frequencies.err());
    let names = study.assembly.connections.iter();
    let mounts = study.assembly.system.mounts().iter();
    let supported = names.zip(mounts.map(support::of));
    value["solvers"] = supported
        .map(|(name, list)| (name.clone(), json!(list)))
        .collect::<serde_json::Map<_, _>>()
        .into();
    value["integrator"] = json!(automatic(&study.assembly.system));
    value["static_is_unique"] = json!(rest.ok().map(|r| r.is_unique));
    value["analyses"] = json!(
        study
            .runs
            .iter()
            .map(|r| r.name.clone())
            .collect::<Vec<_>>()
    );
    value["numbers"] = json!(study.model.numbers());
    value["warnings"] = json!(warnings);
    value
}

fn as_text(study: &Study, state: &AtRest, warnings: &[String]) -> String {
    let (model, assembly) = (&study.model, &study.assembly);
    let data = summary(model, assembly);
    let mut text = format!("{}\n\n", model.name);
    if let Some(bodies) = data["bodies"].as_array().filter(|list| !list.is_empty()) {
        let named = bodies
            .iter()
            .zip(data["inertias"].as_array().into_iter().flatten());
        let list: Vec<String> = named
            .map(|(b, i)| match (b.as_str().unwrap_or_default(), i) {
                (body, Value::Null) => format!("{body} (prescribed motion)"),
                (body, i) => format!("{body} ({i})"),
            })
            .collect();
        let _ = writeln!(text, "bodies (inertia):      {}", list.join(", "));
    }
    let _ = writeln!(
        text,
        "relative coordinates:  {}",
        assembly.coordinates.join(", ")
    );
    let _ = writeln!(text, "rigid-body modes:      {}", data["rigid_body_modes"]);
    let _ = writeln!(
        text,
        "omega_c:               {} rad/s",
        number(assembly.scales.frequency)
    );
    let jacobian = match stored_blocks(&assembly.system) {
        None => "dense".to_string(),
        Some([stored, all]) => format!("by blocks, {stored} of {all}"),
    };
    let _ = writeln!(text, "Galerkin Jacobian:     {jacobian}\n");
    let _ = writeln!(text, "{}\n", connections(study, state));
    text.push_str(&kinematics::text(model));
    text.push_str(&solvers(study));
    let contact = study.assembly.natural_frequencies.as_slice();
    let _ = writeln!(text, "{}\n", frequencies(study, "mode in contact", contact));
    if let Some(own) = state.own_frequencies(study) {
        let _ = writeln!(text, "{}\n", frequencies(study, "mode at rest", own));
    }
    if let (Ok(_), Err(reason)) = (&state.rest, &state.frequencies) {
        let _ = writeln!(text, "no natural frequencies at rest: {reason}\n");
    }
    for (name, matrix) in [
        ("stiffness (kappa, n x e)", assembly.system.stiffness()),
        ("damping (Gam, n x n)", assembly.system.damping()),
        ("element map (W, e x n)", assembly.system.element_map()),
    ] {
        let _ = writeln!(text, "{name}, nondimensional\n{}", as_rows(matrix));
    }
    let names: Vec<&str> = study.runs.iter().map(|r| r.name.as_str()).collect();
    let _ = writeln!(
        text,
        "analyses: {}",
        if names.is_empty() {
            "none".to_string()
        } else {
            names.join(", ")
        }
    );
    for warning in warnings {
        let _ = writeln!(text, "warning: {warning}");
    }
    text
}

/// A line per analysis: estimated time and memory.
fn estimates(costs: &[(String, Cost)]) -> String {
    let line = |(name, cost): &(String, Cost)| {
        let (time, memory) = (machine::duration(cost.seconds), machine::bytes(cost.bytes));
        match cost.seconds >= 1.0 || cost.bytes >= 1e8 {
            true => format!("estimated cost of {name}: {time}, {memory}\n"),
            false => String::new(),
        }
    };
    costs.iter().map(line).collect()
}

/// What each solver can do with each connection: a table, and a line for every answer but a plain yes.
fn solvers(study: &Study) -> String {
    let assembly = &study.assembly;
    let mut table = Table::new();
    table.load_style(presets::UTF8_HORIZONTAL_ONLY);
    let mut notes: Vec<(String, Vec<&str>)> = Vec::new();
    for (name, mount) in assembly.connections.iter().zip(assembly.system.mounts()) {
        let list = support::of(mount);
        if table.header().is_none() {
            let solvers = list.iter().map(|s| s.solver);
            table.set_header(std::iter::once("solvers").chain(solvers));
        }
        table.add_row(std::iter::once(name.as_str()).chain(list.iter().map(word)));
        for s in list.iter().filter(|s| s.reach != Reach::Yes) {
            let note = format!("{}, {}: {}", s.solver, word(s), s.how);
            match notes.iter_mut().find(|(text, _)| *text == note) {
                Some((_, names)) => names.push(name),
                None => notes.push((note, vec![name])),
            }
        }
    }
    let mut text = format!("{table}\n");
    for (note, names) in notes {
        const SHOWN: usize = 8;
        let more = if names.len() > SHOWN { ", .." } else { "" };
        let shown = &names[..names.len().min(SHOWN)];
        let _ = writeln!(text, "{note} ({}{more})", shown.join(", "));
    }
    let chosen = match automatic(&assembly.system) {
        IntegratorChoice::Exact => "exact flow",
        IntegratorChoice::Series => "series flow",
        IntegratorChoice::Dopri5 | IntegratorChoice::Auto => "DOPRI5",
    };
    let _ = writeln!(text, "integrator auto: {chosen}\n");
    text
}

fn word(support: &Support) -> &str {
    match support.reach {
        Reach::Yes if support.solver == "multipliers" => &support.how,
        Reach::Yes => "yes",
        Reach::Limited => "limited",
        Reach::No => "no",
    }
}

/// One line per connection: scale, law, rest position.
fn connections(study: &Study, state: &AtRest) -> Table {
    let assembly = &study.assembly;
    let mut table = Table::new();
    table.load_style(presets::UTF8_HORIZONTAL_ONLY);
    table.set_header(["connection", "law", "scale l", "at rest", "rests on"]);
    let rest = state.rest.as_ref().ok();
    let at_rest = rest.map(|r| at_rest(study, r));
    for (e, name) in assembly.connections.iter().enumerate() {
        let element = &assembly.system.mounts()[e].element;
        let (unit, _) = study.model.units_of(e);
        let position = at_rest
            .as_ref()
            .map_or("none".to_string(), |x| number(x[e]));
        let flank = match rest.map(|r| r.flank[e]) {
            None => "-",
            Some(0) => "open",
            Some(1) => "+ flank",
            Some(_) => "- flank",
        };
        let scale = format!("{} {unit}", number(assembly.scales.displacement[e]));
        table.add_row([
            name.clone(),
            element.typetag_name().to_string(),
            scale,
            position,
            flank.into(),
        ]);
    }
    table
}

fn frequencies(study: &Study, title: &str, list: &[f64]) -> Table {
    let is_train = study.assembly.coupling.is_some();
    let mut table = Table::new();
    table.load_style(presets::UTF8_HORIZONTAL_ONLY);
    table.set_header([title, "omega/omega_c", "Hz", "rpm"]);
    for (k, w) in list.iter().enumerate() {
        let hertz = w * study.assembly.scales.frequency / TAU;
        let dimensional = |x: f64| if is_train { number(x) } else { "-".to_string() };
        table.add_row([
            (k + 1).to_string(),
            number(*w),
            dimensional(hertz),
            dimensional(60.0 * hertz),
        ]);
    }
    table
}

fn as_rows(matrix: &DMatrix<f64>) -> String {
    const SHOWN: usize = 12;
    if matrix.nrows() > SHOWN || matrix.ncols() > SHOWN {
        return format!(
            "    {} x {}; --json prints all of it\n",
            matrix.nrows(),
            matrix.ncols()
        );
    }
    let row = |r: usize| {
        (0..matrix.ncols())
            .map(|c| format!("{:>14}", number(matrix[(r, c)])))
            .collect::<String>()
    };
    (0..matrix.nrows()).map(|r| row(r) + "\n").collect()
}
