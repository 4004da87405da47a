//! Axes: range from the data, ticks at round numbers, text of the ticks.

use crate::report::AxisScale;
use kuva::render::render_utils::generate_ticks;

/// A range with its ticks.
#[derive(Debug, Clone)]
pub(super) struct DrawnAxis {
    pub low: f64,
    pub high: f64,
    pub ticks: Vec<Tick>,
    /// Common power of ten of the tick texts, 0 when they are plain.
    pub exponent: i32,
    pub scale: AxisScale,
}

#[derive(Debug, Clone, PartialEq)]
pub(super) struct Tick {
    pub value: f64,
    pub text: String,
}

/// Room between the data and the frame, as a share of the span.
const MARGIN: f64 = 0.05;
/// Room of a logarithmic axis, as a factor.
const LOG_ROOM: f64 = 1.15;

impl DrawnAxis {
    /// Axis over exactly this range, in whichever order its ends are given.
    pub fn exact(ends: (f64, f64), count: usize) -> Self {
        let (low, high) = widened(ends.0.min(ends.1), ends.0.max(ends.1));
        let mut values = generate_ticks(low, high, count);
        let slack = 1e-9 * (high - low);
        values.retain(|t| *t >= low - slack && *t <= high + slack);
        let (exponent, ticks) = texts(&values);
        DrawnAxis {
            low,
            high,
            ticks,
            exponent,
            scale: AxisScale::Linear,
        }
    }

    /// Logarithmic axis over the positive data, or over the range given as far as it is positive.
    pub fn logarithmic(range: Option<(f64, f64)>, data: impl Iterator<Item = f64>) -> Self {
        let (low, high) = extent(data.filter(|v| *v > 0.0)).unwrap_or((0.1, 1.0));
        let (low, high) = match range {
            Some((a, b)) if a.max(b) > 0.0 => (a.min(b), a.max(b)),
            _ => (low / LOG_ROOM, high * LOG_ROOM),
        };
        let low = if low > 0.0 { low } else { 1e-3 * high };
        let high = if high > low { high } else { 10.0 * low };
        let decades = (high / low).log10();
        let within = |v: &f64| *v >= low * (1.0 - 1e-9) && *v <= high * (1.0 + 1e-9);
        let powers = low.log10().floor() as i32..=high.log10().ceil() as i32;
        let stride = (decades / 7.0).ceil().max(1.0) as i32;
        let factors: &[f64] = if decades < 2.0 {
            &[1.0, 2.0, 5.0]
        } else {
            &[1.0]
        };
        let powers = powers.filter(|p| p.rem_euclid(stride) == 0);
        let values = powers.flat_map(|p| factors.iter().map(move |f| (*f, p)));
        let ticks = values.map(|(f, p)| Tick {
            value: f * 10f64.powi(p),
            text: match (f == 1.0, (-2..4).contains(&p)) {
                (_, true) => format!("{}", f * 10f64.powi(p)),
                (true, _) => power_of_ten(p).trim_start_matches('\u{d7}').to_string(),
                _ => format!("{f}{}", power_of_ten(p)),
            },
        });
        DrawnAxis {
            low,
            high,
            ticks: ticks.filter(|t| within(&t.value)).collect(),
            exponent: 0,
            scale: AxisScale::Log,
        }
    }

    /// One place for each name, the first on top.
    pub fn of_names(names: &[String]) -> Self {
        let count = names.len();
        let tick = |(k, name): (usize, &String)| Tick {
            value: (count - 1 - k) as f64,
            text: name.clone(),
        };
        DrawnAxis {
            low: -0.6,
            high: count.max(1) as f64 - 0.4,
            ticks: names.iter().enumerate().map(tick).collect(),
            exponent: 0,
            scale: AxisScale::Linear,
        }
    }

    /// Axis around the data with some room; from zero where the data come close to it.
    pub fn around(data: impl Iterator<Item = f64>, count: usize) -> Self {
        let (low, high) = extent(data).unwrap_or((0.0, 1.0));
        let (low, high) = widened(low, high);
        let room = MARGIN * (high - low);
        let from_zero = low >= 0.0 && low < 0.5 * high;
        let to_zero = high <= 0.0 && high > 0.5 * low;
        let bottom = if from_zero { 0.0 } else { low - room };
        let top = if to_zero { 0.0 } else { high + room };
        DrawnAxis::exact((bottom, top), count)
    }

    /// Axis around the data with some room, wherever zero is; data without negative values stay at or above zero.
    pub fn framing(data: impl Iterator<Item = f64>, count: usize) -> Self {
        let (low, high) = extent(data).unwrap_or((0.0, 1.0));
        let positive = low >= 0.0;
        let (low, high) = widened(low, high);
        let room = MARGIN * (high - low);
        let bottom = if positive {
            f64::max(0.0, low - room)
        } else {
            low - room
        };
        DrawnAxis::exact((bottom, high + room), count)
    }

    /// Where a value lies: 0 at the low end, 1 at the high end. Far outside values are brought near, so that coordinates
    /// stay small numbers.
    pub fn share(&self, value: f64) -> f64 {
        let share = match self.scale {
            AxisScale::Linear => (value - self.low) / (self.high - self.low),
            AxisScale::Log => (value / self.low).ln() / (self.high / self.low).ln(),
        };
        share.clamp(-10.0, 11.0)
    }
}

