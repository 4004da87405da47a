//! Touchings of a grazing curve: the flow beside them, and the conditions on it.

use super::defining::{Passes, Spot};
use super::{CurveKind, Defining};
use crate::error::SolveError;
use nalgebra::DMatrix;

/// Distance from a touching, in sizes, within which images are those of the flow that does not touch, extended: the square of it is
/// what the extension is wrong by.
const APART: f64 = 1e-7;

/// A connection on its way to a breakpoint.
struct TouchingExtremum {
    /// Deformation, its rate over dtau, and its second derivative.
    x: f64,
    rate: f64,
    rise: f64,
    level: f64,
}

impl Defining<'_> {
    /// P(u) - u and the conditions of a grazing, as if its touching did nothing: the flow beside it, which is smooth, extended by its
    /// transition matrix. The flow that touches has a square root, and behind a stop another motion. NaN where there is no image.
    pub(super) fn touching(
        &mut self,
        spot: &Spot,
        passes: Passes<'_>,
        out: &mut [f64],
    ) -> Result<(), SolveError> {
        out.fill(f64::NAN);
        let CurveKind::Grazing { connection, .. } = self.kind else {
            return Ok(());
        };
        let (n, span) = (spot.u.len(), (0.0, self.shots.period()));
        let tau = spot.extra.rem_euclid(span.1);
        let is_varied = matches!(passes, Passes::Varied(_));
        let mut state = spot.u.clone();
        let phi = is_varied.then_some(&mut self.before);
        if !self
            .shots
            .approach(spot.p, (connection, tau), (&mut state, phi))?
        {
            return Ok(());
        }
        let beside = self.clear(spot, &state, APART)?;
        self.state.copy_from_slice(&beside.u);
        let phi = is_varied.then_some(&mut self.phi);
        if !self.shots.map(spot.p, span, (&mut self.state, phi))? {
            return Ok(());
        }
        extend(&mut self.state, &self.phi, (&spot.u, &beside.u));
        for (r, (image, u)) in out.iter_mut().zip(self.state.iter().zip(&spot.u)) {
            *r = (image - u) / self.size;
        }
        state.copy_from_slice(&beside.u);
        let phi = is_varied.then_some(&mut self.before);
        if !self
            .shots
            .approach(spot.p, (connection, tau), (&mut state, phi))?
        {
            out[n..].fill(f64::NAN);
            return Ok(());
        }
        extend(&mut state, &self.before, (&spot.u, &beside.u));
        let Some(extremum) = self.extremum(spot, &state)? else {
            out[n..].fill(f64::NAN);
            return Ok(());
        };
        out[n] = (extremum.x - extremum.level) / self.size;
        out[n + 1] = extremum.rate / self.size;
        if let Passes::Varied(partials) = passes {
            self.partials(spot, &extremum, partials)?;
        }
        Ok(())
    }

    /// Derivatives of the conditions, in sizes, to u and tau.
    fn partials(
        &mut self,
        spot: &Spot,
        extremum: &TouchingExtremum,
        partials: &mut DMatrix<f64>,
    ) -> Result<(), SolveError> {
        let CurveKind::Grazing { connection, .. } = self.kind else {
            return Ok(());
        };
        let n = spot.u.len();
        let tau = spot.extra.rem_euclid(self.shots.period());
        let system = self.shots.system(spot.p)?;
        let dof = system.dof();
        let row = system.element_map().row(connection);
        for j in 0..n {
            let phi = &self.before;
            partials[(0, j)] = (0..dof).map(|i| row[i] * phi[(i, j)]).sum();
            partials[(1, j)] = (0..dof).map(|i| row[i] * phi[(dof + i, j)]).sum();
        }
        let nu = system.subharmonic() as f64;
        let error = system.mounts()[connection].transmission_error.as_ref();
        let bend = error.map_or(0.0, |e| {
            system.excitation_frequency() * nu * e.second_derivative(nu * tau)
        });
        partials[(0, n)] = extremum.rate / self.size / system.omega();
        partials[(1, n)] = (extremum.rise / system.omega() - bend) / self.size;
        Ok(())
    }

    /// The touching connection in a state at its phase; `None` where its law has no such breakpoint.
    fn extremum(
        &mut self,
        spot: &Spot,
        state: &[f64],
    ) -> Result<Option<TouchingExtremum>, SolveError> {
        let CurveKind::Grazing {
            connection,
            breakpoint,
        } = self.kind
        else {
            return Ok(None);
        };
        let tau = spot.extra.rem_euclid(self.shots.period());
        let system = self.shots.system(spot.p)?;
        let (dof, mut scratch) = (system.dof(), system.scratch());
        let mut acceleration = vec![0.0; dof];
        system.acceleration(tau, state, &mut scratch, &mut acceleration);
        let row = system.element_map().row(connection);
        let rise = (0..dof).map(|i| row[i] * acceleration[i]).sum();
        let levels = system.mounts()[connection].element.breakpoints();
        Ok(levels.get(breakpoint).map(|level| TouchingExtremum {
            x: scratch.deformation[connection],
            rate: scratch.rate[connection],
            rise,
            level: *level,
        }))
    }

    /// A spot at which the extremum stays clear of its breakpoint by at least a number of sizes: the state moved, against the gradient of the
    /// touched deformation.
    pub(super) fn untouched(&mut self, spot: &Spot, away: f64) -> Result<Spot, SolveError> {
        self.beside(spot, away)
    }

    /// The same, or, where the number is negative, a spot at which the extremum passes its breakpoint by at least as much.
    pub(super) fn beside(&mut self, spot: &Spot, away: f64) -> Result<Spot, SolveError> {
        let CurveKind::Grazing { connection, .. } = self.kind else {
            return Ok(spot.clone());
        };
        let tau = spot.extra.rem_euclid(self.shots.period());
        let mut state = spot.u.clone();
        let into = (state.as_mut_slice(), Some(&mut self.before));
        match self.shots.approach(spot.p, (connection, tau), into)? {
            true => self.clear(spot, &state, away),
            false => Ok(spot.clone()),
        }
    }

    /// The same with the state at the touching, the transition to which is known.
    fn clear(&mut self, spot: &Spot, state: &[f64], away: f64) -> Result<Spot, SolveError> {
        let (CurveKind::Grazing { connection, .. }, Some(extremum)) =
            (self.kind, self.extremum(spot, state)?)
        else {
            return Ok(spot.clone());
        };
        let TouchingExtremum {
            x,
            rate,
            rise,
            level,
        } = extremum;
        let (size, before) = (self.size, &self.before);
        let system = self.shots.system(spot.p)?;
        let (dof, row) = (system.dof(), system.element_map().row(connection));
        // What is remembered is data.
        let gradient: Vec<f64> = (0..2 * dof)
            .map(|j| (0..dof).map(|i| row[i] * before[(i, j)]).sum())
            .collect();
        let square: f64 = gradient.iter().map(|g| g * g).sum();
        // The extremum itself lies beside tau where the rate is not 0. A maximum is kept below the breakpoint, a minimum above.
        let extremum = match rate * rate < size * rise.abs() {
            true => x - rate * rate / (2.0 * rise),
            false => x,
        };
        let gap = level - extremum - away * size * -rise.signum();
        let mut moved = spot.clone();
        if away * gap * rise < 0.0 {
            return Ok(moved);
        }
        for (u, g) in moved.u.iter_mut().zip(&gradient) {
            *u += g * gap / square.max(f64::MIN_POSITIVE);
        }
        Ok(moved)
    }
}

/// Adds the image of the way from one state to another.
fn extend(state: &mut [f64], phi: &DMatrix<f64>, (to, from): (&[f64], &[f64])) {
    for (j, (a, b)) in to.iter().zip(from).enumerate().filter(|(_, (a, b))| a != b) {
        for (i, x) in state.iter_mut().enumerate() {
            *x += phi[(i, j)] * (a - b);
        }
    }
}
