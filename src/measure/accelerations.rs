//! Peak accelerations of the bodies along an orbit, and the rattle index that follows from them.
//!
//! The motion is sampled once for all bodies; where the samples of a body show a peak that may be its largest, the search
//! evaluates that body alone, from the two or three connections that act on it. The cost grows with the number of bodies.

use super::{ColumnHeading, Measure, ReportedUnits, Solved};
use crate::assembly::{Action, Anchor, Assembly, Torque};
use crate::element::ResponseSeries;
use crate::model::{Load, Model, Structure};
use crate::numeric::fourier::Fourier;
use crate::numeric::{roots, trigonometric};
use crate::postprocess::connection::is_clearance;
use crate::solve::galerkin::march::{self, MarchTrack};
use crate::solve::orbit::Orbit;
use crate::system::{LoadKind, Moment, System};
use std::f64::consts::TAU;

/// Instants per response period at which a motion is sampled: short impacts must not fall between two of them.
const INSTANTS: usize = 512;
/// At least this many per excitation period,
const INSTANTS_PER_EXCITATION: usize = 64;
/// and this many per harmonic of a Fourier series.
const INSTANTS_PER_HARMONIC: usize = 16;
/// Rounding of an acceleration, relative to the sum of what acts on the body.
const ROUNDING: f64 = 8.0 * f64::EPSILON;
/// Accelerations below this many times their rounding are noise, whose peaks are not refined.
const NOISE: f64 = 1e3;

/// `peak_acceleration.<body>..`, then `rattle_index.<body>..` of the loose bodies.
#[derive(Debug)]
pub(crate) struct PeakAccelerations {
    accelerometer: Accelerometer,
    loose: Vec<LooseBody>,
}

impl PeakAccelerations {
    /// Measures of the bodies of a model as written.
    pub fn new(model: &Model, assembly: &Assembly) -> PeakAccelerations {
        PeakAccelerations {
            accelerometer: Accelerometer::default(),
            loose: loose_bodies(model, assembly),
        }
    }
}

impl Measure for PeakAccelerations {
    fn headings(&self, units: &ReportedUnits<'_>) -> Vec<ColumnHeading> {
        let mut list = units.accelerations("peak_acceleration");
        let index = |body: &LooseBody| ColumnHeading::number(format!("rattle_index.{}", body.name));
        list.extend(self.loose.iter().map(index));
        list
    }

    fn measure(&mut self, at: &Solved<'_>, out: &mut Vec<f64>) {
        let peaks = self.accelerometer.peaks(at.assembly, at.system, at.orbit);
        out.extend(&peaks);
        out.extend(self.loose.iter().map(|body| body.index(at.model, &peaks)));
    }
}

/// A body that only clearances hold, driven by no alternating load of its own: it rattles when its inertia demands more
/// than its drag torque.
#[derive(Debug)]
struct LooseBody {
    number: usize,
    name: String,
}

impl LooseBody {
    /// Inertia times the peak acceleration over the modulus of the mean load.
    fn index(&self, model: &Model, peaks: &[f64]) -> f64 {
        let Structure::Train(train) = &model.structure else {
            return f64::NAN;
        };
        let load = train.loads.get(&self.name);
        let drag = load.map_or(0.0, Load::mean_torque);
        train.bodies[self.number].inertia * peaks[self.number] / drag.abs()
    }
}

/// Loose bodies with a drag torque.
fn loose_bodies(model: &Model, assembly: &Assembly) -> Vec<LooseBody> {
    let Structure::Train(train) = &model.structure else {
        return Vec::new();
    };
    let mounts = assembly.system.mounts();
    let is_held = |body: usize| {
        let connections = train.connections.values().zip(mounts);
        let mut own = connections.filter(|(c, _)| c.arms.iter().any(|(b, _)| *b == body));
        own.any(|(_, mount)| !is_clearance(mount.element.as_ref()))
    };
    let loose = |(number, name): (usize, &String)| {
        let load = train.loads.get(name)?;
        let is_loose = load.mean_torque() != 0.0 && load.is_constant() && !is_held(number);
        is_loose.then(|| LooseBody {
            number,
            name: name.clone(),
        })
    };
    train.bodies.keys().enumerate().filter_map(loose).collect()
}

