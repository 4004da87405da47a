//! A course of speed: the phase of the excitation over time, where it does not turn evenly.
//!
//! Along a course the variable `tau` of every solver is the time T = omega_c t itself, Om = 1 and nu = 1.

use super::{LoadKind, System};
use crate::numeric::broken_line::BrokenLine;
use crate::numeric::growth::Growth;
use crate::numeric::periodic::Periodic;

/// Speed against time, and the phase that follows from it.
#[derive(Debug, Clone, PartialEq)]
pub struct Course {
    /// Rate of the base phase over omega_c, against omega_c t; continuous.
    speed: BrokenLine,
    /// Base phase at the points of `speed`.
    phases: Vec<f64>,
    /// Whether the train follows: torques in proportion to inertias give every body its mean acceleration.
    is_followed: bool,
}

/// State of the excitation at an instant.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Moment {
    /// Phase of the base order.
    pub phase: f64,
    /// Its rate over omega_c.
    pub frequency: f64,
    /// The rate of that, over omega_c^2.
    pub change: f64,
}

impl Moment {
    /// d^2/d(omega_c t)^2 of a function of the phase.
    pub fn bend(&self, of: &Periodic) -> f64 {
        self.frequency.powi(2) * of.second_derivative(self.phase)
            + self.change * of.derivative(self.phase)
    }
}

impl Course {
    /// `speed`: rate of the base phase over omega_c against omega_c t; `phase`: at time 0.
    pub fn new(speed: BrokenLine, phase: f64) -> Course {
        let points = speed.points();
        let first = points.first().map_or(0.0, |(t, w)| phase + w * t);
        let mut phases = vec![first];
        for pair in points.windows(2) {
            let [(t0, w0), (t1, w1)] = [pair[0], pair[1]];
            let last = phases[phases.len() - 1];
            phases.push(last + 0.5 * (w0 + w1) * (t1 - t0));
        }
        Course {
            speed,
            phases,
            is_followed: false,
        }
    }

    /// The course with a train that follows it, or does not.
    #[must_use]
    pub fn followed(self, is_followed: bool) -> Course {
        Course {
            is_followed,
            ..self
        }
    }

    /// Whether the train follows.
    pub fn is_followed(&self) -> bool {
        self.is_followed
    }

    /// Speed against time.
    pub fn speed(&self) -> &BrokenLine {
        &self.speed
    }

    /// The excitation at a time, on the stretch of even acceleration that holds `inside`.
    pub fn moment_on(&self, time: f64, inside: f64) -> Moment {
        let k = self.speed.rank(inside).max(1) - 1;
        let (t0, w0) = self.speed.points()[k];
        let slope = self.speed.on(time, inside).slope;
        let t = time - t0;
        Moment {
            phase: self.phases[k] + t * (w0 + 0.5 * slope * t),
            frequency: w0 + slope * t,
            change: slope,
        }
    }

    /// The first time after `time` at which the phase has passed `distance` further (backwards where it is negative), if that
    /// happens on the stretch of even acceleration behind `time`.
    pub fn after(&self, time: f64, distance: f64) -> Option<f64> {
        let Moment {
            frequency, change, ..
        } = self.moment_on(time, time);
        let root = (frequency * frequency + 2.0 * change * distance)
            .max(0.0)
            .sqrt();
        if frequency * frequency + 2.0 * change * distance < 0.0 {
            return None;
        }
        let root = if distance < 0.0 { -root } else { root };
        let t = 2.0 * distance / (frequency + root);
        (t > 0.0 && t.is_finite()).then_some(time + t)
    }

    /// The time at which the phase reaches a value, where the speed is above 0 throughout.
    pub fn time_of(&self, phase: f64) -> f64 {
        let k = self.phases.partition_point(|p| *p <= phase).max(1) - 1;
        let (t0, w0) = self.speed.points()[k];
        let distance = phase - self.phases[k];
        let inside = match self.speed.points().get(k + 1) {
            Some((t1, _)) if distance >= 0.0 => 0.5 * (t0 + t1),
            _ => t0,
        };
        let slope = match distance >= 0.0 {
            true => self.speed.on(inside, inside).slope,
            false => 0.0,
        };
        let root = (w0 * w0 + 2.0 * slope * distance).max(0.0).sqrt();
        t0 + 2.0 * distance / (w0 + root)
    }

    /// Times at which the speed has a corner or passes 0, or its modulus one of these values.
    fn corners(&self, speeds: &[f64]) -> Vec<f64> {
        let mut list: Vec<f64> = self.speed.places().collect();
        for pair in self.speed.points().windows(2) {
            let [(t0, w0), (t1, w1)] = [pair[0], pair[1]];
            let levels = speeds.iter().flat_map(|w| [*w, -*w]).chain([0.0]);
            for level in levels {
                if (w0 - level) * (w1 - level) < 0.0 {
                    list.push(t0 + (level - w0) / (w1 - w0) * (t1 - t0));
                }
            }
        }
        list
    }
}

impl System {
    /// The same system along a course of speed: its solvers' `tau` is omega_c t.
    #[must_use]
    pub fn along(&self, course: Course) -> System {
        System {
            omega: 1.0,
            subharmonic: 1,
            course: Some(course),
            ..self.clone()
        }
    }

