//! The series flow as an integrator, and the ends of its stretches.

use super::laws::LawPart;
use super::{Exact, MovedState};
use crate::numeric::bernstein::evaluate;
use crate::numeric::periodic::Periodic;
use crate::solve::integrate::{
    Flight, FlowObserver, IntegrationEnd, Integrator, Singularity, Strain, Switch, SwitchKind,
};
use crate::system::System;
use nalgebra::DMatrix;
use std::f64::consts::TAU;

/// Corners of stiffness variations, transmission errors and loads; the begin of a turn where a law reads the phase.
pub(super) fn kinks(system: &System, laws: &[LawPart]) -> Vec<f64> {
    let nu = system.subharmonic();
    let mounts = system.mounts().iter();
    let series = mounts.flat_map(|m| [&m.stiffness_variation, &m.transmission_error]);
    let series = series
        .flatten()
        .chain(system.loads().iter().map(|l| &l.series));
    let corners = series
        .filter(|s| !s.is_constant())
        .flat_map(Periodic::kinks);
    let turns = laws
        .iter()
        .filter(|part| part.law.reads_phase())
        .map(|_| 0.0);
    let phases = corners.chain(turns);
    let mut list: Vec<f64> = phases
        .flat_map(|x| (0..nu).map(move |m| (x + TAU * m as f64) / nu as f64))
        .collect();
    list.sort_by(f64::total_cmp);
    list
}

/// The end at a connection with its deformation and rate.
pub(super) fn not_analytic(
    system: &System,
    tau: f64,
    (connection, deformation, rate): (usize, f64, f64),
) -> IntegrationEnd {
    let (share, period) = match system.course() {
        None => (
            (system.subharmonic() as f64 * tau / TAU).rem_euclid(1.0),
            TAU / system.excitation_frequency(),
        ),
        Some(_) => (tau, 1.0),
    };
    IntegrationEnd::NotAnalytic(Singularity {
        connection,
        deformation,
        rate,
        share,
        period,
    })
}

/// Steps of the closed form that cost as much as one of a series.
const CLOSED: usize = 2;

impl Integrator for Exact {
    fn name(&self) -> &'static str {
        self.name
    }

    fn start(&mut self, system: &System, tau: f64, state: &[f64], observer: &mut dyn FlowObserver) {
        self.prepare(system);
        let (state, memory) = state.split_at(2 * system.dof());
        let mut memory = memory.to_vec();
        let placed = self.place(system, tau, state, &mut memory);
        if placed
            .and_then(|()| self.open_series(system, tau, state))
            .is_err()
        {
            return;
        }
        for part in 0..self.regions.parts().len() {
            let here = &self.regions.parts()[part];
            if here.memory.is_some() {
                continue;
            }
            let connection = here.connection;
            let (value, slope) = evaluate(self.series.deformation(connection), 0.0);
            let element = system.mounts()[connection].element.as_ref();
            let begun = (self.regions).begun(&self.series, (tau, state), part, value);
            let Some((level, to)) = begun.filter(|(level, _)| element.flank(*level) == 0) else {
                continue;
            };
            observer.switch(&Switch {
                tau,
                connection,
                level,
                from: 0,
                to,
                velocity: slope / self.series.unit,
                kind: SwitchKind::Breakpoint,
            });
        }
    }

    fn error(&self) -> f64 {
        match self.name {
            "exact" => 1e-13,
            _ => 10.0 * self.options.tolerance,
        }
    }

    fn effort(&self) -> usize {
        match self.name {
            "exact" => (self.effort + self.switches).div_ceil(CLOSED),
            _ => self.effort,
        }
    }

    fn allow(&mut self, steps: usize) {
        self.allowance = steps;
    }

    fn strain(&self) -> Option<Strain> {
        let strain = Strain {
            steps: self.labour.hardest(),
            bounces: self.bounces.hardest(),
        };
        (strain != Strain::default()).then_some(strain)
    }

    fn flight(&self, system: &System) -> Option<Box<dyn Flight>> {
        self.clone().side_by_side(system)
    }

    fn advance(
        &mut self,
        system: &System,
        tau: (f64, f64),
        state: &mut [f64],
        observer: &mut dyn FlowObserver,
    ) -> IntegrationEnd {
        let motion = MovedState {
            system,
            phi: None,
            observer,
        };
        self.run(tau, state, motion)
    }

    fn advance_with_variation(
        &mut self,
        system: &System,
        tau: (f64, f64),
        state: &mut [f64],
        phi: &mut DMatrix<f64>,
        observer: &mut dyn FlowObserver,
    ) -> IntegrationEnd {
        let motion = MovedState {
            system,
            phi: Some(phi),
            observer,
        };
        self.run(tau, state, motion)
    }
}
