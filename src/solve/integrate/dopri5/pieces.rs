//! Stretches of time in which every excitation is smooth.

use crate::numeric::periodic::Periodic;
use crate::system::{LoadKind, System};
use std::f64::consts::TAU;

/// Radians of the highest harmonic of a load or of a stiffness variation that one step may cover, and of a transmission
/// error, which moves the deformation also where it has no part in the motion (open contact).
const LOAD_RADIANS: f64 = 2.0;
const ERROR_RADIANS: f64 = 0.5;

/// Walks from kink to kink of loads, stiffness variation and transmission error.
#[derive(Debug, Clone, Default)]
pub(super) struct Pieces {
    /// Kinks in [0, 2 pi) of the phase, ascending.
    kinks: Vec<f64>,
    /// Full turns of the phase before the next kink, and its place in the list.
    next: (f64, usize),
    subharmonic: f64,
    /// Ends of the stretch in phases of the response, moved inwards by rounding: evaluation takes place inside.
    inside: (f64, f64),
    /// Phase of the response at the end of the stretch.
    end: f64,
    /// Times along a course of speed at which an excitation has a corner.
    corners: Vec<f64>,
    /// Steps at most, in omega_c t.
    pub(super) longest_step: f64,
}

impl Pieces {
    /// The stretch that begins at or holds `tau`.
    pub(super) fn start(&mut self, system: &System, tau: f64) {
        self.kinks.clear();
        let mut rate = 0.0_f64;
        let mut gather = |series: &Periodic, radians: f64, kinks: &mut Vec<f64>| {
            if series.is_constant() {
                return;
            }
            kinks.extend(series.kinks());
            if let Periodic::Fourier { harmonics, .. } = series {
                let present = harmonics.iter().filter(|h| h.cos != 0.0 || h.sin != 0.0);
                let order = present.map(|h| h.order).max().unwrap_or(0);
                rate = rate.max(order as f64 / radians);
            }
        };
        for mount in system.mounts() {
            if let Some(series) = &mount.stiffness_variation {
                gather(series, LOAD_RADIANS, &mut self.kinks);
            }
            if let Some(series) = &mount.transmission_error {
                gather(series, ERROR_RADIANS, &mut self.kinks);
            }
        }
        for load in system.loads() {
            let ratio = match load.kind {
                LoadKind::Orders { ratio, .. } => ratio,
                _ => 1.0,
            };
            gather(&load.series, LOAD_RADIANS / ratio, &mut self.kinks);
        }
        self.longest_step = 1.0 / (rate * system.highest_frequency());
        self.kinks.sort_by(f64::total_cmp);
        self.kinks.dedup_by(|b, a| *b - *a <= 4.0 * nudge(TAU));
        if system.course().is_some() {
            self.corners = system.corners();
            self.begin_at(system, tau);
            return;
        }
        self.subharmonic = system.subharmonic() as f64;
        let phase = self.subharmonic * tau;
        if self.kinks.is_empty() {
            (self.inside, self.end) = ((f64::NEG_INFINITY, f64::INFINITY), f64::INFINITY);
            return;
        }
        self.next = ((phase / TAU).floor() - 1.0, 0);
        while self.next_phase() <= phase + 2.0 * nudge(phase) {
            self.step_kink();
        }
        self.enter(phase - TAU);
    }

    /// The stretch after this one.
    pub(super) fn advance(&mut self, system: &System) {
        if system.course().is_some() {
            self.begin_at(system, self.end);
            return;
        }
        let begin = self.next_phase();
        self.step_kink();
        self.enter(begin);
    }

    /// Phase of the response at the end of the stretch.
    pub(super) fn end(&self) -> f64 {
        self.end
    }

    /// The phase of the response nearest to `tau` within the stretch.
    pub(super) fn clamp(&self, tau: f64) -> f64 {
        tau.clamp(self.inside.0, self.inside.1)
    }

    /// The stretch behind a time along a course of speed.
    fn begin_at(&mut self, system: &System, time: f64) {
        let first = self.corners.partition_point(|t| *t <= time);
        let stop = self.corners.get(first).copied().unwrap_or(f64::MAX);
        let kink = system.next_kink(&self.kinks, time, stop);
        self.end = kink.unwrap_or(match stop {
            f64::MAX => f64::INFINITY,
            stop => stop,
        });
        let (low, high) = (time, self.end - nudge(self.end));
        self.inside = (low.min(high), high.max(low));
    }

    /// `begin`: a phase at or before the begin of the stretch.
    fn enter(&mut self, begin: f64) {
        let end = self.next_phase();
        let last = self.previous_phase().max(begin);
        let (low, high) = (last + nudge(last), end - nudge(end));
        self.inside = (
            low.min(high) / self.subharmonic,
            high.max(low) / self.subharmonic,
        );
        self.end = end / self.subharmonic;
    }

    fn next_phase(&self) -> f64 {
        self.next.0 * TAU + self.kinks[self.next.1]
    }

    fn previous_phase(&self) -> f64 {
        match self.next {
            (turns, 0) => (turns - 1.0) * TAU + self.kinks[self.kinks.len() - 1],
            (turns, k) => turns * TAU + self.kinks[k - 1],
        }
    }

    fn step_kink(&mut self) {
        self.next.1 += 1;
        if self.next.1 == self.kinks.len() {
            self.next = (self.next.0 + 1.0, 0);
        }
    }
}

/// A distance that rounding of a phase does not bridge.
fn nudge(phase: f64) -> f64 {
    64.0 * f64::EPSILON * (1.0 + phase.abs())
}
