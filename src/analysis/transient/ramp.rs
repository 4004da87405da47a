//! A speed that goes evenly from one value to another.

use super::history::positive_time;
use super::{SpeedProfile, time};
use crate::analysis::{Fault, Setting};
use crate::numeric::broken_line::BrokenLine;
use crate::quantity::{Quantity, UnitDimension};
use crate::system::Course;
use std::f64::consts::TAU;

/// The keys of a ramp.
pub struct RampKeys<'a> {
    /// First speed.
    pub from: Option<&'a Quantity>,
    /// Last speed.
    pub to: Option<&'a Quantity>,
    /// Speed over time, instead of all others but the phase.
    pub speed: Option<&'a SpeedProfile>,
    /// Time between them.
    pub duration: Option<&'a Quantity>,
    /// Change of speed per time, instead of the duration.
    pub rate: Option<&'a Quantity>,
    /// Time for which the ends are held.
    pub hold: Option<&'a Quantity>,
    /// Phase of the reference at t = 0.
    pub phase: Option<&'a Quantity>,
}

/// A speed over time.
#[derive(Debug, Clone)]
pub struct SpeedRamp {
    /// Speed of the reference over omega_c against omega_c t.
    pub line: BrokenLine,
    /// Phase of the reference at t = 0.
    pub phase: f64,
    /// Its end, omega_c t.
    pub end: f64,
    /// Revolutions of the reference.
    pub turns: f64,
    /// The first revolution that begins in the run and the one behind the last whole one.
    pub revolutions: (i64, i64),
}

impl SpeedRamp {
    fn new(line: BrokenLine, phase: f64, (end, turns): (f64, f64)) -> SpeedRamp {
        let first = phase / TAU;
        let revolutions = (
            (first - ROUNDING).ceil() as i64,
            (first + turns + ROUNDING).floor() as i64,
        );
        SpeedRamp {
            line,
            phase,
            end,
            turns,
            revolutions,
        }
    }

    /// Least and largest speed over omega_c.
    pub fn extent(&self) -> (f64, f64) {
        let speeds = self.line.points().iter().map(|p| p.1);
        speeds.fold((f64::INFINITY, 0.0), |(low, high), w| {
            (low.min(w), high.max(w))
        })
    }
}

/// rad/s^2
const ACCELERATION: UnitDimension = UnitDimension::new(0, 0, -2, 1);
/// Revolutions closer to a whole number are whole.
const ROUNDING: f64 = 1e-9;

/// The ramp that keys ask for.
///
/// # Errors
/// Everything wrong with them.
pub fn ramp(keys: RampKeys<'_>, setting: &Setting<'_>) -> Result<SpeedRamp, Vec<Fault>> {
    if let Some(speed) = keys.speed {
        return measured(speed, &keys, setting);
    }
    let mut faults = Vec::new();
    let mut note = |key: &str, value: Result<f64, String>| {
        value
            .map_err(|message| faults.push(Fault::new(key, message)))
            .ok()
    };
    let end = |quantity: Option<&Quantity>| match quantity {
        Some(quantity) => setting.frequency(quantity),
        None => {
            Err("is missing: a speed of the reference, such as `800 rpm`; or give `speed`".into())
        }
    };
    let from = note("from", end(keys.from));
    let to = note("to", end(keys.to));
    let hold = match keys.hold {
        None => Some(0.0),
        Some(hold) => note("hold", not_negative(setting, hold)),
    };
    let phase = match keys.phase {
        None => Some(0.0),
        Some(phase) => note("phase", phase.si(UnitDimension::ANGLE)),
    };
    let (Some(from), Some(to), Some(hold), Some(phase)) = (from, to, hold, phase) else {
        return Err(faults);
    };
    let duration = duration(&keys, setting, (from, to)).map_err(|fault| vec![fault])?;
    let mut points = vec![(0.0, from)];
    if hold > 0.0 {
        points.push((hold, from));
    }
    points.push((hold + duration, to));
    let end = 2.0 * hold + duration;
    let line = BrokenLine::new(points).map_err(|_| {
        let message = "the speed over time is not finite";
        vec![Fault::new("duration", message)]
    })?;
    let turns = (hold * (from + to) + 0.5 * duration * (from + to)) / TAU;
    Ok(SpeedRamp::new(line, phase, (end, turns)))
}

/// A speed as it was measured.
fn measured(
    speed: &SpeedProfile,
    keys: &RampKeys<'_>,
    setting: &Setting<'_>,
) -> Result<SpeedRamp, Vec<Fault>> {
    let others = [
        ("from", keys.from),
        ("to", keys.to),
        ("duration", keys.duration),
        ("rate", keys.rate),
        ("hold", keys.hold),
    ];
    let given = others.into_iter().filter(|(_, value)| value.is_some());
    let mut faults: Vec<Fault> = given
        .map(|(key, _)| Fault::new(key, "does not go with `speed`, which says everything"))
        .collect();
    let phase = keys
        .phase
        .map_or(Ok(0.0), |phase| phase.si(UnitDimension::ANGLE));
    let phase = phase.map_err(|message| faults.push(Fault::new("phase", message)));
    let line = speed
        .line(setting, "speed")
        .map_err(|list| faults.extend(list));
    let (Ok(line), Ok(phase), true) = (line, phase, faults.is_empty()) else {
        return Err(faults);
    };
    let end = line.places().last().unwrap_or(0.0);
    let least = line
        .points()
        .iter()
        .fold(f64::INFINITY, |low, p| low.min(p.1));
    if !(least > 0.0 && end > 0.0) {
        let message = "wanted speeds above 0 over a time above 0: orders have no windows at rest; a time_history takes any speed";
        return Err(vec![Fault::new("speed", message)]);
    }
    let course = Course::new(line.clone(), phase);
    let [first, last] = [0.0, end].map(|t| course.moment_on(t, t).phase);
    Ok(SpeedRamp::new(line, phase, (end, (last - first) / TAU)))
}

fn not_negative(setting: &Setting<'_>, quantity: &Quantity) -> Result<f64, String> {
    let value = time(setting, quantity)?;
    match value >= 0.0 {
        true => Ok(value),
        false => Err(format!("`{}` must be a time, 0 or more", quantity.text)),
    }
}

/// Time from one speed to the other.
fn duration(
    keys: &RampKeys<'_>,
    setting: &Setting<'_>,
    (from, to): (f64, f64),
) -> Result<f64, Fault> {
    match (keys.duration, keys.rate) {
        (Some(duration), None) => positive_time(setting, "duration", duration),
        (None, Some(rate)) => {
            let w_c = setting.assembly.scales.frequency;
            let value = match rate.dimension {
                None if !setting.is_si() => Ok(rate.value),
                _ => rate.si(ACCELERATION).map(|a| a / (w_c * w_c)),
            };
            let value = value.map_err(|message| Fault::new("rate", message))?;
            let time = (to - from).abs() / value.abs();
            match value != 0.0 && time > 0.0 && time.is_finite() {
                true => Ok(time),
                false => Err(Fault::new(
                    "rate",
                    "wanted a rate other than 0 between two different speeds",
                )),
            }
        }
        (Some(_), Some(_)) => Err(Fault::new(
            "rate",
            "`duration` and `rate` exclude each other",
        )),
        (None, None) => {
            let message = "is missing: give the length of the run, or `rate`, such as `170 rpm/s`";
            Err(Fault::new("duration", message))
        }
    }
}
