//! Results as tables: written once by the analyses, read by every output.

/// Values of a column. A NaN in `Float` is an empty cell.
#[derive(Debug, Clone, PartialEq)]
pub enum Values {
    /// Real numbers, written with 17 significant digits.
    Float(Vec<f64>),
    /// Whole numbers.
    Integer(Vec<i64>),
    /// Words.
    Text(Vec<String>),
}

impl Values {
    /// Number of rows.
    pub fn len(&self) -> usize {
        match self {
            Values::Float(v) => v.len(),
            Values::Integer(v) => v.len(),
            Values::Text(v) => v.len(),
        }
    }

    /// Whether there is no row.
    pub fn is_empty(&self) -> bool {
        self.len() == 0
    }
}

/// A named column with its unit (empty: dimensionless).
#[derive(Debug, Clone, PartialEq)]
pub struct Column {
    /// Column name, as in the header row.
    pub name: String,
    /// Unit, such as `m` or `rad/s`; empty when dimensionless.
    pub unit: String,
    /// One value a row.
    pub values: Values,
}

/// A table: columns of equal length. File name: `<analysis>.csv` when `name` is empty, else `<analysis>.<name>.csv`.
#[derive(Debug, Clone, Default, PartialEq)]
pub struct Table {
    /// Empty for the main table, else `events`, `multipliers`, `orbits`, ...
    pub name: String,
    /// Columns, in the order of the file.
    pub columns: Vec<Column>,
}

/// One curve of a figure: columns of a table by name. It holds no numbers of its own.
#[derive(Debug, Clone, PartialEq)]
pub struct Curve {
    /// Name of the table (empty: the main table).
    pub table: String,
    /// Column along the abscissa.
    pub x: String,
    /// Column along the ordinate.
    pub y: String,
    /// Text in the legend.
    pub label: String,
    /// How it is drawn.
    pub style: CurveStyle,
    /// Rows drawn: a column of words or whole numbers and the value it must have; all rows when `None`.
    pub only: Option<(String, String)>,
}

/// How a curve is drawn.
#[derive(Debug, Clone, PartialEq)]
pub enum CurveStyle {
    /// A plain line.
    Line,
    /// A line that breaks where column `branch` changes, solid where column `stable` is 1, dashed where it is 0,
    /// thin solid where it is empty (unknown).
    Branch {
        /// Column with the branch number.
        branch: String,
        /// Column with 1, 0 or empty.
        stable: String,
    },
    /// Crosses, such as the backbone curve of the paper's figures.
    Crosses,
    /// Small dots, such as a Poincaré map.
    Dots,
    /// Event markers; the column named here holds the kind, one marker shape and legend entry a kind. When the table has
    /// no column `y`, the ordinate is interpolated in the main table, between the points `after_point` and the next one
    /// of the event's `branch`.
    Events {
        /// Column with the kind of the event.
        kind: String,
    },
}

/// A diagram: one or several panels that share nothing but the page.
#[derive(Debug, Clone, Default, PartialEq)]
pub struct Figure {
    /// Heading.
    pub title: String,
    /// Panels from top to bottom.
    pub panels: Vec<Panel>,
}

/// One pair of axes.
#[derive(Debug, Clone, Default, PartialEq)]
pub struct Panel {
    /// Text of the abscissa, unit included.
    pub x_label: String,
    /// Text of the ordinate, unit included.
    pub y_label: String,
    /// Range of the abscissa; from the data when `None`.
    pub x_range: Option<(f64, f64)>,
    /// Curves, drawn in this order.
    pub curves: Vec<Curve>,
}

/// What one analysis delivers.
#[derive(Debug, Clone, Default, PartialEq)]
pub struct Report {
    /// Name of the analysis in the model file: file stem of the results.
    pub name: String,
    /// Type of the analysis, such as `frequency_response`.
    pub kind: String,
    /// Heading.
    pub title: String,
    /// What to look for.
    pub caption: String,
    /// Parameters that the author of the model assumed.
    pub assumed: Vec<String>,
    /// Main table first.
    pub tables: Vec<Table>,
    /// One figure an analysis at most.
    pub figure: Option<Figure>,
    /// Everything else for the JSON file: options, scales, branches, events, timings.
    pub summary: serde_json::Map<String, serde_json::Value>,
    /// What the user must know: shown on the terminal, in the JSON file and on the page.
    pub warnings: Vec<String>,
    /// Why the analysis ended early, if it did (exit status 1).
    pub ended_early: Option<String>,
}

impl Table {
    /// Column of that name.
    pub fn column(&self, name: &str) -> Option<&Column> {
        self.columns.iter().find(|c| c.name == name)
    }

    /// Number of rows.
    pub fn rows(&self) -> usize {
        self.columns.first().map_or(0, |c| c.values.len())
    }
}

impl Report {
    /// Table of that name; the main table has the empty name.
    pub fn table(&self, name: &str) -> Option<&Table> {
        self.tables.iter().find(|t| t.name == name)
    }
}
