//! In which region of its law every connection is, and where it leaves it.

use super::pieces::Pieces;
use crate::numeric::bernstein::{Direction, first_passage};
use crate::numeric::periodic::Periodic;
use crate::solve::integrate::{FlowObserver, Switch, SwitchKind};
use crate::solve::jumps;
use crate::system::{Scratch, System};

/// Coefficients of the quintic polynomials of a step.
pub(super) const COUNT: usize = 6;

/// The passage that ends a step.
#[derive(Debug, Clone, Copy)]
pub(super) struct StepPassage {
    /// Share of the step before it.
    pub(super) x: f64,
    pub(super) connection: usize,
    pub(super) level: f64,
    pub(super) direction: Direction,
    /// Number of the slider whose guard it is, and whether that is a rate; `None` for a breakpoint.
    pub(super) slider: Option<(usize, bool)>,
}

/// Breakpoints of every law, and between which two of them the connection is.
#[derive(Debug, Clone, Default)]
pub(super) struct SteppedRegions {
    levels: Vec<Vec<f64>>,
    region: Vec<usize>,
    /// The region of each law, moved inwards by rounding: laws are evaluated inside.
    windows: Vec<(f64, f64)>,
    /// Largest value and slope of each transmission error together, per radian of the response.
    slopes: Vec<f64>,
    /// Breakpoints passed since the start.
    pub(super) switches: usize,
    /// Jumps of the force passed and not yet given to Phi; `None` before the start.
    pub(super) jumps: Option<Vec<Jump>>,
    /// A connection that has come to rest on a jump of its force.
    pub(super) sticks: Option<usize>,
    /// Excursions from a jump shorter than this are rest.
    shortest_stay: f64,
}

/// Excursions from a jump on which a motion can rest that are shorter than this, in units of the fastest time scale, end on it.
const SHORTEST_STAY: f64 = 1e-4;

/// A jump of a connection's force, passed at a rate.
#[derive(Debug, Clone, Copy)]
pub(super) struct Jump {
    pub(super) connection: usize,
    pub(super) size: f64,
    pub(super) rate: f64,
}

/// Adds W q of a connection on a step, given the coefficients of q in powers of x.
pub(super) fn add_deformation(
    sum: &mut [f64; COUNT],
    system: &System,
    connection: usize,
    coefficients: &[f64],
) {
    for (j, w) in system.element_map_row(connection) {
        let q = &coefficients[j * COUNT..(j + 1) * COUNT];
        sum.iter_mut().zip(q).for_each(|(s, c)| *s += w * c);
    }
}

/// A state with everything that is known about it: tau, [q; v], accelerations, deformations.
#[derive(Debug, Clone, Copy)]
pub(super) struct StepInstant<'a> {
    pub(super) tau: f64,
    pub(super) state: &'a [f64],
    pub(super) acceleration: &'a [f64],
    pub(super) scratch: &'a Scratch,
}

impl StepInstant<'_> {
    /// d^2/d(omega_c t)^2 of a deformation; the transmission error at `tau`, on the right side of its corners.
    pub(super) fn bend(&self, system: &System, connection: usize, tau: f64) -> f64 {
        let row = system.element_map_row(connection).iter();
        let mut bend: f64 = row.map(|(i, w)| w * self.acceleration[*i]).sum();
        if let Some(error) = &system.mounts()[connection].transmission_error {
            bend -= system.moment(tau).bend(error);
        }
        bend
    }
}

impl SteppedRegions {
    /// Reads the breakpoints and places every connection by its deformation alone.
    pub(super) fn start(&mut self, system: &System, deformation: &[f64]) {
        self.levels.clear();
        // Laws with memory have regions of another kind.
        let breakpoints = system
            .mounts()
            .iter()
            .map(|m| match m.element.memory_count() {
                0 => m.element.breakpoints(),
                _ => Vec::new(),
            });
        self.levels.extend(breakpoints);
        self.region.clear();
        let places = self.levels.iter().zip(deformation);
        self.region
            .extend(places.map(|(levels, x)| levels.iter().filter(|l| **l < *x).count()));
        self.windows.resize(self.levels.len(), (0.0, 0.0));
        (0..self.levels.len()).for_each(|k| self.set_window(k));
        self.slopes.clear();
        let slope = |error: &Periodic| system.subharmonic() as f64 * error.steepest();
        let errors = system.mounts().iter().map(|m| &m.transmission_error);
        self.slopes
            .extend(errors.map(|e| e.as_ref().map_or(0.0, slope)));
        self.jumps = None;
    }

    /// The motion starts: from now on passages count. `unit`: fastest time scale.
    pub(super) fn begin(&mut self, unit: f64) {
        self.switches = 0;
        self.jumps = Some(Vec::new());
        self.sticks = None;
        self.shortest_stay = SHORTEST_STAY * unit;
    }

