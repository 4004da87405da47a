//! In which region of its law every part is, and where it leaves it.

use super::ROUNDING;
use super::cells::departs;
use super::laws::{ForcePiece, Law, LawPart};
use super::part::{Exits, Part, Watched, speed_of};
use super::rebound::Rebound;
use super::series::MotionSeries;
use crate::element::automaton::{MemoryRate, RegionForce, Reset};
use crate::numeric::bernstein::Direction;
use crate::numeric::outline::{Gate, Outline};
use crate::numeric::taylor::{COUNT, Polynomial};
use crate::system::System;
use std::cmp::Ordering;

/// The first crossing on a step.
#[derive(Debug, Clone, Copy)]
pub(crate) struct RegionCrossing {
    pub theta: f64,
    pub part: usize,
    pub watched: Watched,
    pub direction: Direction,
}

/// Guard that a part has passed.
#[derive(Debug, Clone, Copy)]
pub(crate) struct GuardPassage {
    /// Deformation.
    pub level: f64,
    /// Flank before.
    pub from: i8,
    /// Flank after.
    pub to: i8,
}

/// Regions of all parts.
#[derive(Debug, Clone)]
pub(crate) struct Regions {
    pub(super) parts: Vec<Part>,
    /// theta^k of the step.
    powers: Polynomial,
    /// Whether some part has an automaton, and whether some part can be held.
    has_automata: bool,
    has_contacts: bool,
}

/// Largest coordinate or, in units of time of the series, rate.
pub(super) fn size(series: &MotionSeries, state: &[f64]) -> f64 {
    let (q, v) = state.split_at(state.len() / 2);
    let rates = v.iter().map(|v| v.abs() * series.unit);
    q.iter().map(|q| q.abs()).chain(rates).fold(0.0, f64::max)
}

impl Regions {
    /// Every part in the lowest region of its law.
    pub(crate) fn new(laws: Vec<LawPart>, series: &MotionSeries) -> Regions {
        let part = |part: LawPart| {
            let sizes = series.sizes(part.connection);
            Part::new(part, sizes)
        };
        let parts: Vec<Part> = laws.into_iter().map(part).collect();
        Regions {
            has_automata: parts.iter().any(|p| p.law.automaton.is_some()),
            has_contacts: parts.iter().any(Part::can_be_held),
            parts,
            powers: [0.0; COUNT],
        }
    }

    /// All parts.
    pub(crate) fn parts(&self) -> &[Part] {
        &self.parts
    }

    /// Whether some part has an automaton.
    pub(crate) fn has_automata(&self) -> bool {
        self.has_automata
    }

    /// Whether some part can be held.
    pub(crate) fn has_contacts(&self) -> bool {
        self.has_contacts
    }

    /// Whether some part has regions between breakpoints.
    pub(crate) fn has_lines(&self) -> bool {
        let has_breakpoints =
            |p: &Part| p.law.automaton.is_none() && !p.evolves() && p.law.pieces.len() > 1;
        self.parts.iter().any(has_breakpoints)
    }

    /// The force of a part in its region.
    #[inline]
    pub(crate) fn piece(&self, part: usize) -> &ForcePiece {
        self.parts[part].piece()
    }

    /// The connection that alone would oscillate fastest in its steepest region.
    pub(crate) fn stiffest(&self, system: &System) -> usize {
        let square = |part: &Part| {
            let e = part.connection;
            let row = system.element_map_row(e).iter();
            let own: f64 = row.map(|(i, w)| w * system.stiffness()[(*i, e)]).sum();
            let variation = system.mounts()[e].stiffness_variation.as_ref();
            let factor = variation.map_or(1.0, |s| s.largest());
            own.abs() * factor * part.law.slopes(f64::max).0
        };
        let fastest = (self.parts.iter()).max_by(|a, b| square(a).total_cmp(&square(b)));
        fastest.map_or(0, |part| part.connection)
    }

    /// Action where a part passes a guard.
    pub(crate) fn reset(&self, crossing: &RegionCrossing) -> Reset {
        let part = &self.parts[crossing.part];
        part.guard(crossing.watched, crossing.direction)
            .map_or(Reset::None, |g| g.reset)
    }

    /// Moves a part over a guard into the next region.
    pub(crate) fn pass(&mut self, crossing: &RegionCrossing, deformation: f64) -> GuardPassage {
        let part = &mut self.parts[crossing.part];
        let before = part.region;
        let flank = |law: &Law, region: usize| law.flanks[region];
        if let Some(cells) = &part.law.cells {
            let next = cells.beside(before, crossing.watched.axis(), crossing.direction);
            let (low, high) = (part.exits.low, part.exits.high);
            let level = match crossing.direction {
                Direction::Up => high,
                Direction::Down => low,
            };
            part.enter(next);
            return GuardPassage {
                level,
                from: flank(&part.law, before),
                to: flank(&part.law, next),
            };
        }
        let (next, level) = match part.guard(crossing.watched, crossing.direction) {
            Some(guard) => {
                let level = match (crossing.watched, crossing.direction) {
                    (Watched::Level, Direction::Up) => part.exits.high,
                    (Watched::Level, Direction::Down) => part.exits.low,
                    _ => deformation,
                };
                (guard.to, level)
            }
            None => match crossing.direction {
                Direction::Up => (before + 1, part.law.breakpoints[before]),
                Direction::Down => (before - 1, part.law.breakpoints[before - 1]),
            },
        };
        part.settle(deformation);
        part.enter(next);
        GuardPassage {
            level,
            from: flank(&part.law, before),
            to: flank(&part.law, next),
        }
    }

