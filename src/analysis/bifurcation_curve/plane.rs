//! The two parameters of a curve, and the systems over them.

use super::BifurcationCurve;
use crate::analysis::columns::{float, frequency_label};
use crate::analysis::parameter::{Systems, VariedParameter, joined};
use crate::analysis::{Fault, Link, Setting};
use crate::assembly::Assembly;
use crate::error::{Diagnostic, SolveError};
use crate::model::Model;
use crate::quantity::Quantity;
use crate::report::{Table, Values, Words};
use crate::solve::curve::Plane;
use crate::system::System;

/// One parameter.
#[derive(Debug, Clone)]
pub(in crate::analysis) struct CurveAxis {
    pub parameter: VariedParameter,
    /// As the user wrote it.
    pub written: String,
    /// Native values at shares 0 and 1: omega/omega_c, or SI base units.
    pub ends: (f64, f64),
    /// Unit of reported values, and the factor to them.
    pub unit: String,
    pub factor: f64,
    /// Unit in which the user wrote the first end, and reported values over those in it.
    users: (String, f64),
}

impl CurveAxis {
    /// The native value at a share.
    pub fn value(&self, share: f64) -> f64 {
        match share {
            0.0 => self.ends.0,
            1.0 => self.ends.1,
            share => self.ends.0 + share * (self.ends.1 - self.ends.0),
        }
    }

    /// The share of a native value.
    pub fn share(&self, value: f64) -> f64 {
        (value - self.ends.0) / (self.ends.1 - self.ends.0)
    }

    /// Text of an axis of reported values.
    pub fn reported_label(&self) -> String {
        Words::of_number(&self.written, &self.unit)
    }

    /// Text of an axis in the user's unit.
    pub fn label(&self, setting: &Setting<'_>) -> String {
        let written = Words::of_number(&self.written, &self.users.0);
        match (&self.parameter, self.users.0.as_str()) {
            (VariedParameter::Frequency(_), "rpm") => frequency_label(setting, &written),
            _ => written,
        }
    }

    /// Whether values are reported in the user's unit.
    fn is_users(&self) -> bool {
        self.users.0 == self.unit
    }

    /// A native value in words.
    pub fn told(&self, value: f64) -> String {
        let unit = match self.unit.as_str() {
            "" => String::new(),
            unit => format!(" {unit}"),
        };
        format!("{} = {:.9e}{unit}", self.written, value * self.factor)
    }

    /// The parameter that a user names, with two of its values.
    ///
    /// # Errors
    /// Message of a name that is none, or of a value that the model refuses, with the number of the value.
    pub fn read(
        setting: &Setting<'_>,
        written: &str,
        ends: (&Quantity, &Quantity),
        linked: (&Link, &[&str]),
    ) -> Result<CurveAxis, (Option<usize>, String)> {
        let parameter = VariedParameter::linked(setting, written, linked);
        let parameter = parameter.map_err(|message| (None, message))?;
        let value = |k: usize, quantity: &Quantity| {
            let checked = parameter.check(setting, quantity);
            let value = checked.and_then(|()| parameter.value(setting, quantity));
            value.map_err(|message| (Some(k), message))
        };
        let values = (value(0, ends.0)?, value(1, ends.1)?);
        let (unit, factor) = parameter.reported(setting, ends.0);
        let both = [(ends.0, values.0 * factor), (ends.1, values.1 * factor)];
        let users = both
            .into_iter()
            .find_map(|(written, value)| users_unit(written, value));
        let users = users.unwrap_or_else(|| (unit.clone(), 1.0));
        Ok(CurveAxis {
            parameter,
            written: written.into(),
            ends: values,
            unit,
            factor,
            users,
        })
    }
}

/// Unit of a quantity as a user wrote it, and its reported value over the number in it.
fn users_unit(written: &Quantity, reported: f64) -> Option<(String, f64)> {
    written.dimension?;
    let text = written.text.trim();
    let end =
        text.find(|c: char| c.is_whitespace() || c.is_alphabetic() && c != 'e' && c != 'E')?;
    let number: f64 = text[..end].trim().parse().ok()?;
    let is_usable = number != 0.0 && reported != 0.0;
    is_usable.then(|| (text[end..].trim().to_string(), reported / number))
}

/// Both parameters.
#[derive(Debug, Clone)]
pub(in crate::analysis) struct Axes {
    pub list: [CurveAxis; 2],
    /// Excitation frequency over omega_c, where it is not a parameter.
    pub at: f64,
}

