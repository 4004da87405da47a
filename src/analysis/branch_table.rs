//! Branches as tables and figures: the columns of a frequency response.

use super::columns::{float, integer, text};
use super::response::{Method, Swept};
use super::{Setting, rattle};
use crate::postprocess::effective_stiffness::natural_frequencies;
use crate::postprocess::floquet_estimate::averaged_multipliers;
use crate::postprocess::measures::{Measures, Meter};
use crate::report::Table;
use crate::solve::attractor::Label;
use crate::solve::branch::{BranchPoint, Recorder, Stability};
use crate::solve::events::BifurcationEvent;
use crate::solve::orbit::Orbit;
use crate::system::System;

/// Records the measures of every connection and the effective frequencies, nondimensional; then the rattle metrics; last, where
/// stability is asked for, the estimated multipliers.
pub struct MeasureRecorder<'a> {
    meter: Meter,
    swept: &'a Swept<'a>,
    points: usize,
    estimates_multipliers: bool,
    /// Connections whose contact pulled somewhere on the branch.
    pub pulling: Vec<bool>,
}

/// Values recorded a connection, in the order of [`MeasureRecorder`].
const PER_CONNECTION: usize = 12;

impl<'a> MeasureRecorder<'a> {
    /// A recorder for orbits of so many samples.
    pub fn new(swept: &'a Swept<'a>, samples: usize) -> Self {
        let pulling = vec![false; swept.setting.assembly.connections.len()];
        MeasureRecorder {
            meter: Meter::new(samples),
            swept,
            points: 0,
            estimates_multipliers: false,
            pulling,
        }
    }

    /// The same, with the averaged estimate of the multipliers at every point.
    pub fn with_multiplier_estimates(self) -> Self {
        MeasureRecorder {
            estimates_multipliers: true,
            ..self
        }
    }
}

impl Recorder for MeasureRecorder<'_> {
    fn record(&mut self, lambda: f64, system: &System, orbit: &Orbit, values: &mut Vec<f64>) {
        let mut measures = self.meter.measure(system, orbit);
        let here = self.swept.here(lambda);
        for (m, stiffening) in measures.iter_mut().zip(&here.stiffening) {
            // The law is in units of its own stiffness, the report in those of the stiffness as written.
            m.scale_force(*stiffening);
        }
        let mut slopes = Vec::with_capacity(measures.len());
        for (m, pulling) in measures.iter().zip(&mut self.pulling) {
            let Measures {
                mean,
                rms,
                min,
                max,
                rms_velocity,
                ..
            } = *m;
            let stiffness =
                [m.effective_stiffness, m.effective_stiffness_dc].map(|k| k.unwrap_or(f64::NAN));
            values.extend([mean, rms, min, max, rms_velocity]);
            values.extend(stiffness);
            values.extend([
                m.contacts.ratio(),
                m.contacts.impacts(),
                m.force_mean,
                m.force_max,
                m.force_std,
            ]);
            slopes.push(m.effective_stiffness.unwrap_or(m.mean_slope));
            *pulling |= m.pulls;
        }
        values.extend(natural_frequencies(system, &slopes));
        rattle::record(
            self.swept.setting,
            &here,
            (system, orbit),
            &measures,
            values,
        );
        if self.estimates_multipliers {
            let means = measures.iter().map(|m| [m.mean_slope, m.mean_damping]);
            let list = averaged_multipliers(system, &means.collect::<Vec<_>>());
            values.extend(list.iter().flat_map(|mu| [mu.re, mu.im]));
        }
    }

    fn accept(&mut self, point: &BranchPoint) -> bool {
        self.points += 1;
        let (from, to) = self.swept.range;
        let share = ((point.lambda - from) / (to - from)).clamp(0.0, 1.0);
        let words = format!(
            "point {} at {}",
            self.points,
            self.swept.place(point.lambda)
        );
        let Setting { name, control, .. } = self.swept.setting;
        control.progress(name, share, &words);
        !control.is_interrupted()
    }
}

/// A recorded column: its name, unit, and the factor from nondimensional to reported values.
pub(super) struct Recorded {
    pub name: String,
    pub unit: String,
    pub factor: f64,
}

