//! Lever arms of connections, and the teeth that they follow from.
//!
//! ```text
//! R_b = m_n z cos(alpha_t) / (2 cos beta),    tan(alpha_t) = tan(alpha_n) / cos(beta)
//! ```
//!
//! m_n normal module, alpha_n normal pressure angle, beta helix angle, z teeth.

use super::fields::Mistakes;
use super::kinematics::RigidRow;
use super::{Body, DeformationUnit, Motion};
use crate::error::{Diagnostic, did_you_mean, nearest};
use crate::numeric::fraction::{self, Fraction, whole};
use crate::yaml::Node;
use indexmap::IndexMap;
use num_traits::Signed;

/// Bodies by name; `None` for a body that was named but has an error of its own.
pub(super) type Bodies = IndexMap<String, Option<Body>>;

/// Arms of a connection and the unit of its deformation.
#[derive(Debug, Clone)]
pub(super) struct Geometry {
    pub arms: Vec<(usize, f64)>,
    pub unit: DeformationUnit,
    /// Of a mesh that is given by them.
    pub teeth: Option<Teeth>,
}

impl Geometry {
    pub(super) fn new(arms: Vec<(usize, f64)>, unit: DeformationUnit) -> Geometry {
        Geometry {
            arms,
            unit,
            teeth: None,
        }
    }

    /// The connection in rigid motion: tooth numbers where there are any, else the arms as the simplest fractions.
    pub(super) fn row(&self) -> RigidRow {
        let arms = match &self.teeth {
            Some(teeth) => teeth.row(),
            None => {
                let arms = self.arms.iter();
                arms.map(|(b, arm)| (*b, fraction::nearest(*arm))).collect()
            }
        };
        RigidRow { arms }
    }
}

/// A mesh of two wheels with teeth.
#[derive(Debug, Clone, PartialEq)]
pub struct Teeth {
    /// Bodies with their numbers of teeth; the second one is the ring of an internal mesh.
    pub wheels: [(usize, usize); 2],
    /// Whether the second wheel is a ring.
    pub is_internal: bool,
    /// The turning carrier of the mesh.
    pub carrier: Option<usize>,
    /// Normal module \[m\].
    pub module: f64,
    /// Normal pressure angle \[rad\].
    pub pressure_angle: f64,
    /// Helix angle \[rad\].
    pub helix_angle: f64,
    /// Working centre distance \[m\], where it is given.
    pub centre_distance: Option<f64>,
}

impl Teeth {
    /// Transverse pressure angle \[rad\].
    pub fn transverse_pressure_angle(&self) -> f64 {
        (self.pressure_angle.tan() / self.helix_angle.cos()).atan()
    }

    /// Helix angle on the base cylinder \[rad\]: sin(beta_b) = sin(beta) cos(alpha_n).
    pub fn base_helix_angle(&self) -> f64 {
        (self.helix_angle.sin() * self.pressure_angle.cos()).asin()
    }

    /// Base radii of both wheels \[m\].
    pub fn base_radii(&self) -> [f64; 2] {
        let share = self.transverse_pressure_angle().cos();
        self.wheels
            .map(|(_, z)| self.module * z as f64 * share / (2.0 * self.helix_angle.cos()))
    }

    /// Centre distance without profile shift \[m\].
    pub fn reference_centre_distance(&self) -> f64 {
        let [a, b] = self.wheels.map(|(_, z)| z as f64);
        let sum = if self.is_internal { b - a } else { a + b };
        self.module * sum / (2.0 * self.helix_angle.cos())
    }

    /// Sum of the profile shift coefficients (their difference in an internal mesh) that a centre distance asks for; `None`
    /// where no involute mesh has it.
    ///
    /// ```text
    /// x = z (inv alpha_w - inv alpha_t) / (2 tan alpha_n),    cos alpha_w = a_ref cos alpha_t / a
    /// ```
    pub fn profile_shift(&self, centre_distance: f64) -> Option<f64> {
        let (alpha, reference) = (
            self.transverse_pressure_angle(),
            self.reference_centre_distance(),
        );
        let cosine = reference * alpha.cos() / centre_distance;
        let involute = |angle: f64| angle.tan() - angle;
        let [a, b] = self.wheels.map(|(_, z)| z as f64);
        let teeth = if self.is_internal { b - a } else { a + b };
        (cosine.abs() < 1.0).then(|| {
            teeth * (involute(cosine.acos()) - involute(alpha)) / (2.0 * self.pressure_angle.tan())
        })
    }

