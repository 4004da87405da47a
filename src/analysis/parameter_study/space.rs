//! From the number of a run to the values of its parameters.

use super::direction::{Coordinate, StudyParameter, link};
use super::place::{Destination, Target};
use super::sample::{Draw, Inverse};
use super::settings::{Axis, Given, Range, Spacing};
use super::{ParameterStudy, Sample};
use crate::analysis::{Fault, Setting};
use crate::quantity::{Quantity, UnitDimension};
use crate::report::{Column, Values};
use indexmap::IndexMap;

/// All runs.
#[derive(Debug)]
pub(super) struct Space {
    pub directions: Vec<StudyParameter>,
    layout: SpaceLayout,
    runs: u64,
}

#[derive(Debug)]
enum SpaceLayout {
    Grid(Vec<GridValues>),
    List(Vec<Vec<Coordinate>>),
    Sample(Draw, Vec<Inverse>),
}

/// Values along one direction of a grid.
#[derive(Debug)]
enum GridValues {
    Listed(Vec<Coordinate>),
    Even(Range),
}

/// Runs of a study at most.
const MOST_RUNS: u64 = 1_000_000_000_000;

impl Space {
    /// The space of a study.
    ///
    /// # Errors
    /// Everything wrong with its paths and values, each on its own key.
    pub fn new(
        study: &ParameterStudy,
        setting: &Setting<'_>,
        target: &Target,
    ) -> Result<Space, Vec<Fault>> {
        let mut reader = DirectionReader {
            setting,
            target,
            directions: Vec::new(),
            faults: Vec::new(),
        };
        let layout = match (&study.grid, &study.list, &study.sample) {
            (Some(grid), None, None) => reader.grid(grid),
            (None, Some(list), None) => reader.list(list),
            (None, None, Some(sample)) => reader.sample(sample),
            _ => {
                let message = "wanted exactly one of `grid`, `list` and `sample`";
                return Err(vec![Fault::new("", message)]);
            }
        };
        let linked = link(&mut reader.directions, setting, &study.link);
        reader.faults.extend(linked.err());
        let DirectionReader {
            directions, faults, ..
        } = reader;
        match layout {
            Some((layout, runs)) if faults.is_empty() => Ok(Space {
                directions,
                layout,
                runs,
            }),
            _ => Err(faults),
        }
    }

    /// Number of runs.
    pub fn runs(&self) -> u64 {
        self.runs
    }

    /// Values of a run, one per direction.
    pub fn values(&self, run: u64) -> Vec<Coordinate> {
        match &self.layout {
            SpaceLayout::Grid(lines) => {
                let mut rest = run;
                let mut values: Vec<Coordinate> = (lines.iter().rev())
                    .map(|line| {
                        let value = line.value(rest % line.length());
                        rest /= line.length();
                        value
                    })
                    .collect();
                values.reverse();
                values
            }
            SpaceLayout::List(rows) => rows[run as usize].clone(),
            SpaceLayout::Sample(draw, inverses) => (inverses.iter().enumerate())
                .map(|(k, inverse)| Coordinate::Number(inverse.at(draw.uniform(run, k))))
                .collect(),
        }
    }

    /// Values worth a look before anything runs, each with its key: all those that are listed, the ends of ranges, the
    /// middle and the ends of distributions; `most` of them at most.
    pub fn probes(&self, most: usize) -> Vec<(String, Vec<Coordinate>)> {
        let first = self.values(0);
        let at = |k: usize, value: Coordinate| {
            let mut values = first.clone();
            values[k] = value;
            values
        };
        let name = |k: usize| self.directions[k].column.name.as_str();
        let mut list = Vec::new();
        match &self.layout {
            SpaceLayout::List(rows) => {
                let row = |(k, row): (usize, &Vec<Coordinate>)| (format!("list.{k}"), row.clone());
                list.extend(rows.iter().enumerate().take(most).map(row));
            }
            SpaceLayout::Grid(lines) => {
                for (k, line) in lines.iter().enumerate() {
                    let key = format!("grid.{}", name(k));
                    match line {
                        GridValues::Listed(values) => list.extend(
                            values
                                .iter()
                                .enumerate()
                                .map(|(i, value)| (format!("{key}.{i}"), at(k, value.clone()))),
                        ),
                        GridValues::Even(range) => {
                            list.push((format!("{key}.from"), at(k, line.value(0))));
                            list.push((format!("{key}.to"), at(k, line.value(range.points - 1))));
                        }
                    }
                }
            }
            SpaceLayout::Sample(_, inverses) => {
                for (k, inverse) in inverses.iter().enumerate() {
                    let key = format!("sample.parameters.{}", name(k));
                    let (low, high) = inverse.ends();
                    for value in [low, Some(inverse.at(0.5)), high].into_iter().flatten() {
                        list.push((key.clone(), at(k, Coordinate::Number(value))));
                    }
                }
            }
        }
        list.truncate(most);
        list
    }
}