/// Smallest and largest finite value.
pub(super) fn extent(data: impl Iterator<Item = f64>) -> Option<(f64, f64)> {
    data.filter(|v| v.is_finite())
        .fold(None, |ends, v| match ends {
            None => Some((v, v)),
            Some((low, high)) => Some((f64::min(low, v), f64::max(high, v))),
        })
}

/// A range that is wide enough to divide by.
fn widened(low: f64, high: f64) -> (f64, f64) {
    let size = low.abs().max(high.abs());
    if high - low > 1e-9 * size {
        return (low, high);
    }
    let half = if size > 0.0 { 0.1 * size } else { 1.0 };
    (low - half, high + half)
}

fn texts(values: &[f64]) -> (i32, Vec<Tick>) {
    let size = values.iter().fold(0.0, |m: f64, v| m.max(v.abs()));
    let power = if size > 0.0 {
        (size * (1.0 + 1e-12)).log10().floor() as i32
    } else {
        0
    };
    let exponent = if (-2..5).contains(&power) { 0 } else { power };
    let scale = 10f64.powi(-exponent);
    let step = values.windows(2).map(|w| w[1] - w[0]);
    let step = step.fold(f64::INFINITY, f64::min) * scale;
    let decimals = (0..12).find(|&d| is_whole(step * 10f64.powi(d)));
    let decimals = decimals.unwrap_or(3) as usize;
    let tick = |v: &f64| Tick {
        value: *v,
        text: minus(format!("{:.*}", decimals, v * scale + 0.0)),
    };
    (exponent, values.iter().map(tick).collect())
}

fn is_whole(x: f64) -> bool {
    x >= 0.5 && (x - x.round()).abs() < 1e-6 * x.max(1.0)
}

/// A true minus sign; no minus before a zero.
fn minus(text: String) -> String {
    let digits = text.trim_start_matches('-');
    if digits.chars().all(|c| c == '0' || c == '.') {
        return digits.to_string();
    }
    text.replace('-', "\u{2212}")
}

/// `×10⁻⁵`.
pub(super) fn power_of_ten(exponent: i32) -> String {
    const DIGITS: [char; 10] = ['⁰', '¹', '²', '³', '⁴', '⁵', '⁶', '⁷', '⁸', '⁹'];
    let mut text = String::from("×10");
    for c in exponent.to_string().chars() {
        text.push(match c.to_digit(10) {
            Some(d) => DIGITS[d as usize],
            None => '⁻',
        });
    }
    text
}

#[cfg(test)]
mod tests {
    use super::*;

    fn labels(axis: &DrawnAxis) -> Vec<&str> {
        axis.ticks.iter().map(|t| t.text.as_str()).collect()
    }

    #[test]
    fn ticks_are_round_and_equally_written() {
        let axis = DrawnAxis::exact((2.5, 0.3), 6);
        assert_eq!((axis.low, axis.high), (0.3, 2.5));
        assert_eq!(labels(&axis), ["0.5", "1.0", "1.5", "2.0", "2.5"]);
    }

    #[test]
    fn small_numbers_share_a_power_of_ten() {
        let axis = DrawnAxis::around([1e-6, 2.2e-5].into_iter(), 5);
        assert_eq!(axis.low, 0.0);
        assert_eq!(axis.exponent, -5);
        assert_eq!(labels(&axis)[0], "0.0");
        assert_eq!(power_of_ten(-5), "×10⁻⁵");
    }

    #[test]
    fn a_frame_does_not_reach_for_zero() {
        let axis = DrawnAxis::framing([0.5, 2.5].into_iter(), 5);
        assert_eq!((axis.low, axis.high), (0.4, 2.6));
        assert_eq!(DrawnAxis::framing([0.01, 2.0].into_iter(), 5).low, 0.0);
        assert_eq!(DrawnAxis::framing([0.0, 0.0].into_iter(), 5).low, 0.0);
        assert!(DrawnAxis::framing([-0.1, 2.0].into_iter(), 5).low < -0.1);
    }

    #[test]
    fn decades_have_ticks() {
        let axis = DrawnAxis::logarithmic(None, [1e-6, 0.0, 2e-2].into_iter());
        assert_eq!(labels(&axis), ["10⁻⁶", "10⁻⁵", "10⁻⁴", "10⁻³", "0.01"]);
        assert!((axis.share((axis.low * axis.high).sqrt()) - 0.5).abs() < 1e-12);
        let axis = DrawnAxis::logarithmic(Some((1.0, 30.0)), [2.0].into_iter());
        assert_eq!(labels(&axis), ["1", "2", "5", "10", "20"]);
    }

    #[test]
    fn no_data_and_constant_data_have_an_axis() {
        for data in [vec![], vec![3.0], vec![0.0, 0.0], vec![f64::NAN]] {
            let axis = DrawnAxis::around(data.into_iter(), 5);
            assert!(axis.high > axis.low && axis.ticks.len() > 1, "{axis:?}");
        }
        assert_eq!(
            labels(&DrawnAxis::exact((-1.0, 1.0), 5)).first(),
            Some(&"\u{2212}1.0")
        );
    }
}
