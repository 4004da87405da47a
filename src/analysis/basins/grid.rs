//! The starts: a grid over some coordinates, all others fixed.

use super::BasinAxis;
use crate::analysis::initial::{self, InitialKind};
use crate::analysis::{Fault, Setting, columns, limits};
use crate::error::did_you_mean;
use crate::measure::ColumnHeading;
use crate::quantity::Quantity;
use indexmap::IndexMap;

/// A varied coordinate.
pub(super) struct GridLine {
    /// Place in [q; v].
    pub place: usize,
    pub heading: ColumnHeading,
    /// Values, nondimensional.
    pub values: Vec<f64>,
}

/// Starts in the order of rows: the first coordinate changes fastest.
pub(super) struct Grid {
    pub lines: Vec<GridLine>,
}

/// A part of the grid: lowest and highest value per line, nondimensional.
pub(super) type StartRegion = Option<Vec<(f64, f64)>>;

impl Grid {
    /// Reads the keys.
    ///
    /// # Errors
    /// All that is wrong with them.
    pub fn new(
        setting: &Setting<'_>,
        axes: &IndexMap<String, BasinAxis>,
    ) -> Result<Grid, Vec<Fault>> {
        let mut faults = Vec::new();
        let mut lines: Vec<GridLine> = Vec::new();
        if axes.is_empty() {
            let message = "empty grid: give values for at least one coordinate";
            faults.push(Fault::new("grid", message));
        }
        for (name, axis) in axes {
            match line(setting, name, axis) {
                Ok(line) if lines.iter().any(|l| l.place == line.place) => {
                    let message = format!("{name} is given twice");
                    faults.push(Fault::new("grid", message));
                }
                Ok(line) => lines.push(line),
                Err(list) => faults.extend(list),
            }
        }
        match faults.is_empty() {
            true => Ok(Grid { lines }),
            false => Err(faults),
        }
    }

    pub fn starts(&self) -> usize {
        let counts = self.lines.iter().map(|line| line.values.len());
        counts.fold(1, usize::saturating_mul)
    }

    /// Writes the coordinates of a start into a state.
    pub fn place(&self, mut start: usize, state: &mut [f64]) {
        for line in &self.lines {
            let count = line.values.len();
            state[line.place] = line.values[start % count];
            start /= count;
        }
    }

    /// Values of a line at every one of some starts.
    pub fn column(&self, number: usize, starts: impl Iterator<Item = usize>) -> Vec<f64> {
        let before = &self.lines[..number];
        let stride: usize = before.iter().map(|line| line.values.len()).product();
        let values = &self.lines[number].values;
        starts
            .map(|start| values[start / stride % values.len()])
            .collect()
    }

    /// A part of the grid in nondimensional values.
    ///
    /// # Errors
    /// The first of its coordinates that is not varied, or whose range is none.
    pub fn region(
        &self,
        setting: &Setting<'_>,
        written: Option<&IndexMap<String, (Quantity, Quantity)>>,
    ) -> Result<StartRegion, Fault> {
        let Some(written) = written else {
            return Ok(None);
        };
        let mut region = vec![(f64::NEG_INFINITY, f64::INFINITY); self.lines.len()];
        for (name, (low, high)) in written {
            let fault = |message: String| Fault::new(format!("box.{name}"), message);
            let line = self
                .lines
                .iter()
                .position(|line| line.heading.name == *name);
            let Some(k) = line else {
                let known = self.lines.iter().map(|line| line.heading.name.as_str());
                let hint = did_you_mean(name, known);
                return Err(fault(format!("is no coordinate of the grid; {hint}")));
            };
            let value = |quantity| value(setting, self.lines[k].place, quantity).map_err(fault);
            let (low, high) = (value(low)?, value(high)?);
            if low >= high {
                return Err(fault("the first value must be below the second".into()));
            }
            region[k] = (low, high);
        }
        Ok(Some(region))
    }
}

/// A coordinate with its values.
fn line(setting: &Setting<'_>, name: &str, axis: &BasinAxis) -> Result<GridLine, Vec<Fault>> {
    let headings = columns::coordinates(setting);
    let Some(place) = headings.iter().position(|heading| heading.name == name) else {
        let known = headings.iter().map(|heading| heading.name.as_str());
        let message = format!(
            "`{name}` is no coordinate of the motion; {}",
            did_you_mean(name, known)
        );
        return Err(vec![Fault::new("grid", message)]);
    };
    let heading = headings[place].clone();
    let mut faults = Vec::new();
    let mut end = |key: &str, written: &Quantity| {
        let found = value(setting, place, written);
        found.unwrap_or_else(|message| {
            faults.push(Fault::new(format!("grid.{name}.{key}"), message));
            f64::NAN
        })
    };
    let (from, to) = (end("from", &axis.from), end("to", &axis.to));
    let key = format!("grid.{name}.points");
    faults.extend(limits::check(&key, axis.points, 1, limits::POINTS));
    if axis.points > 1 && from == to {
        let message = format!("{} is the start of the range", axis.to.text);
        faults.push(Fault::new(format!("grid.{name}.to"), message));
    }
    if !faults.is_empty() {
        return Err(faults);
    }
    let last = axis.points - 1;
    let at = |k: usize| match k {
        0 => from,
        k if k == last => to,
        k => from + (to - from) * k as f64 / last as f64,
    };
    Ok(GridLine {
        place,
        heading,
        values: (0..axis.points).map(at).collect(),
    })
}

/// A value of a coordinate, nondimensional.
fn value(setting: &Setting<'_>, place: usize, written: &Quantity) -> Result<f64, String> {
    let n = setting.assembly.system.dof();
    let kind = match place < n {
        true => InitialKind::Position,
        false => InitialKind::Rate,
    };
    initial::number(setting, place % n, written, kind)
}