/// Finds peak accelerations; owns its buffers.
#[derive(Debug, Default)]
struct Accelerometer {
    fourier: Option<Fourier>,
    /// Coordinates and their rates, n lists of instants each.
    q: Vec<f64>,
    v: Vec<f64>,
    /// What laws remember, a list per number, along orbits that have it.
    z: Vec<f64>,
    /// Forces of the connections, e lists.
    force: Vec<f64>,
    phase: Vec<f64>,
    deformation: Vec<f64>,
    rate: Vec<f64>,
    slopes: [Vec<f64>; 2],
    acceleration: Vec<f64>,
}

impl Accelerometer {
    /// Largest modulus of the acceleration of every body over one response period, SI; none for reduced systems.
    fn peaks(&mut self, assembly: &Assembly, system: &System, orbit: &Orbit) -> Vec<f64> {
        let Some(anchor) = &assembly.anchor else {
            return Vec::new();
        };
        self.sample(system, orbit);
        let tracks = match orbit {
            Orbit::Fourier(orbit) => march::tracks_of_each(system, orbit),
            Orbit::Segments(_) => Vec::new(),
        };
        self.respond(system, &tracks);
        let motion = BodyForces {
            assembly,
            anchor,
            system,
            orbit,
            tracks,
        };
        let bodies = 0..anchor.bodies.len();
        bodies
            .map(|body| {
                // Impulses have no largest acceleration.
                let is_struck = |(_, action): (f64, Action<'_>)| match action {
                    Action::Force(k) => system.mounts()[k].element.least_impact().is_some(),
                    _ => false,
                };
                if anchor.actions(body).any(is_struck) {
                    return f64::NAN;
                }
                let rounding = ROUNDING * self.accelerate(&motion, body);
                let largest = self.acceleration.iter().fold(0.0_f64, |m, a| m.max(*a));
                if largest <= NOISE * rounding {
                    return largest;
                }
                let acceleration = |tau: f64| motion.acceleration(body, tau).abs();
                peak(&self.acceleration, largest, rounding, acceleration)
            })
            .collect()
    }

    /// Coordinates and rates at equally spaced instants.
    fn sample(&mut self, system: &System, orbit: &Orbit) {
        let (n, nu) = (system.dof(), system.subharmonic());
        let harmonics = match orbit {
            Orbit::Fourier(orbit) => orbit.harmonics(),
            Orbit::Segments(_) => 0,
        };
        let count = INSTANTS
            .max(INSTANTS_PER_EXCITATION * nu)
            .max(INSTANTS_PER_HARMONIC * harmonics)
            .next_power_of_two();
        let width = TAU / count as f64;
        self.phase.clear();
        self.phase
            .extend((0..count).map(|j| nu as f64 * (j as f64 * width)));
        self.q.resize(n * count, 0.0);
        self.v.resize(n * count, 0.0);
        match orbit {
            Orbit::Segments(orbit) => {
                let mut state = vec![0.0; system.state_size()];
                self.z.resize(system.memory_count() * count, 0.0);
                for j in 0..count {
                    orbit.state(j as f64 * width, &mut state);
                    for (m, z) in state[2 * n..].iter().enumerate() {
                        self.z[m * count + j] = *z;
                    }
                    for i in 0..n {
                        (self.q[i * count + j], self.v[i * count + j]) = (state[i], state[n + i]);
                    }
                }
            }
            Orbit::Fourier(orbit) => {
                let fourier = match &mut self.fourier {
                    Some(fourier) if fourier.samples() == count => fourier,
                    other => other.insert(Fourier::new(count)),
                };
                let mut derivative = vec![0.0; 2 * harmonics + 1];
                let lists = self.q.chunks_exact_mut(count);
                let lists = lists.zip(self.v.chunks_exact_mut(count));
                for (a, (q, v)) in orbit.coefficients.iter().zip(lists) {
                    fourier.to_samples(a, q);
                    trigonometric::differentiate(a, &mut derivative);
                    derivative.iter_mut().for_each(|d| *d *= orbit.omega);
                    fourier.to_samples(&derivative, v);
                }
            }
        }
    }

