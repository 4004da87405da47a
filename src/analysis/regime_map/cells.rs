//! The cells of a map, level by level; each depends on its own start alone, so that any number of threads gives the same.

use super::measures::WantedColumns;
use super::{RegimeMap, Seed};
use crate::analysis::bifurcation_curve::{Axes, Grounds};
use crate::analysis::response::OrbitTable;
use crate::analysis::summary::measured;
use crate::analysis::{Setting, flow};
use crate::interrupt;
use crate::measure::Solved;
use crate::postprocess::measures::Meter;
use crate::solve::attractor::{
    Attractor, Goal, Label, LabelOptions, MapSize, RecordStop, Stroboscopic, attractor,
};
use crate::solve::curve::Plane;
use crate::system::System;
use rayon::prelude::*;
use std::collections::BTreeMap;
use std::sync::atomic::{AtomicUsize, Ordering};

/// One motion in a cell.
#[derive(Debug, Clone)]
pub(super) struct MapCell {
    pub label: Label,
    /// Wanted measures in nondimensional numbers.
    pub values: Vec<f64>,
    /// Last state.
    pub end: Vec<f64>,
    /// Whether the motion has gone on beside orbits of neighbours without being caught.
    pub has_waited: bool,
    /// Reason of the missing result.
    pub failure: Option<String>,
    /// The periodic orbit, where it is kept.
    pub orbit: Option<OrbitTable>,
}

/// Orbits kept, and rows of each.
const ORBITS: (usize, usize) = (200, 128);

/// Times that an undecided motion goes on, each four times as long as the one before, before neighbours are asked; and once more behind it.
const ROUNDS: usize = 2;

/// Times that what neighbours have found is handed on.
const NEIGHBOURS: usize = 3;

/// Place of a cell on the finest grid.
pub(super) type CellIndex = (usize, usize);

/// The cells that are known.
pub(super) struct Field<'a> {
    pub(super) keys: &'a RegimeMap,
    pub(super) setting: &'a Setting<'a>,
    pub(super) axes: &'a Axes,
    wanted: &'a WantedColumns,
    /// Cells along each axis on the coarsest grid.
    base: [usize; 2],
    /// By seed and place.
    pub cells: BTreeMap<(usize, CellIndex), MapCell>,
    done: AtomicUsize,
}

