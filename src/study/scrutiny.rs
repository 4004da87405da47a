//! The last look at a report: a column without a value says why, numbers beyond the range of numbers are told, and a table without a
//! single finite number is no success.

use crate::report::{Report, Table, Values};

/// Quantities, the part of a column name before the first dot, that may have no value in any row, and why.
const REASONS: &[(&[&str], &str)] = &[
    (
        &[
            "impact_velocity_max",
            "impact_velocity_mean",
            "impact_energy_max",
        ],
        "no contact was made",
    ),
    (
        &["contact_front", "contact_back", "rattle_index"],
        "not defined for this motion: nothing touches, or no inertia is compared with a drag",
    ),
    (
        &[
            "effective_stiffness",
            "effective_stiffness_dc",
            "effective_frequency",
        ],
        "nothing moves, or a law without reference stiffness",
    ),
    (
        &[
            "f",
            "force_max",
            "force_min",
            "force_std",
            "force_peak",
            "force_peak_factor",
        ],
        "a rigid stop has impulses instead of a force",
    ),
    (
        &["force_mean"],
        "several stops act in the same direction: the balance of a period does not decide how much each carries",
    ),
    (
        &["stable", "multiplier_modulus", "neutral"],
        "multipliers were not computed: by the method of integration, or with `stability: false`",
    ),
    (&["residual", "iterations"], "the method has no residual"),
    (&["lyapunov"], "`lyapunov: false`"),
    (
        &[
            "located",
            "confirmed",
            "bracket_low",
            "bracket_high",
            "after_point",
        ],
        "the flow was not asked",
    ),
    (&["multiplicity"], "no multiplier passes the unit circle"),
    (
        &["connection", "breakpoint", "level"],
        "no event belongs to one connection",
    ),
    (&["parent", "event"], "no branch begins on another one"),
    (
        &["theta", "criticality", "mark", "state"],
        "does not apply to these rows",
    ),
    (
        &["peak_acceleration"],
        "a rigid stop acts on the body: at an impact its acceleration is an impulse",
    ),
    (&["deviation"], "nothing was compared"),
    (
        &["exact_fold"],
        "no point that was verified lies beyond a fold of the exact branch",
    ),
];

/// Columns named in one message.
const NAMED: usize = 6;

/// Notes why columns are empty, warns of those that should not be and of infinite numbers, and ends a report without a finite
/// number early.
pub(super) fn examine(report: &mut Report) {
    let mut reasons = Vec::new();
    let (mut unexplained, mut infinite) = (Vec::new(), Vec::new());
    let mut is_hollow = false;
    for table in &report.tables {
        // Of a table that went to its file row by row, only some rows are here.
        if report.is_streamed(table) || table.rows() == 0 {
            continue;
        }
        let look = TableFindings::at(table);
        let told = |column: &String| report.explains(&table.name, column);
        for (column, reason) in look.explained {
            reasons.push((table.name.clone(), column, reason));
        }
        let own = look.unexplained.into_iter().filter(|c| !told(c));
        unexplained.extend(own.map(|c| of_table(table, &c)));
        is_hollow |= table.name.is_empty() && look.is_hollow;
        infinite.extend(look.infinite.into_iter().map(|c| of_table(table, &c)));
    }
    for (table, column, reason) in reasons {
        report.explain_empty(&table, &column, reason);
    }
    let beyond = format!(
        "{} left the range of numbers (1.8e308): check sizes and units of the model",
        listed(&infinite)
    );
    if is_hollow {
        let nothing = "no row of the table has a value: check sizes and units of the model";
        let message = match infinite.is_empty() {
            true => nothing.to_owned(),
            false => beyond,
        };
        end(report, message);
        return;
    }
    if !infinite.is_empty() {
        report.warnings.push(beyond);
    }
    if !unexplained.is_empty() && report.ended_early.is_none() {
        report.warnings.push(format!(
            "no row has a value of {}: it does not exist for this motion, or could not be computed",
            listed(&unexplained)
        ));
    }
}

fn end(report: &mut Report, message: String) {
    report.ended_early = Some(match report.ended_early.take() {
        Some(reason) => format!("{reason}; {message}"),
        None => message,
    });
}

