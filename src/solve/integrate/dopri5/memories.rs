//! Laws with memory: sliders by their automata, and memories that have a rate.
//!
//! Within a step every slider keeps its region, so that a trial step is smooth wherever it looks; a step ends where a slider
//! starts to slip or sticks. While it slips its memory follows the deformation. Kinks of laws whose memory has a rate are integrated
//! under error control.

use super::regions::{COUNT, StepInstant, StepPassage};
use crate::element::Response;
use crate::element::automaton::{Automaton, Guard, MemoryRate, RegionForce, Surface};
use crate::element::evolving::Evolution;
use crate::numeric::bernstein::first_passage;
use crate::solve::integrate::{FlowObserver, Switch, SwitchKind};
use crate::system::{Scratch, System};

/// Rounding of a distance in units of what it is made of.
const ROUNDING: f64 = 16.0 * f64::EPSILON;

/// Sliders and memories of a system.
#[derive(Debug, Clone, Default)]
pub(super) struct Memories {
    sliders: Vec<SteppedSlider>,
    /// Connections whose memory has a rate, with the place of the memory, and the latest evaluation.
    evolving: Vec<(usize, usize, Evolution)>,
    /// Regions entered since the start of the call.
    pub(super) switches: usize,
}

/// One automaton of a law.
#[derive(Debug, Clone)]
struct SteppedSlider {
    connection: usize,
    memory: Option<usize>,
    automaton: Automaton,
    region: usize,
}

/// What a memory does to the rates: its place, how it changes, and the change of the force with it.
#[derive(Debug, Clone, Copy)]
pub(super) struct Influence {
    pub(super) connection: usize,
    pub(super) memory: usize,
    /// df/dz of the connection, without the stiffness variation.
    pub(super) force_by: f64,
    /// Partials of the rate of the memory by deformation, rate and memory.
    pub(super) rate_by: [f64; 3],
}

impl Memories {
    /// The laws with memory of a system.
    pub(super) fn new(system: &System) -> Memories {
        let mut all = Memories::default();
        for (connection, mount) in system.mounts().iter().enumerate() {
            let law = mount.element.as_ref();
            let mut places = system.memory_of(connection);
            if law.evolving().is_some() {
                let place = (connection, places.start, Evolution::default());
                all.evolving.push(place);
                continue;
            }
            for automaton in law.automata().unwrap_or_default() {
                all.sliders.push(SteppedSlider {
                    connection,
                    memory: automaton.has_memory.then(|| places.next()).flatten(),
                    automaton,
                    region: 0,
                });
            }
        }
        all
    }

    pub(super) fn is_empty(&self) -> bool {
        self.sliders.is_empty() && self.evolving.is_empty()
    }

    /// Moves memories to what their deformations allow, and every slider into a region that keeps its memory.
    pub(super) fn start(&mut self, system: &System, deformation: &[f64], memory: &mut [f64]) {
        self.switches = 0;
        for (k, mount) in system.mounts().iter().enumerate() {
            let places = system.memory_of(k);
            mount.element.project(deformation[k], &mut memory[places]);
        }
        for slider in &mut self.sliders {
            slider.region = slider
                .automaton
                .home(deformation[slider.connection], |_| 0.0);
        }
    }

    /// Forces of the laws with memory in their regions, stiffness variation included, into the responses; `rate`: the rates of the
    /// memories.
    pub(super) fn respond(
        &mut self,
        system: &System,
        phase: f64,
        memory: &[f64],
        (scratch, rate): (&mut Scratch, &mut [f64]),
    ) {
        for slider in &self.sliders {
            scratch.response[slider.connection] = Response::default();
        }
        for slider in &self.sliders {
            let e = slider.connection;
            let (x, v) = (scratch.deformation[e], scratch.rate[e]);
            let z = slider.memory.map_or(0.0, |m| memory[m]);
            let own = system.mounts()[e].vary(slider.response([x, v], z), phase);
            let sum = &mut scratch.response[e];
            sum.f += own.f;
            sum.df_dq += own.df_dq;
            sum.df_dv += own.df_dv;
            if let Some(m) = slider.memory {
                rate[m] = if slider.follows().is_some() { v } else { 0.0 };
            }
        }
        for (e, m, latest) in &mut self.evolving {
            let mount = &system.mounts()[*e];
            let Some(law) = mount.element.evolving() else {
                continue;
            };
            *latest = law.evolve([scratch.deformation[*e], scratch.rate[*e], phase, memory[*m]]);
            scratch.response[*e] = mount.vary(latest.response(), phase);
            rate[*m] = latest.rate;
        }
    }

