//! Connections whose force is not a constant multiple of the deformation: their series, made order by order beside the motion.
//!
//! The force of such a connection is s(phase) f(x, dx/dT, phase), x = W q - e. Coefficient k of it follows from those of x and
//! dx/dT up to k, which the recursion of the motion has at that moment.

use super::forcing::{Instant, Sources};
use super::laws::{ForcePiece, LawPart};
use crate::numeric::taylor::{COUNT, Inputs, Polynomial, convolve};
use crate::system::System;

/// All connections, and which of them act in this way at the moment.
#[derive(Debug, Clone)]
pub(crate) struct Acting {
    /// Numbers of the parts that act, ascending.
    pub list: Vec<usize>,
    parts: Vec<ActingPart>,
    variations: Sources,
    variation: Vec<Polynomial>,
    phase: [f64; 3],
    /// Unit of time of the series in omega_c t.
    unit: f64,
}

/// The series of one part of a law.
#[derive(Debug, Clone)]
struct ActingPart {
    connection: usize,
    x: Polynomial,
    /// dx/dT.
    rate: Polynomial,
    law: Polynomial,
    force: Polynomial,
    /// What the law remembers, and that memory a term later: the terms of a step are judged by it.
    memory: Polynomial,
    later: Polynomial,
    /// Whether the memory has a rate.
    evolves: bool,
    /// s df/dx, s df/dv, s df/dz, then the partials of the rate of the memory by the same.
    partials: [Polynomial; 6],
    /// Whether s is a function of the phase.
    varies: bool,
    /// s where it is constant on the stretch.
    factor: f64,
    registers: Vec<Polynomial>,
}

impl Acting {
    /// Buffers for every connection of a system.
    pub fn new(system: &System, laws: &[LawPart]) -> Acting {
        let e = system.element_count();
        let mut variations = Sources::new(e);
        for (k, mount) in system.mounts().iter().enumerate() {
            match mount.stiffness_variation.as_ref() {
                Some(series) if series.varies_smoothly() => variations.add(k, 1.0, series),
                _ => {}
            }
        }
        let zero = [0.0; COUNT];
        let part = |part: &LawPart| ActingPart {
            connection: part.connection,
            x: zero,
            rate: zero,
            law: zero,
            force: zero,
            memory: zero,
            later: zero,
            evolves: part.law.cells.is_some(),
            partials: [zero; 6],
            varies: (system.mounts()[part.connection].stiffness_variation.iter())
                .any(|s| s.varies_smoothly()),
            factor: 1.0,
            registers: vec![zero; part.law.registers()],
        };
        Acting {
            list: Vec::with_capacity(laws.len()),
            parts: laws.iter().map(part).collect(),
            variations,
            variation: vec![zero; e],
            phase: [0.0; 3],
            unit: 1.0,
        }
    }

    /// Sets the excitation frequency over omega_c, the unit of time of the series and the revolutions in a turn.
    pub fn prepare(&mut self, frequency: f64, unit: f64, revolutions: f64) {
        self.unit = unit;
        self.variations.prepare(frequency, unit, revolutions);
    }

    /// Connection of a part.
    #[inline]
    pub fn connection(&self, part: usize) -> usize {
        self.parts[part].connection
    }

    /// The connection of a part with the coefficients of its force.
    pub(crate) fn whole_force(&self, part: usize) -> (usize, &Polynomial) {
        let part = &self.parts[part];
        (part.connection, &part.force)
    }

    /// Whether a part in a region acts; if not, its slope and offset with the stiffness at a phase inside the stretch.
    pub fn admit(&mut self, k: usize, piece: &ForcePiece, factor: f64) -> Option<(f64, f64)> {
        let part = &mut self.parts[k];
        part.factor = factor;
        match piece {
            ForcePiece::Affine(a) if a.v == 0.0 && !part.varies => {
                return Some((factor * a.q, factor * a.constant));
            }
            ForcePiece::Affine(a) if *a == Default::default() => return Some((0.0, 0.0)),
            _ => self.list.push(k),
        }
        None
    }

    /// Series of the stiffness variation for a step.
    pub(crate) fn expand(&mut self, at: &Instant) {
        self.phase = [at.phase, at.rate, 0.5 * at.change];
        if !self.list.is_empty() && !self.variations.is_zero() {
            self.variations.expand(at, &mut self.variation);
        }
    }

    /// Coefficient k of the force of a part, from those of its deformation and rate.
    #[inline]
    pub fn force(
        &mut self,
        part: usize,
        piece: &ForcePiece,
        k: usize,
        (x, rate): (f64, f64),
    ) -> f64 {
        let part = &mut self.parts[part];
        (part.x[k], part.rate[k]) = (x, rate);
        let law = match piece {
            ForcePiece::Affine(a) => a.q * x + a.v * rate + if k == 0 { a.constant } else { 0.0 },
            ForcePiece::Smooth(smooth) => {
                let inputs = Inputs {
                    x: &part.x,
                    y: &part.rate,
                    phase: self.phase,
                    memory: &part.memory,
                };
                smooth.force.step(k, &inputs, &mut part.registers);
                let force = smooth.force.output(0, k, &inputs, &part.registers);
                if part.evolves && k + 1 < COUNT {
                    // (k + 1) z_{k+1} = h g_k
                    let rate = smooth.force.output(1, k, &inputs, &part.registers);
                    part.memory[k + 1] = self.unit * rate / (k + 1) as f64;
                    part.later[k + 1] = part.memory[k] / (k + 1) as f64;
                }
                force
            }
        };
        part.law[k] = law;
        part.force[k] = match part.varies {
            true => convolve(&part.law, &self.variation[part.connection], k),
            false => part.factor * law,
        };
        part.force[k]
    }