/// Names, units and factors of the recorded values, in their order.
pub(super) fn recorded_columns(setting: &Setting<'_>) -> Vec<Recorded> {
    let scales = &setting.assembly.scales;
    let is_si = setting.is_si();
    let mut list = Vec::new();
    for (e, connection) in setting.assembly.connections.iter().enumerate() {
        let (x, force) = setting.model.units_of(e);
        let (l, w, k) = (
            scales.displacement[e],
            scales.frequency,
            scales.stiffness[e],
        );
        for (name, unit, factor) in [
            ("mean", x.to_string(), l),
            ("rms", x.to_string(), l),
            ("min", x.to_string(), l),
            ("max", x.to_string(), l),
            ("rms_velocity", format!("{x}/s"), l * w),
            ("effective_stiffness", String::new(), 1.0),
            ("effective_stiffness_dc", String::new(), 1.0),
            ("contact_ratio", String::new(), 1.0),
            ("impacts", String::new(), 1.0),
            ("force_mean", force.to_string(), k * l),
            ("force_max", force.to_string(), k * l),
            ("force_std", force.to_string(), k * l),
        ] {
            let name = format!("{name}.{connection}");
            list.push(if is_si {
                Recorded { name, unit, factor }
            } else {
                Recorded {
                    name,
                    unit: String::new(),
                    factor: 1.0,
                }
            });
        }
    }
    debug_assert_eq!(
        list.len(),
        PER_CONNECTION * setting.assembly.connections.len()
    );
    for i in 1..=setting.assembly.system.dof() {
        let (unit, factor) = if is_si {
            ("Hz", scales.frequency / std::f64::consts::TAU)
        } else {
            ("", 1.0)
        };
        list.push(Recorded {
            name: format!("effective_frequency.{i}"),
            unit: unit.into(),
            factor,
        });
    }
    list
}

/// What one method delivered.
pub struct Traced<'a> {
    /// Points in their order.
    pub points: &'a [BranchPoint],
    /// Events in their order.
    pub events: &'a [BifurcationEvent],
    /// Kinds of the attractors, one a point; none for branches of periodic solutions.
    pub labels: &'a [Label],
    /// How the points were computed.
    pub method: Method,
}

/// The main table: one row a point.
pub fn points(swept: &Swept<'_>, traced: &[Traced<'_>]) -> Table {
    let setting = swept.setting;
    let rows: Vec<(usize, usize, &Traced<'_>, &BranchPoint)> = traced
        .iter()
        .enumerate()
        .flat_map(|(b, t)| {
            let points = t.points.iter().enumerate();
            points.map(move |(p, point)| (b, p, t, point))
        })
        .collect();
    let hertz = setting.assembly.scales.frequency / std::f64::consts::TAU;
    let of =
        |f: &dyn Fn(&BranchPoint) -> f64| rows.iter().map(|row| f(row.3)).collect::<Vec<f64>>();
    let stable = |p: &BranchPoint| match p.stability {
        Stability::Stable => 1.0,
        Stability::Unstable => 0.0,
        Stability::Unknown => f64::NAN,
    };
    let mut columns = vec![
        integer("branch", rows.iter().map(|r| r.0 as i64).collect()),
        integer("point", rows.iter().map(|r| r.1 as i64).collect()),
        integer(
            "mark",
            rows.iter().map(|r| i64::from(r.3.is_mark)).collect(),
        ),
        text(
            "method",
            rows.iter().map(|r| r.2.method.word().into()).collect(),
        ),
        float("omega", "", of(&|p| p.frequency)),
    ];
    if setting.is_si() {
        columns.push(float("frequency_hz", "Hz", of(&|p| p.frequency * hertz)));
    }
    columns.push(float(
        "parameter",
        &swept.unit,
        of(&|p| swept.value(p.lambda)),
    ));
    columns.push(float("stable", "", of(&stable)));
    columns.push(float(
        "multiplier_modulus",
        "",
        of(&|p| p.multipliers.first().map_or(f64::NAN, |mu| mu.norm())),
    ));
    columns.push(integer(
        "iterations",
        rows.iter().map(|r| r.3.newton.iterations as i64).collect(),
    ));
    columns.push(float("residual", "", of(&|p| p.newton.residual_norm)));
    for (k, Recorded { name, unit, factor }) in recorded_columns(setting).into_iter().enumerate() {
        columns.push(float(name, unit, of(&|p| p.recorded[k] * factor)));
    }
    if traced.iter().any(|t| t.method == Method::Integration) {
        let label = |(_, p, t, _): &(usize, usize, &Traced<'_>, &BranchPoint)| {
            t.labels.get(*p).map_or(String::new(), Label::to_string)
        };
        columns.push(text("label", rows.iter().map(label).collect()));
    }
    Table {
        name: String::new(),
        columns,
    }
}

/// Rattle metrics, one row a point.
pub fn rattle(swept: &Swept<'_>, traced: &[Traced<'_>]) -> Table {
    rattle::table(swept, traced, recorded_columns(swept.setting).len())
}
