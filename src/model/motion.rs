//! Measured motion of a body in a model file: speed or angle, over the cycle or over time.

use super::arms::Bodies;
use super::cycle::cycle;
use super::fields::{Fields, Mistakes};
use super::mean_motion::MeanMotion;
use super::orders::Orders;
use super::profile::profile;
use super::{Load, Motion};
use crate::error::Diagnostic;
use crate::numeric::broken_line::BrokenLine;
use crate::numeric::fraction;
use crate::numeric::periodic::{Harmonic, Periodic};
use crate::quantity::{Quantity, UnitDimension};
use crate::yaml::Node;
use indexmap::IndexMap;
use std::borrow::Cow;
use std::f64::consts::TAU;

/// The prescribed motion of a body, which is then a moving ground: torques do not move it.
#[derive(Debug, Clone, PartialEq)]
pub struct BodyMotion {
    /// The body.
    pub body: usize,
    /// How it moves.
    pub course: BodyCourse,
}

/// How a body with prescribed motion moves.
#[derive(Debug, Clone, PartialEq)]
pub enum BodyCourse {
    /// Relative to the phase of the base order: the same at every speed of the reference.
    PerPhase {
        /// Angle per phase \[rad/rad; m/rad of a translating mass\].
        slope: Periodic,
        /// Mean deviation from even rotation \[rad; m\]. It counts only where the frame or other motions hold the train.
        offset: f64,
    },
    /// Speed over the phase of the base order \[rad/s; m/s\]: the same at every frequency. Its mean does not count.
    Speed(Periodic),
    /// Speed over time \[rad/s; m/s\], without jumps.
    Timed(BrokenLine),
}

/// A measured mean speed may differ by this factor from that of the reference: the irregularity is taken over.
const FACTOR: f64 = 5.0;
/// Mean speeds that differ by more are worth a note.
const NOTED: f64 = 0.02;
/// An angle that swings more looks like the angle itself, not its deviation from even rotation.
const LARGEST_SWING: f64 = 1.0;
/// Most orders of the cycle that are kept of a measured angle.
const MOST_ORDERS: usize = 2048;

/// All motions of a train, with notes: `motion` of a body, or beside its loads.
pub(super) fn motions(
    root: &Fields<'_>,
    bodies: &Bodies,
    mean: Option<&MeanMotion>,
    orders: &mut Orders<'_>,
    mistakes: &mut Mistakes,
) -> (Vec<BodyMotion>, Vec<String>) {
    let (mut list, mut notes) = (Vec::new(), Vec::new());
    for (number, (name, body)) in bodies.iter().enumerate() {
        let places = ["bodies", "loads"].map(|key| format!("{key}.{name}.motion"));
        let is_given = |path: &String| root.node.at(path).is_some_and(|node| !node.is_null());
        let (Some(path), Some(body)) = (places.into_iter().find(is_given), body) else {
            continue;
        };
        let Some(node) = root.node.at(&path) else {
            continue;
        };
        let ratio = mean.map_or(0.0, |motion| {
            motion.speed.signum() * fraction::to_f64(&motion.ratios[number])
        });
        let turning = TurningBody {
            kind: body.motion,
            ratio,
            speed: mean.map_or(0.0, |motion| motion.speed.abs()),
        };
        let before = mistakes.count();
        match course(node, &path, &turning, orders, mistakes) {
            Some((course, said)) => {
                list.push(BodyMotion {
                    body: number,
                    course,
                });
                notes.extend(said);
            }
            None if mistakes.count() == before => {
                let message = "cannot be read";
                mistakes.add(Diagnostic::at(node, &path, message));
            }
            None => {}
        }
    }
    (list, notes)
}

/// Loads that act on a body whose motion is prescribed, and bodies of which the train cannot find the torque.
pub(super) fn refuse_loads(
    root: &Fields<'_>,
    bodies: &Bodies,
    motions: &[BodyMotion],
    loads: &IndexMap<String, Load>,
    mistakes: &mut Mistakes,
) {
    for motion in motions {
        let Some((name, _)) = bodies.get_index(motion.body) else {
            continue;
        };
        if loads.contains_key(name) {
            let path = format!("loads.{name}");
            let node = root.node.at(&path).unwrap_or(root.node);
            let message = format!(
                "moves nothing: the motion of `{name}` is prescribed, and its torque follows from it"
            );
            let help = "leave out the load or the motion";
            mistakes.add(Diagnostic::at(node, &path, message).with_help(help));
        }
    }
}

/// What the train says of a body.
struct TurningBody {
    kind: Motion,
    /// Mean speed over the frequency of the reference, with its sign; 0 where nothing is known of it.
    ratio: f64,
    /// Frequency of the reference \[rad/s\].
    speed: f64,
}

