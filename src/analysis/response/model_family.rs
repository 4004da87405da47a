//! The systems along a number of the model.

use super::swept::Track;
use crate::analysis::Setting;
use crate::analysis::parameter::{Variation, joined};
use crate::error::SolveError;
use crate::solve::family::Family;
use crate::system::{Line, System};
use crate::yaml::Node;

/// Systems kept: a value and its two neighbours, which Newton's iteration asks for in turn.
const KEPT: usize = 3;
/// Places at which a straight line is held against the model.
const PROBES: [f64; 3] = [0.061, 0.463, 0.937];
/// Ends of the line: where a load vanishes at an end, the system there lacks a number.
const LINES: [(f64, f64); 2] = [(0.0, 1.0), (0.01, 0.99)];

/// The systems between two values of a number of the model, over lambda from 0 to 1.
///
/// Many numbers enter the scaled equation affinely (loads, gaps, damping): the system is then a point on the line between two
/// systems, and no model is read. For the others (inertias, stiffnesses, phases) the model is read and assembled again.
///
/// Beyond the ends of the range, where the path following looks over the border, the system of the end stands in for one that
/// does not exist.
pub(super) struct ModelFamily<'a> {
    variation: Variation<'a>,
    track: &'a Track,
    subharmonic: usize,
    line: Option<(f64, f64, Line)>,
    /// With their lambda; NaN before the first use.
    kept: [(f64, System); KEPT],
    next: usize,
}

impl<'a> ModelFamily<'a> {
    /// The systems of a setting along a number of its model.
    ///
    /// # Errors
    /// There is no system at lambda = 0.
    pub fn new(
        setting: &'a Setting<'a>,
        track: &'a Track,
        subharmonic: usize,
    ) -> Result<ModelFamily<'a>, SolveError> {
        let system = setting.assembly.system.clone();
        let mut family = ModelFamily {
            variation: Variation::new(setting, &track.path),
            track,
            subharmonic,
            line: None,
            kept: std::array::from_fn(|_| (f64::NAN, system.clone())),
            next: 0,
        };
        family.kept[0] = (0.0, family.built(0.0)?);
        family.line = LINES.iter().find_map(|ends| family.line_between(*ends));
        Ok(family)
    }

    /// The straight line through the systems at two places, if the others lie on it.
    fn line_between(&mut self, (a, b): (f64, f64)) -> Option<(f64, f64, Line)> {
        let (first, last) = (self.built(a).ok()?, self.built(b).ok()?);
        let line = Line::between(&first, &last)?;
        for place in PROBES {
            let system = self.built(place).ok()?;
            if !line.passes((place - a) / (b - a), &system) {
                return None;
            }
        }
        Some((a, b, line))
    }

    /// The system of the model, read and assembled.
    fn built(&mut self, lambda: f64) -> Result<System, SolveError> {
        let value = Node::number(self.track.value(lambda));
        let found = self.variation.at(value);
        let (_, assembly) = found.map_err(|list| SolveError::NoSystem {
            reason: joined(&list),
        })?;
        let mut system = assembly.system;
        system.set_subharmonic(self.subharmonic);
        system.set_reference_frequency(self.track.at);
        Ok(system)
    }

    /// Makes the system at lambda the one in a slot.
    fn fill(&mut self, slot: usize, lambda: f64) -> Result<(), SolveError> {
        if let Some((a, b, line)) = &self.line
            && (*a..=*b).contains(&lambda)
        {
            self.kept[slot].1 = line.system((lambda - a) / (b - a));
        } else {
            let border = lambda.clamp(0.0, 1.0);
            self.kept[slot].1 = match self.built(lambda) {
                Err(_) if border != lambda => self.built(border)?,
                built => built?,
            };
        }
        self.kept[slot].0 = lambda;
        Ok(())
    }
}

impl Family for ModelFamily<'_> {
    fn at(&mut self, lambda: f64) -> Result<&System, SolveError> {
        let known = self.kept.iter().position(|(place, _)| *place == lambda);
        let slot = match known {
            Some(slot) => slot,
            None => {
                let slot = self.next;
                self.next = (slot + 1) % KEPT;
                // A slot that fails halfway holds nothing.
                self.kept[slot].0 = f64::NAN;
                self.fill(slot, lambda)?;
                slot
            }
        };
        Ok(&self.kept[slot].1)
    }

    /// Inside the range, for a model may end at its border; a step for the size of the number, where that is the larger one.
    fn neighbours(&self, lambda: f64) -> (f64, f64) {
        let (from, to) = self.track.ends;
        let size = self.track.value(lambda).abs() / (to - from).abs();
        let h = f64::EPSILON.cbrt() * size.clamp(1.0, 1e3);
        let (low, high) = (lambda - h, lambda + h);
        if (0.0..=1.0).contains(&lambda) {
            (low.max(0.0), high.min(1.0))
        } else {
            (low, high)
        }
    }
}
