//! What is known of a place on a curve: multipliers, criticality, and the functions that vanish at codimension 2.

use super::conditions::shifted;
use super::defining::Spot;
use super::shots::Passages;
use super::{CurveKind, Defining};
use crate::error::SolveError;
use crate::solve::floquet;
use nalgebra::DMatrix;
use num_complex::Complex;
use std::f64::consts::PI;

/// Kind of a point on a curve.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(crate) enum Codimension {
    /// Two fold curves meet.
    Cusp,
    /// Multipliers +1 and -1.
    FoldFlip,
    /// A pair of the angle 2 pi / n.
    Resonance(u8),
    /// A period doubling changes its criticality.
    GeneralisedFlip,
    /// A Neimark-Sacker event changes its criticality.
    GeneralisedTorus,
    /// A pair on the circle and +1.
    FoldTorus,
    /// A pair on the circle and -1.
    FlipTorus,
    /// An extremum touches a breakpoint, another one than that of the curve.
    MeetsGrazing {
        /// Connection.
        connection: usize,
    },
    /// A grazing curve meets one of folds.
    GrazingFold,
    /// A grazing curve meets one of period doublings.
    GrazingFlip,
    /// A grazing curve meets one of Neimark-Sacker events.
    GrazingTorus,
    /// The first parameter turns.
    TurningFirst,
    /// The second parameter turns.
    TurningSecond,
}

impl Codimension {
    /// Word for files.
    pub fn word(self) -> &'static str {
        match self {
            Codimension::Cusp => "cusp",
            Codimension::FoldFlip => "fold_flip",
            Codimension::Resonance(1) => "resonance_1_1",
            Codimension::Resonance(2) => "resonance_1_2",
            Codimension::Resonance(3) => "resonance_1_3",
            Codimension::Resonance(_) => "resonance_1_4",
            Codimension::GeneralisedFlip => "generalised_flip",
            Codimension::GeneralisedTorus => "generalised_neimark_sacker",
            Codimension::FoldTorus => "fold_neimark_sacker",
            Codimension::FlipTorus => "flip_neimark_sacker",
            Codimension::MeetsGrazing { .. }
            | Codimension::GrazingFold
            | Codimension::GrazingFlip
            | Codimension::GrazingTorus => "meets_grazing",
            Codimension::TurningFirst => "turning_1",
            Codimension::TurningSecond => "turning_2",
        }
    }

    /// Other curve at a crossing with a grazing curve.
    pub fn met(self) -> Option<&'static str> {
        match self {
            Codimension::GrazingFold => Some("fold"),
            Codimension::GrazingFlip => Some("period_doubling"),
            Codimension::GrazingTorus => Some("neimark_sacker"),
            _ => None,
        }
    }
}

/// A place on a curve with what is known there.
#[derive(Debug, Clone)]
pub(super) struct Nature {
    /// Angle of the critical multiplier; the phase of a touch.
    pub theta: f64,
    /// Coefficient of the normal form, negative where what branches off is attracting as far as the critical direction goes.
    pub criticality: f64,
    /// Functions that vanish at codimension 2.
    pub tests: Vec<(Codimension, f64)>,
    pub passages: Passages,
}

/// Distance, in sizes, by which a touching is undone before multipliers are taken: they have a square root on the other side.
const AWAY: f64 = 1e-11;
/// Phase and rate (in sizes) within which a passage is the touching itself.
const TOUCHING: (f64, f64) = (1e-2, 1e-4);

