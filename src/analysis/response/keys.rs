//! The keys that all analyses of responses share.

use schemars::{JsonSchema, Schema, SchemaGenerator, json_schema};
use serde::{Deserialize, Serialize};
use std::borrow::Cow;

/// Declares the keys of an analysis of responses: its own, then those that all of them share ([`BranchSettings`]), in one map
/// as users write them.
///
/// serde's `flatten` would do without a macro, but it reads through a buffer: errors would lose their line, and unknown
/// keys would pass. A new key of all responses is added here and in [`branch_settings`].
macro_rules! response_keys {
    ($(#[$about:meta])* pub struct $name:ident { $($own:tt)* }) => {
        $(#[$about])*
        #[derive(Debug, Clone, serde::Serialize, serde::Deserialize, schemars::JsonSchema)]
        #[serde(deny_unknown_fields)]
        #[non_exhaustive]
        pub struct $name {
            $($own)*
            /// First value.
            #[serde(default)]
            pub from: Option<crate::quantity::Quantity>,
            /// Last value.
            #[serde(default)]
            pub to: Option<crate::quantity::Quantity>,
            /// How responses are computed.
            #[serde(default)]
            pub method: Option<crate::analysis::response::Method>,
            /// Several methods, drawn together; excludes `method`.
            #[serde(default)]
            pub methods: Option<Vec<crate::analysis::response::Method>>,
            /// Integrator of shooting and integration.
            #[serde(default)]
            pub integrator: crate::solve::integrate::IntegratorChoice,
            /// Local error of the series flow, relative to the motion; default 1e-12.
            #[serde(default)]
            pub flow_tolerance: Option<f64>,
            /// Number of harmonics of the excitation frequency, or limits for an adaptive number; default 12 times the greatest common
            /// divisor of all excitation orders.
            #[serde(default, skip_serializing_if = "crate::analysis::response::Harmonics::is_usual")]
            pub harmonics: crate::analysis::response::Harmonics,
            /// Samples per response period, a power of two.
            #[serde(default)]
            pub samples: Option<usize>,
            /// Integration of the forces over a period.
            #[serde(default)]
            pub quadrature: crate::analysis::response::Quadrature,
            /// Compute Floquet multipliers and bifurcations.
            #[serde(default = "crate::analysis::response::defaults::stability")]
            pub stability: bool,
            /// Width of the narrowest window of changed stability that is found, relative to the larger of the
            /// parameter and a tenth of the range.
            #[serde(default = "crate::analysis::response::defaults::stability_resolution")]
            pub stability_resolution: f64,
            /// nu: excitation periods per response period.
            #[serde(default = "crate::analysis::response::defaults::subharmonic")]
            pub subharmonic: usize,
            /// Branches to follow: the primary branch, or also those that begin at period doublings and branch
            /// points.
            #[serde(default)]
            pub branches: crate::analysis::response::Branches,
            /// Random initial states to search for further branches, at values inside the range.
            #[serde(default)]
            pub starts: Option<crate::analysis::response::Starts>,
            /// Values to solve exactly, every time the branch passes them.
            #[serde(default)]
            pub marks: Vec<crate::quantity::Quantity>,
            /// Orbits to keep.
            #[serde(default)]
            pub orbits: crate::analysis::response::Orbits,
            /// Tables to compute and write: a list, or `all`. Default: all except `multiplier_estimates`, and
            /// `rattle` only if a law has a gap.
            #[serde(default, skip_serializing_if = "crate::analysis::TableChoice::are_usual")]
            pub tables: crate::analysis::TableChoice,
            /// Orders of the reference whose amplitudes in deformations, forces and accelerations are columns of the main table.
            #[serde(default, skip_serializing_if = "Vec::is_empty")]
            pub orders: Vec<crate::analysis::ReportedOrder>,
            /// What the flow confirms on Galerkin branches: `events` with a spread of points, `all` points, every
            /// k-th point, or `none`. Default: `events` where the flow is exact.
            #[serde(default)]
            pub confirm: Option<crate::analysis::response::Confirm>,
            /// Short form of `confirm`: `true` means `all`, a number k means k, `false` means `none`.
            #[serde(default)]
            pub verify: Option<crate::analysis::response::Verify>,
            /// Estimate the error of every point of Galerkin branches, from the flow or from twice the harmonics.
            #[serde(default)]
            pub error_estimate: bool,
            /// Solve every point of Galerkin branches also with twice the harmonics.
            #[serde(default)]
            pub convergence_check: bool,
            /// First step of the path, in arclength; default 0.02, or `max_step` if that is smaller.
            #[serde(default)]
            pub step: Option<f64>,
            /// Smallest step; the branch ends if a smaller one would be required.
            #[serde(default = "crate::analysis::response::defaults::min_step")]
            pub min_step: f64,
            /// Largest step.
            #[serde(default = "crate::analysis::response::defaults::max_step")]
            pub max_step: f64,
            /// Limit of points per branch.
            #[serde(default = "crate::analysis::response::defaults::max_points")]
            pub max_points: usize,
            /// Shooting and integration: limit of integration steps per response period. A stiff mode far above the
            /// excitation requires more, and minutes per point.
            #[serde(default = "crate::analysis::response::defaults::max_steps")]
            pub max_steps: usize,
            /// Deformation beyond which a branch counts as unbounded, relative to the largest of breakpoints, static
            /// and linear deformations and the displacement scale.
            #[serde(default = "crate::analysis::response::defaults::bound")]
            pub bound: f64,
            /// Largest residual, relative to the size of its terms.
            #[serde(default = "crate::analysis::response::defaults::tolerance")]
            pub tolerance: f64,
            /// First guess of the search for the first solution, or a point saved by another run, through which the
            /// branch is followed both ways.
            #[serde(default)]
            pub start: crate::analysis::response::Beginning,
            /// Integration: number of values, evenly spaced, both ends included; default 200.
            #[serde(default)]
            pub points: Option<usize>,
            /// Integration: direction in which the attractor is followed; default: from `from` to `to`.
            #[serde(default)]
            pub direction: Option<crate::analysis::bifurcation_diagram::SweepDirection>,
            /// Integration: excitation periods before the record, at every value; default 200.
            #[serde(default)]
            pub transient: Option<usize>,
            /// Integration: recorded periods per value; default 100.
            #[serde(default)]
            pub periods: Option<usize>,
            /// Integration: whether small deviations are followed, without which nothing is called chaotic; true when absent.
            #[serde(default, skip_serializing_if = "Option::is_none")]
            pub lyapunov: Option<bool>,
            /// Integration: longest period of a label; default 256.
            #[serde(default)]
            pub longest_period: Option<usize>,
            /// Integration: limit to which an undecided record is extended, in lengths of the record; default 8.
            #[serde(default)]
            pub extend: Option<usize>,
        }
    };
}
pub(in crate::analysis) use response_keys;

response_keys! {
    /// How branches are computed.
    pub struct BranchSettings {}
}

/// The shared keys among those of an analysis.
macro_rules! branch_settings {
    ($keys:expr) => {
        crate::analysis::response::BranchSettings {
            from: $keys.from.clone(),
            to: $keys.to.clone(),
            method: $keys.method,
            methods: $keys.methods.clone(),
            integrator: $keys.integrator,
            flow_tolerance: $keys.flow_tolerance,
            harmonics: $keys.harmonics,
            samples: $keys.samples,
            quadrature: $keys.quadrature,
            stability: $keys.stability,
            stability_resolution: $keys.stability_resolution,
            subharmonic: $keys.subharmonic,
            branches: $keys.branches,
            starts: $keys.starts.clone(),
            marks: $keys.marks.clone(),
            orbits: $keys.orbits,
            tables: $keys.tables.clone(),
            orders: $keys.orders.clone(),
            lyapunov: $keys.lyapunov,
            confirm: $keys.confirm,
            verify: $keys.verify,
            error_estimate: $keys.error_estimate,
            convergence_check: $keys.convergence_check,
            step: $keys.step,
            min_step: $keys.min_step,
            max_step: $keys.max_step,
            max_points: $keys.max_points,
            max_steps: $keys.max_steps,
            bound: $keys.bound,
            tolerance: $keys.tolerance,
            start: $keys.start.clone(),
            points: $keys.points,
            direction: $keys.direction,
            transient: $keys.transient,
            periods: $keys.periods,
            longest_period: $keys.longest_period,
            extend: $keys.extend,
        }
    };
}
pub(in crate::analysis) use branch_settings;

pub(in crate::analysis) mod defaults {
    pub fn stability() -> bool {
        true
    }
    pub fn stability_resolution() -> f64 {
        1e-3
    }
    pub fn subharmonic() -> usize {
        1
    }
    pub fn min_step() -> f64 {
        1e-8
    }
    pub fn max_step() -> f64 {
        0.1
    }
    pub fn max_points() -> usize {
        10_000
    }
    pub fn max_steps() -> usize {
        30_000
    }
    pub fn bound() -> f64 {
        1000.0
    }
    pub fn tolerance() -> f64 {
        1e-10
    }
}

/// How responses are computed.
#[derive(Debug, Clone, Copy, Default, PartialEq, Eq, Serialize, Deserialize, JsonSchema)]
#[serde(rename_all = "snake_case")]
#[non_exhaustive]
pub enum Method {
    /// Multi-harmonic balance.
    #[default]
    Galerkin,
    /// Fixed points of the Poincaré map.
    Shooting,
    /// Time integration: the attractor, followed from value to value.
    Integration,
}

impl Method {
    /// Word for files.
    pub fn word(self) -> &'static str {
        match self {
            Method::Galerkin => "galerkin",
            Method::Shooting => "shooting",
            Method::Integration => "integration",
        }
    }

    /// Name for readers.
    pub fn title(self) -> &'static str {
        match self {
            Method::Galerkin => "Galerkin",
            Method::Shooting => "shooting",
            Method::Integration => "integration",
        }
    }
}

