//! Figures: which columns are drawn against which, and how. They hold no numbers of their own.

use schemars::JsonSchema;
use serde::{Deserialize, Serialize};

/// One curve of a figure: columns of a table by name. It holds no numbers of its own.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct Curve {
    /// Name of the table (empty: the main table).
    pub table: String,
    /// Column of the abscissa.
    pub x: String,
    /// Column along the ordinate.
    pub y: String,
    /// Text in the legend.
    pub label: String,
    /// Style.
    pub style: CurveStyle,
    /// Rows drawn: a column of words or whole numbers and the value it must have; all rows when `None`.
    pub only: Option<(String, String)>,
}

/// Style of a curve.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
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
    /// Dots coloured by the values of a column.
    Coloured {
        /// Column of the colour.
        by: String,
    },
    /// Cells of a grid over the two columns, each coloured by its row: words and whole numbers a colour per value, real numbers
    /// a scale of colours. Curves that follow are drawn over them.
    Cells {
        /// Column that decides the colour.
        value: String,
        /// Values with what the legend says of them, in the order of their colours; others come behind.
        names: Vec<(String, String)>,
    },
    /// Bars along the ordinate from zero: `x` their middle, `width` a column of their widths.
    Bars {
        /// Column of the widths.
        width: String,
    },
    /// Horizontal bars from zero, the largest on top: `y` their length; a column of words names each.
    Tornado {
        /// Column of the names.
        name: String,
    },
    /// Event markers; the column named here holds the kind, one marker shape and legend entry a kind. When the table has
    /// no column `y`, the ordinate is interpolated in the main table, between the points `after_point` and the next one
    /// of the event's `branch`.
    Events {
        /// Column with the kind of the event.
        kind: String,
    },
}

/// A figure beside the first one of a report.
#[derive(Debug, Clone, Default, PartialEq, Serialize, Deserialize)]
pub struct NamedFigure {
    /// Follows the name of the report in the name of the file.
    pub name: String,
    /// The figure.
    pub figure: Figure,
}

/// Scale of an axis.
#[derive(Debug, Clone, Copy, Default, PartialEq, Eq, Serialize, Deserialize, JsonSchema)]
#[serde(rename_all = "snake_case")]
pub enum AxisScale {
    /// Linear.
    #[default]
    Linear,
    /// Logarithmic.
    Log,
}

/// A diagram: one or several panels that share nothing but the page.
#[derive(Debug, Clone, Default, PartialEq, Serialize, Deserialize)]
pub struct Figure {
    /// Heading.
    pub title: String,
    /// Panels from top to bottom.
    pub panels: Vec<Panel>,
}

/// An abscissa of frequencies omega.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
pub struct FrequencyAxis {
    /// Unit of the column.
    pub written: FrequencyUnit,
    /// Unit of the axis.
    pub shown: FrequencyUnit,
    /// Characteristic frequency omega_c, rad/s.
    pub omega_c: f64,
}

/// Unit of a column of frequencies.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize, Deserialize)]
pub enum FrequencyUnit {
    /// omega/omega_c.
    Nondimensional,
    /// rad/s.
    RadianPerSecond,
    /// Hz.
    Hertz,
    /// rpm.
    RevolutionsPerMinute,
}

impl FrequencyAxis {
    /// Numbers that are drawn over those that are written.
    pub fn factor(&self) -> f64 {
        match self.written == self.shown {
            true => 1.0,
            false => self.size(self.written) / self.size(self.shown),
        }
    }

    /// One of a unit in rad/s.
    pub fn size(&self, unit: FrequencyUnit) -> f64 {
        match unit {
            FrequencyUnit::Nondimensional => self.omega_c,
            FrequencyUnit::RadianPerSecond => 1.0,
            FrequencyUnit::Hertz => std::f64::consts::TAU,
            FrequencyUnit::RevolutionsPerMinute => std::f64::consts::TAU / 60.0,
        }
    }
}

/// One pair of axes.
#[derive(Debug, Clone, Default, PartialEq, Serialize, Deserialize)]
pub struct Panel {
    /// Text of the abscissa, unit included.
    pub x_label: String,
    /// Text of the ordinate, unit included.
    pub y_label: String,
    /// Heading above the panel; empty: none.
    pub heading: String,
    /// Range of the abscissa; from the data when `None`.
    pub x_range: Option<(f64, f64)>,
    /// Range of the ordinate; from the data when `None`.
    pub y_range: Option<(f64, f64)>,
    /// Scale of the ordinate.
    pub y_scale: AxisScale,
    /// Unit of the abscissa other than the one in its label; empty: that one.
    pub x_unit: String,
    /// Set where the abscissa is a frequency of known scale: it can be shown in other units.
    pub x_frequency: Option<FrequencyAxis>,
    /// Speeds of shafts over that frequency: the abscissa can be the speed of each.
    #[serde(default, skip_serializing_if = "Vec::is_empty")]
    pub shafts: Vec<(String, f64)>,
    /// Curves, drawn in this order.
    pub curves: Vec<Curve>,
}