/// Lowest frequency beyond the range, in lowest ones of the range.
const SLOWEST: f64 = 0.5;
/// Share of the range by which a number is moved to see whether it changes anything.
const NUDGE: f64 = 1e-3 * std::f64::consts::SQRT_2;

impl Axes {
    /// Reads the keys.
    ///
    /// # Errors
    /// All that is wrong with them.
    pub fn new(setting: &Setting<'_>, keys: &BifurcationCurve) -> Result<Axes, Vec<Fault>> {
        let mut faults = Vec::new();
        for (key, count) in [
            ("parameters", keys.parameters.len()),
            ("ranges", keys.ranges.len()),
        ] {
            if count != 2 {
                let message = format!("{count} entries; a curve has two parameters");
                faults.push(Fault::new(key, message));
            }
        }
        if !faults.is_empty() {
            return Err(faults);
        }
        let mut list = Vec::new();
        let names: Vec<&str> = keys.parameters.iter().map(String::as_str).collect();
        for (k, (written, range)) in keys.parameters.iter().zip(&keys.ranges).enumerate() {
            match CurveAxis::read(setting, written, (&range.0, &range.1), (&keys.link, &names)) {
                Ok(axis) if axis.ends.0 == axis.ends.1 => {
                    let message = format!("{} is the start of the range", range.1.text);
                    faults.push(Fault::new(format!("ranges.{k}.1"), message));
                }
                Ok(axis) => list.push(axis),
                Err((None, message)) => {
                    faults.push(Fault::new(format!("parameters.{k}"), message));
                }
                Err((Some(end), message)) => {
                    faults.push(Fault::new(format!("ranges.{k}.{end}"), message));
                }
            }
        }
        Axes::of(setting, list, keys.at.as_ref(), faults)
    }

    /// Of two axes and the key `at`, with what was wrong with them before.
    ///
    /// # Errors
    /// All that is wrong with them.
    pub fn of(
        setting: &Setting<'_>,
        list: Vec<CurveAxis>,
        at: Option<&Quantity>,
        mut faults: Vec<Fault>,
    ) -> Result<Axes, Vec<Fault>> {
        let has_frequency = list.iter().any(|a| a.parameter.is_frequency());
        let at = match (at, has_frequency) {
            (Some(_), true) => {
                let message = "the excitation frequency is a parameter; leave `at` out";
                faults.push(Fault::new("at", message));
                1.0
            }
            (Some(at), false) => setting.frequency(at).unwrap_or_else(|message| {
                faults.push(Fault::new("at", message));
                1.0
            }),
            (None, false) if list.len() == 2 => {
                let message =
                    "missing: the excitation frequency, because it is not one of the parameters";
                faults.push(Fault::new("at", message));
                1.0
            }
            (None, _) => 1.0,
        };
        match <[CurveAxis; 2]>::try_from(list) {
            Ok(list) if list[0].parameter == list[1].parameter => {
                let message = format!(
                    "`{}` and `{}` are the same number",
                    list[0].written, list[1].written
                );
                faults.push(Fault::new("parameters", message));
                Err(faults)
            }
            Ok(list) if faults.is_empty() => Ok(Axes { list, at }),
            _ => Err(faults),
        }
    }

    /// Whether both axes are reported in the user's units.
    pub fn are_users(&self) -> bool {
        self.list.iter().all(CurveAxis::is_users)
    }

    /// Adds what a picture is drawn over, from the columns of the two parameters: `x` and `y` in the user's units.
    pub fn drawn(&self, mut table: Table, columns: [&str; 2]) -> Table {
        for ((axis, from), name) in self.list.iter().zip(columns).zip(["x", "y"]) {
            let own = table.column(from).map(|column| column.values.clone());
            if let Some(Values::Float(values)) = own {
                let (unit, size) = &axis.users;
                let values = values.iter().map(|v| v / size).collect();
                table.columns.push(float(name, unit, values));
            }
        }
        table
    }

    /// Errors in the plane: corners without a system, numbers without effect.
    pub fn check(&self, setting: &Setting<'_>) -> Vec<Fault> {
        let mut plane = Grounds::new(setting, self.clone(), 1);
        let mut faults = Vec::new();
        for corner in [[0.0, 0.0], [1.0, 1.0], [0.0, 1.0], [1.0, 0.0]] {
            if let Err(error) = plane.system(corner) {
                let both = [0, 1].map(|k| self.list[k].told(self.list[k].value(corner[k])));
                let message = format!("no system at {}: {error}", both.join(", "));
                return vec![Fault::new("ranges", message)];
            }
        }
        let inside = 0.381_966_011_250_105_1;
        for k in 0..2 {
            let mut moved = [inside; 2];
            moved[k] += NUDGE;
            let pair = (plane.system([inside; 2]), plane.system(moved));
            let is_idle = match (&pair, &self.list[k].parameter) {
                (_, VariedParameter::Frequency(_)) => false,
                ((Ok(a), Ok(b)), _) => a.is_alike(b),
                _ => false,
            };
            if is_idle {
                let message = format!(
                    "{} changes nothing: the scaled equation is the same at every value",
                    self.list[k].written
                );
                faults.push(Fault::new(format!("parameters.{k}"), message));
            }
        }
        faults
    }

