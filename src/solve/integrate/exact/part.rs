//! One part of a law: the region it is in, and what it watches there.

use super::ROUNDING;
use super::laws::{ForcePiece, Law, LawPart};
use super::rebound::Rebound;
use super::series::MotionSeries;
use crate::element::automaton::{Guard, MemoryRate, Region, RegionForce, Surface};
use crate::numeric::bernstein::Direction;
use crate::numeric::outline::{Gate, Outline};
use crate::numeric::taylor::{Affine, COUNT, Polynomial};

/// Quantity monitored by a guard.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(crate) enum Watched {
    /// A level of the deformation.
    Level,
    /// Rate 0.
    Rate,
    /// A force in held contact.
    Force,
    /// A level of a memory that has a rate.
    Memory,
}

impl Watched {
    /// Place among deformation, rate and memory.
    pub fn axis(self) -> usize {
        match self {
            Watched::Level | Watched::Force => 0,
            Watched::Rate => 1,
            Watched::Memory => 2,
        }
    }
}

/// Instant at which a part leaves its region; infinite if it does not.
#[derive(Debug, Clone, Copy)]
pub(crate) struct Exits {
    /// Deformations.
    pub low: f64,
    pub high: f64,
    /// Numbers of the guards there.
    down: Option<usize>,
    up: Option<usize>,
    /// Way in which rate 0 is passed.
    pub rate: Option<Direction>,
    /// Holding forces.
    pub weak: f64,
    pub strong: f64,
    /// Borders in rate and memory of a law whose memory has a rate.
    pub rates: (f64, f64),
    pub memories: (f64, f64),
}

const NOWHERE: Exits = Exits {
    low: f64::NEG_INFINITY,
    high: f64::INFINITY,
    down: None,
    up: None,
    rate: None,
    weak: f64::NEG_INFINITY,
    strong: f64::INFINITY,
    rates: (f64::NEG_INFINITY, f64::INFINITY),
    memories: (f64::NEG_INFINITY, f64::INFINITY),
};

/// A part of the law of a connection.
#[derive(Debug, Clone)]
pub struct Part {
    pub connection: usize,
    pub law: Law,
    pub region: usize,
    /// Place of its memory in the state, and the memory where it is kept.
    pub memory: Option<usize>,
    pub z: f64,
    pub exits: Exits,
    /// Series of the memory on the step, where it has a rate.
    pub course: Polynomial,
    /// Whether it watches levels of the deformation alone.
    pub is_plain: bool,
    /// The flight from a stop that it has hit.
    pub rebounds: Option<Rebound>,
    /// Force in the region with what the memory adds.
    remembered: Option<ForcePiece>,
    /// Sum of the moduli of W in its row.
    pub weight: f64,
    /// Bound on its transmission error and the slope of it.
    error: f64,
}

impl Part {
    pub fn new(part: LawPart, (weight, error): (f64, f64)) -> Part {
        let mut part = Part {
            connection: part.connection,
            law: part.law,
            region: 0,
            memory: part.memory,
            z: 0.0,
            course: [0.0; COUNT],
            exits: NOWHERE,
            is_plain: true,
            rebounds: None,
            remembered: None,
            weight,
            error,
        };
        part.enter(0);
        part
    }

    /// Distance from a level that rounding bridges, for a state of a size at a phase of the response.
    pub fn tolerance(&self, level: f64, size: f64, tau: f64) -> f64 {
        ROUNDING * (level.abs() + self.weight * size + self.error * (1.0 + tau.abs()))
    }

    /// The force in its region.
    #[inline]
    pub fn piece(&self) -> &ForcePiece {
        match &self.remembered {
            Some(piece) => piece,
            None => &self.law.pieces[self.region],
        }
    }

    fn of_automaton(&self) -> Option<&Region> {
        let automaton = self.law.automaton.as_ref()?;
        Some(&automaton.regions[self.region])
    }

