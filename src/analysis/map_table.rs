//! Records of Poincaré maps as rows of a table and as dots of a figure.

use super::{Setting, columns};
use crate::report::{Curve, CurveStyle, Table};
use crate::solve::attractor::MapRecord;

/// Runs with a colour of their own.
const MAX_COLOURS: usize = 6;

/// Rows `run, period, q.., v..`.
pub(super) struct MapRows<'a> {
    setting: &'a Setting<'a>,
    run: Vec<i64>,
    period: Vec<i64>,
    state: Vec<Vec<f64>>,
}

impl<'a> MapRows<'a> {
    pub fn new(setting: &'a Setting<'a>) -> MapRows<'a> {
        MapRows {
            setting,
            run: Vec::new(),
            period: Vec::new(),
            state: vec![Vec::new(); setting.assembly.system.state_size()],
        }
    }

    /// Appends the points of a record; how many.
    pub fn append(&mut self, run: usize, transient: usize, record: &MapRecord) -> usize {
        let size = self.state.len();
        let points = record.points.chunks_exact(size);
        let count = points.len();
        for (k, point) in points.enumerate() {
            self.run.push(run as i64);
            self.period.push((transient + 1 + k) as i64);
            for (column, x) in self.state.iter_mut().zip(point) {
                column.push(*x);
            }
        }
        count
    }

    pub fn table(self) -> Table {
        let described = columns::states(self.setting).into_iter();
        let mut list = vec![
            columns::integer("run", self.run),
            columns::integer("period", self.period),
        ];
        list.extend(
            described
                .zip(self.state)
                .map(|(d, values)| d.column(values)),
        );
        Table {
            name: String::new(),
            columns: list,
        }
    }
}

/// Curves of dots, one per run if the runs are few.
pub(super) fn dots(x: &str, y: &str, labels: &[String]) -> Vec<Curve> {
    let curve = |label: String, only| Curve {
        table: String::new(),
        x: x.into(),
        y: y.into(),
        label,
        style: CurveStyle::Dots,
        only,
    };
    if labels.len() > MAX_COLOURS {
        return vec![curve(format!("{} runs", labels.len()), None)];
    }
    let one = |(run, label): (usize, &String)| {
        curve(label.clone(), Some(("run".into(), run.to_string())))
    };
    labels.iter().enumerate().map(one).collect()
}