    /// Rounding of the distance between a deformation and a level, at a phase of the response.
    fn tolerance(&self, k: usize, level: f64, state: &[f64], tau: f64) -> f64 {
        // Velocities measure the size of the motion where a level at 0 is passed.
        let scale = level.abs() + largest(state);
        16.0 * f64::EPSILON * (scale + self.slopes[k] * (1.0 + tau.abs()))
    }

    /// Windows of the laws, one per connection.
    pub(super) fn windows(&self) -> &[(f64, f64)] {
        &self.windows
    }

    fn set_window(&mut self, k: usize) {
        let (levels, region) = (&self.levels[k], self.region[k]);
        let below = region.checked_sub(1).map(|r| levels[r]);
        let above = levels.get(region).copied();
        let room = match (below, above) {
            (Some(a), Some(b)) => 0.25 * (b - a),
            _ => f64::INFINITY,
        };
        let low = below.map_or(f64::NEG_INFINITY, |l| l + room.min(nudge(l)));
        let high = above.map_or(f64::INFINITY, |l| l - room.min(nudge(l)));
        self.windows[k] = (low, high);
    }

    /// The first passage of any connection through an end of its region on a step.
    ///
    /// `tau` and `state` at its begin; `coefficients`: those of q; `error`: of the transmission errors, in powers of x.
    pub(super) fn first_passage(
        &self,
        system: &System,
        (tau, state): (f64, &[f64]),
        coefficients: &[f64],
        mut error: impl FnMut(usize, &mut [f64; COUNT]),
    ) -> Option<StepPassage> {
        let mut first: Option<StepPassage> = None;
        for (k, levels) in self.levels.iter().enumerate() {
            if levels.is_empty() {
                continue;
            }
            let mut deformation = [0.0; COUNT];
            error(k, &mut deformation);
            add_deformation(&mut deformation, system, k, coefficients);
            let region = self.region[k];
            let ends = [
                (region.checked_sub(1).map(|r| levels[r]), Direction::Down),
                (levels.get(region).copied(), Direction::Up),
            ];
            for (level, direction) in ends {
                let Some(level) = level else { continue };
                let tolerance = self.tolerance(k, level, state, tau);
                let Some(x) = first_passage(&deformation, level, direction, tolerance) else {
                    continue;
                };
                if first.is_none_or(|f| x < f.x) {
                    first = Some(StepPassage {
                        x,
                        connection: k,
                        level,
                        direction,
                        slider: None,
                    });
                }
            }
        }
        first
    }

    /// How far beyond its level a passage is, how fast it goes on, and the distance that counts as none.
    pub(super) fn beyond(&self, passage: &StepPassage, at: &StepInstant<'_>) -> (f64, f64, f64) {
        let k = passage.connection;
        let sign = passage.direction.sign();
        let distance = sign * (at.scratch.deformation[k] - passage.level);
        let tolerance = 0.5 * self.tolerance(k, passage.level, at.state, at.tau);
        (distance, sign * at.scratch.rate[k], tolerance)
    }

    /// Moves every connection into the region it is in or about to enter; `landed` passes in any case. Says whether
    /// anything moved.
    pub(super) fn settle(
        &mut self,
        system: &System,
        pieces: &Pieces,
        at: &StepInstant<'_>,
        landed: Option<StepPassage>,
        observer: &mut dyn FlowObserver,
    ) -> bool {
        let before = self.switches;
        for k in 0..self.levels.len() {
            if let Some(passage) = landed.filter(|p| p.connection == k && p.slider.is_none()) {
                self.pass((system, pieces), at, k, passage.direction, observer);
                continue;
            }
            while let Some(level) = self.levels[k].get(self.region[k]).copied() {
                if !self.is_above((system, pieces), at, k, (level, Direction::Down)) {
                    break;
                }
                self.pass((system, pieces), at, k, Direction::Up, observer);
            }
            while let Some(below) = self.region[k].checked_sub(1) {
                let level = self.levels[k][below];
                if self.is_above((system, pieces), at, k, (level, Direction::Up)) {
                    break;
                }
                self.pass((system, pieces), at, k, Direction::Down, observer);
            }
        }
        self.switches > before
    }

    /// Whether a deformation is above a level or, on the level, about to be. `side`: where it counts to now.
    fn is_above(
        &self,
        (system, pieces): (&System, &Pieces),
        at: &StepInstant<'_>,
        k: usize,
        (level, side): (f64, Direction),
    ) -> bool {
        let (x, rate) = (at.scratch.deformation[k], at.scratch.rate[k]);
        let tolerance = self.tolerance(k, level, at.state, at.tau);
        if (x - level).abs() > tolerance {
            return x > level;
        }
        let bend = at.bend(system, k, pieces.clamp(at.tau));
        // A rate that the acceleration turns round within the tolerance says nothing: later steps show the way.
        if rate * rate > 2.0 * bend.abs() * tolerance {
            return rate > 0.0;
        }
        match self.jumps {
            Some(_) => side == Direction::Up,
            None if bend == 0.0 => x > level,
            None => bend > 0.0,
        }
    }

