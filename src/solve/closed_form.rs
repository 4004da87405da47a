//! Requirements of piecewise-affine methods on a connection: one list for the exact flow and the exact quadrature.

use crate::numeric::periodic::Periodic;
use crate::system::Mount;

/// A method that takes forces in closed form between two switches.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(crate) enum ClosedForm {
    /// The motion, by the exact flow.
    Flow,
    /// The motion, by the series flow. What the law itself needs is seen when it is followed.
    Series,
    /// The Fourier integrals of the force, by the exact quadrature.
    Quadrature,
}

impl ClosedForm {
    /// Reason why the method does not apply to a connection; `None` if it applies.
    pub fn refusal(self, mount: &Mount) -> Option<String> {
        let need = self.need(mount)?;
        Some(match self {
            ClosedForm::Flow => format!("exact integration needs {need}"),
            ClosedForm::Series => format!("the series flow needs {need}"),
            ClosedForm::Quadrature => format!("exact quadrature needs {need}"),
        })
    }

    fn need(self, mount: &Mount) -> Option<&'static str> {
        let law = mount.element.as_ref();
        let has_automaton = law.automata().is_some();
        if self == ClosedForm::Quadrature && law.least_impact().is_some() {
            return Some("a law without impacts");
        }
        let varies = mount.stiffness_variation.iter().any(|s| !s.is_constant());
        if self == ClosedForm::Quadrature && law.memory_count() > 0 && varies {
            return Some("a constant stiffness of a law with memory");
        }
        let is_affine = law.is_piecewise_affine() || has_automaton;
        if self != ClosedForm::Series && (!is_affine || law.depends_on_velocity()) {
            return Some("a piecewise-affine law (and impact_damping 0)");
        }
        if law.least_impact().is_some()
            && matches!(mount.transmission_error, Some(Periodic::Table { .. }))
        {
            return Some("a transmission error made of harmonics at a rigid stop, not of a table");
        }
        let error = mount.transmission_error.as_ref();
        match (self, error) {
            (_, None | Some(Periodic::Fourier { .. })) => {}
            (ClosedForm::Quadrature, Some(_)) => {
                return Some("a transmission error made of harmonics, not of a table");
            }
            (_, Some(Periodic::Rectangular { .. })) => {
                return Some("a transmission error without jumps");
            }
            (_, Some(Periodic::Table { .. } | Periodic::Uneven { .. })) => {}
        }
        let is_allowed = |s: &Periodic| match s {
            _ if s.is_constant() => true,
            Periodic::Rectangular { .. } => true,
            Periodic::Fourier { .. } => self != ClosedForm::Flow,
            Periodic::Table { .. } | Periodic::Uneven { .. } => self == ClosedForm::Series,
        };
        match self {
            _ if mount.stiffness_variation.iter().all(is_allowed) => None,
            ClosedForm::Flow | ClosedForm::Series => {
                Some("a constant or rectangular stiffness variation")
            }
            ClosedForm::Quadrature => {
                Some("a stiffness variation made of harmonics or rectangular, not of a table")
            }
        }
    }
}
