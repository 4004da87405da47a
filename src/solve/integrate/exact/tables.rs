//! What trajectories side by side need of the flow.

use super::Exact;
use super::ROUNDING;
use crate::numeric::taylor::Polynomial;
use crate::system::System;
use std::f64::consts::TAU;

/// What the trajectories have in common: a system of N coordinates, each of which is the deformation of a connection.
#[derive(Debug, Clone)]
pub struct LaneTables<const N: usize> {
    /// Unit of time of the series in omega_c t, and in phases of the response.
    pub unit: f64,
    pub per_theta: f64,
    /// A period of the excitation in phases of the response, and the phase of the excitation over that of the response.
    pub period: f64,
    pub turns: f64,
    /// h Gam.
    pub damping: [[f64; N]; N],
    pub mean: [f64; N],
    pub orders: Vec<TableOrder<N>>,
    pub lines: Vec<Line>,
    /// By the regions of all connections.
    pub variants: Vec<RegionTable<N>>,
}

/// A harmonic of the loads.
#[derive(Debug, Clone)]
pub struct TableOrder<const N: usize> {
    pub order: f64,
    pub scale: f64,
    pub cos: [f64; N],
    pub sin: [f64; N],
    /// w^k / k!.
    pub powers: Polynomial,
}

/// A connection with regions between breakpoints.
#[derive(Debug, Clone)]
pub struct Line {
    pub connection: usize,
    /// Sum of the moduli of W in its row.
    pub weight: f64,
    pub breakpoints: Vec<f64>,
    /// What its region counts in the number of a variant.
    pub stride: usize,
}

/// The equation with every connection in a region.
#[derive(Debug, Clone)]
pub(crate) struct RegionTable<const N: usize> {
    /// h^2 kappa diag(slope) W.
    pub coupled: [[f64; N]; N],
    /// -h^2 kappa offset.
    pub constant: [f64; N],
    /// Unit of time that suits it, in units of the series.
    pub pace: f64,
}

impl Line {
    /// Distance from a level that rounding bridges.
    #[inline(always)]
    pub fn tolerance(&self, level: f64, size: f64) -> f64 {
        ROUNDING * (level.abs() + self.weight * size)
    }
}

/// Combinations of regions at most.
const MOST_VARIANTS: usize = 4096;

impl Exact {
    /// The tables of a system for which they exist.
    pub(super) fn tables<const N: usize>(&mut self, system: &System) -> Option<LaneTables<N>> {
        let (mut lines, mut count) = (Vec::new(), 1_usize);
        for part in self.regions.parts() {
            lines.push(Line {
                connection: part.connection,
                weight: part.weight,
                breakpoints: part.law.breakpoints.clone(),
                stride: count,
            });
            count = count.saturating_mul(part.law.pieces.len());
        }
        if count > MOST_VARIANTS {
            return None;
        }
        let variants: Option<Vec<RegionTable<N>>> = (0..count)
            .map(|number| self.variant(system, &lines, number))
            .collect();
        let variants = variants?;
        let (mean, terms) = self.series.loads.harmonics()?;
        let unit = self.series.unit;
        let orders = terms.iter().map(|term| {
            Some(TableOrder {
                order: term.order,
                scale: term.scale,
                cos: *term.cos.first_chunk()?,
                sin: *term.sin.first_chunk()?,
                powers: term.powers,
            })
        });
        Some(LaneTables {
            unit,
            per_theta: system.omega() * unit,
            period: TAU / system.subharmonic() as f64,
            turns: system.subharmonic() as f64,
            damping: self.series.damping.rows(),
            mean: *mean.first_chunk()?,
            orders: orders.collect::<Option<_>>()?,
            lines,
            variants,
        })
    }

    /// The equation with the regions that a number stands for.
    fn variant<const N: usize>(
        &mut self,
        system: &System,
        lines: &[Line],
        number: usize,
    ) -> Option<RegionTable<N>> {
        for (part, line) in lines.iter().enumerate() {
            let region = number / line.stride % (line.breakpoints.len() + 1);
            self.regions.enter(part, region);
        }
        self.stiffen(system, 0.0).ok()?;
        Some(RegionTable {
            coupled: self.series.coupled.rows(),
            constant: *self.series.constant.first_chunk()?,
            pace: self.series.pace(),
        })
    }
}