/// What a column measures.
#[derive(Clone, Copy, PartialEq)]
enum Quality {
    Speed,
    Angle,
}

impl TurningBody {
    fn dimension(&self, quality: Quality) -> UnitDimension {
        match (self.kind, quality) {
            (Motion::Rotation, Quality::Speed) => UnitDimension::FREQUENCY,
            (Motion::Rotation, Quality::Angle) => UnitDimension::ANGLE,
            (Motion::Translation, Quality::Speed) => UnitDimension::VELOCITY,
            (Motion::Translation, Quality::Angle) => UnitDimension::LENGTH,
        }
    }

    /// From the unit of the column or of the first number: an angle (a length), else a speed.
    fn quality(&self, node: &Node) -> Quality {
        let text = node.get("unit").and_then(|unit| unit.as_text("").ok());
        let of_unit = text.and_then(|text| Quantity::parse(&format!("1 {text}")).ok());
        let first = |node: &Node, k: usize| node.as_list("").ok().and_then(|l| l.get(k).cloned());
        let written = of_unit.or_else(|| {
            let values = node.get("values").and_then(|list| first(list, 0));
            let points = || first(&first(node.get("points")?, 0)?, 1);
            Quantity::from_node(&values.or_else(points)?, "").ok()
        });
        match written.and_then(|quantity| quantity.dimension) {
            Some(found) if found == self.dimension(Quality::Angle) => Quality::Angle,
            _ => Quality::Speed,
        }
    }
}

fn course(
    node: &Node,
    path: &str,
    turning: &TurningBody,
    orders: &mut Orders<'_>,
    mistakes: &mut Mistakes,
) -> Option<(BodyCourse, Option<String>)> {
    let quality = turning.quality(node);
    let dimension = turning.dimension(quality);
    if node.get("time").is_some() || node.get("points").is_some() {
        let line = profile(node, path, dimension, mistakes)?;
        return Some((
            BodyCourse::Timed(timed(node, path, (line, quality), mistakes)?),
            None,
        ));
    }
    let (table, said) = cycle((node, path), dimension, &["orders"], orders, mistakes)?;
    let revolutions = orders.revolutions as f64;
    let (course, noted) = match quality {
        Quality::Speed => speed_over_cycle(node, path, (table, turning), revolutions, mistakes)?,
        Quality::Angle => {
            let kept = kept_orders(node, path, &table, mistakes)?;
            angle_over_cycle((table, kept), turning, revolutions, path)
        }
    };
    let said: Vec<String> = said.into_iter().chain(noted).collect();
    Some((course, (!said.is_empty()).then(|| said.join("; "))))
}

/// A measured speed as angle per phase, or as it is where no mean speed is known.
fn speed_over_cycle(
    node: &Node,
    path: &str,
    (table, turning): (Periodic, &TurningBody),
    revolutions: f64,
    mistakes: &mut Mistakes,
) -> Option<(BodyCourse, Option<String>)> {
    let mean = table.mean();
    if turning.ratio == 0.0 {
        return Some((BodyCourse::Speed(table.plus(-mean)), None));
    }
    let wanted = turning.ratio * turning.speed;
    let per_phase = turning.ratio * revolutions;
    // A fluctuation alone: its size belongs to the speed of the reference.
    if mean.abs() <= 1e-6 * wanted.abs() && table.largest() > 0.0 {
        let series = table.plus(-mean).scaled(1.0 / wanted).plus(1.0);
        return Some((per_phase_of(series.scaled(per_phase)), None));
    }
    let share = mean / wanted;
    if !(1.0 / FACTOR..=FACTOR).contains(&share) {
        let rpm = |w: f64| w * 60.0 / TAU;
        let message = format!(
            "its mean is {:.6} rpm, but the reference turns this body at {:.6} rpm",
            rpm(mean),
            rpm(wanted)
        );
        let help = "look at `unit` (rad/s when absent), at the sign, and at `reference`";
        mistakes.add(Diagnostic::at(node, path, message).with_help(help));
        return None;
    }
    let note = ((share - 1.0).abs() > NOTED).then(|| {
        format!(
            "{path}: measured at a mean speed {share:.4} times that of the reference: the irregularity, speed over mean \
             speed, is taken over"
        )
    });
    Some((per_phase_of(table.scaled(per_phase / mean)), note))
}

/// Without a mean deviation, of which a speed says nothing.
fn per_phase_of(slope: Periodic) -> BodyCourse {
    let offset = 0.0;
    BodyCourse::PerPhase { slope, offset }
}