    /// Connections on an end of their region, with that level, which their rates do not move off.
    pub(super) fn undecided(&self, at: &StepInstant<'_>) -> Vec<(usize, f64)> {
        let stands = |(k, level): &(usize, f64)| {
            let tolerance = self.tolerance(*k, *level, at.state, at.tau);
            let is_slow = at.scratch.rate[*k].abs() <= tolerance;
            is_slow && (at.scratch.deformation[*k] - level).abs() <= tolerance
        };
        let all = (0..self.levels.len()).flat_map(|k| self.ends(k).map(move |level| (k, level)));
        all.filter(stands).collect()
    }

    /// Levels at the ends of a connection's region.
    fn ends(&self, k: usize) -> impl Iterator<Item = f64> + use<'_> {
        let (levels, region) = (&self.levels[k], self.region[k]);
        let below = region.checked_sub(1).map(|r| levels[r]);
        below.into_iter().chain(levels.get(region).copied())
    }

    /// Moves those connections that have left their level at a trial state to its side.
    pub(super) fn place_leaving(&mut self, waiting: &mut Vec<(usize, f64)>, at: &StepInstant<'_>) {
        waiting.retain(|(k, level)| {
            let distance = at.scratch.deformation[*k] - level;
            if distance.abs() <= 4.0 * self.tolerance(*k, *level, at.state, at.tau) {
                return true;
            }
            let below = self.levels[*k].iter().filter(|l| *l < level).count();
            self.region[*k] = below + usize::from(distance > 0.0);
            self.set_window(*k);
            false
        });
    }

    /// Reports connections on a breakpoint that are placed in contact behind it, if they are open on it.
    pub(super) fn report_begun(
        &self,
        system: &System,
        at: &StepInstant<'_>,
        observer: &mut dyn FlowObserver,
    ) {
        for k in 0..self.levels.len() {
            let element = &system.mounts()[k].element;
            let x = at.scratch.deformation[k];
            let stands =
                |level: &f64| (x - level).abs() <= self.tolerance(k, *level, at.state, at.tau);
            let (low, high) = self.windows[k];
            for level in self.ends(k).filter(stands) {
                let inside = if level < low { low } else { high };
                let switch = Switch {
                    kind: SwitchKind::Breakpoint,
                    tau: at.tau,
                    connection: k,
                    level,
                    from: element.flank(level),
                    to: element.flank(inside),
                    velocity: at.scratch.rate[k],
                };
                if switch.makes_contact() {
                    observer.switch(&switch);
                }
            }
        }
    }

    fn pass(
        &mut self,
        (system, pieces): (&System, &Pieces),
        at: &StepInstant<'_>,
        k: usize,
        direction: Direction,
        observer: &mut dyn FlowObserver,
    ) {
        let element = &system.mounts()[k].element;
        let level = match direction {
            Direction::Up => self.levels[k][self.region[k]],
            Direction::Down => self.levels[k][self.region[k] - 1],
        };
        let leaving = self.windows[k];
        match direction {
            Direction::Up => self.region[k] += 1,
            Direction::Down => self.region[k] -= 1,
        }
        self.set_window(k);
        let entering = self.windows[k];
        let (from, to) = match direction {
            Direction::Up => (leaving.1, entering.0),
            Direction::Down => (leaving.0, entering.1),
        };
        self.switches += 1;
        let (mount, rate) = (&system.mounts()[k], at.scratch.rate[k]);
        if let (true, Some(list)) = (element.is_discontinuous(), &mut self.jumps) {
            let phase = system.moment(pieces.clamp(at.tau)).phase;
            let size = jumps::size(mount, level, rate, phase);
            let here = direction.sign() * at.bend(system, k, pieces.clamp(at.tau));
            // Towards the level from both sides.
            let back = system.mobility(k, k) * size - here;
            let stays = 2.0 * rate.abs() <= self.shortest_stay * here.min(back);
            if here > 0.0 && back > 0.0 && stays {
                self.sticks = Some(k);
            }
            list.push(Jump {
                connection: k,
                size,
                rate,
            });
        }
        observer.switch(&Switch {
            kind: SwitchKind::Breakpoint,
            tau: at.tau,
            connection: k,
            level,
            from: element.flank(from),
            to: element.flank(to),
            velocity: rate,
        });
    }
}

fn largest(values: &[f64]) -> f64 {
    values.iter().fold(0.0, |m, x| m.max(x.abs()))
}

/// A distance from a level that a law's own rounding does not bridge.
fn nudge(level: f64) -> f64 {
    8.0 * f64::EPSILON * level.abs().max(1e-3)
}
