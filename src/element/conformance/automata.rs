//! Laws with memory, impacts or jumps that hold: their automata against what they say of themselves.

use crate::element::automaton::{
    Automaton, Direction, Guard, MemoryRate, Region, RegionForce, Reset, Surface,
};
use crate::element::{Element, Units, nondimensional};
use std::f64::consts::TAU;

/// Steps of the march, and its turns: the first four grow, the last two are alike.
const STEPS: usize = 6000;
const TURNS: f64 = 6.0;
const GROWING: f64 = 4.0;
/// Largest deformation of the march.
const AMPLITUDE: f64 = 3.0;
/// Difference allowed between a law and its automata, relative to the sizes that occur.
const TOLERANCE: f64 = 1e-9;
/// Difference step of the partial derivatives.
const STEP: f64 = 1e-6;
const DERIVATIVE_TOLERANCE: f64 = 1e-5;
/// Distance from a border of a region within which partials are not compared.
const NEAR: f64 = 1e-3;
/// Energy that a closed loop may give: the error of the sum along it.
const LOOP: f64 = 1e-2;

/// Everything at fault with the automata of a law.
pub(super) fn check(element: &dyn Element, found: &mut Vec<String>) {
    let Some(list) = element.automata() else {
        return;
    };
    let memories = list.iter().filter(|a| a.has_memory).count();
    if memories != element.memory_count() {
        found.push(format!(
            "{memories} automata have a memory, memory_count says {}",
            element.memory_count()
        ));
        return;
    }
    let before = found.len();
    list.iter().for_each(|automaton| shape(automaton, found));
    projection(element, found);
    if found.len() > before {
        return;
    }
    if element.least_impact().is_none() {
        march(element, &list, found);
    }
    for (displacement, frequency) in [(0.37, 1.0), (4.1e-3, 0.2)] {
        let units = Units {
            displacement,
            frequency,
            force: displacement,
        };
        covariance(element, &list, &units, found);
    }
}

/// Whether guards lead somewhere, and a motion can begin in a region.
fn shape(automaton: &Automaton, found: &mut Vec<String>) {
    let count = automaton.regions.len();
    let is_home =
        |r: &Region| r.memory == MemoryRate::Kept && matches!(r.force, RegionForce::Affine { .. });
    if !automaton.regions.iter().any(is_home) {
        found.push("no region keeps its memory: motions cannot begin".into());
    }
    for (k, region) in automaton.regions.iter().enumerate() {
        if !automaton.has_memory && region.memory != MemoryRate::Kept {
            found.push(format!(
                "the memory of region {k} follows, but the automaton has none"
            ));
        }
        for guard in &region.guards {
            let held = match guard.reset {
                Reset::None => guard.to,
                Reset::Restitution { held, .. } | Reset::Jump { held } => held,
            };
            if guard.to.max(held) >= count {
                found.push(format!(
                    "a guard of region {k} leads to a region that is not there"
                ));
                return;
            }
            if let Reset::Restitution { coefficient, held } = guard.reset {
                let is_held = matches!(automaton.regions[held].force, RegionForce::Held { .. });
                if !(0.0..=1.0).contains(&coefficient) || !is_held || guard.to != k {
                    found.push(format!(
                        "region {k}: an impact has a restitution from 0 to 1, a region in which it is held, and leads back"
                    ));
                }
            }
        }
    }
}

/// Whether a memory that has been moved to what a deformation allows stays there.
fn projection(element: &dyn Element, found: &mut Vec<String>) {
    for q in [-2.3, -0.4, 0.0, 0.7, 3.1] {
        let mut memory = vec![50.0; element.memory_count()];
        element.project(q, &mut memory);
        let once = memory.clone();
        element.project(q, &mut memory);
        if memory != once {
            found.push(format!("project moves a memory twice at q = {q}"));
        }
    }
}

/// An automaton along the march.
struct AutomatonMarch<'a> {
    automaton: &'a Automaton,
    region: usize,
    z: f64,
}

impl AutomatonMarch<'_> {
    fn here(&self) -> &Region {
        &self.automaton.regions[self.region]
    }

    /// Force and its partials by deformation and rate.
    fn force(&self, q: f64, v: f64) -> [f64; 3] {
        match self.here().force {
            RegionForce::Affine {
                constant,
                q: slope,
                v: damping,
                z,
            } => {
                let force = constant + slope * q + damping * v + z * self.z;
                [force, slope, damping]
            }
            RegionForce::Held { .. } => [f64::NAN; 3],
        }
    }

    /// How far a state is beyond a guard.
    fn beyond(&self, guard: &Guard, q: f64, v: f64) -> f64 {
        let distance = match guard.surface {
            Surface::Deformation { level, gain } => q - level - gain * self.z,
            Surface::Rate => v,
            Surface::HoldingForce(_) => return f64::NEG_INFINITY,
        };
        match guard.direction {
            Direction::Up => distance,
            Direction::Down => -distance,
        }
    }

    /// Follows the guards that a state has passed; the memory follows the deformation between them.
    fn follow(&mut self, q: f64, v: f64) {
        for _ in 0..=self.automaton.regions.len() {
            let guards = self.here().guards.iter();
            let passed = guards.filter(|g| self.beyond(g, q, v) > 0.0);
            let farthest =
                passed.max_by(|a, b| self.beyond(a, q, v).total_cmp(&self.beyond(b, q, v)));
            let Some(guard) = farthest.copied() else {
                break;
            };
            if let MemoryRate::Follows { offset } = self.here().memory {
                let here = match guard.surface {
                    Surface::Deformation { level, gain } => level + gain * self.z,
                    _ => q,
                };
                self.z = here + offset;
            }
            self.region = guard.to;
        }
        if let MemoryRate::Follows { offset } = self.here().memory {
            self.z = q + offset;
        }
    }

    fn is_near_border(&self, q: f64, v: f64) -> bool {
        let guards = self.here().guards.iter();
        guards.clone().any(|g| self.beyond(g, q, v).abs() < NEAR)
    }
}

