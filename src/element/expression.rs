//! A law typed as a formula.

mod formula;
mod kinks;
mod program;
mod reader;
mod relation;
mod token;

use super::derivatives::{Dual, from_force};
use super::traced::Symbol;
use super::{Dimension, Element, InvalidParameter, Parameter, ParameterKind, Response, Scale};
pub use relation::Relation;

use formula::{Formula, FormulaNode, Variable, is_reserved};
use indexmap::IndexMap;
use kinks::FoundKinks;
use program::{FormulaArguments, run};
use serde::{Deserialize, Serialize};
use std::f64::consts::TAU;

/// Longest formula in bytes.
const MAX_TEXT: usize = 10_000;
/// Deepest nesting of brackets and operators.
const MAX_DEPTH: usize = 100;
/// Most places where a formula may switch: each is looked for in every region between the others.
const MAX_SWITCHES: usize = 100;
/// Most intermediate values at once.
const MAX_STACK: usize = 64;

/// A law typed as a formula of q, v and phase.
///
/// ```text
/// f = F(q, v, phase) / K
/// ```
///
/// F: force in N of q in m and v in m/s (N m, rad, rad/s for shafts; nondimensional in reduced models), K: reference stiffness.
/// phase: that of the excitation, from 0 to 2 pi. Numbers (`1e5`, `.5`), `+ - * / ^` with `-q^2` = -(q^2) and `2^3^2` =
/// 2^9, comparisons, `and`, `or`, `not`, `pi`, the functions abs, sign, min, max, if(condition, then, else), sqrt, exp,
/// log (natural), sin, cos, tan, atan, sinh, cosh, tanh, and named parameters. Derivatives are exact.
///
/// Breakpoints are found where abs, sign, min, max and conditions switch on something affine in q alone; other switches
/// give a caution, and no solver locates them. Regions where the force vanishes altogether count as open (no contact).
#[derive(Debug, Clone, Serialize, Deserialize)]
#[serde(from = "ExpressionKeys", into = "ExpressionKeys")]
pub struct Expression {
    force: String,
    parameters: IndexMap<String, f64>,
    formula: Result<Formula, FormulaError>,
    /// Parameters as the instructions number them.
    values: Vec<f64>,
    kinks: FoundKinks,
    /// Flank in each region between breakpoints.
    flanks: Vec<i8>,
    is_discontinuous: bool,
    jumps_with_the_phase: bool,
    scale: Scale,
}

/// The law as a user writes it.
#[derive(Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
struct ExpressionKeys {
    force: String,
    #[serde(default, skip_serializing_if = "IndexMap::is_empty")]
    parameters: IndexMap<String, f64>,
}

/// An error in a formula and its position.
#[derive(Debug, Clone, PartialEq, thiserror::Error)]
#[error("{message} (character {})", place + 1)]
pub struct FormulaError {
    /// Characters before the place.
    pub place: usize,
    /// Found and expected values.
    pub message: String,
}

impl FormulaError {
    /// `start`: bytes before the place.
    fn new(text: &str, start: usize, message: impl Into<String>) -> FormulaError {
        FormulaError {
            place: text[..start].chars().count(),
            message: message.into(),
        }
    }
}

crate::register_element! {
    tag: "expression",
    doc: "f = force/K with the force as a formula of q, v and phase in SI units; exact derivatives",
    parameters: [
        { name: "force", doc: "formula of the force in N or N m; q, v in m, m/s or rad, rad/s; phase of the excitation; abs sign min max if(c, a, b) sqrt exp log sin cos tan atan sinh cosh tanh, < <= > >= == != and or not, pi", kind: ParameterKind::Text, dimension: Dimension::NONE, default: None },
        { name: "parameters", doc: "named numbers of the formula; quantities are converted to SI units", kind: ParameterKind::Map, dimension: Dimension::NONE, default: Some("{}") },
    ],
    example: "{type: expression, force: \"k*max(q - b, 0) + c*v\", parameters: {k: 2.0, b: 0.3, c: 0.1}}",
}