/// How the Galerkin method integrates forces over a period.
#[derive(Debug, Clone, Copy, Default, PartialEq, Eq, Serialize, Deserialize, JsonSchema)]
#[serde(rename_all = "snake_case")]
#[non_exhaustive]
pub enum Quadrature {
    /// Closed form if every law admits it and `samples` is not given, otherwise equally spaced samples.
    #[default]
    Auto,
    /// Equally spaced samples, for any law.
    Sampled,
    /// Closed form between switching instants, for piecewise-affine laws.
    Exact,
}

/// Orbits to keep.
#[derive(Debug, Clone, Copy, Default, PartialEq, Eq)]
pub enum Orbits {
    /// None.
    #[default]
    None,
    /// All points.
    All,
    /// Points solved at marks.
    Marks,
}

impl Orbits {
    /// Whether any orbit may be kept.
    pub(super) fn are_kept(self) -> bool {
        self != Orbits::None
    }

    /// Whether the orbit of a point is kept.
    pub(super) fn keeps(self, is_mark: bool) -> bool {
        match self {
            Orbits::None => false,
            Orbits::All => true,
            Orbits::Marks => is_mark,
        }
    }
}

impl JsonSchema for Orbits {
    fn schema_name() -> Cow<'static, str> {
        "Orbits".into()
    }

    fn json_schema(_generator: &mut SchemaGenerator) -> Schema {
        json_schema!({ "enum": [false, true, "marks"] })
    }
}

impl Serialize for Orbits {
    fn serialize<S: serde::Serializer>(&self, serializer: S) -> Result<S::Ok, S::Error> {
        match self {
            Orbits::None => serializer.serialize_bool(false),
            Orbits::All => serializer.serialize_bool(true),
            Orbits::Marks => serializer.serialize_str("marks"),
        }
    }
}

impl<'de> Deserialize<'de> for Orbits {
    fn deserialize<D: serde::Deserializer<'de>>(deserializer: D) -> Result<Self, D::Error> {
        deserializer.deserialize_any(WrittenOrbits)
    }
}

struct WrittenOrbits;

impl serde::de::Visitor<'_> for WrittenOrbits {
    type Value = Orbits;

    fn expecting(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        f.write_str("false, true or `marks`")
    }

    fn visit_bool<E: serde::de::Error>(self, all: bool) -> Result<Orbits, E> {
        Ok(if all { Orbits::All } else { Orbits::None })
    }

    fn visit_str<E: serde::de::Error>(self, word: &str) -> Result<Orbits, E> {
        match word {
            "marks" => Ok(Orbits::Marks),
            _ => Err(E::invalid_value(serde::de::Unexpected::Str(word), &self)),
        }
    }
}
