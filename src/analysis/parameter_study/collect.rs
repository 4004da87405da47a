//! One cell from a table of a run.

use super::settings::Given;
use crate::analysis::EVENTS;
use crate::analysis::{Fault, Setting};
use crate::error::did_you_mean;
use crate::quantity::Quantity;
use crate::report::{Cell, Column, Report, Table, Values};
use indexmap::IndexMap;
use schemars::JsonSchema;
use serde::{Deserialize, Serialize};

/// A quantity of each run.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
#[non_exhaustive]
pub struct Collected {
    /// Table: `main`, or one with a name such as `events`.
    #[serde(default = "main")]
    pub table: String,
    /// Column; optional for `count` of rows.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub column: Option<String>,
    /// Reduction of its rows to one value.
    pub reduce: Reduce,
    /// Column to which `argmax`, `argmin` and `at` refer; default: the excitation frequency, the time or the
    /// parameter.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub by: Option<String>,
    /// Selects rows with these values in these columns.
    #[serde(default, rename = "where", skip_serializing_if = "IndexMap::is_empty")]
    pub only: IndexMap<String, Given>,
}

fn main() -> String {
    "main".into()
}

/// Reduction of the rows of a column to one value. Empty cells are ignored.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(rename_all = "snake_case")]
pub enum Reduce {
    /// The largest value.
    Max,
    /// The smallest value.
    Min,
    /// The arithmetic mean.
    Mean,
    /// The largest minus the smallest value.
    Range,
    /// The first value in the table.
    First,
    /// The last value in the table.
    Last,
    /// Number of values.
    Count,
    /// `by` in the row of the maximum.
    Argmax,
    /// `by` in the row of the minimum.
    Argmin,
    /// The value where `by` has this value: in a row with exactly that value, otherwise interpolated between the
    /// first two neighbours around it.
    At(Quantity),
}

/// What the rows of a table go by, the first that it has.
const ABSCISSAE: [&str; 8] = [
    "frequency_hz",
    "omega",
    "T",
    "t",
    "time",
    "parameter",
    "amplitude",
    "effective_stiffness",
];
/// A row is at a value when it agrees with it to this share: marks are solved at rounded frequencies.
const AT: f64 = 1e-9;

/// A quantity ready to be taken from reports.
#[derive(Debug, Clone)]
pub(super) struct Collector {
    table: String,
    values: Option<String>,
    by: Option<String>,
    reduce: Rule,
    only: Vec<(String, Given)>,
    /// Its column: name, unit, no values.
    pub column: Column,
}

/// [`Reduce`] with its number in the unit of `by`.
#[derive(Debug, Clone, Copy, PartialEq)]
enum Rule {
    Extremum(Extreme),
    Mean,
    Range,
    First,
    Last,
    Count,
    Where(Extreme),
    At(f64),
}

#[derive(Debug, Clone, Copy, PartialEq, Eq)]
enum Extreme {
    Max,
    Min,
}

impl Collector {
    /// Checks a quantity against the tables that the runs deliver; `kind` is their analysis's type.
    ///
    /// # Errors
    /// Everything wrong with it, on keys below `collect.NAME`.
    pub fn new(
        name: &str,
        written: &Collected,
        (kind, tables): (&str, &[Table]),
        setting: &Setting<'_>,
    ) -> Result<Collector, Vec<Fault>> {
        let fault =
            |key: &str, message: String| Fault::new(format!("collect.{name}.{key}"), message);
        let own = if written.table == "main" {
            ""
        } else {
            &written.table
        };
        let Some(table) = tables.iter().find(|t| t.name == own) else {
            let known = tables.iter().map(|t| match t.name.as_str() {
                "" => "main",
                name => name,
            });
            let known: Vec<&str> = known.collect();
            let hint = did_you_mean(&written.table, known);
            let message = format!(
                "`{kind}` delivers no table `{}` here; {hint}",
                written.table
            );
            return Err(vec![fault("table", message)]);
        };
        let mut faults = Vec::new();
        let mut find = |key: &str, name: &str| {
            let found = table.column(name);
            if found.is_none() {
                let names: Vec<&String> = table.columns.iter().map(|c| &c.name).collect();
                let hint = did_you_mean(name, names);
                let message = format!(
                    "the table `{}` has no column `{name}`; {hint}",
                    written.table
                );
                faults.push(fault(key, message));
            }
            found
        };
        let column = (written.column.as_ref()).and_then(|name| find("column", name));
        let mut only = Vec::new();
        for (name, value) in &written.only {
            find(&format!("where.{name}"), name);
            only.push((name.clone(), value.clone()));
        }
        let by = match &written.by {
            Some(name) => find("by", name),
            None => abscissa(table, kind),
        };
        if !faults.is_empty() {
            return Err(faults);
        }
        let found = CollectedColumns { column, by };
        let (reduce, unit, values) = found
            .rule(written, setting)
            .map_err(|(key, message)| vec![fault(key, message)])?;
        if let Some(message) = unknown_event(own, &written.only) {
            return Err(vec![fault("where.kind", message)]);
        }
        Ok(Collector {
            table: own.to_owned(),
            values: column.map(|c| c.name.clone()),
            by: by.map(|c| c.name.clone()),
            reduce,
            only,
            column: Column {
                name: name.to_owned(),
                unit,
                values,
            },
        })
    }