impl From<ExpressionKeys> for Expression {
    fn from(written: ExpressionKeys) -> Expression {
        let ExpressionKeys { force, parameters } = written;
        let names: Vec<&str> = parameters.keys().map(String::as_str).collect();
        let formula = reader::read(&force, &names);
        let mut law = Expression {
            force,
            parameters,
            formula,
            values: Vec::new(),
            kinks: FoundKinks::default(),
            flanks: Vec::new(),
            is_discontinuous: false,
            jumps_with_the_phase: false,
            scale: Scale::default(),
        };
        law.refresh();
        law
    }
}

impl From<Expression> for ExpressionKeys {
    fn from(law: Expression) -> ExpressionKeys {
        let Expression {
            force, parameters, ..
        } = law;
        ExpressionKeys { force, parameters }
    }
}

impl Expression {
    /// The law of a formula with named parameters.
    ///
    /// # Errors
    /// The error in the formula and its position. [`Element::validate`] reports errors in the parameters.
    pub fn new(force: &str, parameters: &[(&str, f64)]) -> Result<Expression, FormulaError> {
        let parameters = parameters.iter().map(|(name, x)| ((*name).to_owned(), *x));
        let law = Expression::from(ExpressionKeys {
            force: force.to_owned(),
            parameters: parameters.collect(),
        });
        match law.formula {
            Err(fault) => Err(fault),
            Ok(_) => Ok(law),
        }
    }

    /// Response in the units of the formula; NaN where there is no formula.
    #[inline]
    fn own(&self, q: f64, v: f64, phase: f64) -> Response {
        let Ok(formula) = &self.formula else {
            let nan = f64::NAN;
            return Response {
                f: nan,
                df_dq: nan,
                df_dv: nan,
            };
        };
        let phase = if self.kinks.on_phase {
            phase.rem_euclid(TAU)
        } else {
            0.0
        };
        from_force(q, v, |q, v| {
            let phase = Dual::from(phase);
            run(formula, &self.values, FormulaArguments { q, v, phase })
        })
    }

    /// What follows from the formula and the values of its parameters.
    fn refresh(&mut self) {
        self.values = self.parameters.values().copied().collect();
        let Ok(formula) = &self.formula else {
            return;
        };
        self.kinks = kinks::find(formula, &self.values);
        self.jumps_with_the_phase = self.differs_after_a_turn();
        self.is_discontinuous = self.has_hidden_jumps() || self.jumps_at_a_level();
        self.flanks = self.find_flanks();
    }

    /// Velocities and phases at which the law is probed.
    fn probes() -> impl Iterator<Item = (f64, f64)> {
        let velocities = [0.0, 1.0, -0.3, 2e-3];
        velocities
            .into_iter()
            .flat_map(|v| [0.0, 1.1, 2.9, 4.6].map(|phase| (v, phase)))
    }

    fn jumps_at_a_level(&self) -> bool {
        let levels = &self.kinks.levels;
        let insides: Vec<f64> = kinks::insides(levels).collect();
        levels.iter().zip(insides.windows(2)).any(|(level, near)| {
            Self::probes().any(|(v, phase)| {
                let force = |q: f64| self.own(q, v, phase).f;
                let aside = 8.0 * f64::EPSILON * level.abs().max(1e-3 * (near[1] - near[0]));
                let size = force(near[0]).abs().max(force(near[1]).abs());
                (force(level + aside) - force(level - aside)).abs() > 1e-9 * size
            })
        })
    }

    /// Whether the force differs between the end of a turn and the begin of the next.
    fn differs_after_a_turn(&self) -> bool {
        let end = TAU * (1.0 - f64::EPSILON);
        let regions = kinks::regions(&self.kinks.levels).into_iter();
        let mut places = regions.flat_map(|(low, high)| [low, 0.7 * low + 0.3 * high, high]);
        let differs = |q: f64, v: f64| {
            let force = |phase: f64| self.own(q, v, phase).f;
            let phases = [0.0, 0.7, 1.9, 3.3, 5.1];
            let size = phases
                .into_iter()
                .fold(0.0_f64, |m, p| m.max(force(p).abs()));
            (force(0.0) - force(end)).abs() > 1e-9 * size
        };
        self.kinks.on_phase && places.any(|q| [0.0, 1.0, -0.3].into_iter().any(|v| differs(q, v)))
    }