    /// What every memory does at the latest evaluation.
    pub(super) fn influences(&self) -> impl Iterator<Item = Influence> {
        let sliders = self.sliders.iter().filter_map(|s| {
            Some(Influence {
                connection: s.connection,
                memory: s.memory?,
                force_by: s.gain(),
                rate_by: [0.0, if s.follows().is_some() { 1.0 } else { 0.0 }, 0.0],
            })
        });
        let evolving = self
            .evolving
            .iter()
            .map(|(connection, memory, at)| Influence {
                connection: *connection,
                memory: *memory,
                force_by: at.force_by[2],
                rate_by: at.rate_by,
            });
        sliders.chain(evolving)
    }

    /// Memories that follow their deformation: connection, memory, and the offset from it.
    pub(super) fn following(&self) -> impl Iterator<Item = (usize, usize, f64)> {
        let sliders = self.sliders.iter();
        sliders.filter_map(|s| Some((s.connection, s.memory?, s.follows()?)))
    }

    /// The first guard that a slider passes on a step; `deformation`: its polynomial for a connection, in powers of the step h.
    pub(super) fn first_passage(
        &self,
        (state, dof, h): (&[f64], usize, f64),
        mut deformation: impl FnMut(usize) -> [f64; COUNT],
    ) -> Option<StepPassage> {
        let mut first: Option<StepPassage> = None;
        let size = state.iter().fold(0.0_f64, |m, x| m.max(x.abs()));
        for (number, slider) in self.sliders.iter().enumerate() {
            let x = deformation(slider.connection);
            let z = slider.memory.map_or(0.0, |m| state[2 * dof + m]);
            for guard in slider.guards() {
                let (polynomial, level) = match guard.surface {
                    Surface::Deformation { level, gain } => (x, level + gain * z),
                    Surface::Rate => (derivative(&x, h), 0.0),
                    Surface::HoldingForce(_) => continue,
                };
                let tolerance = ROUNDING * (level.abs() + size);
                let found = first_passage(&polynomial, level, guard.direction, tolerance);
                let is_first = |x: &f64| first.is_none_or(|f| *x < f.x);
                if let Some(x) = found.filter(is_first) {
                    first = Some(StepPassage {
                        x,
                        connection: slider.connection,
                        level,
                        direction: guard.direction,
                        slider: Some((number, guard.surface == Surface::Rate)),
                    });
                }
            }
        }
        first
    }

    /// How far beyond its guard a passage is, how fast it goes on, and the distance that counts as none.
    pub(super) fn beyond(
        &self,
        system: &System,
        passage: &StepPassage,
        at: &StepInstant<'_>,
    ) -> (f64, f64, f64) {
        let (e, sign) = (passage.connection, passage.direction.sign());
        let size = at.state.iter().fold(0.0_f64, |m, x| m.max(x.abs()));
        let tolerance = 0.5 * ROUNDING * (passage.level.abs() + size);
        match passage.slider {
            Some((_, true)) => {
                let bend = at.bend(system, e, at.tau);
                (sign * at.scratch.rate[e], sign * bend, tolerance)
            }
            _ => {
                let distance = at.scratch.deformation[e] - passage.level;
                (sign * distance, sign * at.scratch.rate[e], tolerance)
            }
        }
    }

