//! What the shared keys mean for the solvers, and what can be wrong with them.

use super::{BranchSettings, Confirm, Method, Quadrature, Swept};
use crate::analysis::flow::LabelKeys;
use crate::analysis::{Fault, Setting, flow, limits};
use crate::error::SolveError;
use crate::quantity::Quantity;
use crate::solve::attractor::{Lengths, MapSize};
use crate::solve::closed_form::ClosedForm;
use crate::solve::continuation::{ContinuationOptions, Crossings};
use crate::solve::family::{Family, FrequencyFamily};
use crate::solve::galerkin::{self, Galerkin};
use crate::solve::integrate::IntegratorOptions;
use crate::solve::jumps::refuse_hidden;
use crate::solve::newton::NewtonOptions;
use crate::system::System;

/// First step when none is given.
const FIRST_STEP: f64 = 0.02;
/// Share of the tolerance that shooting's corrector is held to.
const SHOOTING_TOLERANCE: f64 = 1e-2;
/// Values of an integrated response when no number is given.
const POINTS: usize = 200;
/// Periods before the record at every value when no number is given.
const TRANSIENT: usize = 200;
/// Periods recorded at every value when no number is given: as many as a torus needs to be told from chaos.
const PERIODS: usize = 100;

impl BranchSettings {
    /// The requested methods; default Galerkin.
    pub(super) fn methods(&self) -> Vec<Method> {
        match &self.methods {
            Some(list) => list.clone(),
            None => vec![self.method.unwrap_or_default()],
        }
    }

    /// The integrator of shooting and integration.
    pub(super) fn flow(&self) -> IntegratorOptions {
        flow::options(self.integrator, self.flow_tolerance)
    }

    /// Values of an integrated response.
    pub(super) fn points(&self) -> usize {
        self.points.unwrap_or(POINTS)
    }

    /// Whether one value is integrated instead of a range.
    pub(in crate::analysis) fn is_single(&self) -> bool {
        self.points == Some(1) && self.methods() == [Method::Integration]
    }

    /// The first and the last value as written; a single one is both.
    ///
    /// # Errors
    /// Those that are missing.
    pub(in crate::analysis) fn ends(&self) -> Result<(&Quantity, &Quantity), Vec<Fault>> {
        match (&self.from, &self.to) {
            (Some(from), None) if self.is_single() => Ok((from, from)),
            (Some(from), Some(to)) => Ok((from, to)),
            (from, to) => {
                let keys = [("from", from), ("to", to)];
                let missing = keys.iter().filter(|(_, value)| value.is_none());
                let fault = |(key, _): &(&'static str, _)| {
                    let message = format!("missing: the range needs `{key}`");
                    Fault::new(*key, message)
                };
                Err(missing.map(fault).collect())
            }
        }
    }

    /// Length of an integrated record.
    pub(super) fn map_size(&self) -> MapSize {
        MapSize {
            transient: self.transient.unwrap_or(TRANSIENT),
            periods: self.periods.unwrap_or(PERIODS),
            exponents: Lengths::for_labels(self.lyapunov.unwrap_or(true)),
        }
    }

    /// How far its labels go.
    pub(super) fn label_keys(&self) -> LabelKeys {
        LabelKeys {
            longest_period: self.longest_period,
            extend: self.extend,
        }
    }

    pub(super) fn has_galerkin(&self) -> bool {
        self.methods().contains(&Method::Galerkin)
    }

    /// The same settings with `quadrature: auto` resolved for the systems along a parameter, and why forces are sampled where
    /// nobody requested it.
    pub(super) fn resolved(&self, swept: &Swept<'_>) -> (BranchSettings, Option<String>) {
        let mut settings = self.clone();
        if self.quadrature != Quadrature::Auto {
            return (settings, None);
        }
        let reason = match self.samples {
            Some(_) => Some("`samples` without `quadrature`".into()),
            None => swept.refusal(ClosedForm::Quadrature),
        };
        settings.quadrature = match reason {
            Some(_) => Quadrature::Sampled,
            None => Quadrature::Exact,
        };
        (settings, reason)
    }

    /// The same problem with the requested quadrature; `auto` samples until it is [`resolved`](BranchSettings::resolved).
    ///
    /// # Errors
    /// A connection that does not allow it.
    pub(super) fn with_quadrature<F: Family>(
        &self,
        galerkin: Galerkin<F>,
        lambda: f64,
    ) -> Result<Galerkin<F>, SolveError> {
        match self.quadrature {
            Quadrature::Auto | Quadrature::Sampled => Ok(galerkin),
            Quadrature::Exact => galerkin.with_exact_quadrature(lambda),
        }
    }

    pub(super) fn newton(&self) -> NewtonOptions {
        NewtonOptions {
            tolerance: self.tolerance,
            step_tolerance: self.tolerance,
            ..NewtonOptions::default()
        }
    }

    /// The flow is good to rounding, and so shall its fixed points be.
    pub(super) fn shooting_newton(&self) -> NewtonOptions {
        NewtonOptions {
            tolerance: SHOOTING_TOLERANCE * self.tolerance,
            ..self.newton()
        }
    }

