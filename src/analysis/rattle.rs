//! Rattle metrics along branches: the table `rattle`, one row a point. What the columns mean stands in docs/rattle.md.

use super::Setting;
use super::branch_table::Traced;
use super::columns::{Quantity, accelerations, float, integer};
use super::response::{Here, Swept};
use crate::assembly::Assembly;
use crate::model::{Model, Structure};
use crate::numeric::periodic::Periodic;
use crate::numeric::roots;
use crate::postprocess::contacts::effective_mass;
use crate::postprocess::measures::{Measures, is_clearance};
use crate::report::Table;
use crate::solve::branch::BranchPoint;
use crate::solve::orbit::Orbit;
use crate::system::System;
use std::f64::consts::TAU;

/// What a metric of a connection is measured in.
#[derive(Clone, Copy)]
enum Kind {
    Number,
    Rate,
    Force,
    Energy,
    /// A whole number.
    Code,
}

/// Metrics of a connection, in the order in which they are recorded.
const METRICS: [(&str, Kind); 17] = [
    ("contact_ratio", Kind::Number),
    ("contact_loss", Kind::Number),
    ("contact_front", Kind::Number),
    ("contact_back", Kind::Number),
    ("impacts", Kind::Number),
    ("impacts_front", Kind::Number),
    ("impacts_back", Kind::Number),
    ("impact_velocity_max", Kind::Rate),
    ("impact_velocity_mean", Kind::Rate),
    ("impact_energy_max", Kind::Energy),
    ("impact_energy", Kind::Energy),
    ("regime", Kind::Code),
    ("force_mean", Kind::Force),
    ("force_std", Kind::Force),
    ("force_min", Kind::Force),
    ("force_peak", Kind::Force),
    ("force_peak_factor", Kind::Number),
];

/// Appends the metrics of every connection, nondimensional, the peak acceleration of every body, SI, and the rattle index of
/// every loose one. `here`: the model at this point; `measures`: with forces in units of the model as written.
pub(super) fn record(
    setting: &Setting<'_>,
    here: &Here<'_>,
    (system, orbit): (&System, &Orbit),
    measures: &[Measures],
    values: &mut Vec<f64>,
) {
    for (e, (m, stiffening)) in measures.iter().zip(&here.stiffening).enumerate() {
        let mass = effective_mass(system, e).map(|mass| mass * stiffening);
        values.extend(metrics(m, mass));
    }
    let peaks = peak_accelerations(&here.assembly, system, orbit);
    let loose = loose_bodies(setting);
    let indices = loose.iter().map(|body| body.index(&here.model, &peaks));
    let indices: Vec<f64> = indices.collect();
    values.extend(peaks.into_iter().chain(indices));
}

fn metrics(m: &Measures, mass: Option<f64>) -> [f64; METRICS.len()] {
    let contacts = &m.contacts;
    let has_impacts = contacts.impacts() > 0.0;
    let empty_without = |x: f64| if has_impacts { x } else { f64::NAN };
    let half_mass = 0.5 * mass.unwrap_or(f64::NAN);
    let peak = m.force_max.abs().max(m.force_min.abs());
    let force_rms = m.force_mean.hypot(m.force_std);
    [
        contacts.ratio(),
        1.0 - contacts.ratio(),
        contacts.front.share,
        contacts.back.share,
        contacts.impacts(),
        contacts.front.impacts,
        contacts.back.impacts,
        empty_without(contacts.speed_max),
        contacts.speed_mean().unwrap_or(f64::NAN),
        empty_without(half_mass * contacts.speed_max * contacts.speed_max),
        half_mass * contacts.speed_square_sum,
        f64::from(contacts.regime().code()),
        m.force_mean,
        m.force_std,
        m.force_min,
        peak,
        peak / force_rms,
    ]
}

/// Instants a response period, and at least so many an excitation period, at which accelerations are looked at before the
/// largest is refined between its neighbours.
const INSTANTS: usize = 512;
const INSTANTS_PER_EXCITATION: usize = 64;

/// Largest modulus of the acceleration of every body over one response period, SI; none for reduced systems.
fn peak_accelerations(assembly: &Assembly, system: &System, orbit: &Orbit) -> Vec<f64> {
    let (mut state, mut scratch) = (vec![0.0; 2 * system.dof()], system.scratch());
    let mut at = |tau: f64| -> Vec<f64> {
        orbit.state(tau, &mut state);
        let list = assembly.body_accelerations(system, tau, &state, &mut scratch);
        list.unwrap_or_default()
    };
    let count = INSTANTS.max(INSTANTS_PER_EXCITATION * system.subharmonic());
    let width = TAU / count as f64;
    let mut best = vec![(0.0, 0.0); at(0.0).len()];
    if best.is_empty() {
        return Vec::new();
    }
    for k in 0..count {
        let tau = k as f64 * width;
        for (best, acceleration) in best.iter_mut().zip(at(tau)) {
            if acceleration.abs() > best.1 {
                *best = (tau, acceleration.abs());
            }
        }
    }
    let mut refined = Vec::with_capacity(best.len());
    for (body, (tau, sampled)) in best.into_iter().enumerate() {
        let top = roots::maximum(|x| at(x)[body].abs(), (tau - width, tau + width));
        refined.push(at(top)[body].abs().max(sampled));
    }
    refined
}

