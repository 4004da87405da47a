//! Laws with memory on a trigonometric polynomial: their automata followed around the period, from extremum to extremum.
//!
//! Between two extrema the deformation x is monotonic, so that every level is passed once at most and the rate has one sign: in each
//! of these intervals the regions follow one after the other. After one turn a memory that moves at all is periodic; one that does not
//! is a given number. On every stretch the force is g x + h; where its offset holds a memory that was set at an extremum of x, it
//! changes with the value of x there.

use super::evolve::{MemoryCourse, PhasePoint};
use crate::element::Response;
use crate::element::automaton::{Automaton, Direction, Guard, MemoryRate, RegionForce, Surface};
use crate::element::evolving::Evolving;
use crate::numeric::roots::newton_bracketed;
use crate::numeric::trigonometric;
use crate::solve::orbit::FourierOrbit;
use crate::system::System;
use std::f64::consts::TAU;

/// Cells per harmonic in which extrema are sought.
const CELLS_PER_HARMONIC: usize = 16;

/// Part of a period in one region.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(crate) struct MarchStretch {
    /// Its begin; not reduced to one period.
    pub begin: f64,
    /// Its end.
    pub end: f64,
    /// df/dx.
    pub slope: f64,
    /// Force at x = 0.
    pub offset: f64,
    /// df/dz.
    pub gain: f64,
    /// Instant at which the memory was set; `None` if it is given.
    pub set_at: Option<f64>,
    /// Whether the memory follows the deformation.
    pub follows: bool,
    /// The memory, or how far it is ahead of the deformation that it follows.
    pub memory: f64,
}

/// State at one instant of the march.
#[derive(Debug, Clone, Copy, PartialEq)]
struct MarchState {
    region: usize,
    z: f64,
    set_at: Option<f64>,
}

/// Follows automata; owns its buffers.
#[derive(Debug, Default)]
pub(crate) struct March {
    derivative: Vec<f64>,
    slopes: Vec<f64>,
    /// Extrema in the order of time, the first one repeated a period later.
    extrema: Vec<(f64, f64)>,
    stretches: Vec<MarchStretch>,
}

impl March {
    /// Finds the extrema of a polynomial with coefficients mean, sin 1, cos 1, ..
    pub(crate) fn prepare(&mut self, x: &[f64]) {
        let cells = (CELLS_PER_HARMONIC * (x.len() / 2))
            .next_power_of_two()
            .max(64);
        self.derivative.resize(x.len(), 0.0);
        self.slopes.resize(cells, 0.0);
        trigonometric::differentiate(x, &mut self.derivative);
        trigonometric::sample_derivative(x, &mut self.slopes);
        self.extrema.clear();
        let tau = |j: usize| j as f64 * TAU / cells as f64;
        for j in 0..cells {
            let (here, next) = (self.slopes[j], self.slopes[(j + 1) % cells]);
            if (here > 0.0) == (next > 0.0) {
                continue;
            }
            let slope = |t: f64| {
                let [_, first, second] = trigonometric::evaluate(x, t);
                (first, second)
            };
            let t = newton_bracketed(slope, (tau(j), here), tau(j + 1));
            self.extrema.push((t, trigonometric::evaluate(x, t)[0]));
        }
        if let Some((t, value)) = self.extrema.first().copied() {
            self.extrema.push((t + TAU, value));
        }
    }

    /// The stretches of a period, for the polynomial last prepared; `given`: the memory before.
    pub(crate) fn follow(
        &mut self,
        automaton: &Automaton,
        x: &[f64],
        given: f64,
    ) -> &[MarchStretch] {
        self.stretches.clear();
        let (begin, first) = self.extrema.first().copied().unwrap_or((0.0, x[0]));
        let mut state = start(automaton, (begin, first), given);
        if self.extrema.is_empty() {
            self.record(automaton, &state, (0.0, TAU));
            return &self.stretches;
        }
        // The first turn forgets, or shakes down; a second one that ends as it began is periodic.
        for _ in 0..MOST_TURNS {
            let before = state;
            self.stretches.clear();
            state = self.turn(automaton, x, state);
            if is_same(&before, &state) {
                break;
            }
        }
        &self.stretches
    }

    /// Once around the period.
    fn turn(&mut self, automaton: &Automaton, x: &[f64], mut state: MarchState) -> MarchState {
        for i in 0..self.extrema.len() - 1 {
            let (from, to) = (self.extrema[i], self.extrema[i + 1]);
            let direction = if to.1 > from.1 {
                Direction::Up
            } else {
                Direction::Down
            };
            let turns = |g: &&Guard| g.surface == Surface::Rate && g.direction == direction;
            if let Some(guard) = automaton.regions[state.region].guards.iter().find(turns) {
                state = settled(automaton, &state, from.1, Some(from.0));
                state.region = guard.to;
            }
            state = self.stride(automaton, x, (from, to), state);
        }
        state
    }

