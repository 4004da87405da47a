//! Integration in time: one contract, two integrators.

mod dopri5;
mod exact;
mod flight;

pub use dopri5::{Dopri5, Dopri5Options};
use exact::Law;
pub use exact::{Exact, SeriesOptions};
pub use flight::{Flight, Status};

use super::closed_form::ClosedForm;
use crate::error::SolveError;
use crate::system::{Mount, System};
use nalgebra::DMatrix;

/// Reason of the end of an integration.
#[derive(Debug, Clone, Copy, PartialEq)]
pub enum IntegrationEnd {
    /// The end of the interval.
    Reached,
    /// The step fell below the resolution of the time.
    StepTooSmall,
    /// As many steps as were allowed.
    MaxSteps,
    /// More switches in one call than were allowed: chatter.
    TooManySwitches,
    /// The state is not finite, or beyond all bounds.
    Diverged,
    /// An interrupt was requested.
    Interrupted,
    /// The force of a connection has no finite series: a root of a negative number, a division by zero.
    NotAnalytic(Singularity),
    /// Stops that are closed at once contradict each other, this connection among them.
    Locked(usize),
    /// A joint comes to rest on a jump of its force, which the integrator does not hold.
    Sticks(usize),
}

/// Instant at which a force has no finite series.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Singularity {
    /// Connection.
    pub connection: usize,
    /// Deformation.
    pub deformation: f64,
    /// Its rate, d/d(omega_c t).
    pub rate: f64,
    /// Share of the excitation period at hand, 0..1; along a course of speed the time.
    pub share: f64,
    /// Length of the excitation period in omega_c t; 1 along a course of speed.
    pub period: f64,
}

impl IntegrationEnd {
    /// A sentence for people.
    pub fn message(self) -> &'static str {
        match self {
            IntegrationEnd::Reached => "the end was reached",
            IntegrationEnd::StepTooSmall => "the step fell below the resolution of the time",
            IntegrationEnd::MaxSteps => "too many steps",
            IntegrationEnd::TooManySwitches => "too many switches in one period (chatter)",
            IntegrationEnd::Diverged => "the state is not finite",
            IntegrationEnd::Interrupted => "interrupted",
            IntegrationEnd::NotAnalytic(_) => {
                "a force is not analytic (division by zero, or root or logarithm of a negative number)"
            }
            IntegrationEnd::Locked(_) => {
                "closed stops contradict each other: no motion keeps within all of them"
            }
            IntegrationEnd::Sticks(_) => {
                "the joint comes to rest on a jump of its force, which DOPRI5 does not hold; the exact flow does (`integrator: auto`)"
            }
        }
    }
}

/// A stretch of time on which every coordinate, and what laws remember, is one polynomial, to the accuracy of the integrator. It never reaches
/// across a breakpoint.
#[derive(Debug, Clone, Copy)]
pub struct Segment<'a> {
    /// Phase of the response at its begin.
    pub tau: f64,
    /// Its length in tau; x = (tau - begin) / width runs from 0 to 1.
    pub width: f64,
    /// Coefficients of q_i in powers of x, coordinate by coordinate, then those of the memories: `coefficients[i * count + k]` belongs
    /// to x^k.
    pub coefficients: &'a [f64],
    /// Coefficients a coordinate: degree + 1.
    pub count: usize,
}

impl Segment<'_> {
    /// State [q; v; z] at x in [0, 1], v = Om dq/dtau.
    pub fn state(&self, x: f64, omega: f64, out: &mut [f64]) {
        let n = out.len() - self.coefficients.len() / self.count;
        for (i, c) in self.coefficients.chunks_exact(self.count).enumerate() {
            let (mut q, mut slope) = (0.0, 0.0);
            for a in c.iter().rev() {
                slope = slope * x + q;
                q = q * x + a;
            }
            if i < n {
                (out[i], out[n + i]) = (q, slope * omega / self.width);
            } else {
                out[n + i] = q;
            }
        }
    }
}

/// A connection passes a breakpoint of its law.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Switch {
    /// Phase of the response.
    pub tau: f64,
    /// Connection.
    pub connection: usize,
    /// The breakpoint.
    pub level: f64,
    /// Flank before: -1, 0 (open) or 1.
    pub from: i8,
    /// Flank after.
    pub to: i8,
    /// Rate of the deformation, d/d(omega_c t): its sign is the direction.
    pub velocity: f64,
    /// Action at the passage.
    pub kind: SwitchKind,
}