    /// 0 in regions without any force, -1 below the first of them and 1 elsewhere.
    fn find_flanks(&self) -> Vec<i8> {
        let is_open = |(low, high): &(f64, f64)| {
            [0.07, 0.31, 0.5, 0.83].into_iter().all(|share| {
                let q = low + share * (high - low);
                Self::probes().all(|(v, phase)| self.own(q, v, phase) == Response::default())
            })
        };
        let regions = kinks::regions(&self.kinks.levels);
        let open: Vec<bool> = regions.iter().map(is_open).collect();
        let first = open.iter().position(|open| *open).unwrap_or(0);
        let flank = |(k, open): (usize, &bool)| match open {
            true => 0,
            false if k < first => -1,
            false => 1,
        };
        open.iter().enumerate().map(flank).collect()
    }

    /// A place where the law is not finite, if one is seen.
    fn pole(&self) -> Option<(f64, f64, f64)> {
        let regions = kinks::regions(&self.kinks.levels).into_iter();
        let places = regions.flat_map(|(low, high)| [low, 0.5 * (low + high), high]);
        let places = places.chain([1e-6, 1e-3, 1.0].into_iter().flat_map(|q| [q, -q]));
        let mut points = places.flat_map(|q| Self::probes().map(move |(v, phase)| (q, v, phase)));
        points.find(|(q, v, phase)| !is_finite(self.own(*q, *v, *phase)))
    }

    /// The text at a place, for messages.
    fn word_at(&self, place: usize) -> (String, usize) {
        let rest = &self.force[place..];
        let end = rest.find(|c: char| !c.is_ascii_alphanumeric() && c != '_');
        let word = match end {
            Some(0) => rest.chars().take(1).collect(),
            Some(end) => rest[..end].to_owned(),
            None => rest.to_owned(),
        };
        (word, self.force[..place].chars().count() + 1)
    }

    /// Parameters that the formula does not name.
    fn unused(&self) -> impl Iterator<Item = &String> {
        let nodes = self.formula.iter().flat_map(|f| &f.nodes);
        let used: Vec<usize> = nodes
            .filter_map(|node| match node {
                formula::FormulaNode::Parameter(k) => Some(*k),
                _ => None,
            })
            .collect();
        let names = self.parameters.keys().enumerate();
        names
            .filter(move |(k, _)| !used.contains(k))
            .map(|(_, name)| name)
    }
}

#[typetag::serde(name = "expression")]
impl Element for Expression {
    #[inline]
    fn eval(&self, q: f64, v: f64, phase: f64) -> Response {
        self.scale.eval(q, v, |q, v| self.own(q, v, phase))
    }

