//! Force laws of one relative displacement, nondimensional: force divided by the connection's reference stiffness.
//!
//! An element knows only its own displacement, velocity and excitation phase. It never sees indices, matrices,
//! frequencies, units or solvers.

pub mod automaton;
pub mod conformance;
pub mod derivatives;
pub mod evolving;
pub mod number;
mod registry;
mod scale;
pub mod tape;
mod traced;

mod backlash;
mod clutch;
mod cubic;
mod expression;
mod jenkins;
mod linear;
mod one_sided;
mod piecewise_linear;
mod preloaded;
mod rigid_stop;
mod tanh_friction;

pub use backlash::{Backlash, ImpactDampingLaw};
pub use clutch::{Clutch, Stage};
pub use cubic::Cubic;
pub use expression::{Expression, FormulaError, Relation};
pub use jenkins::Jenkins;
pub use linear::Linear;
pub use one_sided::{OneSided, Side};
pub use piecewise_linear::PiecewiseLinear;
pub use preloaded::Preloaded;
pub use registry::{
    ElementInfo, ParameterInfo, ParameterKind, ParameterRange, find, registered, table_mistakes,
};
pub use rigid_stop::RigidStop;
pub use scale::Scale;
pub use tanh_friction::TanhFriction;
pub use traced::{Symbol, Traced};

use automaton::Automaton;
use evolving::Evolving;

/// Force of a law and its partial derivatives at one instant.
#[derive(Debug, Clone, Copy, PartialEq, Default)]
pub struct Response {
    /// f(q, v, phase), in units of displacement (force / reference stiffness).
    pub f: f64,
    /// df/dq. At a breakpoint: either one-sided value, never an average.
    pub df_dq: f64,
    /// df/dv, v = dq/d(nondimensional time) = Omega q'.
    pub df_dv: f64,
}

/// Forces and partials over a time series: separate slices of equal length, so that loops vectorise.
pub struct ResponseSeries<'a> {
    /// Forces.
    pub f: &'a mut [f64],
    /// df/dq.
    pub df_dq: &'a mut [f64],
    /// df/dv.
    pub df_dv: &'a mut [f64],
}

/// Exponents, in halves, of displacement, time and force carried by a parameter.
///
/// A gap: displacement 2. Impact damping [time/displacement]: displacement -2, time 2. A preload: force 2.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
pub struct Dimension {
    /// Twice the exponent of displacement.
    pub displacement: i8,
    /// Twice the exponent of time.
    pub time: i8,
    /// Twice the exponent of force.
    pub force: i8,
}

impl Dimension {
    /// A pure number.
    pub const NONE: Dimension = Dimension {
        displacement: 0,
        time: 0,
        force: 0,
    };
    /// A displacement: m for meshes, rad for shafts.
    pub const DISPLACEMENT: Dimension = Dimension {
        displacement: 2,
        time: 0,
        force: 0,
    };
    /// A velocity.
    pub const VELOCITY: Dimension = Dimension {
        displacement: 2,
        time: -2,
        force: 0,
    };
    /// Force times time over displacement: a dashpot.
    pub const DAMPING: Dimension = Dimension {
        displacement: -2,
        time: 2,
        force: 2,
    };
    /// Time over displacement, as impact damping.
    pub const INVERSE_VELOCITY: Dimension = Dimension {
        displacement: -2,
        time: 2,
        force: 0,
    };
    /// A force: N for meshes, N m for shafts.
    pub const FORCE: Dimension = Dimension {
        displacement: 0,
        time: 0,
        force: 2,
    };

    /// Name of the dimension: `displacement`, `time/displacement`, ...; `None` for pure numbers. Displacement is in m for
    /// meshes and rad for shafts, force in N or N m.
    pub fn unit(self) -> Option<String> {
        let parts = [
            ("displacement", self.displacement),
            ("time", self.time),
            ("force", self.force),
        ];
        let power = |(name, halves): (&str, i8)| match halves.abs() {
            2 => name.to_string(),
            even if even % 2 == 0 => format!("{name}^{}", even / 2),
            odd => format!("{name}^({odd}/2)"),
        };
        let above: Vec<String> = parts.into_iter().filter(|p| p.1 > 0).map(power).collect();
        let below: Vec<String> = parts.into_iter().filter(|p| p.1 < 0).map(power).collect();
        match (above.is_empty(), below.is_empty()) {
            (true, true) => None,
            (false, true) => Some(above.join(" ")),
            (true, false) => Some(format!("1/{}", below.join("/"))),
            (false, false) => Some(format!("{}/{}", above.join(" "), below.join("/"))),
        }
    }
}