    /// Forces of the connections at these instants.
    fn respond(&mut self, system: &System, tracks: &[Vec<MarchTrack>]) {
        let (count, frequency) = (self.phase.len(), system.excitation_frequency());
        self.force.resize(system.element_count() * count, 0.0);
        for buffer in self.slopes.iter_mut() {
            buffer.resize(count, 0.0);
        }
        let mounts = system.mounts().iter().enumerate();
        for ((k, mount), force) in mounts.zip(self.force.chunks_exact_mut(count)) {
            self.deformation.clear();
            self.deformation.resize(count, 0.0);
            self.rate.clear();
            self.rate.resize(count, 0.0);
            for (i, w) in system.element_map_row(k) {
                let part = i * count..(i + 1) * count;
                add(&mut self.deformation, *w, &self.q[part.clone()]);
                add(&mut self.rate, *w, &self.v[part]);
            }
            if mount.transmission_error.is_some() {
                let motion = self.deformation.iter_mut().zip(&mut self.rate);
                for ((x, rate), phase) in motion.zip(&self.phase) {
                    [*x, *rate] = mount.deformation([*x, *rate], *phase, frequency);
                }
            }
            let [df_dq, df_dv] = &mut self.slopes;
            let out = ResponseSeries {
                f: force,
                df_dq,
                df_dv,
            };
            let (x, rate) = (&self.deformation, &self.rate);
            match (mount.element.memory_count(), tracks.get(k)) {
                (0, _) => mount.element.eval_many(x, rate, &self.phase, out),
                (_, Some(tracks)) => {
                    for (j, f) in out.f.iter_mut().enumerate() {
                        let tau = TAU * j as f64 / count as f64;
                        let motion = [x[j], rate[j], self.phase[j]];
                        *f = march::response(tracks, system, tau, motion).f;
                    }
                }
                (memories, None) => {
                    let mut memory = vec![0.0; memories];
                    for j in 0..count {
                        for (z, m) in memory.iter_mut().zip(system.memory_of(k)) {
                            *z = self.z[m * count + j];
                        }
                        let law = &mount.element;
                        out.f[j] = law.respond(x[j], rate[j], self.phase[j], &memory).f;
                    }
                }
            }
            if let Some(variation) = &mount.stiffness_variation {
                let values = force.iter_mut().zip(&self.phase);
                values.for_each(|(f, phase)| *f *= variation.value(*phase));
            }
        }
    }

    /// Modulus of the acceleration of one body at these instants; returns the sum of its parts at the
    /// first one.
    fn accelerate(&mut self, motion: &BodyForces<'_>, body: usize) -> f64 {
        let (assembly, count) = (motion.assembly, self.phase.len());
        let list = |k: usize| k * count..(k + 1) * count;
        self.acceleration.clear();
        self.acceleration.resize(count, 0.0);
        let out = &mut self.acceleration;
        let mut size = 0.0;
        for (factor, action) in motion.anchor.actions(body) {
            match action {
                Action::Rate(i) => {
                    let scale = factor * assembly.rate_scale(i);
                    size += add(out, scale, &self.v[list(i)]);
                }
                Action::Force(k) => {
                    let scale = factor * assembly.force_scale(k);
                    size += add(out, scale, &self.force[list(k)]);
                }
                Action::Load(torque)
                    if torque.kind == LoadKind::Value && torque.series.is_constant() =>
                {
                    let load = factor * torque.series.mean();
                    out.iter_mut().for_each(|a| *a += load);
                    size += load.abs();
                }
                Action::Load(_) | Action::Dashpot(..) => {
                    for (a, phase) in out.iter_mut().zip(&self.phase) {
                        *a += factor * motion.value(action, *phase);
                    }
                }
            }
        }
        let inertia = motion.anchor.inertia(body);
        out.iter_mut().for_each(|a| *a = (*a / inertia).abs());
        size / inertia
    }
}