    /// The value in a run's report; an empty cell where there is none.
    pub fn cell(&self, report: &Report) -> Cell {
        let empty = match self.column.values {
            Values::Float(_) => Cell::Float(f64::NAN),
            Values::Integer(_) => Cell::Integer(0),
            Values::Text(_) => Cell::Text(String::new()),
        };
        let Some(table) = report.table(&self.table) else {
            return empty;
        };
        let rows: Vec<usize> = (0..table.rows())
            .filter(|row| self.counts(table, *row))
            .collect();
        let column = self.values.as_ref().and_then(|name| table.column(name));
        let by = self.by.as_ref().and_then(|name| table.column(name));
        match (column.map(|c| &c.values), self.reduce) {
            (None, Rule::Count) => Cell::Integer(rows.len() as i64),
            (None, _) => empty,
            (Some(Values::Text(words)), rule) => {
                let words = |row: usize| Some(words[row].as_str()).filter(|word| !word.is_empty());
                let found = match rule {
                    Rule::Count => {
                        let count = rows.iter().filter(|row| words(**row).is_some()).count();
                        return Cell::Integer(count as i64);
                    }
                    Rule::First => rows.iter().find_map(|row| words(*row)),
                    Rule::Last => rows.iter().rev().find_map(|row| words(*row)),
                    Rule::At(value) => by.and_then(|by| exactly(&rows, by, value)).and_then(words),
                    _ => None,
                };
                found.map_or(empty, |word| Cell::Text(word.to_owned()))
            }
            (Some(values), rule) => numeric(&rows, values, by, table, rule),
        }
    }

    /// Whether a row has the requested values.
    fn counts(&self, table: &Table, row: usize) -> bool {
        self.only.iter().all(|(name, wanted)| {
            let Some(column) = table.column(name) else {
                return false;
            };
            match (&column.values, wanted) {
                (Values::Text(words), wanted) => words[row] == wanted.text(),
                (values, Given::Quantity(q)) => is_at(number(values, row), q.value),
                (_, Given::Word(_)) => false,
            }
        })
    }
}

/// The columns that a quantity is about.
struct CollectedColumns<'a> {
    column: Option<&'a Column>,
    by: Option<&'a Column>,
}

impl CollectedColumns<'_> {
    /// The rule, and unit and kind of its results.
    fn rule(
        &self,
        written: &Collected,
        setting: &Setting<'_>,
    ) -> Result<(Rule, String, Values), (&'static str, String)> {
        let float = Values::Float(Vec::new());
        if written.reduce == Reduce::Count {
            return Ok((Rule::Count, String::new(), Values::Integer(Vec::new())));
        }
        let column = (self.column).ok_or(("column", "missing: which column?".to_string()))?;
        let is_text = matches!(column.values, Values::Text(_));
        let text_or_float = if is_text {
            Values::Text(Vec::new())
        } else {
            float.clone()
        };
        let own = |rule| (rule, column.unit.clone(), text_or_float.clone());
        let rule = match &written.reduce {
            Reduce::First => return Ok(own(Rule::First)),
            Reduce::Last => return Ok(own(Rule::Last)),
            Reduce::At(value) => {
                let by = self.numeric_by()?;
                let value = in_unit_of(by, value, setting).map_err(|m| ("reduce.at", m))?;
                return Ok(own(Rule::At(value)));
            }
            Reduce::Max => Rule::Extremum(Extreme::Max),
            Reduce::Min => Rule::Extremum(Extreme::Min),
            Reduce::Argmax => Rule::Where(Extreme::Max),
            Reduce::Argmin => Rule::Where(Extreme::Min),
            Reduce::Mean => Rule::Mean,
            Reduce::Range => Rule::Range,
            Reduce::Count => Rule::Count,
        };
        if is_text {
            let message = format!("`{}` holds words: first, last, count or at", column.name);
            return Err(("reduce", message));
        }
        match rule {
            Rule::Where(_) => Ok((rule, self.numeric_by()?.unit.clone(), float)),
            _ => Ok((rule, column.unit.clone(), float)),
        }
    }

    fn numeric_by(&self) -> Result<&Column, (&'static str, String)> {
        match self.by {
            Some(by) if !matches!(by.values, Values::Text(_)) => Ok(by),
            Some(by) => Err(("by", format!("`{}` holds words, wanted numbers", by.name))),
            None => Err((
                "by",
                "missing: the table has none of the default columns".into(),
            )),
        }
    }
}

