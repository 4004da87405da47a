//! Equilibrium of a train with loops: the minimum of its energy.
//!
//! ```text
//! minimise  sum_j k_j U_j(W_j q - e_j) - F q,    U_j' = f_j
//! ```
//!
//! With laws that never fall the energy is convex, piecewise quadratic where the laws are broken lines. From any state, either
//! the load does work on a motion that deforms open connections only: the state moves that way until they touch, and if none
//! ever does, nothing carries the load. Or the closed connections are balanced by one linear solution; if no connection passes
//! a kink on the way there, it is the equilibrium, else the lowest energy on that way is the next state (as for Huber's estimator,
//! Madsen & Nielsen, BIT 30 (1990)). Both strictly lower the energy, so no set of regions occurs twice.

use super::balance::Demand;
use super::face::{Face, FaceStep};
use super::graph::{Graph, middle};
use super::{Equilibrium, NoEquilibrium};
use crate::system::System;
use nalgebra::{Cholesky, DMatrix, DVector};

/// Steps allowed: some, and more for every connection.
const STEPS: usize = 200;
const STEPS_EACH: usize = 20;
/// Force on open connections relative to the whole that is rounding.
const CARRIED: f64 = 1e-13;
/// Misfit of the balance that a result may have, relative to the forces in it.
const BALANCED: f64 = 1e-9;
/// Change of a deformation, relative to itself, at which the iteration on curved laws ends.
const SETTLED: f64 = 1e-13;

/// The minimum of the energy.
///
/// # Errors
/// A motion on which the load works and nothing resists; or no end within the steps allowed.
pub(super) fn minimise(
    system: &System,
    demand: &Demand,
    graphs: &[Graph<'_>],
    error: &[f64],
) -> Result<Equilibrium, NoEquilibrium> {
    let mut energy = Energy::new(system, demand, graphs, error);
    for _ in 0..STEPS + STEPS_EACH * graphs.len() {
        energy.linearise();
        let face = Face::of(&energy.rows, &energy.slope);
        let (slack, closed) = face.split(&energy.rest());
        if slack.norm() > energy.noise + CARRIED * energy.size {
            let change = &energy.rows * &slack;
            match energy.lowest(&slack, &change) {
                Some(share) => energy.q.axpy(share, &slack, 1.0),
                None if energy.falls => return Err(NoEquilibrium::NotFound),
                None => return Err(energy.runs_apart(&change)),
            }
            continue;
        }
        let step = face
            .balance((&energy.force, &energy.slope), closed)
            .ok_or(NoEquilibrium::NotFound)?;
        let change = &energy.rows * &step.motion;
        if energy.nearest_kink(&change) > 1.0 {
            energy.q += &step.motion;
            if energy.is_final(&change) {
                return energy.conclude(&face, step);
            }
            continue;
        }
        match energy.lowest(&step.motion, &change) {
            Some(share) if share > 0.0 => energy.q.axpy(share, &step.motion, 1.0),
            _ => return Err(NoEquilibrium::NotFound),
        }
    }
    Err(NoEquilibrium::NotFound)
}

/// The train in coordinates and deformations of unit size, at a state.
struct Energy<'a> {
    graphs: &'a [Graph<'a>],
    error: &'a [f64],
    /// Rows of W of unit length, e x n; deformation j is `size_of[j]` times row j times q, less e_j.
    rows: DMatrix<f64>,
    size_of: Vec<f64>,
    /// Coordinates of the system per coordinate here.
    unit: DVector<f64>,
    stiffness: Vec<f64>,
    load: DVector<f64>,
    noise: f64,
    q: DVector<f64>,
    /// Deformations, forces and stiffnesses at q; on a ramp.
    x: Vec<f64>,
    force: Vec<f64>,
    slope: Vec<f64>,
    on_jump: Vec<bool>,
    /// Largest force, as the size of what cancels.
    size: f64,
    /// Whether a law falls somewhere on the way: then the energy is not convex.
    falls: bool,
}