    /// Moves sliders that are on a guard and about to pass it, and the one that has landed on one; whether any has moved.
    pub(super) fn settle(
        &mut self,
        system: &System,
        at: &StepInstant<'_>,
        landed: Option<StepPassage>,
        observer: &mut dyn FlowObserver,
    ) -> bool {
        let size = at.state.iter().fold(0.0_f64, |m, x| m.max(x.abs()));
        let dof = system.dof();
        let mut moved = false;
        for number in 0..self.sliders.len() {
            let slider = &self.sliders[number];
            let e = slider.connection;
            let (x, v) = (at.scratch.deformation[e], at.scratch.rate[e]);
            let z = slider.memory.map_or(0.0, |m| at.state[2 * dof + m]);
            let bend = at.bend(system, e, at.tau);
            let passes = |guard: &&Guard| {
                let is_rate = guard.surface == Surface::Rate;
                let has_landed = landed.is_some_and(|p| {
                    p.slider == Some((number, is_rate)) && p.direction == guard.direction
                });
                let (distance, rate) = match guard.surface {
                    Surface::Deformation { level, gain } => (x - level - gain * z, v),
                    Surface::Rate => (v, bend),
                    Surface::HoldingForce(_) => return false,
                };
                let sign = guard.direction.sign();
                let tolerance = ROUNDING * (x.abs() + z.abs() + size);
                // On a level without a rate the acceleration shows the way.
                let goes = match !is_rate && rate.abs() <= ROUNDING * size {
                    true => bend,
                    false => rate,
                };
                has_landed
                    || sign * distance > tolerance
                    || distance.abs() <= tolerance && sign * goes > 0.0
            };
            let Some(guard) = slider.guards().iter().find(passes).copied() else {
                continue;
            };
            let slider = &mut self.sliders[number];
            let (from, to) = (slider.contact(), guard.to);
            slider.region = to;
            moved = true;
            self.switches += 1;
            observer.switch(&Switch {
                tau: at.tau,
                connection: e,
                level: x,
                from,
                to: slider.contact(),
                velocity: v,
                kind: match slider.memory {
                    Some(_) => SwitchKind::Memory,
                    None => SwitchKind::Breakpoint,
                },
            });
        }
        moved
    }

    /// Cubic polynomials of the memories on a step from their values and rates at both ends.
    pub(super) fn interpolate(
        coefficients: &mut [f64],
        (value, increment): (&[f64], &[f64]),
        (first, last): (&[f64], &[f64]),
        h: f64,
    ) {
        for (m, c) in coefficients.chunks_exact_mut(COUNT).enumerate() {
            let (rise, v0, v1) = (increment[m], h * first[m], h * last[m]);
            c.fill(0.0);
            (c[0], c[1]) = (value[m], v0);
            c[2] = 3.0 * rise - 2.0 * v0 - v1;
            c[3] = v0 + v1 - 2.0 * rise;
        }
    }
}

impl SteppedSlider {
    fn guards(&self) -> &[Guard] {
        &self.automaton.regions[self.region].guards
    }

    fn contact(&self) -> i8 {
        self.automaton.regions[self.region].contact
    }

    /// Offset of the memory from the deformation, where it follows.
    fn follows(&self) -> Option<f64> {
        match self.automaton.regions[self.region].memory {
            MemoryRate::Follows { offset } => Some(offset),
            MemoryRate::Kept => None,
        }
    }

    /// df/dz.
    fn gain(&self) -> f64 {
        match self.automaton.regions[self.region].force {
            RegionForce::Affine { z, .. } => z,
            RegionForce::Held { .. } => 0.0,
        }
    }

    fn response(&self, [x, v]: [f64; 2], memory: f64) -> Response {
        match self.automaton.regions[self.region].force {
            RegionForce::Affine {
                constant,
                q,
                v: damping,
                z,
            } => Response {
                f: constant + q * x + damping * v + z * memory,
                df_dq: q,
                df_dv: damping,
            },
            RegionForce::Held { .. } => Response::default(),
        }
    }
}

/// Rate of a polynomial on a step h.
fn derivative(x: &[f64; COUNT], h: f64) -> [f64; COUNT] {
    std::array::from_fn(|k| match x.get(k + 1) {
        Some(c) => (k + 1) as f64 * c / h,
        None => 0.0,
    })
}