    pub(super) fn continuation(&self, range: (f64, f64), weight: f64) -> ContinuationOptions {
        ContinuationOptions {
            range,
            step: self.step.unwrap_or(FIRST_STEP.min(self.max_step)),
            min_step: self.min_step,
            max_step: self.max_step,
            max_points: self.max_points,
            weight,
            newton: self.newton(),
            crossings: Crossings::Expected,
        }
    }

    /// What is wrong with the ends and the marks, `value` being the number of a written one.
    pub(in crate::analysis) fn check_range(
        &self,
        value: &dyn Fn(&Quantity) -> Result<f64, String>,
    ) -> Vec<Fault> {
        let mut faults = Vec::new();
        let (first, last) = match self.ends() {
            Ok(ends) => ends,
            Err(faults) => return faults,
        };
        let mut read = |key: String, written: &Quantity| match value(written) {
            Ok(value) => Some(value),
            Err(message) => {
                faults.push(Fault::new(key, message));
                None
            }
        };
        let (from, to) = (read("from".into(), first), read("to".into(), last));
        let marks = self.marks.iter().enumerate();
        let marks = marks.map(|(k, mark)| (format!("marks.{k}"), mark));
        let listed: Vec<(String, &Quantity)> = marks.chain(self.starts_at()).collect();
        let values: Vec<Option<f64>> = listed
            .iter()
            .map(|(key, written)| read(key.clone(), written))
            .collect();
        let (Some(from), Some(to)) = (from, to) else {
            return faults;
        };
        let (low, high) = (from.min(to), from.max(to));
        for ((key, written), value) in listed.into_iter().zip(values) {
            if value.is_some_and(|m| m < low || m > high) {
                let message = format!(
                    "{} lies outside the range from {} to {}",
                    written.text, first.text, last.text
                );
                faults.push(Fault::new(key, message));
            }
        }
        if !self.is_single()
            && let Err(error) = self.continuation((from, to), 1.0).validate()
        {
            faults.push(fault_of(error));
        }
        faults
    }

    /// What is wrong with the other keys, for the system at the beginning of the range.
    pub(in crate::analysis) fn check(&self, setting: &Setting<'_>, system: &System) -> Vec<Fault> {
        let mut faults = self.check_methods(setting, system);
        faults.extend(self.check_integration());
        faults.extend(self.check_branches());
        faults.extend(self.check_starts(setting));
        faults.extend(self.check_saved(setting));
        faults.extend(self.check_size(setting, system));
        let orders = self.orders.iter().enumerate();
        faults.extend(orders.filter_map(|(k, order)| {
            let fault = order.value(setting).err()?;
            Some(Fault::new(format!("orders.{k}"), fault))
        }));
        faults
    }

    fn check_methods(&self, setting: &Setting<'_>, system: &System) -> Vec<Fault> {
        let mut faults = Vec::new();
        if self.method.is_some() && self.methods.is_some() {
            let message = "`method` and `methods` exclude each other";
            faults.push(Fault::new("methods", message));
        }
        let methods = self.methods();
        let repeated = (1..methods.len()).any(|k| methods[..k].contains(&methods[k]));
        if methods.is_empty() || repeated {
            faults.push(Fault::new("methods", "wanted a list of different methods"));
        }
        if self.verify.is_some() && self.confirm.is_some() {
            let message =
                "`verify` and `confirm` exclude each other; `verify: true` means `confirm: all`";
            faults.push(Fault::new("verify", message));
        }
        let is_asked = matches!(self.asked(), Some(asked) if asked != Confirm::None);
        if is_asked && !self.has_galerkin() {
            let key = if self.verify.is_some() {
                "verify"
            } else {
                "confirm"
            };
            let message =
                format!("`{key}` confirms points of the method `galerkin`, which is not selected");
            faults.push(Fault::new(key, message));
        }
        for (key, is_asked_for) in [
            ("error_estimate", self.error_estimate),
            ("convergence_check", self.convergence_check),
        ] {
            if is_asked_for && !self.has_galerkin() {
                let message = format!(
                    "`{key}` applies to points of the method `galerkin`, which is not selected"
                );
                faults.push(Fault::new(key, message));
            }
        }
        if self.has_galerkin()
            && let Err(error) = galerkin::refuse(&setting.assembly.system)
        {
            let key = if self.methods.is_some() {
                "methods"
            } else {
                "method"
            };
            faults.push(Fault::new(key, setting.name_connection(&error)));
        }
        let needs_flow = is_asked || self.starts.is_some() || self.start.saved().is_some();
        if needs_flow || methods.iter().any(|m| *m != Method::Galerkin) {
            faults.extend(flow::check_tolerance(self.flow()));
            faults.extend(flow::integrator(setting, system, self.flow()).err());
        }
        if methods.contains(&Method::Shooting)
            && let Err(error) = refuse_hidden(&setting.assembly.system)
        {
            let key = if self.methods.is_some() {
                "methods"
            } else {
                "method"
            };
            faults.push(Fault::new(key, setting.name_connection(&error)));
        }
        faults
    }