    /// From one extremum to the next.
    fn stride(
        &mut self,
        automaton: &Automaton,
        x: &[f64],
        (from, to): ((f64, f64), (f64, f64)),
        mut state: MarchState,
    ) -> MarchState {
        let sign = if to.1 > from.1 { 1.0 } else { -1.0 };
        let (mut begin, mut here) = from;
        for _ in 0..=2 * automaton.regions.len() {
            let Some((level, guard)) = next_level(automaton, &state, sign) else {
                break;
            };
            if sign * (to.1 - level) <= 0.0 {
                break;
            }
            let end = match sign * (level - here) > 0.0 {
                false => begin,
                true => {
                    let gap = |t: f64| {
                        let [value, slope, _] = trigonometric::evaluate(x, t);
                        (value - level, slope)
                    };
                    newton_bracketed(gap, (begin, here - level), to.0)
                }
            };
            self.record(automaton, &state, (begin, end));
            state = settled(automaton, &state, level, None);
            state.region = guard.to;
            (begin, here) = (end, if end > begin { level } else { here });
        }
        self.record(automaton, &state, (begin, to.0));
        state
    }

    fn record(&mut self, automaton: &Automaton, state: &MarchState, (begin, end): (f64, f64)) {
        if end <= begin {
            return;
        }
        let region = &automaton.regions[state.region];
        let RegionForce::Affine { constant, q, z, .. } = region.force else {
            return;
        };
        self.stretches.push(MarchStretch {
            begin,
            end,
            slope: q,
            offset: constant + z * state.z,
            gain: z,
            set_at: state.set_at,
            follows: region.memory != MemoryRate::Kept,
            memory: match region.memory {
                MemoryRate::Kept => state.z,
                MemoryRate::Follows { offset } => offset,
            },
        });
    }
}

/// Turns at most.
const MOST_TURNS: usize = 6;
/// Difference of memories that counts as none.
const SAME: f64 = 1e-13;

fn is_same(a: &MarchState, b: &MarchState) -> bool {
    let follows = |s: &MarchState| (s.region, s.z, s.set_at.map(|t| t.rem_euclid(TAU)));
    let ((r, y, s), (q, z, t)) = (follows(a), follows(b));
    let near = match (s, t) {
        (Some(s), Some(t)) => (s - t).abs() < 1e-9,
        (s, t) => s.is_none() && t.is_none(),
    };
    r == q && near && (y - z).abs() <= SAME * (1.0 + y.abs())
}

/// The region that holds a deformation with a memory, moved where it does not fit.
fn start(automaton: &Automaton, (tau, x): (f64, f64), given: f64) -> MarchState {
    let region = automaton.home(x, |_| 0.0);
    let mut state = MarchState {
        region,
        z: given,
        set_at: None,
    };
    for guard in &automaton.regions[region].guards {
        let Surface::Deformation { level, gain } = guard.surface else {
            continue;
        };
        let beyond = x - level - gain * state.z;
        if gain != 0.0 && guard.direction.sign() * beyond > 0.0 {
            state.z = (x - level) / gain;
            state.set_at = Some(tau);
        }
    }
    state
}

/// The memory taken over at a deformation, at an extremum of it or on a level.
fn settled(automaton: &Automaton, state: &MarchState, x: f64, extremum: Option<f64>) -> MarchState {
    match automaton.regions[state.region].memory {
        MemoryRate::Kept => *state,
        MemoryRate::Follows { offset } => MarchState {
            z: x + offset,
            set_at: extremum,
            ..*state
        },
    }
}

/// The first level that a region is left through in a direction.
fn next_level<'a>(
    automaton: &'a Automaton,
    state: &MarchState,
    sign: f64,
) -> Option<(f64, &'a Guard)> {
    let guards = automaton.regions[state.region].guards.iter();
    let levels = guards.filter_map(|g| match g.surface {
        Surface::Deformation { level, gain } if g.direction.sign() == sign => {
            Some((level + gain * state.z, g))
        }
        _ => None,
    });
    levels.min_by(|a, b| (sign * a.0).total_cmp(&(sign * b.0)))
}

/// The stretches of one automaton along an orbit.
#[derive(Debug, Clone)]
pub(crate) struct MarchTrack {
    /// Connection.
    pub connection: usize,
    /// Place of its memory among those of the system.
    pub memory: Option<usize>,
    /// In the order of time; none where the memory has a rate.
    pub stretches: Vec<MarchStretch>,
    /// The memory where it has a rate.
    pub course: Option<MemoryCourse>,
}

