//! Results as tables: written once by the analyses, read by every output.

mod comparison;
mod description;
mod figure;
mod plot;
mod words;

pub use comparison::{Comparison, Difference, ReportChange};
pub use description::{ArmNote, BodyNote, ConnectionNote, Description};
pub use figure::{
    AxisScale, Curve, CurveStyle, Figure, FrequencyAxis, FrequencyUnit, NamedFigure, Panel,
};
pub use plot::{FigureSize, Measured, Plot};
pub use words::{Words, readable};

use serde::{Deserialize, Deserializer, Serialize, Serializer};
use std::borrow::Cow;

/// Text with control characters replaced by their symbols, such as ␛ for the escape character, because they could move the
/// cursor of a terminal or break a page. Line ends and tabs are kept.
pub fn shown(text: &str) -> Cow<'_, str> {
    let is_plain = |c: char| !c.is_control() && !is_bidirectional(c) || matches!(c, '\n' | '\t');
    if text.chars().all(is_plain) {
        return Cow::Borrowed(text);
    }
    let symbol = |c: char| match c {
        c if is_plain(c) => c,
        '\u{7f}' => '\u{2421}',
        '\0'..='\u{1f}' => char::from_u32(0x2400 + c as u32).unwrap_or('\u{fffd}'),
        _ => '\u{fffd}',
    };
    Cow::Owned(text.chars().map(symbol).collect())
}

/// Marks that turn the direction of what follows: a text could show another order than it has.
fn is_bidirectional(c: char) -> bool {
    matches!(c, '\u{202a}'..='\u{202e}' | '\u{2066}'..='\u{2069}')
}

/// Values of a column. A NaN in `Float` is an empty cell.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
#[serde(rename_all = "lowercase")]
pub enum Values {
    /// Real numbers, written with 17 significant digits.
    #[serde(serialize_with = "with_gaps", deserialize_with = "from_gaps")]
    Float(Vec<f64>),
    /// Whole numbers.
    Integer(Vec<i64>),
    /// Words.
    Text(Vec<String>),
}

/// Numbers with empty cells as null, because JSON has no NaN.
fn with_gaps<S: Serializer>(values: &[f64], serializer: S) -> Result<S::Ok, S::Error> {
    let cell = |x: &f64| (!x.is_nan()).then_some(*x);
    serializer.collect_seq(values.iter().map(cell))
}

fn from_gaps<'de, D: Deserializer<'de>>(deserializer: D) -> Result<Vec<f64>, D::Error> {
    let cells: Vec<Option<f64>> = Vec::deserialize(deserializer)?;
    Ok(cells.into_iter().map(|x| x.unwrap_or(f64::NAN)).collect())
}

impl Values {
    /// A cell of this kind from its text; `None` when the text is of another kind.
    pub(crate) fn read_cell(&self, text: &str) -> Option<Cell> {
        match self {
            Values::Float(_) if text.is_empty() => Some(Cell::Float(f64::NAN)),
            Values::Float(_) => text.parse().ok().map(Cell::Float),
            Values::Integer(_) => text.parse().ok().map(Cell::Integer),
            Values::Text(_) => Some(Cell::Text(text.to_owned())),
        }
    }

    /// Real numbers, NaN for empty cells; `None` for another kind.
    pub fn as_floats(&self) -> Option<&[f64]> {
        match self {
            Values::Float(values) => Some(values),
            _ => None,
        }
    }

    /// Whole numbers; `None` for another kind.
    pub fn as_integers(&self) -> Option<&[i64]> {
        match self {
            Values::Integer(values) => Some(values),
            _ => None,
        }
    }

    /// Words; `None` for another kind.
    pub fn as_texts(&self) -> Option<&[String]> {
        match self {
            Values::Text(values) => Some(values),
            _ => None,
        }
    }

    /// Number of rows.
    pub fn len(&self) -> usize {
        match self {
            Values::Float(v) => v.len(),
            Values::Integer(v) => v.len(),
            Values::Text(v) => v.len(),
        }
    }

    /// Whether there are no rows.
    pub fn is_empty(&self) -> bool {
        self.len() == 0
    }

    /// No values of the same kind.
    fn without_rows(&self) -> Values {
        match self {
            Values::Float(_) => Values::Float(Vec::new()),
            Values::Integer(_) => Values::Integer(Vec::new()),
            Values::Text(_) => Values::Text(Vec::new()),
        }
    }

    /// Appends a cell.
    ///
    /// # Panics
    /// If the cell is of another kind.
    pub fn push(&mut self, cell: Cell) {
        match (self, cell) {
            (Values::Float(v), Cell::Float(x)) => v.push(x),
            (Values::Integer(v), Cell::Integer(i)) => v.push(i),
            (Values::Text(v), Cell::Text(text)) => v.push(text),
            (values, cell) => panic!("{cell:?} in a column of another kind: {values:?}"),
        }
    }

    /// Word for the kind: `float`, `integer` or `text`.
    pub fn kind(&self) -> &'static str {
        match self {
            Values::Float(_) => "float",
            Values::Integer(_) => "integer",
            Values::Text(_) => "text",
        }
    }

    /// No values of the kind that [`Values::kind`] names.
    pub fn of_kind(word: &str) -> Option<Values> {
        match word {
            "float" => Some(Values::Float(Vec::new())),
            "integer" => Some(Values::Integer(Vec::new())),
            "text" => Some(Values::Text(Vec::new())),
            _ => None,
        }
    }
}