/// A deformation that swings ever wider and then evenly: the law and its automata say the same all the way.
fn march(element: &dyn Element, list: &[Automaton], found: &mut Vec<String>) {
    let start = |automaton| AutomatonMarch {
        automaton,
        region: 0,
        z: 0.0,
    };
    let mut parts: Vec<AutomatonMarch<'_>> = list.iter().map(start).collect();
    let (mut work, mut last) = (0.0, (0.0, 0.0));
    for k in 0..=STEPS {
        let (q, v) = swing(k);
        parts.iter_mut().for_each(|part| part.follow(q, v));
        let own = parts.iter().filter(|p| p.automaton.has_memory);
        let mut memory: Vec<f64> = own.map(|p| p.z).collect();
        // A step may end a little beyond a limit.
        element.project(q, &mut memory);
        let law = element.respond(q, v, 0.7, &memory);
        if let Some(what) = disagreement(element, &parts, (q, v), &memory) {
            found.push(what);
            return;
        }
        if k > STEPS - STEPS / TURNS as usize {
            work += 0.5 * (law.f + last.1) * (q - last.0);
        }
        last = (q, law.f);
    }
    if element.is_passive() && work < -LOOP {
        found.push(format!("a closed loop gives the energy {}", -work));
    }
}

/// Deformation and rate of the march.
fn swing(k: usize) -> (f64, f64) {
    let t = TURNS * TAU * k as f64 / STEPS as f64;
    let end = GROWING * TAU;
    let (size, growth) = match t < end {
        true => (AMPLITUDE * t / end, AMPLITUDE / end),
        false => (AMPLITUDE, 0.0),
    };
    (size * t.sin(), size * t.cos() + growth * t.sin())
}

/// Where a law and its automata differ at a state.
fn disagreement(
    element: &dyn Element,
    parts: &[AutomatonMarch<'_>],
    (q, v): (f64, f64),
    memory: &[f64],
) -> Option<String> {
    let law = element.respond(q, v, 0.7, memory);
    let sum = parts.iter().fold([0.0; 3], |sum, p| {
        let own = p.force(q, v);
        std::array::from_fn(|i| sum[i] + own[i])
    });
    let size = 1.0 + law.f.abs() + q.abs();
    let is_near = parts.iter().any(|p| p.is_near_border(q, v));
    if is_near {
        return None;
    }
    if (law.f - sum[0]).abs() > TOLERANCE * size {
        return Some(format!(
            "at q = {q}, v = {v} the regions give {}, respond {}",
            sum[0], law.f
        ));
    }
    let at = |q: f64, v: f64| element.respond(q, v, 0.7, memory).f;
    let by_v = (at(q, v + STEP) - at(q, v - STEP)) / (2.0 * STEP);
    let by_q = (at(q + STEP, v) - at(q - STEP, v)) / (2.0 * STEP);
    // At a fixed memory there is a kink where it would follow.
    let kept = parts.iter().all(|p| p.here().memory == MemoryRate::Kept);
    let gaps = [
        ("df/dq", law.df_dq, sum[1]),
        ("df/dv", law.df_dv, sum[2]),
        ("df/dv", law.df_dv, by_v),
        ("df/dq", law.df_dq, if kept { by_q } else { law.df_dq }),
    ];
    let far = |(_, a, b): &(&str, f64, f64)| (a - b).abs() > DERIVATIVE_TOLERANCE * size;
    let (name, a, b) = gaps.into_iter().find(far)?;
    Some(format!("{name} at q = {q}, v = {v}: {a} is not {b}"))
}

/// Whether scaling changes levels and forces as the dimensions say.
fn covariance(element: &dyn Element, list: &[Automaton], units: &Units, found: &mut Vec<String>) {
    let scaled = nondimensional(element, units)
        .automata()
        .unwrap_or_default();
    let own = list.iter().map(|a| numbers(a, units));
    let one = Units {
        displacement: 1.0,
        frequency: 1.0,
        force: 1.0,
    };
    let other = scaled.iter().map(|a| numbers(a, &one));
    let near = |(a, b): (&f64, &f64)| (a - b).abs() <= TOLERANCE * (1.0 + a.abs());
    let alike = |(a, b): (Vec<f64>, Vec<f64>)| a.len() == b.len() && a.iter().zip(&b).all(near);
    if list.len() != scaled.len() || !own.zip(other).all(alike) {
        found.push(format!(
            "scaling by {units:?} changes the automata otherwise: a parameter's dimension is wrong"
        ));
    }
}

/// All numbers of an automaton, in units.
fn numbers(automaton: &Automaton, units: &Units) -> Vec<f64> {
    let (l, w) = (units.displacement, units.frequency);
    let mut out = Vec::new();
    for region in &automaton.regions {
        match region.force {
            RegionForce::Affine { constant, q, v, z } => out.extend([constant / l, q, v * w, z]),
            RegionForce::Held { level } => out.push(level / l),
        }
        if let MemoryRate::Follows { offset } = region.memory {
            out.push(offset / l);
        }
        for guard in &region.guards {
            match guard.surface {
                Surface::Deformation { level, gain } => out.extend([level / l, gain]),
                Surface::Rate => {}
                Surface::HoldingForce(force) => out.push(force / l),
            }
            if let Reset::Restitution { coefficient, .. } = guard.reset {
                out.push(coefficient);
            }
        }
    }
    out
}
