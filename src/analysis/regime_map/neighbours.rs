//! Cells that are decided by what is known of the cells beside them.

use super::cells::{CellIndex, Field, MapCell};
use crate::analysis::bifurcation_curve::Grounds;
use crate::analysis::flow;
use crate::interrupt;
use crate::solve::attractor::{Label, MapSize, Stroboscopic, caught};
use crate::solve::curve::Plane;
use rayon::prelude::*;

/// Neighbouring places.
const AROUND: [(isize, isize); 4] = [(-1, 0), (1, 0), (0, -1), (0, 1)];
/// Periods after which a motion that is not caught by an orbit stays what it looked like.
const PATIENCE: usize = 4000;
/// Laps of the longest orbit for which a motion that has waited so long goes on when it is asked once more.
const LAPS_MORE: usize = 8;
/// Orbits of neighbours that are tried.
const MOST: usize = 6;

/// What is asked of a cell.
type Question = ((usize, CellIndex), Vec<f64>);

/// What becomes of a motion that waits.
enum Waited {
    Caught(Box<MapCell>),
    /// It goes on from there.
    GoesOn(Vec<f64>),
}

impl Field<'_> {
    /// Goes on with the motions of undecided cells beside which the others agree, for longer with every round.
    pub(super) fn decide(&mut self, round: usize) {
        let is_open = |((seed, place), cell): &(&(usize, CellIndex), &MapCell)| {
            let is_undecided = cell.label == Label::Undecided && cell.failure.is_none();
            is_undecided && !self.is_contested(*seed, *place)
        };
        let open = self.cells.iter().filter(is_open);
        let open: Vec<Question> = open.map(|(key, cell)| (*key, cell.end.clone())).collect();
        let size = self.keys.size();
        let longer = MapSize {
            transient: size.transient << (2 * round),
            periods: size.periods << round,
            ..size
        };
        let flag = interrupt::current();
        let one = |((seed, place), end): Question| {
            flag.scope(|| {
                let mut grounds = Grounds::new(self.setting, self.axes.clone(), 1);
                let cell = self.cell(&mut grounds, (seed, place), Some(end), longer)?;
                Some(((seed, place), cell))
            })
        };
        let found: Vec<_> = open.into_par_iter().filter_map(one).collect();
        self.cells.extend(found);
    }

    /// Goes on with the motions of undecided and chaotic cells beside which others have settled on an orbit that is there in the
    /// cell, too; those beside some places alone, if they are given. Places of the motions that have been caught.
    pub(super) fn ask_neighbours(&mut self, fresh: Option<&[CellIndex]>) -> Vec<CellIndex> {
        let furthest = self.stride(0);
        let is_beside = |(i, j): CellIndex| {
            let near = |other: &CellIndex| other.0.abs_diff(i).max(other.1.abs_diff(j)) <= furthest;
            fresh.is_none_or(|places| places.iter().any(near))
        };
        let is_open = |((_, place), cell): &(&(usize, CellIndex), &MapCell)| {
            let is_restless = matches!(cell.label, Label::Undecided | Label::Chaotic);
            is_restless && cell.failure.is_none() && is_beside(*place)
        };
        let open = self.cells.iter().filter(is_open);
        let open: Vec<_> = open.collect();
        let flag = interrupt::current();
        let one = |(key, cell): (&(usize, CellIndex), &MapCell)| {
            flag.scope(|| Some((*key, self.caught(*key, cell)?)))
        };
        let found: Vec<_> = open.into_par_iter().filter_map(one).collect();
        let mut places = Vec::new();
        for (key, outcome) in found {
            match (outcome, self.cells.get_mut(&key)) {
                (Waited::Caught(cell), _) => {
                    places.push(key.1);
                    self.cells.insert(key, *cell);
                }
                (Waited::GoesOn(end), Some(cell)) => (cell.end, cell.has_waited) = (end, true),
                (Waited::GoesOn(_), None) => {}
            }
        }
        places
    }

    /// What becomes of the motion of a cell beside orbits of neighbours; `None` where none of them is there.
    fn caught(&self, (seed, place): (usize, CellIndex), cell: &MapCell) -> Option<Waited> {
        let orbits = self.orbits_around(place);
        if orbits.is_empty() {
            return None;
        }
        let (setting, keys) = (self.setting, self.keys);
        let mut grounds = Grounds::new(setting, self.axes.clone(), 1);
        let p = [self.share(0, place.0), self.share(1, place.1)];
        let system = grounds.system(p).ok()?;
        let mut integrator = flow::integrator(setting, &system, keys.integrator).ok()?;
        let mut keep_going = |_: usize| !setting.control.is_interrupted();
        let mut map = Stroboscopic {
            system: &system,
            integrator: integrator.as_mut(),
        };
        let longest = orbits.iter().map(|(period, _)| *period).max();
        let periods = match cell.has_waited {
            // Where it has settled on an orbit by now, it is there at once.
            true => LAPS_MORE * longest.unwrap_or(1),
            false => PATIENCE,
        };
        let mut state = cell.end.clone();
        Some(
            match caught(&mut map, &mut state, &orbits, periods, &mut keep_going) {
                Some(found) => {
                    let cell = self.measured(&mut grounds, (seed, place), (system, &found, state));
                    Waited::Caught(Box::new(cell))
                }
                None if state == cell.end => return None,
                None => Waited::GoesOn(state),
            },
        )
    }

    /// Orbits, each with its period and a state, on which motions have settled in the same place or beside it, with any seed.
    fn orbits_around(&self, place: CellIndex) -> Vec<(usize, &[f64])> {
        let longest = self.keys.longest_period.unwrap_or(usize::MAX);
        let mut list: Vec<(usize, &[f64])> = Vec::new();
        for seed in 0..self.keys.seeds.len() {
            let own = self.cells.get(&(seed, place));
            let beside = AROUND
                .iter()
                .filter_map(|way| self.beside((seed, place), *way));
            for cell in own.into_iter().chain(beside) {
                let Label::Period(n) = cell.label else {
                    continue;
                };
                if n <= longest && list.iter().all(|(known, _)| *known != n) {
                    list.push((n, &cell.end));
                }
            }
        }
        list.truncate(MOST);
        list
    }

    /// The nearest cell in a direction, at most a step of the coarsest grid away.
    fn beside(
        &self,
        (seed, (i, j)): (usize, CellIndex),
        (a, b): (isize, isize),
    ) -> Option<&MapCell> {
        let furthest = self.stride(0) as isize;
        let along = (1..=furthest).map(|k| (i as isize + k * a, j as isize + k * b));
        let mut places =
            along.filter_map(|(x, y)| Some((usize::try_from(x).ok()?, usize::try_from(y).ok()?)));
        places.find_map(|place| self.cells.get(&(seed, place)))
    }

    /// Whether the decided cells nearest to a place have different labels.
    fn is_contested(&self, seed: usize, place: CellIndex) -> bool {
        let around = AROUND.map(|way| self.beside((seed, place), way));
        let labels = around.into_iter().flatten().map(|cell| cell.label);
        let mut labels = labels.filter(|label| *label != Label::Undecided);
        let first = labels.next();
        labels.any(|label| Some(label) != first)
    }
}