/// A body that only clearances hold, driven by no alternating load of its own: it rattles when its inertia demands more
/// than its drag torque.
struct LooseBody<'a> {
    number: usize,
    name: &'a str,
}

impl LooseBody<'_> {
    /// Inertia times the peak acceleration over the modulus of the mean load.
    fn index(&self, model: &Model, peaks: &[f64]) -> f64 {
        let Structure::Train(train) = &model.structure else {
            return f64::NAN;
        };
        let drag = train.loads.get(self.name).map_or(0.0, |load| load.mean());
        train.bodies[self.number].inertia * peaks[self.number] / drag.abs()
    }
}

/// Loose bodies with a drag torque, in the model as written.
fn loose_bodies<'a>(setting: &Setting<'a>) -> Vec<LooseBody<'a>> {
    let Structure::Train(train) = &setting.model.structure else {
        return Vec::new();
    };
    let mounts = setting.assembly.system.mounts();
    let is_held = |body: usize| {
        let connections = train.connections.values().zip(mounts);
        let mut own = connections.filter(|(c, _)| c.arms.iter().any(|(b, _)| *b == body));
        own.any(|(_, mount)| !is_clearance(mount.element.as_ref()))
    };
    let loose = |(number, name): (usize, &'a String)| {
        let load = train.loads.get(name)?;
        let is_loose =
            load.mean() != 0.0 && load.parts().all(Periodic::is_constant) && !is_held(number);
        is_loose.then_some(LooseBody { number, name })
    };
    train.bodies.keys().enumerate().filter_map(loose).collect()
}

/// The table. `first`: where the values of [`record`] begin among the recorded ones.
pub(super) fn table(swept: &Swept<'_>, traced: &[Traced<'_>], first: usize) -> Table {
    let setting = swept.setting;
    let rows: Vec<(usize, usize, &BranchPoint)> = (traced.iter().enumerate())
        .flat_map(|(b, t)| {
            let points = t.points.iter().enumerate();
            points.map(move |(p, point)| (b, p, point))
        })
        .collect();
    let of = |f: &dyn Fn(&BranchPoint) -> f64| rows.iter().map(|r| f(r.2)).collect::<Vec<f64>>();
    let mut columns = vec![
        integer("branch", rows.iter().map(|r| r.0 as i64).collect()),
        integer("point", rows.iter().map(|r| r.1 as i64).collect()),
        float("omega", "", of(&|p| p.frequency)),
    ];
    if setting.is_si() {
        let hertz = setting.assembly.scales.frequency / TAU;
        columns.push(float("frequency_hz", "Hz", of(&|p| p.frequency * hertz)));
    }
    let parameter = of(&|p| swept.value(p.lambda));
    columns.push(float("parameter", &swept.unit, parameter));
    let mut next = first;
    for (e, connection) in setting.assembly.connections.iter().enumerate() {
        for (metric, kind) in METRICS {
            let (unit, factor) = scale(setting, e, kind);
            let name = format!("{metric}.{connection}");
            let values = of(&|p| p.recorded[next] * factor);
            columns.push(match kind {
                Kind::Code => integer(&name, values.into_iter().map(|x| x as i64).collect()),
                _ => float(name, unit, values),
            });
            next += 1;
        }
    }
    for quantity in bodies(setting) {
        columns.push(quantity.column(of(&|p| p.recorded[next])));
        next += 1;
    }
    Table {
        name: "rattle".into(),
        columns,
    }
}

/// Unit and factor from nondimensional to reported values.
fn scale(setting: &Setting<'_>, connection: usize, kind: Kind) -> (String, f64) {
    let scales = &setting.assembly.scales;
    let (l, w, k) = (
        scales.displacement[connection],
        scales.frequency,
        scales.stiffness[connection],
    );
    let (x, force) = setting.model.units_of(connection);
    match kind {
        Kind::Rate if setting.is_si() => (format!("{x}/s"), l * w),
        Kind::Force if setting.is_si() => (force.to_string(), k * l),
        Kind::Energy if setting.is_si() => ("J".into(), k * l * l),
        _ => (String::new(), 1.0),
    }
}

/// Peak accelerations of the bodies, and rattle indices of the loose ones.
fn bodies(setting: &Setting<'_>) -> Vec<Quantity> {
    let mut list: Vec<Quantity> = accelerations(setting)
        .into_iter()
        .map(|quantity| Quantity {
            name: format!("peak_{}", quantity.name),
            ..quantity
        })
        .collect();
    list.extend(loose_bodies(setting).iter().map(|body| Quantity {
        name: format!("rattle_index.{}", body.name),
        unit: String::new(),
        factor: 1.0,
    }));
    list
}