/// sum += factor values; returns the modulus of the first term.
fn add(sum: &mut [f64], factor: f64, values: &[f64]) -> f64 {
    for (sum, value) in sum.iter_mut().zip(values) {
        *sum += factor * value;
    }
    values.first().map_or(0.0, |value| (factor * value).abs())
}

/// Largest value of a function of tau from its samples over a period, `largest` among them; `rounding`: of its values. Between
/// two samples it may rise above the larger one by as much as it has risen up to there: the peaks of the samples that
/// may so become the largest are looked at closely.
fn peak(samples: &[f64], mut largest: f64, rounding: f64, f: impl Fn(f64) -> f64) -> f64 {
    let last = samples.len() - 1;
    let reach = |j: usize| {
        let left = samples[if j == 0 { last } else { j - 1 }];
        let right = samples[if j == last { 0 } else { j + 1 }];
        let here = samples[j];
        let is_peak = here >= left && here > right;
        if is_peak {
            here + (here - left).max(here - right)
        } else {
            0.0
        }
    };
    let width = TAU / samples.len() as f64;
    let mut peaks: Vec<usize> = (0..=last).filter(|j| reach(*j) > largest).collect();
    peaks.sort_by(|a, b| samples[*b].total_cmp(&samples[*a]).then(a.cmp(b)));
    for j in peaks {
        if reach(j) > largest {
            let tau = j as f64 * width;
            let ends = (tau - width, tau + width);
            let top = roots::summit(&f, (tau, samples[j]), ends, rounding);
            largest = largest.max(top);
        }
    }
    largest
}

/// What moves the bodies.
struct BodyForces<'a> {
    assembly: &'a Assembly,
    anchor: &'a Anchor,
    system: &'a System,
    orbit: &'a Orbit,
    /// Along Fourier orbits the stretches of every law with memory.
    tracks: Vec<Vec<MarchTrack>>,
}

impl BodyForces<'_> {
    /// Acceleration of one body.
    fn acceleration(&self, body: usize, tau: f64) -> f64 {
        let phase = self.system.subharmonic() as f64 * tau;
        self.anchor.acceleration(body, |action| match action {
            Action::Rate(i) => self.assembly.rate_scale(i) * self.orbit.coordinate(i, tau)[1],
            Action::Force(k) => self.assembly.force_scale(k) * self.force(k, tau),
            Action::Load(_) | Action::Dashpot(..) => self.value(action, phase),
        })
    }

    /// What acts whatever the motion; 0 for the rest.
    fn value(&self, action: Action<'_>, phase: f64) -> f64 {
        match action {
            Action::Load(Torque { series, kind }) => {
                let at = Moment {
                    phase,
                    ..self.system.moment(0.0)
                };
                self.system.load_value((series, kind), 0.0, &at)
            }
            Action::Dashpot(c, error) => {
                c * self.assembly.si_frequency(self.system) * error.derivative(phase)
            }
            Action::Rate(_) | Action::Force(_) => 0.0,
        }
    }

    /// Force of one connection.
    fn force(&self, connection: usize, tau: f64) -> f64 {
        let (system, mount) = (self.system, &self.system.mounts()[connection]);
        let phase = system.subharmonic() as f64 * tau;
        let row = system.element_map_row(connection).iter();
        let motion = row.fold([0.0; 2], |[x, rate], (i, w)| {
            let [q, v] = self.orbit.coordinate(*i, tau);
            [x + w * q, rate + w * v]
        });
        let [x, rate] = mount.deformation(motion, phase, system.excitation_frequency());
        if mount.element.memory_count() == 0 {
            return mount.respond(x, rate, phase).f;
        }
        if let Some(tracks) = self.tracks.get(connection) {
            let here = march::response(tracks, system, tau, [x, rate, phase]);
            return mount.vary(here, phase).f;
        }
        let mut state = vec![0.0; system.state_size()];
        self.orbit.state(tau, &mut state);
        let memory = &state[2 * system.dof()..][system.memory_of(connection)];
        mount.respond_with([x, rate], phase, memory).f
    }
}