    /// Evolution of its memory.
    pub(crate) fn memory_rate(&self) -> Option<MemoryRate> {
        self.memory?;
        Some(self.of_automaton()?.memory)
    }

    /// Whether it has a region in which it is held.
    pub(crate) fn can_be_held(&self) -> bool {
        let held = |r: &Region| matches!(r.force, RegionForce::Held { .. });
        let automaton = self.law.automaton.as_ref();
        automaton.is_some_and(|a| a.regions.iter().any(held))
    }

    /// Level at which it is held.
    pub(crate) fn held_level(&self) -> Option<f64> {
        match self.of_automaton()?.force {
            RegionForce::Held { level } => Some(level),
            RegionForce::Affine { .. } => None,
        }
    }

    /// The memory at a deformation.
    pub(crate) fn memory_at(&self, deformation: f64) -> f64 {
        match self.memory_rate() {
            Some(MemoryRate::Follows { offset }) => deformation + offset,
            _ => self.z,
        }
    }

    /// Takes over the memory at a deformation: it is kept from there on.
    pub fn settle(&mut self, deformation: f64) {
        self.z = self.memory_at(deformation);
    }

    /// The guard of its region that watches something in a direction.
    pub fn guard(&self, watched: Watched, direction: Direction) -> Option<&Guard> {
        let guards = &self.of_automaton()?.guards;
        match (watched, direction) {
            (Watched::Level, Direction::Up) => return guards.get(self.exits.up?),
            (Watched::Level, Direction::Down) => return guards.get(self.exits.down?),
            _ => {}
        }
        guards.iter().find(|g| {
            let kind = match g.surface {
                Surface::Deformation { .. } => Watched::Level,
                Surface::Rate => Watched::Rate,
                Surface::HoldingForce(_) => Watched::Force,
            };
            kind == watched && g.direction == direction
        })
    }

    /// Enters a region.
    pub(crate) fn enter(&mut self, region: usize) {
        self.region = region;
        self.rebounds = None;
        self.exits = NOWHERE;
        self.remembered = None;
        self.is_plain = true;
        if let Some(cells) = &self.law.cells {
            (self.exits.low, self.exits.high) = cells.borders(region, 0);
            self.exits.rates = cells.borders(region, 1);
            self.exits.memories = cells.borders(region, 2);
            self.is_plain = false;
            return;
        }
        let Some(automaton) = &self.law.automaton else {
            (self.exits.low, self.exits.high) = self.law.borders(region);
            return;
        };
        let region = &automaton.regions[region];
        for (number, guard) in region.guards.iter().enumerate() {
            let exits = &mut self.exits;
            match (guard.surface, guard.direction) {
                (Surface::Deformation { level, gain }, direction) => {
                    let level = level + gain * self.z;
                    match direction {
                        Direction::Up if level < exits.high => {
                            (exits.high, exits.up) = (level, Some(number));
                        }
                        Direction::Down if level > exits.low => {
                            (exits.low, exits.down) = (level, Some(number));
                        }
                        _ => {}
                    }
                }
                (Surface::Rate, direction) => exits.rate = Some(direction),
                (Surface::HoldingForce(force), Direction::Up) => exits.strong = force,
                (Surface::HoldingForce(force), Direction::Down) => exits.weak = force,
            }
        }
        let watches_force = self.exits.weak.is_finite() || self.exits.strong.is_finite();
        self.is_plain = self.exits.rate.is_none() && !watches_force;
        if let RegionForce::Affine { constant, q, v, z } = region.force
            && z != 0.0
        {
            self.remembered = Some(ForcePiece::Affine(Affine {
                constant: constant + z * self.z,
                q,
                v,
            }));
        }
    }

    /// Puts a part with automaton into the region of a deformation, on a fixed border into the one below; `tolerance`: rounding of
    /// a level.
    pub fn place(&mut self, deformation: f64, tolerance: impl Fn(&Part, f64) -> f64) {
        let Some(automaton) = &self.law.automaton else {
            return;
        };
        self.enter(automaton.home(deformation, |level| tolerance(self, level)));
    }