impl Switch {
    /// Whether contact is made ([`SwitchKind::makes_contact`]).
    pub(crate) fn makes_contact(&self) -> bool {
        self.kind.makes_contact((self.from, self.to))
    }
}

/// Action at a switch.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
pub enum SwitchKind {
    /// A breakpoint of the law is passed.
    #[default]
    Breakpoint,
    /// A law with memory enters another region: a slider starts to slip, or sticks.
    Memory,
    /// A stop reverses the rate.
    Impact,
    /// A contact comes to rest on a stop or on a jump of the force, or leaves it.
    Holding,
}

impl SwitchKind {
    /// Whether contact is made: an impact on a stop, or the way from open to a flank. A slider that starts to slip makes none, nor
    /// does a contact that comes to rest.
    pub(crate) fn makes_contact(self, (from, to): (i8, i8)) -> bool {
        match self {
            SwitchKind::Impact => true,
            SwitchKind::Breakpoint => from == 0 && to != 0,
            SwitchKind::Memory | SwitchKind::Holding => false,
        }
    }
}

/// What an integration had to do about fast motions.
#[derive(Debug, Clone, Copy, Default, PartialEq)]
pub struct Strain {
    /// Many short steps.
    pub steps: Option<ShortSteps>,
    /// Excursions too many and too short to follow.
    pub bounces: Option<Bounces>,
}

/// A joint that bounces on a jump of its force with so many excursions that the shortest ones were replaced by rest on the jump.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Bounces {
    /// Connection.
    pub connection: usize,
    /// Passages per response period that were followed.
    pub passages: usize,
    /// The longest excursion that was not followed, as a share of the excitation period.
    pub longest: f64,
    /// Its height.
    pub height: f64,
}

/// Many short steps: what the step control of an integration did about fast forces.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct ShortSteps {
    /// Steps per period of the excitation, in the call that took most.
    pub steps: usize,
    /// The shortest of them as a share of that period.
    pub shortest: f64,
    /// Connection whose force changes fastest.
    pub connection: usize,
}

/// Observer of an integration.
pub trait FlowObserver {
    /// A stretch has been accepted.
    fn segment(&mut self, _segment: &Segment<'_>) {}
    /// Whether `segment` is to be called at all.
    fn wants_segments(&self) -> bool {
        true
    }
    /// A switch has been located.
    fn switch(&mut self, _switch: &Switch) {}
}

/// Nobody watches.
impl FlowObserver for () {
    fn wants_segments(&self) -> bool {
        false
    }
}

/// Advances a state in time.
///
/// Crossings are found on the half-open interval (tau.0, tau.1]: a state that starts on a breakpoint does not fire there
/// ([`Integrator::start`] reports it once, at the start of a motion). Where the force jumps at a switch the variation gets the saltation matrix of [`super::jumps`]; a continuous force needs none.
/// With hidden jumps ([`crate::element::Element::has_hidden_jumps`]) the variation is not known: Phi becomes NaN.
pub trait Integrator {
    /// `exact`, `series` or `dopri5`: the result says which integrator ran.
    fn name(&self) -> &'static str;

    /// Reports the contacts made at the start of a motion: by connections on a breakpoint that move from there into contact.
    fn start(&mut self, system: &System, tau: f64, state: &[f64], observer: &mut dyn FlowObserver);

    /// Order of magnitude of the relative error of a period.
    fn error(&self) -> f64;

    /// Trial steps of the last call.
    fn effort(&self) -> usize {
        0
    }

    /// Limits the trial steps of a call.
    fn allow(&mut self, _steps: usize) {}

    /// The most laborious calls so far: more than a thousand steps per period of the excitation, or bounces that were averaged.
    fn strain(&self) -> Option<Strain> {
        None
    }

    /// Places for several trajectories that are advanced together, where there is a fast way to do that.
    fn flight(&self, _system: &System) -> Option<Box<dyn Flight>> {
        None
    }

    /// Advances `state` = [q; v; z], z: what laws remember, over (tau.0, tau.1] in phases of the response.
    fn advance(
        &mut self,
        system: &System,
        tau: (f64, f64),
        state: &mut [f64],
        observer: &mut dyn FlowObserver,
    ) -> IntegrationEnd;