    /// Row of tooth numbers: what the lever arms are proportional to.
    pub fn row(&self) -> Vec<(usize, Fraction)> {
        let [a, b] = self.signed();
        let mut row = vec![(self.wheels[0].0, whole(a)), (self.wheels[1].0, whole(b))];
        row.extend(self.carrier.map(|carrier| (carrier, whole(-a - b))));
        row
    }

    /// Lever arms \[m\]: base radii, and the carrier's so that the set strains nothing when it turns as one body.
    pub(super) fn arms(&self) -> Vec<(usize, f64)> {
        let [a, b] = self.base_radii();
        let b = if self.is_internal { -b } else { b };
        let mut arms = vec![(self.wheels[0].0, a), (self.wheels[1].0, b)];
        arms.extend(self.carrier.map(|carrier| (carrier, -a - b)));
        arms
    }

    fn signed(&self) -> [i64; 2] {
        let [a, b] = self.wheels.map(|(_, z)| z as i64);
        [a, if self.is_internal { -b } else { b }]
    }

    /// Tooth passing order: z |w - w_carrier| over the reference's speed, in whose units `speeds` are.
    pub fn order(&self, speeds: &[Fraction]) -> Fraction {
        let (body, z) = self.wheels[0];
        let slip = match self.carrier {
            Some(carrier) => &speeds[body] - &speeds[carrier],
            None => speeds[body].clone(),
        };
        slip.abs() * whole(z as i64)
    }

    /// Order at which the same two teeth meet again: the tooth order over lcm(z_1, z_2).
    pub fn hunting_order(&self, order: &Fraction) -> Fraction {
        let [a, b] = self.wheels.map(|(_, z)| z);
        let multiple = a / crate::numeric::fraction::gcd(a, b) * b;
        order / whole(multiple as i64)
    }
}

/// Finds bodies by name and notes that something holds them.
pub(super) struct Finder<'b> {
    pub bodies: &'b Bodies,
    pub held: &'b mut [bool],
}

impl Finder<'_> {
    pub(super) fn body(
        &mut self,
        name: &str,
        at: Diagnostic,
        mistakes: &mut Mistakes,
    ) -> Option<usize> {
        let found = self.bodies.get_index_of(name);
        match found {
            Some(body) => self.held[body] = true,
            None => {
                // The body that was probably meant is not reported as unheld on top.
                let meant = nearest(name, self.bodies.keys());
                if let Some(body) = meant.and_then(|name| self.bodies.get_index_of(name)) {
                    self.held[body] = true;
                }
                // Without any body the error is above.
                if !self.bodies.is_empty() {
                    mistakes.add(unknown_body(name, self.bodies, at));
                }
            }
        }
        found
    }

    /// A body that turns.
    pub(super) fn wheel(
        &mut self,
        name: &str,
        at: Diagnostic,
        mistakes: &mut Mistakes,
    ) -> Option<usize> {
        let body = self.body(name, at.clone(), mistakes)?;
        if self.motion(body) == Some(Motion::Translation) {
            let message = format!("`{name}` is a translating mass (inertia in kg), not a wheel");
            let mistake = Diagnostic { message, ..at };
            mistakes.add(mistake.with_help("use acts_on with lever arm 1 for it"));
        }
        Some(body)
    }

    /// The body that a scalar names.
    pub(super) fn named(
        &mut self,
        node: &Node,
        path: &str,
        mistakes: &mut Mistakes,
    ) -> Option<usize> {
        let name = mistakes.note(node.as_text(path))?;
        self.body(name, Diagnostic::at(node, path, ""), mistakes)
    }

    pub(super) fn motion(&self, body: usize) -> Option<Motion> {
        self.bodies[body].map(|body| body.motion)
    }
}

/// An unknown body, at the place of `at`.
pub(super) fn unknown_body(name: &str, bodies: &Bodies, at: Diagnostic) -> Diagnostic {
    Diagnostic {
        message: format!("unknown body `{name}`"),
        ..at
    }
    .with_help(did_you_mean(name, bodies.keys()))
}
