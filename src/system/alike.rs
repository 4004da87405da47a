//! Whether two systems are the same: number by number, and in what they do.

use super::{LoadKind, System};
use crate::numeric::growth::Growth;
use crate::numeric::periodic::Periodic;
use nalgebra::DMatrix;

/// Rounding allowed between accelerations, where that of some products adds up.
const ACCELERATION_ROUNDING: f64 = 1e-11;
/// States at which accelerations are compared.
const STATES: usize = 24;

/// Whether two systems have the same accelerations at states on all sides of their breakpoints.
fn moves_alike(a: &System, b: &System) -> bool {
    let n = a.dof();
    let breakpoints = a.mounts().iter().flat_map(|m| m.element.breakpoints());
    let largest = breakpoints.fold(0.0_f64, |m, b| m.max(b.abs()));
    let reach = if largest > 0.0 { 2.0 * largest } else { 1.0 };
    let mut scratch = (a.scratch(), b.scratch());
    let mut out = (vec![0.0; n], vec![0.0; n]);
    (0..STATES).all(|k| {
        // Fractional parts of multiples of irrational numbers: evenly spread, the same every time.
        let spread = |i: usize| 2.0 * ((k * 2 * n + i + 1) as f64 * 0.618_033_988_75).fract() - 1.0;
        let state: Vec<f64> = (0..2 * n).map(|i| reach * spread(i)).collect();
        let tau = std::f64::consts::TAU * k as f64 / STATES as f64;
        a.acceleration(tau, &state, &mut scratch.0, &mut out.0);
        b.acceleration(tau, &state, &mut scratch.1, &mut out.1);
        let size = out.0.iter().fold(0.0_f64, |m, x| m.max(x.abs()));
        let pairs = out.0.iter().zip(&out.1);
        pairs
            .into_iter()
            .all(|(x, y)| (x - y).abs() <= ACCELERATION_ROUNDING * size)
    })
}

/// All numbers of a system, and the lengths of their groups.
fn numbers(system: &System) -> (Vec<f64>, Vec<usize>) {
    let (mut list, mut groups) = (Vec::new(), Vec::new());
    system.clone().visit_numbers(&mut |group| {
        list.extend_from_slice(group);
        groups.push(group.len());
    });
    (list, groups)
}

impl System {
    /// Whether another system has the same numbers and moves in the same way.
    pub fn is_alike(&self, other: &System) -> bool {
        numbers(self) == numbers(other) && moves_alike(self, other)
    }

    /// Offers every number but the frequency, in a fixed order, those of a matrix, a direction or a series together.
    fn visit_numbers(&mut self, visit: &mut dyn FnMut(&mut [f64])) {
        let whole = |matrix: &mut DMatrix<f64>, visit: &mut dyn FnMut(&mut [f64])| {
            visit(matrix.as_mut_slice());
        };
        whole(&mut self.damping, visit);
        whole(&mut self.stiffness, visit);
        whole(&mut self.element_map, visit);
        for mount in &mut self.mounts {
            mount
                .element
                .visit_parameters(&mut |p| visit(std::slice::from_mut(p.value)));
            let series = [
                &mut mount.stiffness_variation,
                &mut mount.transmission_error,
            ];
            for series in series.into_iter().flatten() {
                visit_series(series, visit);
            }
        }
        for load in &mut self.loads {
            visit(load.direction.as_mut_slice());
            visit_series(&mut load.series, visit);
            match &mut load.kind {
                LoadKind::Orders {
                    growth: Growth::Table(line),
                    ..
                }
                | LoadKind::Timed(line) => line.visit_values(visit),
                LoadKind::Orders {
                    growth: Growth::Signed { reference },
                    ..
                } => visit(std::slice::from_mut(reference)),
                LoadKind::Orders {
                    growth: Growth::Power { power, reference },
                    ..
                } => {
                    visit(std::slice::from_mut(power));
                    visit(std::slice::from_mut(reference));
                }
                _ => {}
            }
        }
        if let Some(balance) = &mut self.balance {
            visit(&mut balance.stiffness);
            visit(balance.weight.as_mut_slice());
            (balance.loads.iter_mut()).for_each(|force| visit(force.as_mut_slice()));
        }
    }
}

fn visit_series(series: &mut Periodic, visit: &mut dyn FnMut(&mut [f64])) {
    match series {
        Periodic::Fourier { mean, harmonics } => {
            visit(std::slice::from_mut(mean));
            for h in harmonics {
                let mut pair = [h.cos, h.sin];
                visit(&mut pair);
                [h.cos, h.sin] = pair;
            }
        }
        Periodic::Table { values, .. } | Periodic::Uneven { values, .. } => visit(values),
        Periodic::Rectangular {
            high,
            low,
            duty,
            phase,
            ..
        } => {
            for value in [high, low, duty, phase] {
                visit(std::slice::from_mut(value));
            }
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::element::{Backlash, Cubic, ImpactDampingLaw};
    use crate::numeric::periodic::Harmonic;
    use crate::system::{LoadKind, LoadSource, Mount};
    use nalgebra::DVector;

    fn system(gamma: f64, half_gap: f64, cos: f64) -> System {
        let one = |x| DMatrix::from_element(1, 1, x);
        let law = Backlash {
            half_gap,
            impact_damping: 0.0,
            impact_damping_law: ImpactDampingLaw::Dissipative,
            contact_damping: 0.0,
        };
        let harmonics = vec![Harmonic {
            order: 1,
            cos,
            sin: 0.0,
        }];
        let load = LoadSource {
            direction: DVector::from_element(1, 1.0),
            series: Periodic::Fourier {
                mean: 0.5,
                harmonics,
            },
            kind: LoadKind::Value,
        };
        let mounts = vec![Mount::new(Box::new(law))];
        System::new(one(gamma), one(1.0), one(1.0), mounts, vec![load]).unwrap()
    }

    #[test]
    fn systems_are_alike_in_numbers_and_in_motion() {
        let one = system(0.1, 1.0, 0.3);
        assert!(!one.is_alike(&system(0.1, 1.0, 0.3 + 1e-12)));
        assert!(!one.is_alike(&one.with_laws(&Cubic { cubic: 1.0 })));
        // The same numbers, another behaviour.
        let mut twin = one.clone();
        twin.loads[0].kind = LoadKind::Rate;
        assert!(one.is_alike(&one.clone()) && !one.is_alike(&twin));
    }
}
