//! Basins as tables and as a picture.

use super::Basins;
use super::grid::{Grid, StartRegion};
use super::sort::{Sorted, Sorting};
use crate::analysis::columns::{coordinates, float, integer, text};
use crate::analysis::response::OrbitTable;
use crate::analysis::{Setting, flow};
use crate::report::{Column, Curve, CurveStyle, Figure, Panel, Report, Table};
use crate::solve::attractor::basins::SettledMotion;
use crate::solve::family::FrequencyFamily;
use crate::solve::integrate::IntegratorChoice;
use crate::solve::residual::PeriodicResidual;
use crate::solve::shooting::Shooting;
use nalgebra::DVector;
use serde_json::{Value, json};

/// Attractors by falling number of starts.
struct Ranking<'a> {
    /// Places of the known attractors, the largest basin first.
    order: Vec<usize>,
    counts: Vec<usize>,
    sorting: &'a Sorting<'a>,
    /// Number of the attractor at which each start ends, from 1; 0: none. Empty where the start was not followed.
    labels: Vec<Option<usize>>,
}

impl<'a> Ranking<'a> {
    fn new(sorting: &'a Sorting<'a>) -> Ranking<'a> {
        let counts = sorting.counts();
        let mut order: Vec<usize> = (0..counts.len()).collect();
        order.sort_by_key(|k| std::cmp::Reverse(counts[*k]));
        let mut rank = vec![0; order.len()];
        for (place, k) in order.iter().enumerate() {
            rank[*k] = place + 1;
        }
        let number = |sorted: &Sorted| match sorted {
            Sorted::Unknown => None,
            Sorted::At(k) => Some(rank[*k as usize]),
            Sorted::Undecided | Sorted::Failed => Some(0),
        };
        Ranking {
            labels: sorting.sorted.iter().map(number).collect(),
            order,
            counts,
            sorting,
        }
    }

    fn attractors(&self) -> impl Iterator<Item = (usize, &'a SettledMotion)> + '_ {
        let known = self.order.iter().map(|k| &self.sorting.known[*k]);
        known.enumerate().map(|(place, a)| (place + 1, a))
    }

    /// Starts that were followed.
    fn followed(&self) -> impl Iterator<Item = usize> + Clone + '_ {
        let is_known = |k: &usize| self.labels[*k].is_some();
        (0..self.labels.len()).filter(is_known)
    }
}

/// Tables without rows.
pub(super) fn empty(setting: &Setting<'_>, grid: &Grid, has_region: bool) -> Vec<Table> {
    let lines = grid.lines.iter();
    let mut main: Vec<Column> = lines.map(|l| l.heading.clone().column([])).collect();
    main.push(integer("attractor", Vec::new()));
    let rows = AttractorColumns::default();
    vec![
        Table {
            name: String::new(),
            columns: main,
        },
        rows.table(setting, has_region),
        points_table(setting, &[]),
    ]
}

/// Everything that is delivered.
pub(super) fn assemble(
    settings: &Basins,
    setting: &Setting<'_>,
    sorting: &Sorting<'_>,
    region: &StartRegion,
) -> Report {
    let ranking = Ranking::new(sorting);
    let grid = sorting.grid;
    let mut main: Vec<Column> = (grid.lines.iter().enumerate())
        .map(|(k, line)| {
            let values = grid.column(k, ranking.followed());
            line.heading.clone().column(values)
        })
        .collect();
    let numbers = ranking.labels.iter().flatten().map(|n| *n as i64);
    main.push(integer("attractor", numbers.collect()));
    let main = Table {
        name: String::new(),
        columns: main,
    };
    let attractors = rows(&ranking, region).table(setting, region.is_some());
    let points: Vec<(usize, &SettledMotion)> = ranking.attractors().collect();
    let mut report = Report {
        figure: figure(&ranking),
        tables: vec![main, attractors, points_table(setting, &points)],
        warnings: warnings(setting, &ranking),
        ended_early: ended_early(setting, &ranking),
        ..Report::default()
    };
    report.tables.extend(orbits(setting, sorting, &points));
    let options = serde_json::to_value(settings).unwrap_or(Value::Null);
    let integrator = sorting.integrator();
    for (key, value) in [
        ("options", options),
        ("integrator", json!(integrator)),
        ("starts", json!(sorting.sorted.len())),
        ("attractors", json!(sorting.known.len())),
        ("limit", json!(sorting.patience.limit)),
    ] {
        report.summary.insert(key.into(), value);
    }
    report
}