impl Defining<'_> {
    /// What is known of a spot; `None` where there is no image.
    pub(super) fn nature(&mut self, spot: &Spot) -> Result<Option<Nature>, SolveError> {
        let spot = &match self.kind {
            CurveKind::Grazing { .. } => self.untouched(spot, AWAY)?,
            _ => spot.clone(),
        };
        let Some(whole) = self.transition(spot)? else {
            return Ok(None);
        };
        let multipliers = floquet::multipliers(&whole.0);
        let (tests, criticality) = self.tests(spot, &whole, &multipliers)?;
        let mut passages = whole.1;
        if let CurveKind::Grazing { connection, .. } = self.kind {
            let (limit, period) = (TOUCHING.1 * self.size, self.shots.period());
            passages.forget_touching(connection, limit, |tau| {
                let gap = (tau - spot.extra).rem_euclid(period);
                gap.min(period - gap) < TOUCHING.0
            });
        }
        let theta = match self.kind {
            CurveKind::Fold | CurveKind::BranchPoint => 0.0,
            CurveKind::PeriodDoubling => PI,
            CurveKind::NeimarkSacker => spot.extra.clamp(-1.0, 1.0).acos(),
            CurveKind::Grazing { .. } => spot.extra.rem_euclid(self.shots.period()),
        };
        Ok(Some(Nature {
            theta,
            criticality,
            tests,
            passages,
        }))
    }

    fn tests(
        &mut self,
        spot: &Spot,
        whole: &(DMatrix<f64>, Passages),
        multipliers: &[Complex<f64>],
    ) -> Result<(Vec<(Codimension, f64)>, f64), SolveError> {
        let phi = &whole.0;
        let determinant = |shift: f64| shifted(phi, shift).determinant();
        let product = |shift: f64| {
            let vectors = self.vectors(&shifted(phi, shift));
            vectors.map_or(f64::NAN, |(p, q)| p.dot(&q))
        };
        Ok(match self.kind {
            CurveKind::Fold => {
                let (resonance, flip) = (product(-1.0), determinant(1.0));
                let a = self.fold_coefficient(spot, whole)?;
                let slope = self.slope(spot, 0)?;
                let side = self
                    .vectors(&shifted(phi, -1.0))
                    .map(|(p, _)| p.dot(&slope));
                let tests = vec![
                    (Codimension::Cusp, a),
                    (Codimension::Resonance(1), resonance),
                    (Codimension::FoldFlip, flip),
                ];
                (tests, side.map_or(f64::NAN, |side| -a * side))
            }
            CurveKind::BranchPoint => {
                let flip = (Codimension::FoldFlip, determinant(1.0));
                (vec![flip], f64::NAN)
            }
            CurveKind::PeriodDoubling => {
                let (resonance, fold) = (product(1.0), determinant(-1.0));
                let b = self.doubling_coefficient(spot, whole)?;
                let tests = vec![
                    (Codimension::Resonance(2), resonance),
                    (Codimension::FoldFlip, fold),
                    // The coefficient has a pole where the fold's determinant has a root.
                    (Codimension::GeneralisedFlip, b * fold),
                ];
                (tests, -b)
            }
            CurveKind::NeimarkSacker => {
                let d = self.torus_coefficient(spot, whole)?;
                let fold = determinant(-1.0);
                let tests = vec![
                    (Codimension::Resonance(1), spot.extra - 1.0),
                    (Codimension::Resonance(2), spot.extra + 1.0),
                    (Codimension::Resonance(3), spot.extra + 0.5),
                    (Codimension::Resonance(4), spot.extra),
                    // Without the pair's own share, |1 -+ e^(i theta)|^2, which vanishes at the strong resonances.
                    (Codimension::FoldTorus, fold / (2.0 - 2.0 * spot.extra)),
                    (
                        Codimension::FlipTorus,
                        determinant(1.0) / (2.0 + 2.0 * spot.extra),
                    ),
                    (Codimension::GeneralisedTorus, d * fold),
                ];
                (tests, d)
            }
            CurveKind::Grazing { .. } => {
                let pairs = multipliers.iter().filter(|mu| mu.im > 0.0);
                let distance = pairs.map(|mu| mu.norm() - 1.0);
                let nearest = distance.min_by(|a, b| a.abs().total_cmp(&b.abs()));
                let tests = vec![
                    (Codimension::GrazingFold, determinant(-1.0)),
                    (Codimension::GrazingFlip, determinant(1.0)),
                    (Codimension::GrazingTorus, nearest.unwrap_or(f64::NAN)),
                ];
                (tests, f64::NAN)
            }
        })
    }
}
