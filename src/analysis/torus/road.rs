//! The systems along one number of the model, as shares of its range.

use crate::analysis::bifurcation_curve::{Axis, KEPT};
use crate::analysis::parameter::{Parameter, joined, rebuild};
use crate::analysis::{Fault, Setting};
use crate::error::SolveError;
use crate::solve::curve::Plane;
use crate::system::{Line, System};
use crate::yaml::Node;

/// Places at which a straight line is held against the model.
const PROBES: [f64; 3] = [0.061, 0.463, 0.937];

/// The systems of a range; the second parameter of the plane is idle.
pub(in crate::analysis) struct Road<'a> {
    setting: &'a Setting<'a>,
    axis: Axis,
    /// Excitation frequency over omega_c, where it is not the parameter.
    at: f64,
    subharmonic: usize,
    root: Node,
    line: Option<Line>,
}

impl<'a> Road<'a> {
    /// Along this axis.
    pub fn new(setting: &'a Setting<'a>, axis: Axis, at: f64, subharmonic: usize) -> Road<'a> {
        let parts = KEPT.into_iter();
        let parts = parts.filter_map(|key| Some((key, setting.model.document().get(key)?.clone())));
        let mut road = Road {
            setting,
            root: Node::map(parts),
            axis,
            at,
            subharmonic,
            line: None,
        };
        road.line = road.straight();
        road
    }

    fn straight(&mut self) -> Option<Line> {
        let line = Line::between(&self.built(0.0).ok()?, &self.built(1.0).ok()?)?;
        let mut passes = |share: f64| self.built(share).is_ok_and(|s| line.passes(share, &s));
        PROBES.into_iter().all(&mut passes).then_some(line)
    }

    fn built(&mut self, share: f64) -> Result<System, SolveError> {
        let refused = |reason: String| SolveError::NoSystem { reason };
        let Parameter::Path(path) = &self.axis.parameter else {
            return Ok(self.setting.assembly.system.clone());
        };
        let value = Node::number(self.axis.value(share));
        let done = self.root.set(path, value);
        done.map_err(|mistake| refused(joined(&[mistake])))?;
        let found = rebuild(&self.root, self.setting.assembly);
        Ok(found.map_err(|list| refused(joined(&list)))?.1.system)
    }

    /// What is wrong with the range.
    pub fn check(&mut self) -> Option<Fault> {
        let mut one = |share: f64| self.system([share, 0.0]);
        match (one(0.0), one(0.381_966_011), one(1.0)) {
            (Err(error), ..) => Some(Fault::new("from", error.to_string())),
            (_, _, Err(error)) => Some(Fault::new("to", error.to_string())),
            (Ok(a), Ok(b), _) if self.axis.parameter != Parameter::Frequency && a.is_alike(&b) => {
                let message = format!(
                    "{} changes nothing: the scaled equation is the same at every value",
                    self.axis.written
                );
                Some(Fault::new("parameter", message))
            }
            _ => None,
        }
    }
}

impl Plane for Road<'_> {
    fn system(&mut self, p: [f64; 2]) -> Result<System, SolveError> {
        let frequency = self.reference_frequency(p);
        if frequency <= 0.0 || frequency.is_nan() {
            let reason = format!("the frequency would be {frequency}");
            return Err(SolveError::NoSystem { reason });
        }
        let mut system = match &self.line {
            Some(line) if (0.0..=1.0).contains(&p[0]) => line.system(p[0]),
            _ => self.built(p[0])?,
        };
        system.set_subharmonic(self.subharmonic);
        system.set_reference_frequency(frequency);
        Ok(system)
    }

    fn frequency(&self) -> Option<usize> {
        (self.axis.parameter == Parameter::Frequency).then_some(0)
    }

    fn reference_frequency(&self, p: [f64; 2]) -> f64 {
        match self.axis.parameter {
            Parameter::Frequency => self.axis.value(p[0]),
            Parameter::Path(_) => self.at,
        }
    }
}