/// Units in which a law is made nondimensional: q* = q / displacement, t* = t frequency, F* = F / force.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Units {
    /// l, characteristic displacement of the connection.
    pub displacement: f64,
    /// omega_c, characteristic frequency.
    pub frequency: f64,
    /// K l, reference stiffness times characteristic displacement.
    pub force: f64,
}

/// One scalar parameter of a law, for scaling, continuation and reporting.
pub struct Parameter<'a> {
    /// Name, as in YAML.
    pub name: &'static str,
    /// Position within a list-valued parameter.
    pub index: Option<usize>,
    /// Dimension of the value.
    pub dimension: Dimension,
    /// The value itself.
    pub value: &'a mut f64,
}

impl Parameter<'_> {
    /// Replaces the dimensional value by the nondimensional one.
    pub fn rescale(&mut self, units: &Units) {
        let half = |base: f64, exponent: i8| base.powf(-0.5 * f64::from(exponent));
        *self.value *= half(units.displacement, self.dimension.displacement)
            * half(1.0 / units.frequency, self.dimension.time)
            * half(units.force, self.dimension.force);
    }
}

/// A parameter outside its range.
#[derive(Debug, Clone, PartialEq, thiserror::Error)]
#[error("{name}{message}")]
pub struct InvalidParameter {
    /// Name of the parameter; with its position if it is a list, `slopes[2]`, with its name in a map, `parameters.k`.
    pub name: String,
    /// Message after the name.
    pub message: String,
    /// For a formula: characters before the error.
    pub place: Option<usize>,
}

impl InvalidParameter {
    /// An error with the found value and the requirement.
    pub fn new(
        name: impl Into<String>,
        found: impl std::fmt::Display,
        wanted: impl std::fmt::Display,
    ) -> Self {
        InvalidParameter {
            name: name.into(),
            message: format!(" = {found}: must be {wanted}"),
            place: None,
        }
    }

    /// Any other error.
    pub fn about(name: impl Into<String>, message: impl std::fmt::Display) -> Self {
        InvalidParameter {
            name: name.into(),
            message: format!(": {message}"),
            place: None,
        }
    }

    /// The same at a place within a text.
    #[must_use]
    pub fn at(self, place: usize) -> Self {
        InvalidParameter {
            place: Some(place),
            ..self
        }
    }
}

/// A force law of one relative displacement.
#[typetag::serde(tag = "type")]
pub trait Element: std::fmt::Debug + Send + Sync {
    /// Force and partials. Finite for finite input; does not allocate. For a law with memory: on first loading.
    fn eval(&self, q: f64, v: f64, phase: f64) -> Response;

    /// Number of memories of the law.
    fn memory_count(&self) -> usize {
        0
    }

    /// Force and partials with a given memory.
    fn respond(&self, q: f64, v: f64, phase: f64, memory: &[f64]) -> Response {
        match self.evolving() {
            Some(law) => law.evolve([q, v, phase, memory[0]]).response(),
            None => self.eval(q, v, phase),
        }
    }

    /// The law as a force and a rate of its memory, where that rate is a function of motion and memory; such a law has one memory
    /// and no automata.
    fn evolving(&self) -> Option<&dyn Evolving> {
        None
    }

    /// Replaces a memory inconsistent with a deformation by the nearest consistent one.
    fn project(&self, _q: f64, _memory: &mut [f64]) {}

    /// The law as a sum of automata of affine regions, those with a memory in the order of the memory; `None` if its regions
    /// are those between its breakpoints and it has no memory.
    fn automata(&self) -> Option<Vec<Automaton>> {
        None
    }

    /// For laws with impacts: rate below which an impact is not counted, relative to the scale of rates.
    fn least_impact(&self) -> Option<f64> {
        None
    }

    /// The law on first loading (with memory) or at rest (with impacts), for the static equilibrium.
    fn first_loading(&self) -> Option<Box<dyn Element>> {
        None
    }

