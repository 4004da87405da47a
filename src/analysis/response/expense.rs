//! What the responses take, and what they are not begun with.

use super::{BranchSettings, Method};
use crate::analysis::cost::{self, Cost, Period};
use crate::analysis::{Fault, Setting, flow};
use crate::machine;

/// Columns of the table besides those of connections and coordinates, and per connection, rattle metrics included.
const COLUMNS: f64 = 12.0;
const PER_CONNECTION: f64 = 24.0;
/// Fewest points that a branch is taken to have.
const FEWEST: f64 = 100.0;
/// Rows of an orbit.
const ORBIT: f64 = 256.0;

impl BranchSettings {
    /// What a run takes; `range`: the ends of the parameter, `slowest`: the lowest excitation frequency, over omega_c.
    pub(in crate::analysis) fn cost(
        &self,
        setting: &Setting<'_>,
        range: (f64, f64),
        slowest: f64,
    ) -> Cost {
        let system = &setting.assembly.system;
        let (n, e) = (system.dof() as f64, system.element_count() as f64);
        let usual = FEWEST.max(2.0 * (range.1 - range.0).abs() / self.max_step);
        let branches = self
            .branches
            .limits()
            .map_or(1.0, |limits| 1.0 + 0.2 * limits.limit as f64);
        let points = branches * usual.min(self.max_points as f64);
        let period = Period::of(setting, slowest);
        let mut sum = Cost::default();
        let mut rows = 0.0;
        for method in self.methods() {
            let (count, part) = match method {
                Method::Galerkin => {
                    let size = self.size();
                    let factor = system.revolutions() as f64;
                    let harmonics = (size.harmonics * self.subharmonic) as f64 * factor;
                    (
                        points,
                        cost::galerkin(system, harmonics, size.samples as f64 * factor, points),
                    )
                }
                Method::Shooting => (
                    points,
                    cost::shooting(period, self.subharmonic as f64, points),
                ),
                Method::Integration => {
                    let count = self.points();
                    let all = flow::cost(self.map_size(), setting, period, count);
                    // A record is dropped as soon as it is summarised.
                    let bytes = all.bytes / count as f64;
                    let key = if all.time_key == "periods" {
                        "points"
                    } else {
                        all.time_key
                    };
                    (
                        count as f64,
                        Cost {
                            bytes,
                            time_key: key,
                            ..all
                        },
                    )
                }
            };
            (rows, sum) = (rows + count, sum.and(part));
        }
        let columns = COLUMNS + PER_CONNECTION * e + 5.0 * n;
        let table = Cost::table(rows, columns, "max_points");
        let kept = if self.orbits.keeps(false) { rows } else { 0.0 };
        let orbits = Cost::table(kept * ORBIT, 3.0 + 3.0 * e, "orbits");
        sum.and(table).and(orbits)
    }

    /// Whether a Galerkin approximation with `harmonics` of the reference fits into memory.
    pub(super) fn fits(&self, setting: &Setting<'_>, harmonics: usize) -> bool {
        let system = &setting.assembly.system;
        let samples = self.size_with(harmonics, self.subharmonic).samples as f64;
        let factor = system.revolutions() as f64;
        let inside = (harmonics * self.subharmonic) as f64 * factor;
        let bytes = cost::galerkin(system, inside, samples * factor, 1.0).bytes;
        let memory = setting.control.memory();
        memory.is_none_or(|most| bytes <= most as f64)
    }

    /// A fault where the highest mode is so much faster than the excitation that a period takes more steps than allowed: most
    /// often the sign of an inertia in a wrong unit.
    pub(in crate::analysis) fn check_steps(
        &self,
        setting: &Setting<'_>,
        slowest: f64,
    ) -> Option<Fault> {
        if self.methods() == [Method::Galerkin] {
            return None;
        }
        let period = Period::of(setting, slowest);
        let steps = period.steps * self.subharmonic as f64;
        (steps > self.max_steps as f64).then(|| {
            let rate = period.stiffness * slowest * setting.assembly.scales.frequency / std::f64::consts::TAU;
            let mode = match setting.assembly.coupling.is_some() {
                true => format!("the fastest motion, {rate:.4e} Hz,"),
                false => "the fastest motion".to_string(),
            };
            let message = format!(
                "a response period takes about {steps:.0} integration steps, more than {}: {mode} is {:.0} times as fast as \
                 the excitation at its slowest. Look for an inertia or a stiffness in a wrong unit; if the model is meant \
                 so, raise `max_steps` (about {} for a branch of 100 points)",
                self.max_steps,
                period.stiffness,
                machine::duration(cost::shooting(period, self.subharmonic as f64, FEWEST).seconds),
            );
            Fault::new("max_steps", message)
        })
    }
}