    /// Puts a part into a region.
    pub(crate) fn enter(&mut self, part: usize, region: usize) {
        self.parts[part].enter(region);
    }

    /// Notes that a part on the level of a stop moves away from it.
    pub(crate) fn rebound(&mut self, part: usize, direction: Direction) {
        self.parts[part].rebounds = Some(Rebound::new(direction));
    }

    /// Follows flights from stops up to theta, where the state is; those that have gone far are over.
    pub(crate) fn fly(&mut self, series: &MotionSeries, theta: f64, state: &[f64]) {
        let size = size(series, state);
        for part in &mut self.parts {
            let course = series.deformation(part.connection);
            part.rebounds = part.rebounds.and_then(|r| r.after(course, theta, size));
        }
    }

    /// The earliest crossing of any part within a step from a state.
    pub(crate) fn first_crossing(
        &mut self,
        series: &MotionSeries,
        (tau, state): (f64, &[f64]),
        step: f64,
    ) -> Option<RegionCrossing> {
        fill_powers(&mut self.powers, step);
        let size = size(series, state);
        let mut first: Option<RegionCrossing> = None;
        for (k, part) in self.parts.iter().enumerate() {
            let Exits { low, high, .. } = part.exits;
            if part.is_plain && low.is_infinite() && high.is_infinite() {
                continue;
            }
            let mut earliest = |x: f64, watched: Watched, direction: Direction| {
                if first.is_none_or(|f| x * step < f.theta) {
                    first = Some(RegionCrossing {
                        theta: x * step,
                        part: k,
                        watched,
                        direction,
                    });
                }
            };
            match part.is_plain {
                true => {}
                false if part.evolves() => {
                    part.watch_cell(series, &self.powers, size, &mut earliest);
                }
                false => part.watch(series, &self.powers, size, &mut earliest),
            }
            if low.is_infinite() && high.is_infinite() {
                continue;
            }
            let mut polynomial = *series.deformation(part.connection);
            for (c, power) in polynomial.iter_mut().zip(&self.powers) {
                *c *= power;
            }
            let outline = Outline::new(&polynomial.map(|c| [c]));
            let ([least], [largest]) = outline.hull();
            let borders = [
                (low, Direction::Down, least),
                (high, Direction::Up, largest),
            ];
            for (level, direction, extreme) in borders {
                let flight = part.rebounds.filter(|r| r.direction == direction);
                if let Some(rebound) = flight {
                    let least = ROUNDING * part.weight * size;
                    if let Some(x) = rebound.ends(&polynomial, least) {
                        earliest(x, Watched::Level, direction);
                    }
                    continue;
                }
                let gate = Gate {
                    level,
                    direction,
                    tolerance: part.tolerance(level, size, tau),
                };
                if gate.is_out_of_reach(extreme) {
                    continue;
                }
                if let Some(x) = outline.passage(0, gate, || polynomial) {
                    earliest(x, Watched::Level, direction);
                }
            }
        }
        first
    }

    /// Puts every part into the region of its deformation, on a breakpoint into the one below. Returns whether one of
    /// them is where it may leave: [`Regions::leave`] decides there.
    pub(crate) fn place(
        &mut self,
        series: &MotionSeries,
        (tau, state): (f64, &[f64]),
        deformation: &[f64],
    ) -> bool {
        let size = size(series, state);
        let mut stands = false;
        for part in self.parts.iter_mut().filter(|p| !p.evolves()) {
            let x = deformation[part.connection];
            if part.law.automaton.is_some() {
                part.place(x, |p, level| p.tolerance(level, size, tau));
                let Exits { low, high, .. } = part.exits;
                for level in [low, high] {
                    stands |= (x - level).abs() <= part.tolerance(level, size, tau);
                }
                continue;
            }
            let mut region = 0;
            for level in &part.law.breakpoints {
                let tolerance = part.tolerance(*level, size, tau);
                region += usize::from(x - level > tolerance);
                stands |= (x - level).abs() <= tolerance;
            }
            part.enter(region);
        }
        stands
    }