    /// The force evaluated with recording numbers, from which the Taylor series of the flow are built.
    ///
    /// A law whose force is generic over [`number::Number`] passes that computation on. It is recorded once in every
    /// region between breakpoints.
    ///
    /// # Errors
    /// Reason why there is no series; the default, for laws that compute with plain numbers only. DOPRI5 integrates such laws.
    fn trace<'t>(
        &self,
        _q: Symbol<'t>,
        _v: Symbol<'t>,
        _phase: Symbol<'t>,
    ) -> Result<Symbol<'t>, String> {
        Err("its force is computed with plain numbers only (`eval` without `trace`)".into())
    }

    /// Visits every dimensional or tunable parameter exactly once, in a fixed order.
    fn visit_parameters(&mut self, visit: &mut dyn FnMut(Parameter<'_>));

    /// Units of the law, if it is scaled as a whole and not parameter by parameter.
    fn scale_mut(&mut self) -> Option<&mut Scale> {
        None
    }

    /// A boxed copy.
    fn clone_box(&self) -> Box<dyn Element>;

    /// By how much the span of what each slider follows exceeds what it can hold without slipping, in an oscillation between two
    /// deformations; negative where it sticks all the time. Empty for laws without sliders.
    fn slip_excess(&self, _low: f64, _high: f64) -> Vec<f64> {
        Vec::new()
    }

    /// Whether the law has neither breakpoints nor a memory: no extremum of its deformation means anything.
    fn is_featureless(&self) -> bool {
        self.memory_count() == 0 && self.breakpoints().is_empty()
    }

    /// Displacements at which f or a partial is not smooth, ascending. Read again after every parameter change.
    fn breakpoints(&self) -> Vec<f64> {
        Vec::new()
    }

    /// -1 or +1 in contact with that flank, 0 open. Default: always in contact.
    fn flank(&self, _q: f64) -> i8 {
        1
    }

    /// True when f is affine in (q, v) between breakpoints and independent of the phase: admits exact integration.
    fn is_piecewise_affine(&self) -> bool {
        false
    }

    /// True when f itself may jump, at a breakpoint (a preloaded contact) or elsewhere.
    fn is_discontinuous(&self) -> bool {
        false
    }

    /// True when f may jump at places other than its breakpoints: at a velocity, a phase, an unknown displacement.
    ///
    /// Such a jump cannot be located: integrators pass it under error control, and methods that need a transition matrix
    /// (shooting, multipliers, Lyapunov exponents) reject the law.
    fn has_hidden_jumps(&self) -> bool {
        false
    }

    /// Warnings about this law with these parameters.
    fn cautions(&self) -> Vec<String> {
        Vec::new()
    }

    /// True when f depends on v.
    fn depends_on_velocity(&self) -> bool {
        true
    }

    /// False when f does not depend on q, as for pure friction: the reference stiffness then cancels in the force, is optional, and
    /// does not contribute to modes, scales and modal damping.
    fn is_spring(&self) -> bool {
        true
    }

    /// True when df/dv >= 0 for every q and v: the law never reduces damping. Default: true for laws without v.
    fn is_passive(&self) -> bool {
        !self.depends_on_velocity()
    }

    /// Checks the parameters. The loader and the conformance check call it. Default: every parameter is within the range that the law is
    /// registered with; a law overrides it where its parameters depend on one another.
    ///
    /// # Errors
    /// The first parameter outside its range.
    fn validate(&self) -> Result<(), InvalidParameter> {
        registry::within_ranges(self.typetag_name(), self.clone_box())
    }

    /// Evaluates a whole time series: one virtual call per element per sweep; `eval` is inlined per type.
    fn eval_many(&self, q: &[f64], v: &[f64], phase: &[f64], out: ResponseSeries<'_>) {
        let input = q.iter().zip(v).zip(phase);
        let output = out
            .f
            .iter_mut()
            .zip(out.df_dq.iter_mut())
            .zip(out.df_dv.iter_mut());
        for (((q, v), phase), ((f, df_dq), df_dv)) in input.zip(output) {
            let r = self.eval(*q, *v, *phase);
            (*f, *df_dq, *df_dv) = (r.f, r.df_dq, r.df_dv);
        }
    }
}

impl Clone for Box<dyn Element> {
    fn clone(&self) -> Self {
        self.clone_box()
    }
}

/// Makes a law nondimensional: every parameter, or the law as a whole through its [`Scale`].
pub fn nondimensional(element: &dyn Element, units: &Units) -> Box<dyn Element> {
    let mut copy = element.clone_box();
    copy.visit_parameters(&mut |mut p| p.rescale(units));
    if let Some(scale) = copy.scale_mut() {
        scale.rescale(units);
    }
    copy
}

/// Rejects NaN and infinities.
pub(crate) fn finite(name: &str, value: f64) -> Result<(), InvalidParameter> {
    if value.is_finite() {
        Ok(())
    } else {
        Err(InvalidParameter::new(name, value, "finite"))
    }
}

/// Rejects NaN, infinities and negative values.
pub(crate) fn not_negative(name: &str, value: f64) -> Result<(), InvalidParameter> {
    finite(name, value)?;
    if value >= 0.0 {
        Ok(())
    } else {
        Err(InvalidParameter::new(name, value, ">= 0"))
    }
}