impl<'a> Field<'a> {
    pub fn new(
        keys: &'a RegimeMap,
        setting: &'a Setting<'a>,
        axes: &'a Axes,
        wanted: &'a WantedColumns,
    ) -> Field<'a> {
        let mut points = keys.parameters.values().map(|v| v.points);
        Field {
            keys,
            setting,
            axes,
            wanted,
            base: [(); 2].map(|()| points.next().unwrap_or(2)),
            cells: BTreeMap::new(),
            done: AtomicUsize::new(0),
        }
    }

    /// Steps of the finest grid between neighbours on a level.
    pub(super) fn stride(&self, level: usize) -> usize {
        1 << (self.keys.refine - level)
    }

    /// Share of an axis at a place.
    pub fn share(&self, axis: usize, place: usize) -> f64 {
        place as f64 / ((self.base[axis] - 1) * self.stride(0)) as f64
    }

    /// All levels.
    pub fn run(&mut self) {
        let stride = self.stride(0);
        let all = |axis: usize| (0..self.base[axis]).map(move |k| k * stride);
        let rows: Vec<Vec<CellIndex>> = all(1).map(|j| all(0).map(|i| (i, j)).collect()).collect();
        self.complete(&rows);
        for level in 1..=self.keys.refine {
            if self.setting.control.is_interrupted() {
                return;
            }
            let new = self.contested(level);
            let rows: Vec<Vec<CellIndex>> = new.into_iter().map(|place| vec![place]).collect();
            self.complete(&rows);
        }
        for round in 1..=ROUNDS {
            if self.setting.control.is_interrupted() {
                return;
            }
            self.decide(round);
        }
        let mut fresh: Option<Vec<CellIndex>> = None;
        for _ in 0..NEIGHBOURS {
            if self.setting.control.is_interrupted() {
                return;
            }
            let places = self.ask_neighbours(fresh.as_deref());
            if places.is_empty() {
                break;
            }
            fresh = Some(places);
        }
        self.decide(ROUNDS + 1);
    }

    /// Places of a level next to which two known neighbours differ.
    fn contested(&self, level: usize) -> Vec<CellIndex> {
        let (coarse, step) = (self.stride(level - 1), self.stride(level));
        let ends = [0, 1].map(|axis| (self.base[axis] - 1) * self.stride(0));
        let labels = |place: CellIndex| -> Vec<Option<Label>> {
            let seeds = 0..self.keys.seeds.len();
            seeds
                .map(|s| self.cells.get(&(s, place)).map(|c| c.label))
                .collect()
        };
        let mut new = Vec::new();
        for j in (0..ends[1]).step_by(coarse) {
            for i in (0..ends[0]).step_by(coarse) {
                let corners = [
                    (i, j),
                    (i + coarse, j),
                    (i, j + coarse),
                    (i + coarse, j + coarse),
                ];
                let known: Vec<_> = corners
                    .into_iter()
                    .filter(|c| self.cells.contains_key(&(0, *c)))
                    .collect();
                let is_plain = known.windows(2).all(|w| labels(w[0]) == labels(w[1]));
                if known.len() < 4 || is_plain {
                    continue;
                }
                for b in (j..=j + coarse).step_by(step) {
                    for a in (i..=i + coarse).step_by(step) {
                        new.push((a, b));
                    }
                }
            }
        }
        new.retain(|place| !self.cells.contains_key(&(0, *place)));
        new.sort_unstable_by_key(|(i, j)| (*j, *i));
        new.dedup();
        new
    }

    /// Computes rows of places with all seeds, one row after another on any thread.
    fn complete(&mut self, rows: &[Vec<CellIndex>]) {
        let flag = interrupt::current();
        let total: usize = rows.iter().map(Vec::len).sum();
        self.done.store(0, Ordering::Relaxed);
        let one = |row: &Vec<CellIndex>| flag.scope(|| self.row(row, total));
        let found: Vec<Vec<((usize, CellIndex), MapCell)>> = rows.par_iter().map(one).collect();
        self.cells.extend(found.into_iter().flatten());
    }

    fn row(&self, row: &[CellIndex], total: usize) -> Vec<((usize, CellIndex), MapCell)> {
        let mut list = Vec::new();
        let mut grounds = Grounds::new(self.setting, self.axes.clone(), 1);
        for (number, seed) in self.keys.seeds.iter().enumerate() {
            let mut order: Vec<CellIndex> = row.to_vec();
            if *seed == Seed::NeighbourDown {
                order.reverse();
            }
            let mut carried: Option<Vec<f64>> = None;
            for place in order {
                if self.setting.control.is_interrupted() {
                    return list;
                }
                let start = match seed {
                    Seed::Rest => None,
                    _ => carried.take().or_else(|| self.nearest(number, place)),
                };
                let key = (number, place);
                let Some(cell) = self.cell(&mut grounds, key, start, self.keys.size()) else {
                    return list;
                };
                if cell.failure.is_none() {
                    carried = Some(cell.end.clone());
                }
                list.push(((number, place), cell));
                if number == 0 {
                    let done = self.done.fetch_add(1, Ordering::Relaxed) + 1;
                    let words = format!("cell {done} of {total}");
                    let share = done as f64 / total as f64;
                    (self.setting.control).progress(self.setting.name, share, &words);
                }
            }
        }
        list
    }

    /// Where the motion of the nearest known cell ended.
    fn nearest(&self, seed: usize, (i, j): CellIndex) -> Option<Vec<f64>> {
        let own = self
            .cells
            .range((seed, (0, 0))..=(seed, (usize::MAX, usize::MAX)));
        let gap = |place: &CellIndex| place.0.abs_diff(i) + place.1.abs_diff(j);
        let usable = own.filter(|(_, cell)| cell.failure.is_none());
        let nearest = usable.min_by_key(|((_, place), _)| gap(place));
        nearest.map(|(_, cell)| cell.end.clone())
    }

    /// No orbits yet.
    pub fn no_orbits(setting: &Setting<'_>) -> OrbitTable {
        OrbitTable::new(setting).with_rows(ORBITS.1)
    }

    /// Whether the orbit of a cell is kept: at regular intervals on the coarsest grid.
    fn keeps(&self, (i, j): CellIndex) -> bool {
        let step = self.stride(0);
        let is_coarse = i.is_multiple_of(step) && j.is_multiple_of(step);
        let total = self.base[0] * self.base[1] * self.keys.seeds.len();
        let number = j / step * self.base[0] + i / step;
        is_coarse && number.is_multiple_of(total.div_ceil(ORBITS.0))
    }

    /// One motion; `None` when it was interrupted.
    pub(super) fn cell(
        &self,
        grounds: &mut Grounds<'_>,
        (seed, place): (usize, CellIndex),
        start: Option<Vec<f64>>,
        size: MapSize,
    ) -> Option<MapCell> {
        let (setting, keys) = (self.setting, self.keys);
        let p = [self.share(0, place.0), self.share(1, place.1)];
        let lost = |reason: String| {
            Some(MapCell {
                label: Label::Undecided,
                values: vec![f64::NAN; self.wanted.columns.len()],
                end: Vec::new(),
                has_waited: false,
                failure: Some(reason),
                orbit: None,
            })
        };
        let system = match grounds.system(p) {
            Ok(system) => system,
            Err(error) => return lost(error.to_string()),
        };
        let mut state = start.unwrap_or_else(|| flow::rest(&system).0);
        let mut integrator = match flow::integrator(setting, &system, keys.integrator) {
            Ok(integrator) => integrator,
            Err(fault) => return lost(fault.message),
        };
        let mut map = Stroboscopic {
            system: &system,
            integrator: integrator.as_mut(),
        };
        let mut keep_going = |_: usize| !setting.control.is_interrupted();
        let labels = LabelOptions {
            goal: Goal::Attractor,
            ..keys.label_keys().options()
        };
        let found = attractor(&mut map, &mut state, size, labels, &mut keep_going);
        match found.record.stop {
            Some(RecordStop::Interrupted) => return None,
            Some(stop) => return lost(flow::tell(stop, setting)),
            None => {}
        }
        Some(self.measured(grounds, (seed, place), (system, &found, state)))
    }

    /// A cell whose motion is known.
    pub(super) fn measured(
        &self,
        grounds: &mut Grounds<'_>,
        (seed, place): (usize, CellIndex),
        (system, found, state): (System, &Attractor, Vec<f64>),
    ) -> MapCell {
        let (setting, keys) = (self.setting, self.keys);
        let p = [self.share(0, place.0), self.share(1, place.1)];
        let mut cell = MapCell {
            label: found.label,
            values: vec![f64::NAN; self.wanted.columns.len()],
            failure: None,
            end: state.clone(),
            has_waited: false,
            orbit: None,
        };
        let keeps = matches!(found.label, Label::Period(_)) && self.keeps(place);
        if self.wanted.columns.is_empty() && !keeps {
            return cell;
        }
        // Contacts need no number of the model but those in the system.
        let changed = match self.wanted.are_contacts() {
            true => None,
            false => match grounds.model(p) {
                Ok(changed) => Some(changed),
                Err(_) => return cell,
            },
        };
        let (model, assembly) = match &changed {
            Some((model, assembly)) => (model, assembly),
            None => (setting.model, setting.assembly),
        };
        if let Ok((system, orbit)) = measured(setting, (system, keys.integrator), found, &state) {
            if keeps {
                let mut table = Field::no_orbits(setting);
                table.add((seed, 0), &system, &orbit);
                cell.orbit = Some(table);
            }
            let mut meter = Meter::new(16);
            let mut connections = match self.wanted.are_contacts() {
                true => meter.contacts(&system, &orbit),
                false => meter.measure(&system, &orbit),
            };
            let stiffness = assembly.scales.stiffness.iter();
            let written = &setting.assembly.scales.stiffness;
            let stiffening: Vec<f64> = stiffness.zip(written).map(|(k, own)| k / own).collect();
            for (m, factor) in connections.iter_mut().zip(&stiffening) {
                m.scale_force(*factor);
            }
            let solved = Solved {
                model,
                assembly,
                system: &system,
                orbit: &orbit,
                connections: &connections,
                stiffening: &stiffening,
            };
            cell.values = self.wanted.of(setting, &solved);
        }
        cell
    }
}