    /// Moves parts on the border of their region that are about to leave it, if nothing else happens there.
    pub(crate) fn leave(&mut self, series: &MotionSeries, (tau, state): (f64, &[f64])) {
        let size = size(series, state);
        for part in &mut self.parts {
            let polynomial = series.deformation(part.connection);
            if let Some(cells) = &part.law.cells {
                let rate = speed_of(series, polynomial);
                let size = [size, size / series.unit, size];
                let tolerance = |axis: usize, level: f64| ROUNDING * (level.abs() + size[axis]);
                let moved = [polynomial, &rate, &part.course];
                let next = cells.leave(part.region, moved, tolerance);
                part.enter(next);
                continue;
            }
            for _ in 0..part.law.pieces.len() {
                let Exits { low, high, .. } = part.exits;
                // A motion on a breakpoint has been put below it.
                let ends = [(high, Direction::Up), (low, Direction::Down)];
                let count = if part.law.automaton.is_some() { 2 } else { 1 };
                let leaves = |(level, direction): &(f64, Direction)| {
                    let tolerance = part.tolerance(*level, size, tau);
                    level.is_finite()
                        && (polynomial[0] - level).abs() <= tolerance
                        && departs(polynomial, tolerance, *direction)
                };
                let Some((_, direction)) = ends.into_iter().take(count).find(leaves) else {
                    break;
                };
                match part.guard(Watched::Level, direction).copied() {
                    None => part.enter(part.region + 1),
                    Some(guard) if guard.reset == Reset::None => {
                        part.settle(polynomial[0]);
                        part.enter(guard.to);
                    }
                    Some(guard) if matches!(guard.reset, Reset::Jump { .. }) => {
                        part.enter(guard.to);
                    }
                    Some(_) => break,
                }
            }
        }
    }

    /// The breakpoint on which a part is and the flank of its region, if it is in contact.
    pub(crate) fn begun(
        &self,
        series: &MotionSeries,
        (tau, state): (f64, &[f64]),
        part: usize,
        deformation: f64,
    ) -> Option<(f64, i8)> {
        let part = &self.parts[part];
        let flank = part.law.flanks[part.region];
        let Exits { low, high, .. } = part.exits;
        let stands = |level: &f64| {
            let tolerance = part.tolerance(*level, size(series, state), tau);
            (deformation - level).abs() <= tolerance
        };
        let level = [low, high].into_iter().filter(|x| x.is_finite());
        let level = level.into_iter().find(stands)?;
        (flank != 0).then_some((level, flank))
    }

    /// Copies the region of every part.
    pub(crate) fn save(&self, list: &mut [usize]) {
        let regions = self.parts.iter().map(|p| p.region);
        list.iter_mut().zip(regions).for_each(|(l, r)| *l = r);
    }

    /// Takes back the region of every part; `list` becomes the ones that were left.
    pub(crate) fn swap(&mut self, list: &mut [usize]) {
        for (l, part) in list.iter_mut().zip(&mut self.parts) {
            let here = part.region;
            if here != *l {
                part.enter(*l);
            }
            *l = here;
        }
    }

    /// Direction in which a part between breakpoints enters a region.
    pub(crate) fn towards(&self, part: usize, region: usize) -> Option<Direction> {
        let part = &self.parts[part];
        if part.law.automaton.is_some() || part.evolves() {
            return None;
        }
        match region.cmp(&part.region) {
            Ordering::Less => Some(Direction::Down),
            Ordering::Equal => None,
            Ordering::Greater => Some(Direction::Up),
        }
    }

    /// Takes over the memory of every part.
    pub(crate) fn remember(&mut self, memory: &[f64]) {
        for part in &mut self.parts {
            if let Some(m) = part.memory {
                part.z = memory[m];
            }
        }
    }

    /// Writes the memory of every part at deformations.
    pub(crate) fn recall(&self, deformation: impl Fn(usize) -> f64, memory: &mut [f64]) {
        for part in &self.parts {
            if let Some(m) = part.memory {
                memory[m] = part.memory_at(deformation(part.connection));
            }
        }
    }

    /// Parts that are held, with their connection and level.
    pub(crate) fn held(&self) -> impl Iterator<Item = (usize, usize, f64)> {
        let parts = self.parts.iter().enumerate();
        parts.filter_map(|(k, p)| Some((k, p.connection, p.held_level()?)))
    }

    /// Offset of the memory from the deformation, of a part that follows it.
    pub(crate) fn follows(&self, part: usize) -> Option<f64> {
        match self.parts[part].memory_rate()? {
            MemoryRate::Follows { offset } => Some(offset),
            MemoryRate::Kept => None,
        }
    }

    /// df/dz of a part in its region.
    pub(crate) fn memory_gain(&self, part: usize) -> f64 {
        let part = &self.parts[part];
        let region = part.law.automaton.as_ref().map(|a| &a.regions[part.region]);
        match region.map(|r| r.force) {
            Some(RegionForce::Affine { z, .. }) => z,
            _ => 0.0,
        }
    }
}

/// theta^k, four at a time.
fn fill_powers(powers: &mut Polynomial, theta: f64) {
    let square = theta * theta;
    let mut four = [1.0, theta, square, square * theta];
    let factor = square * square;
    for part in powers.as_chunks_mut::<4>().0 {
        *part = four;
        four = four.map(|p| p * factor);
    }
}
