//! Names and units of reported quantities: the one place that knows how nondimensional values are reported.

use crate::assembly::Assembly;
use crate::model::{Body, Model, Motion, ReportUnits, Structure};
use crate::report::{Column, Values, Words};
use std::f64::consts::TAU;

/// Kind of the numbers of a column.
#[derive(Debug, Clone, Copy, Default, PartialEq, Eq)]
pub enum Numbers {
    /// Real numbers.
    #[default]
    Real,
    /// Whole numbers.
    Whole,
}

/// A column without its numbers: name, unit, and factor from nondimensional to reported values.
#[derive(Debug, Clone, PartialEq)]
pub struct ColumnHeading {
    /// Name of the column.
    pub name: String,
    /// Unit; empty: dimensionless.
    pub unit: String,
    /// Reported over nondimensional value.
    pub factor: f64,
    /// Kind of the numbers.
    pub numbers: Numbers,
}

impl ColumnHeading {
    /// A heading of real numbers.
    pub fn new(name: impl Into<String>, unit: impl Into<String>, factor: f64) -> ColumnHeading {
        ColumnHeading {
            name: name.into(),
            unit: unit.into(),
            factor,
            numbers: Numbers::Real,
        }
    }

    /// A dimensionless quantity.
    pub fn number(name: impl Into<String>) -> ColumnHeading {
        ColumnHeading::new(name, "", 1.0)
    }

    /// A whole number.
    pub fn code(name: impl Into<String>) -> ColumnHeading {
        ColumnHeading {
            numbers: Numbers::Whole,
            ..ColumnHeading::number(name)
        }
    }

    /// The same quantity under a longer name.
    pub(crate) fn prefixed(self, prefix: &str) -> ColumnHeading {
        ColumnHeading {
            name: format!("{prefix}{}", self.name),
            ..self
        }
    }

    /// The column of nondimensional values.
    pub fn column(self, values: impl IntoIterator<Item = f64>) -> Column {
        let values = values.into_iter();
        Column {
            name: self.name,
            unit: self.unit,
            values: match self.numbers {
                Numbers::Real => Values::Float(values.map(|x| x * self.factor).collect()),
                Numbers::Whole => Values::Integer(values.map(|x| x as i64).collect()),
            },
        }
    }

    /// Text of an axis: the name in words with its unit.
    pub fn axis(&self) -> String {
        Words::of(&self.name).axis(&self.unit)
    }
}

/// Units of a report: SI, or none in nondimensional reports.
#[derive(Debug, Clone, Copy)]
pub struct ReportedUnits<'a> {
    model: &'a Model,
    assembly: &'a Assembly,
}

impl<'a> ReportedUnits<'a> {
    /// Units of the report that a model asks for; its assembly has the scales.
    pub fn new(model: &'a Model, assembly: &'a Assembly) -> ReportedUnits<'a> {
        ReportedUnits { model, assembly }
    }

    /// Whether results are in SI units.
    pub fn is_si(&self) -> bool {
        self.model.report_units == ReportUnits::Si
    }

    /// Names of the connections.
    pub fn connections(&self) -> &'a [String] {
        &self.assembly.connections
    }

    /// Nondimensional, or with a unit and a factor in SI reports.
    fn scaled(
        &self,
        name: impl Into<String>,
        unit: impl Into<String>,
        factor: f64,
    ) -> ColumnHeading {
        if self.is_si() {
            ColumnHeading::new(name, unit, factor)
        } else {
            ColumnHeading::number(name)
        }
    }

    /// A deformation of a connection.
    pub fn displacement(&self, name: impl Into<String>, connection: usize) -> ColumnHeading {
        let unit = self.model.units_of(connection).0;
        self.scaled(name, unit, self.assembly.scales.displacement[connection])
    }

    /// A rate of deformation of a connection.
    pub fn rate(&self, name: impl Into<String>, connection: usize) -> ColumnHeading {
        let scales = &self.assembly.scales;
        let unit = format!("{}/s", self.model.units_of(connection).0);
        self.scaled(
            name,
            unit,
            scales.displacement[connection] * scales.frequency,
        )
    }

    /// A force of a connection.
    pub fn force(&self, name: impl Into<String>, connection: usize) -> ColumnHeading {
        let scales = &self.assembly.scales;
        let unit = self.model.units_of(connection).1;
        let factor = scales.stiffness[connection] * scales.displacement[connection];
        self.scaled(name, unit, factor)
    }

    /// An energy of a connection.
    pub fn energy(&self, name: impl Into<String>, connection: usize) -> ColumnHeading {
        let scales = &self.assembly.scales;
        let (k, l) = (
            scales.stiffness[connection],
            scales.displacement[connection],
        );
        self.scaled(name, "J", k * l * l)
    }

    /// A frequency over omega_c, in hertz in SI reports.
    pub fn frequency(&self, name: impl Into<String>) -> ColumnHeading {
        self.scaled(name, "Hz", self.assembly.scales.frequency / TAU)
    }

    /// A time, in seconds in SI reports.
    pub fn time(&self, name: impl Into<String>) -> ColumnHeading {
        self.scaled(name, "s", 1.0 / self.assembly.scales.frequency)
    }

    /// `NAME.<body>` of accelerations from SI values: rad/s^2 (m/s^2 for translating masses), or rad/T^2 (m/T^2), divided by
    /// omega_c^2, in nondimensional reports. None for reduced systems.
    pub fn accelerations(&self, name: &str) -> Vec<ColumnHeading> {
        let Structure::Train(train) = &self.model.structure else {
            return Vec::new();
        };
        let (per, factor) = if self.is_si() {
            ("s^2", 1.0)
        } else {
            ("T^2", self.assembly.scales.frequency.powi(-2))
        };
        let one = |(body, Body { motion, .. }): (&String, &Body)| {
            let angle = match motion {
                Motion::Rotation => "rad",
                Motion::Translation => "m",
            };
            ColumnHeading::new(format!("{name}.{body}"), format!("{angle}/{per}"), factor)
        };
        train.bodies.iter().map(one).collect()
    }
}