    /// The phase comes within one turn.
    fn trace<'t>(
        &self,
        q: Symbol<'t>,
        v: Symbol<'t>,
        phase: Symbol<'t>,
    ) -> Result<Symbol<'t>, String> {
        let formula = self.formula.as_ref().map_err(FormulaError::to_string)?;
        if let Some(hidden) = self.kinks.hidden.first() {
            let (word, character) = self.word_at(hidden.place);
            return Err(format!(
                "`{word}` (character {character}) switches on something that is not affine in q alone"
            ));
        }
        if self.jumps_with_the_phase {
            return Err("the force jumps from phase 2 pi to 0".into());
        }
        let law = |q, v| run(formula, &self.values, FormulaArguments { q, v, phase });
        Ok(self.scale.force(q, v, law))
    }

    fn visit_parameters(&mut self, visit: &mut dyn FnMut(Parameter<'_>)) {
        for (k, value) in self.parameters.values_mut().enumerate() {
            visit(Parameter {
                name: "parameters",
                index: Some(k),
                // In SI whatever the scale: the law is scaled as a whole.
                dimension: Dimension::NONE,
                value,
            });
        }
        self.refresh();
    }

    fn scale_mut(&mut self) -> Option<&mut Scale> {
        Some(&mut self.scale)
    }

    fn clone_box(&self) -> Box<dyn Element> {
        Box::new(self.clone())
    }

    fn breakpoints(&self) -> Vec<f64> {
        let levels = self.kinks.levels.iter();
        levels.map(|b| self.scale.outwards(*b)).collect()
    }

    fn flank(&self, q: f64) -> i8 {
        let q = self.scale.inwards(q);
        let region = self.kinks.levels.iter().take_while(|b| q > **b).count();
        self.flanks.get(region).copied().unwrap_or(1)
    }

    fn is_piecewise_affine(&self) -> bool {
        self.kinks.is_affine && self.kinks.hidden.is_empty()
    }

    fn is_discontinuous(&self) -> bool {
        self.is_discontinuous
    }

    fn has_hidden_jumps(&self) -> bool {
        self.kinks.hidden.iter().any(|h| h.may_jump) || self.jumps_with_the_phase
    }

    fn is_spring(&self) -> bool {
        let is_displacement =
            |node: &FormulaNode| matches!(node, FormulaNode::Variable(Variable::Displacement));
        (self.formula.as_ref()).map_or(true, |f| f.nodes.iter().any(is_displacement))
    }

    fn depends_on_velocity(&self) -> bool {
        self.kinks.on_velocity
    }

    fn cautions(&self) -> Vec<String> {
        let hidden = self.kinks.hidden.iter().map(|hidden| {
            let (word, character) = self.word_at(hidden.place);
            let what = if hidden.may_jump { "jump" } else { "kink" };
            let advice = if hidden.may_jump {
                "; no shooting, no multipliers"
            } else {
                ""
            };
            format!(
                "force: `{word}` (character {character}) switches on something that is not affine in q alone: the {what} is \
                 not located{advice}"
            )
        });
        let mut list: Vec<String> = hidden.collect();
        if self.jumps_with_the_phase {
            list.push(
                "force: differs between phase 0 and 2 pi, so it jumps once per period: the jump is not located; no \
                 shooting, no multipliers"
                    .into(),
            );
        }
        if let Some((q, v, phase)) = self.pole() {
            list.push(format!(
                "force: not finite at q = {q}, v = {v}, phase = {phase}"
            ));
        }
        list.extend(
            self.unused()
                .map(|name| format!("parameters.{name}: the force does not use it")),
        );
        list
    }

    fn validate(&self) -> Result<(), InvalidParameter> {
        for (name, value) in &self.parameters {
            let path = format!("parameters.{name}");
            if is_reserved(name) {
                let message = "this name is reserved in formulas; choose another one";
                return Err(InvalidParameter::about(path, message));
            }
            if !is_name(name) {
                let message =
                    "names start with a letter or _ and continue with letters, digits or _";
                return Err(InvalidParameter::about(path, message));
            }
            super::finite(&path, *value)?;
        }
        if let Err(fault) = &self.formula {
            return Err(InvalidParameter::about("force", fault).at(fault.place));
        }
        let rest = self.own(0.0, 0.0, 0.0);
        if !is_finite(rest) {
            let found = format!(
                "{} with slopes {} and {} at rest (q = 0, v = 0, phase = 0)",
                rest.f, rest.df_dq, rest.df_dv
            );
            return Err(InvalidParameter::new("force", found, "finite"));
        }
        Ok(())
    }
}

fn is_finite(r: Response) -> bool {
    r.f.is_finite() && r.df_dq.is_finite() && r.df_dv.is_finite()
}

fn is_name(name: &str) -> bool {
    let is_letter = |c: char| c.is_ascii_alphabetic() || c == '_';
    name.starts_with(is_letter) && name.chars().all(|c| is_letter(c) || c.is_ascii_digit())
}