impl MarchTrack {
    /// The stretch at an instant.
    pub(crate) fn at(&self, tau: f64) -> Option<&MarchStretch> {
        let first = self.stretches.first()?.begin;
        let tau = first + (tau - first).rem_euclid(TAU);
        let after = self.stretches.partition_point(|s| s.end <= tau);
        self.stretches.get(after).or(self.stretches.last())
    }

    /// The memory at an instant and a deformation.
    pub(crate) fn memory_at(&self, tau: f64, x: f64) -> f64 {
        if let Some(course) = &self.course {
            return course.at(tau);
        }
        let of = |s: &MarchStretch| match s.follows {
            true => x + s.memory,
            false => s.memory,
        };
        self.at(tau).map_or(0.0, of)
    }

    /// Force with its partials at an instant, without the stiffness variation; `motion`: deformation, rate and phase there.
    pub(crate) fn response(&self, system: &System, tau: f64, motion: PhasePoint) -> Response {
        let [x, v, phase] = motion;
        let law = &system.mounts()[self.connection].element;
        if let (Some(course), Some(law)) = (&self.course, law.evolving()) {
            return law.evolve([x, v, phase, course.at(tau)]).response();
        }
        let line = |s: &MarchStretch| Response {
            f: s.slope * x + s.offset,
            df_dq: s.slope,
            df_dv: 0.0,
        };
        self.at(tau).map_or_else(Response::default, line)
    }
}

/// The sum of several tracks of one connection.
pub(crate) fn response(
    tracks: &[MarchTrack],
    system: &System,
    tau: f64,
    motion: PhasePoint,
) -> Response {
    let parts = tracks.iter().map(|t| t.response(system, tau, motion));
    parts.fold(Response::default(), |sum, part| Response {
        f: sum.f + part.f,
        df_dq: sum.df_dq + part.df_dq,
        df_dv: sum.df_dv + part.df_dv,
    })
}

/// All automata of a connection on the series of its deformation, or the course of its memory.
pub(crate) fn tracks(
    system: &System,
    connection: usize,
    x: &[f64],
    given: &[f64],
) -> Vec<MarchTrack> {
    let element = &system.mounts()[connection].element;
    if let Some(law) = element.evolving() {
        let memory = system.memory_of(connection).next();
        return vec![MarchTrack {
            connection,
            memory,
            stretches: Vec::new(),
            course: Some(course(system, law, x, memory.map_or(0.0, |m| given[m]))),
        }];
    }
    let automata = element.automata();
    let mut march = March::default();
    march.prepare(x);
    let mut places = system.memory_of(connection);
    let track = |automaton: &Automaton| {
        let memory = automaton.has_memory.then(|| places.next()).flatten();
        let z = memory.map_or(0.0, |m| given[m]);
        MarchTrack {
            connection,
            memory,
            stretches: march.follow(automaton, x, z).to_vec(),
            course: None,
        }
    };
    automata.unwrap_or_default().iter().map(track).collect()
}

/// Samples per harmonic along which a memory with a rate is known, and the fewest.
const KNOTS_PER_HARMONIC: usize = 64;
const FEWEST_KNOTS: usize = 1024;

fn course(system: &System, law: &dyn Evolving, x: &[f64], given: f64) -> MemoryCourse {
    let (omega, nu) = (system.omega(), system.subharmonic() as f64);
    let motion = |tau: f64| {
        let [x, slope, _] = trigonometric::evaluate(x, tau);
        [x, omega * slope, nu * tau]
    };
    let knots = (KNOTS_PER_HARMONIC * (x.len() / 2)).max(FEWEST_KNOTS);
    MemoryCourse::new(law, (knots, omega), given, &motion)
}

/// All automata and courses of laws with memory along an orbit.
pub(crate) fn all_tracks(system: &System, orbit: &FourierOrbit) -> Vec<MarchTrack> {
    let given = at_rest(system);
    let remembers = |e: &usize| system.mounts()[*e].element.memory_count() > 0;
    let connections = (0..system.element_count()).filter(remembers);
    connections
        .flat_map(|e| {
            let x = orbit.deformation(system, e).series();
            tracks(system, e, &x, &given)
        })
        .collect()
}

/// The same connection by connection; nothing without any memory.
pub(crate) fn tracks_of_each(system: &System, orbit: &FourierOrbit) -> Vec<Vec<MarchTrack>> {
    if system.memory_count() == 0 {
        return Vec::new();
    }
    let mut list = vec![Vec::new(); system.element_count()];
    for track in all_tracks(system, orbit) {
        list[track.connection].push(track);
    }
    list
}

/// Memories of all laws in the static equilibrium; zeros if there is none.
pub(crate) fn at_rest(system: &System) -> Vec<f64> {
    match crate::solve::equilibrium::equilibrium(system) {
        Ok(rest) => system.memory_at_rest(rest.q.as_slice()),
        Err(_) => vec![0.0; system.memory_count()],
    }
}