    /// The same, and `phi` <- Phi phi with the state-transition matrix Phi in (q, v, z). Rook & Singh (1995), eq. (18).
    fn advance_with_variation(
        &mut self,
        system: &System,
        tau: (f64, f64),
        state: &mut [f64],
        phi: &mut DMatrix<f64>,
        observer: &mut dyn FlowObserver,
    ) -> IntegrationEnd;
}

/// Integrator.
#[derive(
    Debug,
    Clone,
    Copy,
    Default,
    PartialEq,
    Eq,
    serde::Serialize,
    serde::Deserialize,
    schemars::JsonSchema,
)]
#[serde(rename_all = "snake_case")]
pub enum IntegratorChoice {
    /// The series flow if every law admits it (in closed form where possible), otherwise DOPRI5; the JSON states
    /// which.
    #[default]
    Auto,
    /// The flow in closed form; an error if a law or excitation does not admit it.
    Exact,
    /// The flow by Taylor series, which includes the closed form; an error if a law has no series.
    Series,
    /// Dormand-Prince method of order 5.
    Dopri5,
}

/// An integrator and its error control.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct IntegratorOptions {
    /// Which one.
    pub choice: IntegratorChoice,
    /// Error of a step relative to the motion that the series flow allows; the closed form has that of rounding.
    pub flow_tolerance: f64,
}

impl From<IntegratorChoice> for IntegratorOptions {
    fn from(choice: IntegratorChoice) -> Self {
        let flow_tolerance = SeriesOptions::default().tolerance;
        IntegratorOptions {
            choice,
            flow_tolerance,
        }
    }
}

/// Reason why the series flow does not apply to a connection; `None` if it applies.
pub(crate) fn series_refusal(mount: &Mount) -> Option<String> {
    let excitation = ClosedForm::Series.refusal(mount);
    excitation.or_else(|| {
        let law = Law::parts(mount.element.as_ref());
        law.err().map(|reason| format!("no series: {reason}"))
    })
}

/// Meaning of [`IntegratorChoice::Auto`]: `Exact` or `Series` where every connection admits the flow, else `Dopri5`.
pub fn automatic(system: &System) -> IntegratorChoice {
    let mounts = system.mounts();
    if mounts.iter().all(|m| ClosedForm::Flow.refusal(m).is_none()) {
        IntegratorChoice::Exact
    } else if mounts.iter().all(|m| series_refusal(m).is_none()) {
        IntegratorChoice::Series
    } else {
        IntegratorChoice::Dopri5
    }
}

/// Whether the flow, in closed form or by series, integrates a system: its results are accurate to about twelve digits.
pub fn is_flow(system: &System) -> bool {
    automatic(system) != IntegratorChoice::Dopri5
}

/// Switches allowed in one response period before the motion counts as chatter.
pub const MAX_SWITCHES: usize = 10_000;

/// An integrator for a system.
///
/// # Errors
/// [`SolveError::Unsupported`] if the exact flow is requested and a connection does not admit it.
pub fn choose(
    system: &System,
    options: impl Into<IntegratorOptions>,
) -> Result<Box<dyn Integrator + Send>, SolveError> {
    let options = options.into();
    let flow = || {
        let series = SeriesOptions {
            tolerance: options.flow_tolerance,
            ..SeriesOptions::default()
        };
        Exact::with(system, series)
    };
    let has_impacts = |m: &Mount| m.element.least_impact().is_some();
    if let (IntegratorChoice::Dopri5, Some(connection)) =
        (options.choice, system.mounts().iter().position(has_impacts))
    {
        let reason = "DOPRI5 knows no impacts; use the exact flow".into();
        return Err(SolveError::Unsupported { connection, reason });
    }
    match options.choice {
        IntegratorChoice::Dopri5 => Ok(Box::new(Dopri5::new(system, Dopri5Options::default()))),
        IntegratorChoice::Exact => {
            let refusal = |mount| ClosedForm::Flow.refusal(mount);
            let refusals = system.mounts().iter().map(refusal).enumerate();
            let first = refusals.filter_map(|(k, r)| Some((k, r?))).next();
            if let Some((connection, reason)) = first {
                return Err(SolveError::Unsupported { connection, reason });
            }
            Ok(Box::new(flow()?))
        }
        IntegratorChoice::Series => Ok(Box::new(flow()?)),
        IntegratorChoice::Auto => {
            let choice = automatic(system);
            choose(system, IntegratorOptions { choice, ..options })
        }
    }
}