impl GridValues {
    fn length(&self) -> u64 {
        match self {
            GridValues::Listed(list) => list.len() as u64,
            GridValues::Even(range) => range.points,
        }
    }

    fn value(&self, k: u64) -> Coordinate {
        let range = match self {
            GridValues::Listed(list) => return list[k as usize].clone(),
            GridValues::Even(range) => range,
        };
        let (from, to, last) = (range.from.value, range.to.value, range.points - 1);
        let share = k as f64 / last as f64;
        Coordinate::Number(match range.spacing {
            _ if k == 0 => from,
            _ if k == last => to,
            Spacing::Linear => from + (to - from) * share,
            Spacing::Logarithmic => from * (to / from).powf(share),
        })
    }
}

/// Reads the directions one after another.
struct DirectionReader<'a> {
    setting: &'a Setting<'a>,
    target: &'a Target,
    directions: Vec<StudyParameter>,
    faults: Vec<Fault>,
}

impl DirectionReader<'_> {
    fn refuse<T>(&mut self, key: impl Into<String>, message: impl Into<String>) -> Option<T> {
        self.faults.push(Fault::new(key, message));
        None
    }

    fn grid(&mut self, grid: &IndexMap<String, Axis>) -> Option<(SpaceLayout, u64)> {
        if grid.is_empty() {
            return self.refuse("grid", "no parameter: nothing varies");
        }
        let mut lines = Vec::new();
        for (path, axis) in grid {
            let key = format!("grid.{path}");
            let line = match axis {
                Axis::Values(list) => self.listed(path, &key, list.iter().enumerate()),
                Axis::Range(range) => self.even(path, &key, range),
            };
            lines.extend(line);
        }
        let product = |n: Option<u64>, line: &GridValues| n?.checked_mul(line.length());
        match lines.iter().fold(Some(1), product) {
            Some(runs) if runs <= MOST_RUNS => Some((SpaceLayout::Grid(lines), runs)),
            _ => self.refuse(
                "grid",
                format!("more than {MOST_RUNS} runs, which is the limit"),
            ),
        }
    }

    fn listed<'g>(
        &mut self,
        path: &str,
        key: &str,
        list: impl Iterator<Item = (usize, &'g Given)> + Clone,
    ) -> Option<GridValues> {
        let texts = list.clone().map(|(_, given)| given);
        let has_words = texts.clone().any(|g| matches!(g, Given::Word(_)));
        if texts.clone().next().is_none() {
            return self.refuse(key, "an empty list: nothing to run");
        }
        let quantity = |(k, given): (usize, &'g Given)| match given {
            Given::Quantity(quantity) => Some((format!("{key}.{k}"), quantity)),
            Given::Word(_) => None,
        };
        let quantities: Vec<_> = list.filter_map(quantity).collect();
        let values = if has_words {
            Values::Text(Vec::new())
        } else {
            Values::Float(Vec::new())
        };
        self.direction(path, key, &quantities, values)?;
        let coordinate = |given: &Given| match given {
            Given::Quantity(quantity) if !has_words => Coordinate::Number(quantity.value),
            given => Coordinate::Word(given.text().to_owned()),
        };
        Some(GridValues::Listed(texts.map(coordinate).collect()))
    }

    fn even(&mut self, path: &str, key: &str, range: &Range) -> Option<GridValues> {
        let ends = [
            (format!("{key}.from"), &range.from),
            (format!("{key}.to"), &range.to),
        ];
        let number = Values::Float(Vec::new());
        self.direction(path, key, &ends, number)?;
        let (from, to) = (range.from.value, range.to.value);
        if range.points < 2 || range.points > MOST_RUNS {
            let message = format!(
                "{} must be at least 2, and at most {MOST_RUNS}",
                range.points
            );
            return self.refuse(format!("{key}.points"), message);
        }
        if range.spacing == Spacing::Logarithmic && !(from / to > 0.0 && (from / to).is_finite()) {
            let message = "logarithmic spacing needs two ends of one sign, neither of them 0";
            return self.refuse(format!("{key}.spacing"), message);
        }
        Some(GridValues::Even(range.clone()))
    }

    fn list(&mut self, rows: &[IndexMap<String, Given>]) -> Option<(SpaceLayout, u64)> {
        let Some(first) = rows.first().filter(|row| !row.is_empty()) else {
            return self.refuse("list", "no row with a value: nothing to run");
        };
        for (k, row) in rows.iter().enumerate() {
            let missing = first.keys().find(|path| !row.contains_key(*path));
            let extra = row.keys().find(|path| !first.contains_key(*path));
            if let Some(path) = missing {
                let message = format!("`{path}` is missing: every row has the paths of the first");
                return self.refuse(format!("list.{k}"), message);
            }
            if let Some(path) = extra {
                let message = format!("the first row has no `{path}`");
                return self.refuse(format!("list.{k}.{path}"), message);
            }
        }
        let mut columns = Vec::new();
        for path in first.keys() {
            let column = rows.iter().enumerate().map(|(k, row)| (k, &row[path]));
            if let Some(GridValues::Listed(values)) = self.listed(path, "list", column) {
                columns.push(values);
            }
        }
        let row = |k: usize| columns.iter().map(|c| c[k].clone()).collect();
        let rows: Vec<_> = (0..rows.len()).map(row).collect();
        let count = rows.len() as u64;
        Some((SpaceLayout::List(rows), count))
    }

    fn sample(&mut self, sample: &Sample) -> Option<(SpaceLayout, u64)> {
        if sample.parameters.is_empty() {
            return self.refuse("sample.parameters", "no parameter: nothing varies");
        }
        if sample.count == 0 || sample.count > MOST_RUNS {
            let message = format!("{} must be from 1 to {MOST_RUNS}", sample.count);
            return self.refuse("sample.count", message);
        }
        let mut inverses = Vec::new();
        for (path, distribution) in &sample.parameters {
            let key = format!("sample.parameters.{path}");
            let quantities: Vec<_> = (distribution.quantities())
                .map(|(name, quantity)| (format!("{key}.{name}"), quantity))
                .collect();
            let number = Values::Float(Vec::new());
            if self.direction(path, &key, &quantities, number).is_none() {
                continue;
            }
            match distribution.inverse() {
                Ok(inverse) => inverses.push(inverse),
                Err((name, message)) => self
                    .faults
                    .push(Fault::new(format!("{key}.{name}"), message)),
            }
        }
        let draw = Draw::new(sample, sample.parameters.len());
        Some((SpaceLayout::Sample(draw, inverses), sample.count))
    }

    /// Adds a direction with these numbers, each with its key.
    fn direction(
        &mut self,
        path: &str,
        key: &str,
        quantities: &[(String, &Quantity)],
        values: Values,
    ) -> Option<()> {
        let place = match self.target.place(self.setting, path) {
            Ok(place) => place,
            Err(message) => return self.refuse(key, message),
        };
        if self
            .directions
            .iter()
            .any(|d| d.place.path() == place.path())
        {
            return self.refuse(key, "another path of the study leads to the same place");
        }
        let (dimension, fault) = common_dimension(quantities, &place);
        self.faults.extend(fault);
        let unit = dimension.map_or(String::new(), UnitDimension::unit);
        let one = format!("1.5 {unit}");
        let is_readable =
            Quantity::parse(&one).is_ok_and(|q| q.value == 1.5 && q.dimension == dimension);
        let has_its_kind = dimension.is_none() || self.setting.is_si();
        let is_number = has_its_kind && matches!(values, Values::Float(_));
        let (place, followers) = match place {
            Destination::Part(path) => match self.setting.model.resolve(&path) {
                // A unit that is not the number's own may be read as another number.
                Ok(knob) if is_number && knob.takes(dimension) => {
                    (Destination::Number(Box::new(knob)), Vec::new())
                }
                Ok(knob) => (Destination::Part(path), knob.followers().to_vec()),
                Err(_) => (Destination::Part(path), Vec::new()),
            },
            place => (place, Vec::new()),
        };
        self.directions.push(StudyParameter {
            place,
            column: Column {
                name: path.to_owned(),
                unit: unit.clone(),
                values,
            },
            unit: (dimension.is_some() && is_readable).then_some(unit),
            followers,
        });
        Some(())
    }
}

/// Dimension of the numbers of one direction, and the first one that does not agree. A bare number is SI in the model; a
/// setting of an analysis may mean something else by it.
fn common_dimension(
    quantities: &[(String, &Quantity)],
    place: &Destination,
) -> (Option<UnitDimension>, Option<Fault>) {
    let dimension = quantities.iter().find_map(|(_, q)| q.dimension);
    let takes_bare = dimension.is_none() || matches!(place, Destination::Part(_));
    let agrees = |q: &Quantity| match q.dimension {
        None => takes_bare,
        found => found == dimension,
    };
    let odd = quantities.iter().find(|(_, q)| !agrees(q));
    let fault = odd.map(|(key, quantity)| {
        let unit = dimension.map_or(String::new(), UnitDimension::unit);
        let message = format!(
            "`{}` is no quantity in {unit}, as the others are",
            quantity.text
        );
        Fault::new(key.clone(), message)
    });
    (dimension, fault)
}
