//! How an amplitude depends on a speed.

use super::broken_line::BrokenLine;
use super::taylor::{COUNT, Polynomial};

/// Amplitude at a speed over the amplitude as written.
#[derive(Debug, Clone, PartialEq)]
pub enum Growth {
    /// 1.
    Constant,
    /// (|w| / reference)^power.
    Power {
        /// Exponent.
        power: f64,
        /// Speed at which the factor is 1, > 0.
        reference: f64,
    },
    /// A broken line over |w|.
    Table(BrokenLine),
    /// w / reference, with its sign.
    Signed {
        /// Speed at which the factor is 1, > 0.
        reference: f64,
    },
}

impl Growth {
    /// The factor at a speed.
    pub fn factor(&self, speed: f64) -> f64 {
        match self {
            Growth::Constant => 1.0,
            Growth::Power { power, reference } => (speed.abs() / reference).powf(*power),
            Growth::Table(line) => line.value(speed.abs()),
            Growth::Signed { reference } => speed / reference,
        }
    }

    /// Derivative of the factor with respect to a speed above 0.
    pub fn slope(&self, speed: f64) -> f64 {
        match self {
            Growth::Constant => 0.0,
            Growth::Power { power, reference } => {
                power / reference * (speed / reference).powf(power - 1.0)
            }
            Growth::Table(line) => line.on(speed, speed).slope,
            Growth::Signed { reference } => 1.0 / reference,
        }
    }

    /// Speeds above 0 at which the factor has a corner.
    pub fn corners(&self) -> Vec<f64> {
        match self {
            Growth::Table(line) => line.places().filter(|w| *w > 0.0).collect(),
            _ => Vec::new(),
        }
    }

    /// Whether it has no series where the speed passes 0.
    pub(crate) fn needs_speed(&self) -> bool {
        matches!(self, Growth::Power { power, .. } if *power < 0.0 || power.fract() != 0.0)
    }

    /// The same over another unit of speed: speeds are multiplied.
    #[must_use]
    pub fn scaled(&self, factor: f64) -> Growth {
        match self {
            Growth::Constant => Growth::Constant,
            Growth::Power { power, reference } => Growth::Power {
                power: *power,
                reference: reference * factor,
            },
            Growth::Table(line) => Growth::Table(line.scaled(factor, 1.0)),
            Growth::Signed { reference } => Growth::Signed {
                reference: reference * factor,
            },
        }
    }

    /// Taylor coefficients where the speed is w + change t; `inside`: a speed on the piece at hand.
    ///
    /// ```text
    /// y = w^p:   (k + 1) w y_(k+1) = (p - k) change y_k
    /// ```
    pub(crate) fn expand(&self, (speed, change): (f64, f64), inside: f64, out: &mut Polynomial) {
        *out = [0.0; COUNT];
        let sign = if inside < 0.0 { -1.0 } else { 1.0 };
        let (speed, change) = (sign * speed, sign * change);
        match self {
            Growth::Constant => out[0] = 1.0,
            Growth::Signed { reference } => {
                (out[0], out[1]) = (sign * speed / reference, sign * change / reference);
            }
            Growth::Table(line) => {
                let piece = line.on(speed, inside.abs());
                (out[0], out[1]) = (piece.value, piece.slope * change);
            }
            Growth::Power { power, reference } => {
                let (w, a) = (speed / reference, change / reference);
                if w <= 0.0 {
                    // At rest only a whole power has a series: (a t)^p.
                    let k = *power as usize;
                    if let Some(c) = out.get_mut(k) {
                        *c = a.powi(k as i32);
                    }
                    return;
                }
                out[0] = w.powf(*power);
                for k in 0..COUNT - 1 {
                    out[k + 1] = out[k] * (power - k as f64) * a / (w * (k + 1) as f64);
                }
            }
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::numeric::bernstein::evaluate;

    #[test]
    fn series_follow_the_factor() {
        let table = BrokenLine::new(vec![(1.0, 2.0), (3.0, 5.0)]).expect("ascending");
        let list = [
            Growth::Constant,
            Growth::Power {
                power: 2.0,
                reference: 1.7,
            },
            Growth::Power {
                power: -0.4,
                reference: 0.9,
            },
            Growth::Table(table),
        ];
        for growth in list {
            let mut series = [0.0; COUNT];
            for (speed, change) in [(2.0, 0.3), (-2.0, 0.4)] {
                growth.expand((speed, change), speed, &mut series);
                let (value, slope) = evaluate(&series, 0.5);
                let at = speed + 0.5 * change;
                let factor = growth.factor(at);
                assert!((value - factor).abs() < 1e-13 * factor, "{growth:?}");
                let rate = growth.slope(at.abs()) * change * at.signum();
                assert!((slope - rate).abs() < 1e-12, "{growth:?}: {slope} {rate}");
            }
        }
    }
}