/// What the rows of a table go by.
fn abscissa<'a>(table: &'a Table, kind: &str) -> Option<&'a Column> {
    // There the frequency is the same in every row.
    let own = (kind == "parameter_response").then_some("parameter");
    own.into_iter()
        .chain(ABSCISSAE)
        .find_map(|name| table.column(name))
}

/// A quantity as a number in the unit of a column.
fn in_unit_of(column: &Column, given: &Quantity, setting: &Setting<'_>) -> Result<f64, String> {
    if given.dimension.is_none() {
        return Ok(given.value);
    }
    if column.unit.is_empty() {
        return match column.name.as_str() {
            "omega" | "parameter" => setting.frequency(given),
            name => Err(format!("`{name}` has no unit, `{}` has", given.text)),
        };
    }
    let unit = Quantity::parse(&format!("1 {}", column.unit))?;
    let dimension = unit
        .dimension
        .unwrap_or(crate::quantity::UnitDimension::NUMBER);
    Ok(given.si(dimension)? / unit.value)
}

fn unknown_event(table: &str, only: &IndexMap<String, Given>) -> Option<String> {
    let kind = only.get("kind").filter(|_| table == "events")?.text();
    let is_known = EVENTS.contains(&kind);
    (!is_known).then(|| {
        format!(
            "no event is called `{kind}`; {}",
            did_you_mean(kind, EVENTS)
        )
    })
}

/// A number of a column; NaN where there is none.
fn number(values: &Values, row: usize) -> f64 {
    match values {
        Values::Float(v) => v[row],
        Values::Integer(v) => v[row] as f64,
        Values::Text(_) => f64::NAN,
    }
}

fn is_at(found: f64, wanted: f64) -> bool {
    (found - wanted).abs() <= AT * wanted.abs()
}

/// The first of the rows where a column has a value.
fn exactly(rows: &[usize], by: &Column, value: f64) -> Option<usize> {
    let is_there = |row: &&usize| is_at(number(&by.values, **row), value);
    rows.iter().find(is_there).copied()
}

/// A rule for numbers.
fn numeric(
    rows: &[usize],
    values: &Values,
    by: Option<&Column>,
    table: &Table,
    rule: Rule,
) -> Cell {
    let numbers = || {
        (rows.iter())
            .map(|row| (*row, number(values, *row)))
            .filter(|(_, x)| x.is_finite())
    };
    let extremum = |which: Extreme| {
        numbers().fold(None, |best: Option<(usize, f64)>, (row, x)| match best {
            Some((_, y)) if which == Extreme::Max && x <= y => best,
            Some((_, y)) if which == Extreme::Min && x >= y => best,
            _ => Some((row, x)),
        })
    };
    let found = match rule {
        Rule::Count => return Cell::Integer(numbers().count() as i64),
        Rule::Extremum(which) => extremum(which).map(|(_, x)| x),
        Rule::Range => extremum(Extreme::Max)
            .zip(extremum(Extreme::Min))
            .map(|((_, high), (_, low))| high - low),
        Rule::Mean => {
            let (count, sum) = numbers().fold((0usize, 0.0), |(n, sum), (_, x)| (n + 1, sum + x));
            (count > 0).then(|| sum / count as f64)
        }
        Rule::First => numbers().next().map(|(_, x)| x),
        Rule::Last => numbers().next_back().map(|(_, x)| x),
        Rule::Where(which) => extremum(which)
            .zip(by)
            .map(|((row, _), by)| number(&by.values, row)),
        Rule::At(value) => by.and_then(|by| at(rows, values, by, table, value)),
    };
    Cell::Float(found.unwrap_or(f64::NAN))
}

/// The value where `by` passes a value: of the first row that is there, else interpolated between the first two neighbours
/// of one branch and run around it.
fn at(rows: &[usize], values: &Values, by: &Column, table: &Table, value: f64) -> Option<f64> {
    if let Some(row) = exactly(rows, by, value) {
        return Some(number(values, row));
    }
    let same = |a: usize, b: usize| {
        let parts = ["branch", "run"]
            .iter()
            .filter_map(|name| table.column(name));
        parts
            .into_iter()
            .all(|part| number(&part.values, a) == number(&part.values, b))
    };
    rows.windows(2).find_map(|pair| {
        let [a, b] = [pair[0], pair[1]];
        let [xa, xb] = [a, b].map(|row| number(&by.values, row));
        let is_between = (xa - value) * (xb - value) < 0.0 && b == a + 1 && same(a, b);
        let share = (value - xa) / (xb - xa);
        let [ya, yb] = [a, b].map(|row| number(values, row));
        is_between.then_some(ya + share * (yb - ya))
    })
}