    /// Native values of the marks.
    ///
    /// # Errors
    /// Marks outside the range, or that the model refuses.
    pub fn marks(
        &self,
        setting: &Setting<'_>,
        keys: &BifurcationCurve,
    ) -> Result<Vec<f64>, Vec<Fault>> {
        let (mut marks, mut faults) = (Vec::new(), Vec::new());
        let axis = &self.list[1];
        for (k, written) in keys.marks.iter().enumerate() {
            let value = axis.parameter.check(setting, written);
            let value = value.and_then(|()| axis.parameter.value(setting, written));
            let value = value.and_then(|value| match (0.0..=1.0).contains(&axis.share(value)) {
                true => Ok(value),
                false => Err(format!(
                    "{} lies outside the range of {}",
                    written.text, axis.written
                )),
            });
            match value {
                Ok(value) => marks.push(value),
                Err(message) => faults.push(Fault::new(format!("marks.{k}"), message)),
            }
        }
        match faults.is_empty() {
            true => Ok(marks),
            false => Err(faults),
        }
    }

    /// Lowest excitation frequency over omega_c.
    pub fn slowest(&self) -> f64 {
        let frequency = self.list.iter().find(|a| a.parameter.is_frequency());
        frequency.map_or(self.at, |axis| axis.ends.0.min(axis.ends.1))
    }
}

/// The systems over the plane.
pub(in crate::analysis) struct Grounds<'a> {
    axes: Axes,
    systems: Systems<'a>,
    /// Values met exactly: axis, share, native value.
    exact: Vec<(usize, f64, f64)>,
}

impl<'a> Grounds<'a> {
    /// Over these axes.
    pub fn new(setting: &'a Setting<'a>, axes: Axes, subharmonic: usize) -> Grounds<'a> {
        let parameters: Vec<VariedParameter> =
            axes.list.iter().map(|a| a.parameter.clone()).collect();
        Grounds {
            systems: Systems::new(setting, &parameters, axes.at, subharmonic),
            axes,
            exact: Vec::new(),
        }
    }

    /// The same, with values of the second parameter that are met exactly.
    pub fn with_marks(mut self, marks: &[f64]) -> Grounds<'a> {
        let share = |value: &f64| (1, self.axes.list[1].share(*value), *value);
        self.exact = marks.iter().map(share).collect();
        self
    }

    fn native(&self, k: usize, share: f64) -> f64 {
        let listed = self
            .exact
            .iter()
            .find(|(own, x, _)| *own == k && *x == share);
        listed.map_or_else(|| self.axes.list[k].value(share), |(_, _, value)| *value)
    }

    /// The model at a place, with its assembly; frequencies are left as they are.
    pub fn model(&mut self, p: [f64; 2]) -> Result<(Model, Assembly), SolveError> {
        let values = [self.native(0, p[0]), self.native(1, p[1])];
        self.systems.model(&values).map_err(no_system)
    }
}

fn no_system(list: Vec<Diagnostic>) -> SolveError {
    SolveError::NoSystem {
        reason: joined(&list),
    }
}

impl Plane for Grounds<'_> {
    fn system(&mut self, p: [f64; 2]) -> Result<System, SolveError> {
        let frequency = self.reference_frequency(p);
        // A curve that leaves the range downwards would meet ever longer periods.
        let least = SLOWEST * self.axes.slowest();
        if frequency < least || frequency.is_nan() {
            let reason = format!(
                "the frequency would be {frequency}, below half of the lowest one of the range"
            );
            return Err(SolveError::NoSystem { reason });
        }
        let values = [self.native(0, p[0]), self.native(1, p[1])];
        self.systems.at(&values).cloned().map_err(no_system)
    }

    fn frequency(&self) -> Option<usize> {
        self.systems.lone_frequency()
    }

    fn reference_frequency(&self, p: [f64; 2]) -> f64 {
        let mut list = self.axes.list.iter();
        match list.position(|axis| axis.parameter.is_frequency()) {
            Some(k) => self.native(k, p[k]),
            None => self.axes.at,
        }
    }
}