fn of_table(table: &Table, column: &str) -> String {
    match table.name.as_str() {
        "" => column.to_owned(),
        name => format!("{column} (table {name})"),
    }
}

fn listed(names: &[String]) -> String {
    let shown = names[..names.len().min(NAMED)].join(", ");
    match names.len().saturating_sub(NAMED) {
        0 => shown,
        more => format!("{shown} and {more} more"),
    }
}

/// What a look at a table finds.
struct TableFindings {
    /// Empty columns with the reason.
    explained: Vec<(String, &'static str)>,
    unexplained: Vec<String>,
    infinite: Vec<String>,
    /// Whether no measured column has a number.
    is_hollow: bool,
}

impl TableFindings {
    fn at(table: &Table) -> TableFindings {
        let mut look = TableFindings {
            explained: Vec::new(),
            unexplained: Vec::new(),
            infinite: Vec::new(),
            is_hollow: false,
        };
        let (mut measured, mut empty) = (0, 0);
        for (k, column) in table.columns.iter().enumerate() {
            let Values::Float(list) = &column.values else {
                continue;
            };
            if list.iter().any(|x| x.is_infinite()) {
                look.infinite.push(column.name.clone());
            }
            // The first column says where a row stands.
            measured += usize::from(k > 0);
            empty += usize::from(k > 0 && !list.iter().any(|x| x.is_finite()));
            if list.iter().any(|x| !x.is_nan()) {
                continue;
            }
            match reason(&column.name) {
                Some(reason) => look.explained.push((column.name.clone(), reason)),
                None => look.unexplained.push(column.name.clone()),
            }
        }
        look.is_hollow = measured > 0 && empty == measured;
        look
    }
}

fn reason(column: &str) -> Option<&'static str> {
    let quantity = column.split(['.', '(']).next().unwrap_or(column);
    let quantity = quantity.trim_end_matches(|c: char| c.is_ascii_digit() || c == '_');
    let found = REASONS.iter().find(|(list, _)| list.contains(&quantity));
    found.map(|(_, reason)| *reason)
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::report::Column;

    fn report(columns: &[(&str, &[f64])]) -> Report {
        let column = |(name, list): &(&str, &[f64])| Column {
            name: (*name).into(),
            unit: String::new(),
            values: Values::Float(list.to_vec()),
        };
        let table = Table {
            name: String::new(),
            columns: columns.iter().map(column).collect(),
        };
        let mut report = Report {
            tables: vec![table],
            ..Report::default()
        };
        examine(&mut report);
        report
    }

    #[test]
    fn empty_columns_have_a_reason_or_a_warning() {
        let gap = [f64::NAN, f64::NAN];
        let found = report(&[
            ("omega", &[1.0, 2.0]),
            ("rms.m", &[0.1, f64::NAN]),
            ("impact_velocity_max.m", &gap),
        ]);
        assert_eq!((found.warnings.len(), &found.ended_early), (0, &None));
        let reason = &found.summary["empty_columns"]["main"]["impact_velocity_max.m"];
        assert_eq!(reason, "no contact was made");
        let found = report(&[
            ("omega", &[1.0, 2.0]),
            ("rms.m", &gap),
            ("mean.m", &[0.0, 0.0]),
        ]);
        assert!(found.warnings[0].contains("rms.m"), "{:?}", found.warnings);
    }

    #[test]
    fn nothing_but_gaps_or_infinities_is_no_success() {
        let found = report(&[("omega", &[1.0]), ("rms.m", &[f64::NAN])]);
        assert!(found.ended_early.is_some_and(|r| r.contains("no row")));
        let found = report(&[("omega", &[1.0]), ("rms.m", &[f64::INFINITY])]);
        let end = found.ended_early.unwrap();
        assert!(end.contains("rms.m left the range"), "{end}");
        let found = report(&[("omega", &[1.0, 2.0]), ("rms.m", &[f64::INFINITY, 1.0])]);
        assert!(found.ended_early.is_none() && found.warnings[0].contains("left the range"));
    }
}
