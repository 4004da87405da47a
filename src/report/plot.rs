//! What a user asks of a figure: the key `plot` of an analysis, `--plot` of the command line.

use super::AxisScale;
use schemars::JsonSchema;
use serde::{Deserialize, Serialize};

/// Contents and style of the figures of an analysis; the analysis chooses what is not given.
#[derive(Debug, Clone, Default, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(default, deny_unknown_fields)]
pub struct Plot {
    /// Column of the abscissa.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub x: Option<String>,
    /// Columns of the ordinate, one panel each; `rms` selects the r.m.s. of every connection.
    #[serde(skip_serializing_if = "Vec::is_empty")]
    pub y: Vec<String>,
    /// Unit of the abscissa, such as `rpm`, `Hz`, `ms`; `rpm of gear_1` is the speed of that shaft.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub x_unit: Option<String>,
    /// Scale of the ordinate.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub y_scale: Option<AxisScale>,
    /// Limits of the abscissa, in its unit in the figure.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub x_range: Option<[f64; 2]>,
    /// Limits of the ordinate, in the unit of the column.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub y_range: Option<[f64; 2]>,
    /// Draw the backbone: natural frequencies of the response-variant linear system (default: no).
    #[serde(skip_serializing_if = "Option::is_none")]
    pub backbone: Option<bool>,
    /// Kinds of events to draw (default: all; an empty list: none).
    #[serde(skip_serializing_if = "Option::is_none")]
    pub events: Option<Vec<String>>,
    /// Connections to draw (default: all).
    #[serde(skip_serializing_if = "Option::is_none")]
    pub connections: Option<Vec<String>>,
    /// Methods to draw (default: all).
    #[serde(skip_serializing_if = "Option::is_none")]
    pub methods: Option<Vec<String>>,
    /// Width on paper.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub size: Option<FigureSize>,
    /// Measured curves, which the key `compare` of the analysis gives.
    #[serde(skip_serializing_if = "Vec::is_empty")]
    #[schemars(skip)]
    pub measured: Vec<Measured>,
}

/// Measured values, kept in a table of their own, over computed ones.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct Measured {
    /// The table.
    pub table: String,
    /// Its columns, named like the computed ones.
    pub x: String,
    /// Ordinate.
    pub y: String,
    /// Text in the legend.
    pub label: String,
}

/// Width of a figure on paper.
#[derive(Debug, Clone, Copy, Default, PartialEq, Eq, Serialize, Deserialize, JsonSchema)]
#[serde(rename_all = "snake_case")]
pub enum FigureSize {
    /// One column of a journal, 85 mm.
    OneColumn,
    /// Two columns of a journal, 178 mm.
    #[default]
    TwoColumns,
}
