//! What becomes of an orbit at a grazing.

use super::defining::Spot;
use super::{CurveKind, Defining};
use crate::error::SolveError;
use nalgebra::DMatrix;

/// Stroboscopic map at the border between the orbits that touch and those that do not.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum BorderMap {
    /// Its derivative is continuous: the force of the connection is.
    Smooth,
    /// Its derivative jumps: a border collision of the map. A dashpot that pushes and does not pull takes the rate at once.
    Corner,
    /// Its derivative grows without bound as the touching becomes slight: an impact, or a force that jumps.
    SquareRoot,
}

impl BorderMap {
    /// Word for files.
    pub fn word(self) -> &'static str {
        match self {
            BorderMap::Smooth => "smooth",
            BorderMap::Corner => "border_collision",
            BorderMap::SquareRoot => "square_root",
        }
    }
}

/// Where the orbits that touch lie beside a grazing.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum OrbitsBeside {
    /// Across it from those that do not: the orbit goes on, touching.
    Persistence,
    /// On the same side of it: both meet at the grazing and vanish.
    Fold,
}

impl OrbitsBeside {
    /// Word for files.
    pub fn word(self) -> &'static str {
        match self {
            OrbitsBeside::Persistence => "persistence",
            OrbitsBeside::Fold => "fold",
        }
    }
}

/// Type of a grazing.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Grazing {
    /// The map.
    pub border: BorderMap,
    /// The orbits; `None` where the determinants decide nothing.
    pub fate: Option<OrbitsBeside>,
}

/// Clearance on the untouched side, and depths of a touching, in sizes: of a continuous force and of an impact, derivatives depend on
/// their square roots.
const CLEAR: f64 = 1e-11;
const DEPTHS: [f64; 2] = [1e-6, 1e-8];
/// Largest power of the depth, in modulus, that counts as none: a smooth border has 1/2, a square root -1/2.
const CORNER: f64 = 0.25;
/// Change of the derivative, relative to it, below which there is none.
const UNCHANGED: f64 = 1e-9;
/// Determinants below this, relative to the largest term, have no sign.
const NO_SIGN: f64 = 1e-9;

impl Defining<'_> {
    /// Type of a grazing on its curve; `None` elsewhere, or where the derivatives beside it are not known.
    ///
    /// ```text
    /// persistence: det(I - A) has one sign on both sides; fold: it changes its sign (Feigin)
    /// ```
    ///
    /// A: derivative of the map, in the limit of a slight touching on the touched side.
    ///
    /// # Errors
    /// The system cannot be made, or an interruption.
    pub fn grazing(&mut self, spot: &Spot) -> Result<Option<Grazing>, SolveError> {
        if !matches!(self.kind, CurveKind::Grazing { .. }) {
            return Ok(None);
        }
        let clear = self.beside(spot, CLEAR)?;
        let Some((before, passages)) = self.transition(&clear)? else {
            return Ok(None);
        };
        let mut touched = Vec::new();
        for depth in DEPTHS {
            let moved = self.beside(spot, -depth)?;
            match self.transition(&moved)? {
                Some((phi, found)) if !found.is_like(&passages) => touched.push(phi),
                _ => return Ok(None),
            }
        }
        let changes = touched.iter().map(|phi| (phi - &before).amax());
        let changes: Vec<f64> = changes.collect();
        let size = before.amax().max(1.0);
        if changes.iter().any(|change| !change.is_finite()) {
            return Ok(None);
        }
        let power = (changes[0] / changes[1]).ln() / (DEPTHS[0] / DEPTHS[1]).ln();
        let border = match power {
            _ if changes[0] <= UNCHANGED * size => BorderMap::Smooth,
            power if power > CORNER => BorderMap::Smooth,
            power if power < -CORNER => BorderMap::SquareRoot,
            _ => BorderMap::Corner,
        };
        let signs: Vec<Option<bool>> = touched.iter().map(sign).collect();
        let fate = match (sign(&before), border) {
            (None, _) => None,
            (_, BorderMap::Smooth) => Some(OrbitsBeside::Persistence),
            (own, _) if signs == [own; 2] => Some(OrbitsBeside::Persistence),
            (Some(own), _) if signs == [Some(!own); 2] => Some(OrbitsBeside::Fold),
            _ => None,
        };
        Ok(Some(Grazing { border, fate }))
    }
}

/// Whether det(I - A) is positive; `None` where it is 0 to rounding, as beside a multiplier +1 that a memory has.
fn sign(a: &DMatrix<f64>) -> Option<bool> {
    let n = a.nrows();
    let matrix = DMatrix::identity(n, n) - a;
    let rows = matrix.row_iter().map(|row| row.norm());
    let largest: f64 = rows.product();
    let determinant = matrix.determinant();
    (determinant.abs() > NO_SIGN * largest).then_some(determinant > 0.0)
}