    /// The first theta within a step at which a force that the series cannot see comes back: the step ends there.
    pub(crate) fn come_back<'a>(
        &self,
        piece: impl Fn(usize) -> &'a ForcePiece,
        count: usize,
        step: f64,
    ) -> Option<f64> {
        let end = |k: &usize| match piece(*k) {
            ForcePiece::Affine(_) => None,
            ForcePiece::Smooth(smooth) => {
                let registers = &self.parts[*k].registers;
                let ends = smooth.hidden.iter();
                // The forces of the last two coefficients are not made.
                let ends = ends.filter_map(|h| h.end(registers, count - 2, step));
                ends.reduce(f64::min)
            }
        };
        self.list.iter().filter_map(end).reduce(f64::min)
    }

    /// A connection whose force has no series at the begin of the step, with its deformation and rate there.
    pub fn fault(&self, count: usize) -> Option<(usize, f64, f64)> {
        let is_faulty = |k: &&usize| {
            let force = &self.parts[**k].force;
            !force[..count].iter().all(|c| c.is_finite())
        };
        let part = *self.list.iter().find(is_faulty)?;
        Some(self.place(part))
    }

    /// The connection whose force changes fastest, with its deformation and rate.
    pub(crate) fn steepest(&self, count: usize) -> Option<(usize, f64, f64)> {
        let growth = |k: &usize| {
            let force = &self.parts[*k].force[..count];
            let size = force[..2]
                .iter()
                .fold(f64::MIN_POSITIVE, |m, c| m.max(c.abs()));
            force[count - 1].abs().max(force[count - 2].abs()) / size
        };
        let largest = |a: &&usize, b: &&usize| growth(a).total_cmp(&growth(b));
        let part = *self.list.iter().max_by(largest)?;
        Some(self.place(part))
    }

    fn place(&self, part: usize) -> (usize, f64, f64) {
        let part = &self.parts[part];
        (part.connection, part.x[0], part.rate[0])
    }

    /// Makes the series of the partials of every acting connection from that of its motion.
    pub(crate) fn differentiate<'a>(
        &mut self,
        piece: impl Fn(usize) -> &'a ForcePiece,
        count: usize,
    ) {
        for k in &self.list {
            let part = &mut self.parts[*k];
            let (all, of_force) = if part.evolves { (6, 3) } else { (2, 2) };
            match piece(*k) {
                ForcePiece::Affine(a) => {
                    part.partials[..all].fill([0.0; COUNT]);
                    (part.partials[0][0], part.partials[1][0]) = (a.q, a.v);
                }
                ForcePiece::Smooth(smooth) => {
                    let inputs = Inputs {
                        x: &part.x,
                        y: &part.rate,
                        phase: self.phase,
                        memory: &part.memory,
                    };
                    let outputs = smooth.partials.outputs.len();
                    for j in 0..count {
                        smooth.partials.step(j, &inputs, &mut part.registers);
                        let partials = part.partials[..outputs].iter_mut();
                        for (index, partial) in partials.enumerate() {
                            partial[j] = smooth.partials.output(index, j, &inputs, &part.registers);
                        }
                    }
                }
            }
            for partial in &mut part.partials[..of_force] {
                match part.varies {
                    true => multiply(partial, &self.variation[part.connection], count),
                    false => partial[..count].iter_mut().for_each(|c| *c *= part.factor),
                }
            }
        }
    }

    /// s df/dx, s df/dv and s df/dz of a part, then the partials of the rate of its memory, as made by [`Acting::differentiate`].
    pub fn partials(&self, part: usize) -> &[Polynomial; 6] {
        &self.parts[part].partials
    }

    /// Whether the memory of a part has a rate.
    pub(crate) fn evolves(&self, part: usize) -> bool {
        self.parts[part].evolves
    }

    /// Series of the memory of a part.
    pub fn memory(&self, part: usize) -> &Polynomial {
        &self.parts[part].memory
    }

    /// Begins the series of the memory of a part.
    pub(crate) fn remember(&mut self, part: usize, z: f64) {
        (self.parts[part].memory, self.parts[part].later) = ([0.0; COUNT], [0.0; COUNT]);
        self.parts[part].memory[0] = z;
    }

    /// Coefficient k + 1 of the memory of a part, 0 without a rate.
    #[inline]
    pub(crate) fn next_memory(&self, part: usize, k: usize) -> f64 {
        self.parts[part].memory[k + 1]
    }

    /// Cuts the series of the memories behind a number of coefficients, those of the motion less one, and shows them one by one as rates are
    /// shown: shifted by a term.
    pub(crate) fn close_memories(&mut self, count: usize) {
        for part in self.parts.iter_mut().filter(|p| p.evolves) {
            part.memory[count - 1..].fill(0.0);
            part.later[count..].fill(0.0);
        }
    }

    /// The memories that have a rate, a term later each: their rates are the memories.
    pub fn later(&self) -> impl Iterator<Item = &Polynomial> {
        self.parts.iter().filter(|p| p.evolves).map(|p| &p.later)
    }
}

/// a <- a b, truncated to a number of coefficients.
fn multiply(a: &mut Polynomial, b: &Polynomial, count: usize) {
    if a[..count].iter().all(|c| *c == 0.0) {
        return;
    }
    for k in (0..count).rev() {
        a[k] = convolve(a, b, k);
    }
}
