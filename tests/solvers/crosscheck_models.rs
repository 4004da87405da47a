//! Every model that comes with the program over one period: the exact flow against DOPRI5, or DOPRI5 against itself.

use gearlash::analysis::flow;
use gearlash::solve::integrate::{
    Dopri5, Dopri5Options, Exact, FlowObserver, IntegrationEnd, Integrator, MAX_SWITCHES, Switch,
};
use gearlash::study::Study;
use gearlash::system::{Mount, System};
use std::f64::consts::TAU;
use std::path::Path;

/// Excitation frequencies over omega_c.
const FREQUENCIES: [f64; 4] = [0.31, 0.83, 1.27, 2.1];

#[derive(Default)]
struct Log(Vec<Switch>);

impl FlowObserver for Log {
    fn switch(&mut self, switch: &Switch) {
        self.0.push(*switch);
    }
    fn wants_segments(&self) -> bool {
        false
    }
}

/// Initial states: at rest, and flung from there by a displacement scale and a few.
fn starts(system: &System) -> Vec<Vec<f64>> {
    let rest = flow::rest(system).0;
    let flung = |size: f64| -> Vec<f64> {
        let pattern = [1.0, -0.7, 0.4, -1.3, 0.9, 0.2, -0.5];
        let push = pattern.iter().cycle();
        rest.iter().zip(push).map(|(x, p)| x + size * p).collect()
    };
    vec![rest.clone(), flung(1.0), flung(3.0)]
}

fn period(
    system: &System,
    integrator: &mut dyn Integrator,
    start: &[f64],
) -> Result<(Vec<f64>, Vec<Switch>), IntegrationEnd> {
    let (mut state, mut log) = (start.to_vec(), Log::default());
    match integrator.advance(system, (0.0, TAU), &mut state, &mut log) {
        IntegrationEnd::Reached => Ok((state, log.0)),
        end => Err(end),
    }
}

fn tight(system: &System, relative: f64) -> Dopri5 {
    let options = Dopri5Options {
        relative,
        absolute: 1e-2 * relative,
        ..Dopri5Options::default()
    };
    Dopri5::new(system, options)
}

/// Largest difference of two states, relative to the largest of their values where that is above 1.
fn gap(a: &[f64], b: &[f64]) -> f64 {
    let scale = a.iter().fold(1.0_f64, |m, x| m.max(x.abs()));
    let gaps = a.iter().zip(b).map(|(a, b)| (a - b).abs() / scale);
    gaps.fold(0.0, f64::max)
}

#[test]
fn every_model_over_one_period() {
    let folder = Path::new(env!("CARGO_MANIFEST_DIR")).join("models");
    let (mut exact_models, mut switches) = (0, 0);
    for entry in std::fs::read_dir(folder).unwrap() {
        let path = entry.unwrap().path();
        if path.extension().is_none_or(|e| e != "yaml") {
            continue;
        }
        let study = Study::load(&path, &[], &[]).unwrap();
        let mut system = study.assembly.system.clone();
        let has_impacts = |m: &Mount| m.element.least_impact().is_some();
        if system.mounts().iter().any(has_impacts) {
            // DOPRI5 knows no impacts: `memory_flow` has other second opinions.
            continue;
        }
        let is_exact = Exact::new(&system, MAX_SWITCHES).is_ok();
        exact_models += usize::from(is_exact);
        for frequency in FREQUENCIES {
            system.set_excitation_frequency(frequency);
            for (k, start) in starts(&system).iter().enumerate() {
                let wanted = period(&system, &mut tight(&system, 1e-12), start);
                // Without a second method: two tolerances, the looser one at most 1e-7 off.
                let (found, close): (_, f64) = if is_exact {
                    let mut exact = Exact::new(&system, MAX_SWITCHES).unwrap();
                    (period(&system, &mut exact, start), 1e-9)
                } else {
                    (period(&system, &mut tight(&system, 1e-10), start), 1e-7)
                };
                let place = format!("{} at {frequency}, start {k}", path.display());
                let (wanted, found) = (wanted.expect(&place), found.expect(&place));
                // Where many impacts amplify every difference, the error of the second method decides: ten times the tolerance
                // must move it further than the first method is away.
                let looser = period(&system, &mut tight(&system, 1e-11), start).expect(&place);
                let (gap, own) = (gap(&wanted.0, &found.0), gap(&wanted.0, &looser.0));
                assert!(gap < close.max(own), "{place}: {gap:e} {own:e}");
                if own > close {
                    continue;
                }
                let (before, after) = (&wanted.1, &found.1);
                assert_eq!(before.len(), after.len(), "{place}\n{before:?}\n{after:?}");
                switches += if is_exact { after.len() } else { 0 };
            }
        }
    }
    assert!(
        exact_models >= 2,
        "{exact_models} models with an exact flow"
    );
    assert!(switches > 100, "{switches} switches");
}
