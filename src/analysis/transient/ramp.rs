//! A speed that goes evenly from one value to another.

use super::history::positive_time;
use super::time;
use crate::analysis::{Fault, Setting};
use crate::numeric::broken_line::BrokenLine;
use crate::quantity::{Quantity, UnitDimension};
use std::f64::consts::TAU;

/// The keys of a ramp.
pub struct RampKeys<'a> {
    /// First speed.
    pub from: &'a Quantity,
    /// Last speed.
    pub to: &'a Quantity,
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

/// rad/s^2
const ACCELERATION: UnitDimension = UnitDimension::new(0, 0, -2, 1);
/// Revolutions closer to a whole number are whole.
const ROUNDING: f64 = 1e-9;

/// The ramp that keys ask for.
///
/// # Errors
/// Everything wrong with them.
pub fn ramp(keys: RampKeys<'_>, setting: &Setting<'_>) -> Result<SpeedRamp, Vec<Fault>> {
    let mut faults = Vec::new();
    let mut note = |key: &str, value: Result<f64, String>| {
        value
            .map_err(|message| faults.push(Fault::new(key, message)))
            .ok()
    };
    let from = note("from", setting.frequency(keys.from));
    let to = note("to", setting.frequency(keys.to));
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
    let first = phase / TAU;
    let revolutions = (
        (first - ROUNDING).ceil() as i64,
        (first + turns + ROUNDING).floor() as i64,
    );
    Ok(SpeedRamp {
        line,
        phase,
        end,
        turns,
        revolutions,
    })
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