fn ended_early(setting: &Setting<'_>, ranking: &Ranking<'_>) -> Option<String> {
    let (done, total) = (ranking.followed().count(), ranking.labels.len());
    let is_interrupted = setting.control.is_interrupted() && done < total;
    is_interrupted.then(|| format!("interrupted after {done} of {total} starts"))
}

fn warnings(setting: &Setting<'_>, ranking: &Ranking<'_>) -> Vec<String> {
    let sorting = ranking.sorting;
    let of = |kind: Sorted| sorting.sorted.iter().filter(|s| **s == kind).count();
    let mut list = Vec::new();
    let undecided = of(Sorted::Undecided);
    if undecided > 0 {
        list.push(format!(
            "{undecided} of {} starts are undecided after {} periods; increase `limit`",
            sorting.sorted.len(),
            sorting.patience.limit
        ));
    }
    if let Some((start, stop)) = sorting.failure {
        list.push(format!(
            "{} starts could not be integrated (attractor 0); the first is row {}: {}",
            of(Sorted::Failed),
            start + 1,
            flow::tell(stop, setting)
        ));
    }
    list
}

/// Columns of the attractors.
#[derive(Default)]
struct AttractorColumns {
    number: Vec<i64>,
    label: Vec<String>,
    share: Vec<f64>,
    states: Vec<Vec<f64>>,
    distance: Vec<f64>,
    inside: Vec<f64>,
}

impl AttractorColumns {
    fn table(self, setting: &Setting<'_>, has_region: bool) -> Table {
        let mut columns = vec![
            integer("attractor", self.number),
            text("label", self.label),
            float("share", "", self.share),
        ];
        let headings = coordinates(setting).into_iter().enumerate();
        columns.extend(headings.map(|(i, heading)| {
            let values = self
                .states
                .iter()
                .map(|s| s.get(i).copied().unwrap_or(f64::NAN));
            heading.column(values)
        }));
        columns.push(float("distance", "", self.distance));
        if has_region {
            columns.push(float("share_in_box", "", self.inside));
        }
        Table {
            name: "attractors".into(),
            columns,
        }
    }
}

fn rows(ranking: &Ranking<'_>, region: &StartRegion) -> AttractorColumns {
    let mut rows = AttractorColumns::default();
    let followed = ranking.followed().count() as f64;
    let inside = inside(ranking, region);
    let lost = ranking.labels.iter().filter(|n| **n == Some(0)).count();
    let found = ranking.attractors().map(|(n, a)| (n, Some(a)));
    let none = (lost > 0).then_some((0, None));
    for (number, attractor) in found.chain(none) {
        let count = match number {
            0 => lost,
            n => ranking.counts[ranking.order[n - 1]],
        };
        rows.number.push(number as i64);
        rows.share.push(count as f64 / followed);
        rows.inside
            .push(inside.get(number).copied().unwrap_or(f64::NAN));
        match attractor {
            Some(a) => {
                let size = ranking.sorting.size();
                rows.label.push(a.label.to_string());
                rows.states.push(a.points[..size].to_vec());
                rows.distance.push(distance(ranking, number, a));
            }
            None => {
                rows.label.push("undecided".into());
                rows.states.push(Vec::new());
                rows.distance.push(f64::NAN);
            }
        }
    }
    rows
}

/// Share of the starts inside a part of the grid that ends at each attractor.
fn inside(ranking: &Ranking<'_>, region: &StartRegion) -> Vec<f64> {
    let Some(region) = region else {
        return Vec::new();
    };
    let (mut counts, mut total) = (vec![0.0; ranking.order.len() + 1], 0.0);
    let mut state = vec![0.0; ranking.sorting.size()];
    let lines = &ranking.sorting.grid.lines;
    for start in ranking.followed() {
        ranking.sorting.grid.place(start, &mut state);
        let is_inside = lines
            .iter()
            .zip(region)
            .all(|(line, (low, high))| (*low..=*high).contains(&state[line.place]));
        if let (true, Some(n)) = (is_inside, ranking.labels[start]) {
            counts[n] += 1.0;
            total += 1.0;
        }
    }
    counts.into_iter().map(|count| count / total).collect()
}