/// One value of a row.
#[derive(Debug, Clone, PartialEq)]
pub enum Cell {
    /// A real number; NaN is an empty cell.
    Float(f64),
    /// A whole number.
    Integer(i64),
    /// A word.
    Text(String),
}

/// A named column with its unit (empty: dimensionless).
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct Column {
    /// Column name, as in the header row.
    pub name: String,
    /// Unit, such as `m` or `rad/s`; empty when dimensionless.
    pub unit: String,
    /// One value per row.
    pub values: Values,
}

/// A table: columns of equal length. File name: `<analysis>.csv` when `name` is empty, else `<analysis>.<name>.csv`.
#[derive(Debug, Clone, Default, PartialEq, Serialize, Deserialize)]
pub struct Table {
    /// Empty for the main table, else `events`, `multipliers`, `orbits`, ...
    pub name: String,
    /// Columns, in the order of the file.
    pub columns: Vec<Column>,
}

/// Results of one analysis.
#[derive(Debug, Clone, Default, PartialEq, Serialize, Deserialize)]
pub struct Report {
    /// Name of the analysis in the model file: file stem of the results.
    pub name: String,
    /// Type of the analysis, such as `frequency_response`.
    pub kind: String,
    /// Heading.
    pub title: String,
    /// Caption.
    pub caption: String,
    /// Parameters that the author of the model assumed.
    pub assumed: Vec<String>,
    /// Main table first.
    pub tables: Vec<Table>,
    /// The figure of the analysis.
    pub figure: Option<Figure>,
    /// Further figures, each in a file of its own.
    pub further_figures: Vec<NamedFigure>,
    /// Requested contents and style of the figures.
    pub plot: Plot,
    /// Names of the connections in the order of the model: each has its colour in every figure of a run.
    pub connections: Vec<String>,
    /// Other entries of the JSON file: options, scales, branches, events; and the timings.
    pub summary: serde_json::Map<String, serde_json::Value>,
    /// Warnings, shown on the terminal, in the JSON file and on the page.
    pub warnings: Vec<String>,
    /// Reason of an early end (exit status 1); `None` if complete.
    pub ended_early: Option<String>,
    /// Set if the main table was written to its file row by row; `tables` then holds only the rows that are drawn.
    pub streamed: Option<Streamed>,
}

/// A main table that is already on disk.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct Streamed {
    /// Rows in the file.
    pub rows: u64,
    /// Names of the files that hold the table.
    pub files: Vec<String>,
}

impl Table {
    /// Column of that name.
    pub fn column(&self, name: &str) -> Option<&Column> {
        self.columns.iter().find(|c| c.name == name)
    }

    /// Real numbers of a column, NaN for empty cells; `None` if there is no such column of real numbers.
    pub fn floats(&self, name: &str) -> Option<&[f64]> {
        self.column(name)?.values.as_floats()
    }

    /// The columns without values, as announced by an analysis before it runs.
    pub fn without_rows(&self) -> Table {
        let columns = self.columns.iter().map(|column| Column {
            name: column.name.clone(),
            unit: column.unit.clone(),
            values: column.values.without_rows(),
        });
        Table {
            name: self.name.clone(),
            columns: columns.collect(),
        }
    }

    /// Number of rows.
    pub fn rows(&self) -> usize {
        self.columns.first().map_or(0, |c| c.values.len())
    }
}

/// Entry of a summary with the reasons of empty columns, by table.
const EMPTY_COLUMNS: &str = "empty_columns";

/// Name of a table in that entry.
fn of_main(table: &str) -> &str {
    match table {
        "" => "main",
        name => name,
    }
}

impl Report {
    /// Whether a table is already on disk.
    pub fn is_streamed(&self, table: &Table) -> bool {
        self.streamed.is_some() && table.name.is_empty()
    }

    /// Rows of a table in its file.
    pub fn rows(&self, table: &Table) -> u64 {
        match &self.streamed {
            Some(streamed) if self.is_streamed(table) => streamed.rows,
            _ => table.rows() as u64,
        }
    }

    /// Says why a column has no value in any row, as `empty_columns` of the JSON.
    pub(crate) fn explain_empty(&mut self, table: &str, column: &str, reason: &str) {
        let reasons = self
            .summary
            .entry(EMPTY_COLUMNS)
            .or_insert_with(|| serde_json::json!({}));
        reasons[of_main(table)][column] = reason.into();
    }

    /// Whether it is said why a column has no value.
    pub(crate) fn explains(&self, table: &str, column: &str) -> bool {
        let reasons = self.summary.get(EMPTY_COLUMNS);
        reasons.is_some_and(|list| list[of_main(table)].get(column).is_some())
    }

    /// The main table.
    pub fn main(&self) -> Option<&Table> {
        self.table("")
    }

    /// All figures, each with the name that its file has after that of the report; the first one's is empty.
    pub fn figures(&self) -> impl Iterator<Item = (&str, &Figure)> {
        let first = self.figure.iter().map(|figure| ("", figure));
        let further = self.further_figures.iter();
        first.chain(further.map(|named| (named.name.as_str(), &named.figure)))
    }

    /// Table of that name; the main table has the empty name.
    pub fn table(&self, name: &str) -> Option<&Table> {
        self.tables.iter().find(|t| t.name == name)
    }
}
