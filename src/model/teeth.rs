//! Meshes given by tooth numbers: base radii, exact ratios, tooth orders.
//!
//! ```text
//! R_b = m_n z cos(alpha_t) / (2 cos beta),    tan(alpha_t) = tan(alpha_n) / cos(beta)
//! ```
//!
//! m_n normal module, alpha_n normal pressure angle, beta helix angle, z teeth.

use super::DeformationUnit;
use super::fields::{Fields, Measure, Mistakes, Range, count};
use super::geometry::{Finder, Geometry};
use crate::error::Diagnostic;
use crate::numeric::fraction::{Fraction, whole};
use crate::quantity::UnitDimension;
use crate::yaml::{Node, Value};
use num_traits::Signed;

/// Keys that give a tooth its shape.
const SHAPE: [&str; 4] = ["module", "pressure_angle", "helix_angle", "centre_distance"];
/// Most teeth of a wheel.
const MOST_TEETH: usize = 100_000;
/// Normal pressure angle without a word about it \[rad\].
const PRESSURE_ANGLE: f64 = 20.0 * std::f64::consts::PI / 180.0;
/// Largest pressure and helix angles \[rad\]: beyond lies no gear.
const STEEPEST: f64 = 60.0 * std::f64::consts::PI / 180.0;

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
    fn arms(&self) -> Vec<(usize, f64)> {
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

/// Whether a node is a map: the teeth of a mesh, and not the radius of a body of that name.
pub(super) fn is_map(node: &Node) -> bool {
    matches!(node.value, Value::Map(_))
}

/// A pair of wheels on fixed axes.
pub(super) fn pair(
    node: &Node,
    path: &str,
    is_internal: bool,
    find: &mut Finder<'_>,
    mistakes: &mut Mistakes,
) -> Option<Geometry> {
    let keys = ["teeth"].into_iter().chain(SHAPE).collect::<Vec<_>>();
    let fields = Fields::known(node, path, &keys, mistakes)?;
    let wheels = numbers(&fields, find, mistakes);
    mesh(&fields, wheels, is_internal, None, mistakes)
}

/// Sun and planet on a turning carrier: R_s th_s + R_p th_p - (R_s + R_p) th_c.
pub(super) fn planet_gear(
    node: &Node,
    path: &str,
    find: &mut Finder<'_>,
    mistakes: &mut Mistakes,
) -> Option<Geometry> {
    planet(node, path, ("sun", "planet"), false, find, mistakes)
}

/// Planet and ring on a turning carrier: R_p th_p - R_r th_r + (R_r - R_p) th_c.
pub(super) fn planet_ring(
    node: &Node,
    path: &str,
    find: &mut Finder<'_>,
    mistakes: &mut Mistakes,
) -> Option<Geometry> {
    planet(node, path, ("planet", "ring"), true, find, mistakes)
}

fn planet(
    node: &Node,
    path: &str,
    roles: (&'static str, &'static str),
    is_internal: bool,
    find: &mut Finder<'_>,
    mistakes: &mut Mistakes,
) -> Option<Geometry> {
    // `planets` stood for copies of this mesh, which have none.
    let keys = [roles.0, roles.1, "carrier", "teeth", "planets"];
    let keys: Vec<&str> = keys.into_iter().chain(SHAPE).collect();
    let fields = Fields::known(node, path, &keys, mistakes)?;
    let mut body = |role: &str| {
        let node = fields.required(role, "the name of a body", mistakes)?;
        find.named(node, &fields.path_of(role), mistakes)
    };
    let (first, second, carrier) = (body(roles.0), body(roles.1), body("carrier"));
    let numbers = numbers(&fields, find, mistakes)?;
    let (first, second, carrier) = (first?, second?, carrier?);
    if first == second || first == carrier || second == carrier {
        let message = format!("{}, {} and carrier must be three bodies", roles.0, roles.1);
        mistakes.add(Diagnostic::at(node, path, message));
        return None;
    }
    let teeth = |body: usize| numbers.iter().find(|(b, _)| *b == body).copied();
    let Some(wheels) = teeth(first).zip(teeth(second)) else {
        let message = format!("wanted the numbers of teeth of {} and {}", roles.0, roles.1);
        let at = fields.get("teeth").unwrap_or(node);
        mistakes.add(Diagnostic::at(at, &fields.path_of("teeth"), message));
        return None;
    };
    let wheels = Some([wheels.0, wheels.1]);
    mesh(&fields, wheels, is_internal, Some(carrier), mistakes)
}

/// Two bodies with their numbers of teeth, in the order of the file.
fn numbers(
    fields: &Fields<'_>,
    find: &mut Finder<'_>,
    mistakes: &mut Mistakes,
) -> Option<[(usize, usize); 2]> {
    let example = "two wheels with their numbers of teeth, such as {A: 23, B: 41}";
    let node = fields.required("teeth", example, mistakes)?;
    let own = Fields::open(node, &fields.path_of("teeth"), mistakes)?;
    if own.len() != 2 {
        let message = format!("found {} bodies, wanted {example}", own.len());
        mistakes.add(Diagnostic::at(node, &own.path, message));
        return None;
    }
    let mut list = Vec::new();
    for (name, entry) in own.entries() {
        let path = own.path_of(name);
        let body = find.wheel(name, Diagnostic::at_key(entry, &path, ""), mistakes);
        let teeth = mistakes.note(count(&entry.node, &path, MOST_TEETH));
        list.extend(body.zip(teeth));
    }
    list.try_into().ok()
}

fn mesh(
    fields: &Fields<'_>,
    wheels: Option<[(usize, usize); 2]>,
    is_internal: bool,
    carrier: Option<usize>,
    mistakes: &mut Mistakes,
) -> Option<Geometry> {
    let length = Measure::Si(UnitDimension::LENGTH);
    fields.required("module", "the normal module, such as 2.25 mm", mistakes);
    let module = fields.number("module", length, Range::Positive, mistakes);
    let pressure_angle = angle(fields, "pressure_angle", PRESSURE_ANGLE, mistakes);
    let helix_angle = angle(fields, "helix_angle", 0.0, mistakes);
    let centre_distance = fields.number("centre_distance", length, Range::Positive, mistakes);
    let wheels = wheels?;
    if is_internal && wheels[0].1 >= wheels[1].1 {
        let message = format!(
            "found {} teeth inside a ring of {}: name the ring second; it must have more teeth",
            wheels[0].1, wheels[1].1
        );
        let node = fields.get("teeth").unwrap_or(fields.node);
        mistakes.add(Diagnostic::at(node, &fields.path_of("teeth"), message));
        return None;
    }
    let teeth = Teeth {
        wheels,
        is_internal,
        carrier,
        module: module?,
        pressure_angle: pressure_angle?,
        helix_angle: helix_angle?,
        centre_distance,
    };
    let impossible = centre_distance.filter(|a| teeth.profile_shift(*a).is_none());
    if let (Some(_), Some(node)) = (impossible, fields.get("centre_distance")) {
        let message = format!(
            "no involute mesh of these teeth has this centre distance; without profile shift it is {:.6} m",
            teeth.reference_centre_distance()
        );
        mistakes.add(Diagnostic::at(
            node,
            &fields.path_of("centre_distance"),
            message,
        ));
    }
    Some(Geometry {
        arms: teeth.arms(),
        unit: DeformationUnit::Metre,
        teeth: Some(teeth),
    })
}

fn angle(fields: &Fields<'_>, key: &str, absent: f64, mistakes: &mut Mistakes) -> Option<f64> {
    let Some(node) = fields.get(key) else {
        return Some(absent);
    };
    let path = fields.path_of(key);
    let measure = Measure::Si(UnitDimension::ANGLE);
    let value = mistakes.number(node, &path, measure, Range::NotNegative)?;
    if value <= STEEPEST {
        return Some(value);
    }
    let message = format!("found {}, wanted at most 60 deg", node.describe());
    mistakes.add(
        Diagnostic::at(node, &path, message).with_help("such as `20 deg`: a bare number is in rad"),
    );
    None
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_centre_distance_asks_for_a_profile_shift() {
        // 20 and 40 teeth, module 1 mm, reference centre distance 30 mm; x_1 + x_2 = 0.5 gives 30.4733 mm.
        let teeth = Teeth {
            wheels: [(0, 20), (1, 40)],
            is_internal: false,
            carrier: None,
            module: 1e-3,
            pressure_angle: PRESSURE_ANGLE,
            helix_angle: 0.0,
            centre_distance: None,
        };
        assert!((teeth.reference_centre_distance() - 0.03).abs() < 1e-15);
        let at = |a: f64| teeth.profile_shift(a).expect("a mesh");
        assert!(at(0.03).abs() < 1e-9);
        assert!((at(0.030_473_3) - 0.5).abs() < 1e-4, "{}", at(0.030_473_3));
        assert_eq!(teeth.profile_shift(0.02), None);
    }
}