    /// The course of speed, where the excitation does not turn evenly.
    pub fn course(&self) -> Option<&Course> {
        self.course.as_ref()
    }

    /// The excitation at a phase of the response; behind a corner of the course.
    #[inline]
    pub fn moment(&self, tau: f64) -> Moment {
        self.moment_on(tau, tau)
    }

    /// The same on the stretch that holds `inside`.
    #[inline]
    pub fn moment_on(&self, tau: f64, inside: f64) -> Moment {
        match &self.course {
            Some(course) => course.moment_on(tau, inside),
            None => Moment {
                phase: self.subharmonic as f64 * tau,
                frequency: self.excitation_frequency(),
                change: 0.0,
            },
        }
    }

    /// Largest modulus of the rate of the phase over omega_c.
    pub fn highest_frequency(&self) -> f64 {
        let steady = || self.excitation_frequency();
        self.course
            .as_ref()
            .map_or_else(steady, |c| c.speed.largest())
    }

    /// Times along the course at which an excitation has a corner that does not follow the phase, ascending.
    pub fn corners(&self) -> Vec<f64> {
        let Some(course) = &self.course else {
            return Vec::new();
        };
        let (mut times, mut speeds) = (Vec::new(), Vec::new());
        for load in &self.loads {
            match &load.kind {
                LoadKind::Timed(line) => times.extend(line.places()),
                LoadKind::Orders { growth, .. } => speeds.extend(growth.corners()),
                LoadKind::Value | LoadKind::Rate | LoadKind::Acceleration => {}
            }
        }
        let revolutions = self.revolutions as f64;
        speeds.iter_mut().for_each(|w| *w /= revolutions);
        times.extend(course.corners(&speeds));
        times.sort_by(f64::total_cmp);
        times.dedup();
        times
    }

    /// The first time after `tau` at which the phase meets one of `kinks`, ascending in [0, 2 pi), if that is before `end`; a
    /// course has no corner between.
    pub fn next_kink(&self, kinks: &[f64], tau: f64, end: f64) -> Option<f64> {
        const TAU: f64 = std::f64::consts::TAU;
        let course = self.course.as_ref().filter(|_| !kinks.is_empty())?;
        let inside = 0.5 * (tau + end);
        let phase = course.moment_on(tau, inside).phase;
        let is_forward = course.moment_on(inside, inside).frequency >= 0.0;
        let own = phase.rem_euclid(TAU);
        let nudge = ROUNDING * (1.0 + phase.abs());
        // The nearest kink ahead by more than rounding, within this turn or the next.
        let ahead = if is_forward {
            let k = kinks.partition_point(|k| *k <= own + nudge);
            kinks.get(k).map_or_else(
                || kinks.iter().map(|k| k + TAU - own).find(|d| *d > nudge),
                |k| Some(k - own),
            )
        } else {
            let k = kinks.partition_point(|k| *k < own - nudge);
            k.checked_sub(1).map_or_else(
                || {
                    kinks
                        .iter()
                        .rev()
                        .map(|k| k - TAU - own)
                        .find(|d| *d < -nudge)
                },
                |k| Some(kinks[k] - own),
            )
        }?;
        course.after(tau, ahead).filter(|t| *t < end)
    }

    /// Factor of the direction of a load, from its series and kind.
    #[inline]
    pub fn load_value(&self, (series, kind): (&Periodic, &LoadKind), tau: f64, at: &Moment) -> f64 {
        match kind {
            LoadKind::Value => series.value(at.phase),
            LoadKind::Rate => at.frequency * series.derivative(at.phase),
            LoadKind::Acceleration => {
                at.frequency * at.frequency * series.derivative(at.phase)
                    + at.change * series.value(at.phase)
            }
            LoadKind::Orders { ratio, growth } => {
                self.growth(growth, at.frequency) * series.value(ratio * at.phase)
            }
            LoadKind::Timed(line) => match self.course {
                Some(_) => line.value(tau),
                None => series.mean(),
            },
        }
    }

    /// Factor of an amplitude at a rate of the base phase.
    pub fn growth(&self, growth: &Growth, frequency: f64) -> f64 {
        growth.factor(frequency * self.revolutions as f64)
    }
}

/// Phases closer than this, relative to 1 and their size, are the same.
const ROUNDING: f64 = 1e-12;

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn times_and_phases_belong_together() {
        let points = vec![(1.0, 2.0), (3.0, 6.0), (4.0, 1.0)];
        let speed = BrokenLine::new(points).expect("ascending");
        let course = Course::new(speed, 0.5);
        for time in [0.0, 0.5, 1.0, 1.7, 3.0, 3.2, 4.0, 9.0] {
            let at = course.moment_on(time, time);
            assert!((course.time_of(at.phase) - time).abs() < 1e-14, "{time}");
            let later = course.moment_on(time + 1e-6, time + 1e-6);
            let rate = (later.phase - at.phase) / 1e-6;
            assert!((rate - at.frequency).abs() < 1e-5, "{time}");
        }
        let next = course.after(1.5, 2.0).expect("on the stretch");
        let [a, b] = [1.5, next].map(|t| course.moment_on(t, t).phase);
        assert!((b - a - 2.0).abs() < 1e-14);
    }
}