impl<'a> Energy<'a> {
    fn new(
        system: &System,
        demand: &Demand,
        graphs: &'a [Graph<'a>],
        error: &'a [f64],
    ) -> Energy<'a> {
        let mut rows = system.element_map().clone();
        let mut size_of: Vec<f64> = rows.row_iter().map(|row| row.norm()).collect();
        (0..rows.nrows()).for_each(|j| rows.row_mut(j).unscale_mut(size_of[j]));
        let unit = DVector::from_iterator(
            rows.ncols(),
            rows.column_iter()
                .map(|c| 1.0 / c.amax().max(f64::MIN_POSITIVE)),
        );
        for (mut column, unit) in rows.column_iter_mut().zip(unit.iter()) {
            column *= *unit;
        }
        for (j, size) in size_of.iter_mut().enumerate() {
            let norm = rows.row(j).norm();
            rows.row_mut(j).unscale_mut(norm);
            *size *= norm;
        }
        let e = graphs.len();
        Energy {
            graphs,
            error,
            load: demand.load.component_mul(&unit),
            noise: demand.noise.component_mul(&unit).norm(),
            q: DVector::zeros(rows.ncols()),
            stiffness: demand.stiffness.clone(),
            rows,
            size_of,
            unit,
            x: vec![0.0; e],
            force: vec![0.0; e],
            slope: vec![0.0; e],
            on_jump: vec![false; e],
            size: 0.0,
            falls: false,
        }
    }

    /// Deformations, forces and slopes at q.
    fn linearise(&mut self) {
        let along = &self.rows * &self.q;
        self.size = self.load.norm();
        for (j, graph) in self.graphs.iter().enumerate() {
            let size = self.size_of[j];
            self.x[j] = size * along[j] - self.error[j];
            let (f, slope, on_jump) = graph.ramped(self.x[j]);
            self.falls |= slope < 0.0;
            self.force[j] = self.stiffness[j] * size * f;
            self.slope[j] = self.stiffness[j] * size * size * slope.abs();
            self.on_jump[j] = on_jump;
            self.size = self.size.max(self.force[j].abs());
        }
    }

    /// Load less the forces of connections without stiffness.
    fn rest(&self) -> DVector<f64> {
        let mut rest = self.load.clone();
        for j in (0..self.x.len()).filter(|j| self.slope[*j] == 0.0 && self.force[*j] != 0.0) {
            rest.axpy(-self.force[j], &self.rows.row(j).transpose(), 1.0);
        }
        rest
    }

    /// Work of all forces along a motion that has gone a share, per share.
    fn work(&self, motion: &DVector<f64>, change: &DVector<f64>, share: f64) -> f64 {
        let mut work = -self.load.dot(motion);
        for (j, graph) in self
            .graphs
            .iter()
            .enumerate()
            .filter(|(j, _)| change[*j] != 0.0)
        {
            let f = graph
                .ramped(self.x[j] + share * self.size_of[j] * change[j])
                .0;
            work += self.stiffness[j] * self.size_of[j] * f * change[j];
        }
        work
    }

    /// Shares of a motion at which connections pass kinks, ascending.
    fn kinks(&self, change: &DVector<f64>) -> Vec<f64> {
        let mut list = Vec::new();
        for (j, graph) in self.graphs.iter().enumerate() {
            let rate = self.size_of[j] * change[j];
            let shares = graph.kinks().into_iter().map(|b| (b - self.x[j]) / rate);
            list.extend(shares.filter(|s| *s > 0.0 && s.is_finite()));
        }
        list.sort_by(f64::total_cmp);
        list
    }

    fn nearest_kink(&self, change: &DVector<f64>) -> f64 {
        self.kinks(change).first().copied().unwrap_or(f64::INFINITY)
    }

    /// Share of a motion at which the energy is lowest; `None` where it falls for ever.
    fn lowest(&self, motion: &DVector<f64>, change: &DVector<f64>) -> Option<f64> {
        let work = |share: f64| self.work(motion, change, share);
        let kinks = self.kinks(change);
        // The work per share never falls: the first kink at which the forces push back.
        let beyond = kinks.partition_point(|s| work(*s) < 0.0);
        let mut low = beyond.checked_sub(1).map_or(0.0, |k| kinks[k]);
        let mut high = match kinks.get(beyond) {
            Some(high) => *high,
            None => {
                let mut reach = if low > 0.0 { low } else { 1.0 };
                // A force that does not change over many decades does not change at all.
                while work(low + reach) < 0.0 {
                    reach *= 16.0;
                    if reach > 1e30 * (1.0 + low) {
                        return None;
                    }
                }
                low + reach
            }
        };
        if self.graphs.iter().all(Graph::is_affine) {
            let (a, b) = (work(low), work(high));
            return Some(if b > a {
                low - a * (high - low) / (b - a)
            } else {
                high
            });
        }
        loop {
            let share = 0.5 * low + 0.5 * high;
            if share <= low || share >= high {
                return Some(high);
            }
            if work(share) < 0.0 {
                low = share;
            } else {
                high = share;
            }
        }
    }

    /// Connections that move apart.
    fn runs_apart(&self, change: &DVector<f64>) -> NoEquilibrium {
        let largest = change.amax();
        NoEquilibrium::NotCarried {
            connections: (0..change.len())
                .filter(|j| change[*j].abs() > 1e-9 * largest)
                .collect(),
        }
    }

    /// Whether a full step ends the iteration: at once with broken lines, with curved laws when it has become small.
    fn is_final(&self, change: &DVector<f64>) -> bool {
        (0..change.len()).all(|j| {
            let moved = (self.size_of[j] * change[j]).abs();
            self.graphs[j].is_affine() || moved <= SETTLED * self.x[j].abs()
        })
    }

    /// The equilibrium at the end of a full step, its balance checked; open connections take the middle of their gaps.
    fn conclude(mut self, face: &Face, step: FaceStep) -> Result<Equilibrium, NoEquilibrium> {
        for (j, force) in step.forces {
            self.force[j] = force;
        }
        let mut misfit = self.load.clone();
        let mut size = self.load.map(f64::abs);
        for (j, force) in self.force.iter().enumerate() {
            let row = self.rows.row(j).transpose();
            misfit.axpy(-force, &row, 1.0);
            size.axpy(force.abs(), &row.map(f64::abs), 1.0);
        }
        if misfit.norm() > BALANCED * size.norm() + self.noise {
            return Err(NoEquilibrium::NotFound);
        }
        let open = face.open();
        let is_unique = open.ncols() == 0;
        if !is_unique {
            self.centre(&open);
        }
        let along = &self.rows * &self.q;
        let x: Vec<f64> = (0..self.x.len())
            .map(|j| self.size_of[j] * along[j] - self.error[j])
            .collect();
        let force: Vec<f64> = (0..x.len())
            .map(|j| self.force[j] / (self.stiffness[j] * self.size_of[j]))
            .collect();
        let slope = |j: usize| self.graphs[j].ramped(x[j]).1;
        Ok(Equilibrium {
            q: self.q.component_mul(&self.unit),
            slope: (0..x.len())
                .map(|j| {
                    (!self.on_jump[j]).then(|| if self.slope[j] == 0.0 { 0.0 } else { slope(j) })
                })
                .collect(),
            flank: (self.graphs.iter().enumerate())
                .map(|(j, graph)| {
                    graph.flank(x[j], if self.slope[j] == 0.0 { 0.0 } else { force[j] })
                })
                .collect(),
            force,
            deformation: x,
            is_unique,
        })
    }

    /// Moves along directions that meet no stiffness to the middles of the gaps, as far as all of them allow.
    fn centre(&mut self, open: &DMatrix<f64>) {
        let along = &self.rows * &self.q;
        let slack: Vec<(usize, f64, f64)> = (0..self.x.len())
            .filter(|j| self.slope[*j] == 0.0)
            .map(|j| {
                let x = self.size_of[j] * along[j] - self.error[j];
                let (low, high) = self.graphs[j].flat_stretch(x);
                (j, low - x, high - x)
            })
            .collect();
        let width = |low: f64, high: f64| match (high - low).is_finite() {
            true => high - low,
            false => 1.0 + low.abs().min(high.abs()).min(f64::MAX),
        };
        let rows = slack.iter().map(|(j, low, high)| {
            (self.rows.row(*j) * open) * (self.size_of[*j] / width(*low, *high))
        });
        let rows: Vec<_> = rows.collect();
        let wanted = slack.iter().map(|(_, low, high)| {
            // Distances from here: a stretch without end keeps the place nearest to the undeformed state.
            middle(*low, *high) / width(*low, *high)
        });
        let wanted = DVector::from_iterator(slack.len(), wanted);
        let matrix = DMatrix::from_rows(&rows);
        let Some(inner) = Cholesky::new(matrix.tr_mul(&matrix)) else {
            return;
        };
        let motion = open * inner.solve(&matrix.tr_mul(&wanted));
        let change = &self.rows * &motion;
        let room = slack.iter().map(|(j, low, high)| {
            let rate = self.size_of[*j] * change[*j];
            let end = if rate > 0.0 { *high } else { *low };
            if rate == 0.0 {
                f64::INFINITY
            } else {
                (end / rate).max(0.0)
            }
        });
        let share = room.fold(1.0, f64::min);
        self.q.axpy(share, &motion, 1.0);
    }
}