    /// The keys that method integration alone reads.
    fn check_integration(&self) -> Vec<Fault> {
        let mut faults = Vec::new();
        if !self.methods().contains(&Method::Integration) {
            let given = [
                ("points", self.points.is_some()),
                ("direction", self.direction.is_some()),
                ("transient", self.transient.is_some()),
                ("periods", self.periods.is_some()),
                ("longest_period", self.longest_period.is_some()),
                ("extend", self.extend.is_some()),
            ];
            for (key, _) in given.iter().filter(|(_, is_given)| *is_given) {
                let message = format!(
                    "`{key}` belongs to the method `integration`, which is not selected; other methods choose their \
                     points themselves (`max_step`, `marks`)"
                );
                faults.push(Fault::new(*key, message));
            }
            return faults;
        }
        if self.points() < 2 && !self.is_single() {
            let message = format!(
                "{} must be at least 2; `points: 1` is for the method `integration` alone",
                self.points()
            );
            faults.push(Fault::new("points", message));
        }
        let has_range = self
            .to
            .as_ref()
            .is_some_and(|to| self.from.as_ref() != Some(to));
        if self.is_single() && has_range {
            let message = "1 must be at least 2 for a range; one value is given by `at` (of a number of the model: `from` alone)";
            faults.push(Fault::new("points", message));
        }
        faults.extend(limits::check("points", self.points(), 0, limits::POINTS));
        faults.extend(flow::check_size(self.map_size(), 1));
        faults.extend(self.label_keys().check());
        faults
    }

    /// Whether branch switching has what it needs.
    fn check_branches(&self) -> Vec<Fault> {
        let mut faults = Vec::new();
        let Some(wanted) = self.branches.limits() else {
            return faults;
        };
        if !self.stability {
            let message = "period doublings are found from multipliers; remove `stability: false`";
            faults.push(Fault::new("branches", message));
        }
        if self.methods() == [Method::Integration] {
            let message = "the method `integration` follows attractors, not branches";
            faults.push(Fault::new("branches", message));
        }
        for (key, value) in [("depth", wanted.depth), ("limit", wanted.limit)] {
            if value == 0 {
                let message = "0 must be at least 1; `branches: primary` follows no others";
                faults.push(Fault::new(format!("branches.{key}"), message));
            }
            let key = format!("branches.{key}");
            faults.extend(limits::check(&key, value, 0, limits::BRANCHES));
        }
        faults
    }

    fn check_size(&self, setting: &Setting<'_>, system: &System) -> Vec<Fault> {
        let mut faults = Vec::new();
        let share = self.stability_resolution;
        if !(share > 0.0 && share <= 0.1) {
            let message =
                format!("{share} must be above 0 and at most 0.1: a fraction of the parameter");
            faults.push(Fault::new("stability_resolution", message));
        }
        if self.subharmonic == 0 {
            faults.push(Fault::new("subharmonic", "0 must be at least 1"));
            return faults;
        }
        // Integration has no harmonics.
        let is_periodic = self.methods().iter().any(|m| *m != Method::Integration);
        let revolutions = if is_periodic { system.revolutions() } else { 1 };
        faults.extend(self.check_harmonics(revolutions));
        if !faults.is_empty() {
            return faults;
        }
        if let Some(samples) = self.samples {
            let least = 16 * self.harmonics.most() * self.subharmonic;
            if !samples.is_power_of_two() || samples < least || samples > 1 << 22 {
                let message = format!(
                    "{samples} must be a power of two, at least {least} (16 a harmonic), at most {}",
                    1 << 22
                );
                faults.push(Fault::new("samples", message));
            }
        }
        faults.extend(limits::check(
            "max_points",
            self.max_points,
            1,
            limits::POINTS,
        ));
        if !(self.bound >= 2.0 && self.bound <= 1e12) {
            let message = format!("{} must be between 2 and 1e12", self.bound);
            faults.push(Fault::new("bound", message));
        }
        if !(self.tolerance > 0.0 && self.tolerance < 1e-2) {
            faults.push(Fault::new(
                "tolerance",
                format!("{} must be between 0 and 0.01", self.tolerance),
            ));
        }
        // What does not fit is refused by its cost.
        let fits = self.fits(setting, self.harmonics.first());
        if faults.is_empty() && is_periodic && fits {
            let mut system = system.clone();
            system.set_subharmonic(self.subharmonic);
            let fewest = self
                .resolution()
                .map_or(self.size(), |r| self.size_with(r.least, self.subharmonic));
            match Galerkin::new(FrequencyFamily::new(system), 1.0, fewest) {
                Err(error) => faults.push(fault_of(error)),
                Ok(galerkin) => {
                    let refused = self.with_quadrature(galerkin, 1.0).err();
                    let message = refused.map(|error| setting.name_connection(&error));
                    let advised = |m| format!("{m}; use `quadrature: auto` or `sampled`");
                    faults.extend(message.map(|m| Fault::new("quadrature", advised(m))));
                }
            }
        }
        faults
    }
}

fn fault_of(error: SolveError) -> Fault {
    match error {
        SolveError::Option {
            name,
            found,
            wanted,
        } => Fault::new(name, format!("{found} must be {wanted}")),
        other => Fault::new("", other.to_string()),
    }
}