    /// Whether its memory has a rate.
    #[inline]
    pub(crate) fn evolves(&self) -> bool {
        self.law.cells.is_some()
    }

    /// Reports the first passage of a level of rate or memory of a law whose memory has a rate, within a step.
    pub(crate) fn watch_cell(
        &self,
        series: &MotionSeries,
        powers: &Polynomial,
        size: f64,
        earliest: &mut dyn FnMut(f64, Watched, Direction),
    ) {
        let mut rate = rate_of(series.deformation(self.connection), powers);
        // In units of the step from that of the series.
        rate.iter_mut().for_each(|c| *c /= series.unit);
        let mut memory = self.course;
        for (c, power) in memory.iter_mut().zip(powers) {
            *c *= power;
        }
        let speed = self.weight.max(f64::MIN_POSITIVE) * size / series.unit;
        let watched = [
            (Watched::Rate, &rate, self.exits.rates, speed),
            (Watched::Memory, &memory, self.exits.memories, size),
        ];
        for (watched, polynomial, (low, high), size) in watched {
            for (level, direction) in [(low, Direction::Down), (high, Direction::Up)] {
                let tolerance = ROUNDING * (level.abs() + size);
                if level.is_finite()
                    && let Some(x) = passage(polynomial, level, direction, tolerance)
                {
                    earliest(x, watched, direction);
                }
            }
        }
    }

    /// Reports the first passage of rate 0, or of a holding force, within a step.
    pub fn watch(
        &self,
        series: &MotionSeries,
        powers: &Polynomial,
        size: f64,
        earliest: &mut dyn FnMut(f64, Watched, Direction),
    ) {
        if let Some(direction) = self.exits.rate {
            let rate = rate_of(series.deformation(self.connection), powers);
            let tolerance = ROUNDING * self.weight.max(f64::MIN_POSITIVE) * size;
            if let Some(x) = passage(&rate, 0.0, direction, tolerance) {
                earliest(x, Watched::Rate, direction);
            }
        }
        let ends = [
            (self.exits.weak, Direction::Down),
            (self.exits.strong, Direction::Up),
        ];
        for (force, direction) in ends.into_iter().filter(|(f, _)| f.is_finite()) {
            let Some(holding) = series.holding_force(self.connection) else {
                continue;
            };
            let mut polynomial = *holding;
            for (c, power) in polynomial.iter_mut().zip(powers) {
                *c *= power;
            }
            let largest = polynomial.iter().fold(force.abs(), |m, c| m.max(c.abs()));
            let tolerance = ROUNDING * largest;
            // Loads may jump at the begin of a step.
            let is_beyond = direction.sign() * (polynomial[0] - force) > 1e3 * tolerance;
            let found = match is_beyond {
                true => Some(0.0),
                false => passage(&polynomial, force, direction, tolerance),
            };
            if let Some(x) = found {
                earliest(x, Watched::Force, direction);
            }
        }
    }
}

/// dx/dtheta of a deformation, in powers of the step.
fn rate_of(deformation: &Polynomial, powers: &Polynomial) -> Polynomial {
    let mut rate = [0.0; COUNT];
    for k in 1..COUNT {
        rate[k - 1] = k as f64 * deformation[k] * powers[k - 1];
    }
    rate
}

fn passage(
    polynomial: &Polynomial,
    level: f64,
    direction: Direction,
    tolerance: f64,
) -> Option<f64> {
    let outline = Outline::new(&polynomial.map(|c| [c]));
    let gate = Gate {
        level,
        direction,
        tolerance,
    };
    outline.passage(0, gate, || *polynomial)
}

/// dx/dT of a deformation, in powers of theta.
pub fn speed_of(series: &MotionSeries, deformation: &Polynomial) -> Polynomial {
    let mut rate = [0.0; COUNT];
    for k in 1..COUNT {
        rate[k - 1] = k as f64 * deformation[k] / series.unit;
    }
    rate
}
