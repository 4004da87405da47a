//! Energy of closed orbits: what the loads put in, damping takes out.

use crate::common::{self, floats, reference};
use gearlash::numeric::quadrature::unit_nodes;
use gearlash::solve::integrate::{Exact, FlowObserver, IntegrationEnd, Integrator, Segment};
use gearlash::system::System;
use nalgebra::{DMatrix, DVector};
use std::f64::consts::TAU;

/// Integrals of v . M Q and v . M Gam v over time, M = kappa^-1: with it the restoring forces have a potential.
struct Works<'a> {
    system: &'a System,
    inertia: DMatrix<f64>,
    loads: f64,
    damping: f64,
}

impl FlowObserver for Works<'_> {
    fn segment(&mut self, segment: &Segment<'_>) {
        let (system, n) = (self.system, self.system.dof());
        let mut state = vec![0.0; 2 * n];
        for (x, weight) in unit_nodes() {
            segment.state(x, system.omega(), &mut state);
            let v = DVector::from_column_slice(&state[n..]);
            let phase = system.subharmonic() as f64 * (segment.tau + x * segment.width);
            let mut load = DVector::zeros(n);
            for source in system.loads() {
                load += &source.direction * source.series.value(phase);
            }
            let time = weight * segment.width / system.omega();
            self.loads += time * v.dot(&(&self.inertia * load));
            self.damping += time * v.dot(&(&self.inertia * (system.damping() * &v)));
        }
    }
}

/// The closed orbit near a state, by Newton's method on the Poincare map.
fn closed(system: &System, exact: &mut Exact, mut state: DVector<f64>) -> DVector<f64> {
    let size = state.len();
    for _ in 0..3 {
        let (mut end, mut phi) = (state.clone(), DMatrix::identity(size, size));
        let reached =
            exact.advance_with_variation(system, (0.0, TAU), end.as_mut_slice(), &mut phi, &mut ());
        assert_eq!(reached, IntegrationEnd::Reached);
        let residual = &end - &state;
        let step = (phi - DMatrix::identity(size, size)).lu().solve(&residual);
        state -= step.unwrap();
    }
    state
}

#[test]
fn loads_and_damping_balance_on_closed_orbits() {
    let mut orbits = 0;
    for name in ["fig11_case1", "one_dof_backlash"] {
        let data = reference(name);
        let whole = match name {
            "fig11_case1" => common::system(&data["system"]),
            _ => common::one_dof(&data),
        };
        let list = data["solutions"].as_array().unwrap().iter();
        for solution in list.filter(|s| !s.is_null()) {
            let mut system = whole.clone();
            system.set_subharmonic(solution["nu"].as_u64().unwrap() as usize);
            system.set_excitation_frequency(solution["omega"].as_f64().unwrap());
            let inertia = system.stiffness().clone().try_inverse().unwrap();
            assert!((&inertia - inertia.transpose()).amax() < 1e-14);
            let mut exact = Exact::new(&system, 1000).unwrap();
            let start = DVector::from_vec(floats(&solution["u0"]));
            let start = closed(&system, &mut exact, start);
            let mut works = Works {
                system: &system,
                inertia,
                loads: 0.0,
                damping: 0.0,
            };
            let mut end = start.clone();
            exact.advance(&system, (0.0, TAU), end.as_mut_slice(), &mut works);
            let open = (&end - &start).amax();
            assert!(open < 1e-12, "{name}: the orbit is open by {open:e}");
            let gap = works.loads - works.damping;
            assert!(
                gap.abs() < 1e-10,
                "{name} at {}: {gap:e}",
                solution["omega"]
            );
            // Not nothing against nothing.
            assert!(works.damping > 1e-4, "{name}: {:e}", works.damping);
            orbits += 1;
        }
    }
    assert!(orbits > 20, "{orbits} orbits");
}