/// Least distance, in the varied coordinates, from the points of an attractor to a start that does not end there.
fn distance(ranking: &Ranking<'_>, number: usize, attractor: &SettledMotion) -> f64 {
    let sorting = ranking.sorting;
    let mut state = vec![0.0; sorting.size()];
    let mut least = f64::INFINITY;
    for start in ranking.followed() {
        if ranking.labels[start] == Some(number) {
            continue;
        }
        sorting.grid.place(start, &mut state);
        for point in attractor.points.chunks_exact(state.len()) {
            let parts = sorting.grid.lines.iter().map(|line| line.place);
            let square: f64 = parts.map(|i| (point[i] - state[i]).powi(2)).sum();
            least = least.min(square);
        }
    }
    match least.is_finite() {
        true => least.sqrt(),
        false => f64::NAN,
    }
}

/// Points of an attractor that are reported.
const POINTS: usize = 1000;

/// `attractor, point, q.., v..`: all Poincaré points.
fn points_table(setting: &Setting<'_>, attractors: &[(usize, &SettledMotion)]) -> Table {
    let size = 2 * setting.assembly.system.dof();
    let (mut numbers, mut places) = (Vec::new(), Vec::new());
    let mut states: Vec<&[f64]> = Vec::new();
    for (number, attractor) in attractors {
        for (place, point) in attractor.points.chunks_exact(size).take(POINTS).enumerate() {
            numbers.push(*number as i64);
            places.push(place as i64);
            states.push(point);
        }
    }
    let mut columns = vec![integer("attractor", numbers), integer("point", places)];
    let headings = coordinates(setting).into_iter().enumerate();
    columns.extend(headings.map(|(i, heading)| heading.column(states.iter().map(|s| s[i]))));
    Table {
        name: "points".into(),
        columns,
    }
}

/// Orbits of the periodic attractors; `branch` is the attractor.
fn orbits(
    setting: &Setting<'_>,
    sorting: &Sorting<'_>,
    attractors: &[(usize, &SettledMotion)],
) -> Option<Table> {
    let mut table = OrbitTable::new(setting);
    for (number, attractor) in attractors {
        let Some(cycle) = attractor.cycle() else {
            continue;
        };
        let mut system = sorting.system().clone();
        let omega = system.reference_frequency();
        system.set_subharmonic(system.subharmonic() * cycle.period);
        system.set_reference_frequency(omega);
        let family = FrequencyFamily::new(system.clone());
        let mut shooting = Shooting::new(family, omega, IntegratorChoice::Auto).ok()?;
        let u = DVector::from_column_slice(&attractor.points[..sorting.size()]);
        if let Ok(orbit) = shooting.orbit(&u, omega) {
            table.add((*number, 0), &system, &orbit);
        }
    }
    Some(table.finish(setting))
}

/// The first two coordinates of the grid, a colour per attractor, its points as dots.
fn figure(ranking: &Ranking<'_>) -> Option<Figure> {
    let [x, y] = ranking.sorting.grid.lines.get(..2)? else {
        return None;
    };
    if x.values.len() < 2 || y.values.len() < 2 {
        return None;
    }
    let label = |(number, a): (usize, &SettledMotion)| {
        (number.to_string(), format!("{number}: {}", a.label))
    };
    let mut names: Vec<(String, String)> = ranking.attractors().map(label).collect();
    names.push(("0".into(), "undecided".into()));
    let cells = Curve {
        table: String::new(),
        x: x.heading.name.clone(),
        y: y.heading.name.clone(),
        label: String::new(),
        style: CurveStyle::Cells {
            value: "attractor".into(),
            names,
        },
        only: None,
    };
    let dots = Curve {
        table: "points".into(),
        label: "attractors at phase 0".into(),
        style: CurveStyle::Dots,
        ..cells.clone()
    };
    Some(Figure {
        title: String::new(),
        panels: vec![Panel {
            x_label: x.heading.axis(),
            y_label: y.heading.axis(),
            curves: vec![cells, dots],
            ..Panel::default()
        }],
    })
}