/// A measured deviation from even rotation: the exact orders of its broken line.
fn angle_over_cycle(
    (table, kept): (Periodic, usize),
    turning: &TurningBody,
    revolutions: f64,
    path: &str,
) -> (BodyCourse, Option<String>) {
    let base = table.turns();
    let mut coefficients = vec![0.0; 2 * kept * base + 1];
    table.coefficients(1, &mut coefficients);
    let harmonics = (1..=kept).map(|k| {
        let order = k * base;
        let (sin, cos) = (coefficients[2 * order - 1], coefficients[2 * order]);
        // The derivative with respect to the phase.
        Harmonic {
            order,
            cos: order as f64 * sin,
            sin: -(order as f64) * cos,
        }
    });
    let slope = Periodic::Fourier {
        mean: turning.ratio * revolutions,
        harmonics: harmonics.collect(),
    };
    let offset = table.mean();
    let is_large = turning.kind == Motion::Rotation && table.swing() > LARGEST_SWING;
    let note = is_large.then(|| {
        format!(
            "{path}: the angle swings by {:.3} rad: give the deviation from even rotation, not the angle itself",
            table.swing()
        )
    });
    (BodyCourse::PerPhase { slope, offset }, note)
}

/// Orders of the cycle that a measured angle keeps: all that its rows determine, half their number, or `orders`.
fn kept_orders(
    node: &Node,
    path: &str,
    table: &Periodic,
    mistakes: &mut Mistakes,
) -> Option<usize> {
    let rows = table.kinks().len() / table.turns();
    let most = (rows / 2).max(1);
    let Some(own) = node.get("orders") else {
        return Some(most.min(MOST_ORDERS));
    };
    let found = super::fields::count(own, &format!("{path}.orders"), MOST_ORDERS);
    mistakes.note(found)
}

/// Speed over time; an angle is differentiated.
fn timed(
    node: &Node,
    path: &str,
    (line, quality): (BrokenLine, Quality),
    mistakes: &mut Mistakes,
) -> Option<BrokenLine> {
    let points = line.points();
    if let Some(k) = points.windows(2).position(|pair| pair[1].0 <= pair[0].0) {
        let message = format!(
            "instant {} s appears twice: a measured motion does not jump",
            points[k].0
        );
        mistakes.add(Diagnostic::at(node, path, message));
        return None;
    }
    if quality == Quality::Speed {
        return Some(line);
    }
    let speeds = points.windows(2).map(|pair| {
        let [(t0, x0), (t1, x1)] = [pair[0], pair[1]];
        (0.5 * (t0 + t1), (x1 - x0) / (t1 - t0))
    });
    match BrokenLine::new(speeds.collect()) {
        Ok(line) => Some(line),
        Err(_) => {
            let message = "wanted at least two instants with angles";
            mistakes.add(Diagnostic::at(node, path, message));
            None
        }
    }
}

impl BodyCourse {
    /// Acceleration over time, a line of steps; nothing before the first and after the last instant.
    pub fn acceleration_over_time(&self) -> Option<BrokenLine> {
        let BodyCourse::Timed(speed) = self else {
            return None;
        };
        let (Some(first), Some(last)) = (speed.points().first(), speed.points().last()) else {
            return None;
        };
        let mut points = vec![(first.0, 0.0)];
        for pair in speed.points().windows(2) {
            let [(t0, w0), (t1, w1)] = [pair[0], pair[1]];
            let a = (w1 - w0) / (t1 - t0);
            points.extend([(t0, a), (t1, a)]);
        }
        points.push((last.0, 0.0));
        BrokenLine::new(points).ok()
    }
}

/// Least number of orders of a measured speed whose angle is made of harmonics; the angle of the next one is below 1e-8 of the largest.
const LEAST_ORDERS: usize = 512;

impl BodyCourse {
    /// Deviation from even rotation \[rad; m\] over the phase, made of harmonics; `frequency`: rate of the phase \[rad/s\] at which a speed
    /// was measured, where it is known.
    ///
    /// `None` over time, and for a speed without a frequency.
    pub fn deviation(&self, frequency: Option<f64>) -> Option<Periodic> {
        let (slope, offset) = match self {
            BodyCourse::PerPhase { slope, offset } => (Cow::Borrowed(slope), *offset),
            BodyCourse::Speed(speed) => (Cow::Owned(speed.scaled(1.0 / frequency?)), 0.0),
            BodyCourse::Timed(_) => return None,
        };
        Some(
            slope
                .antiderivative(LEAST_ORDERS..=MOST_ORDERS)
                .plus(offset),
        )
    }
}
