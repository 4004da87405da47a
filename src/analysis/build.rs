//! Analyses built in code: defaults, and the most frequent settings.
//!
//! Every other setting is a public field: `analysis.with(|settings| settings.max_step = 0.02)`.

use super::parameter_study::{Axis, Collected, Given, ParameterStudy, Reduce};
use super::response::{Harmonics, Method};
use super::{
    Analysis, BifurcationDiagram, EffectiveFrequencies, FrequencyResponse, Modes, OperatingPoint,
    ParameterResponse, PoincareMap, RunUp, TimeHistory,
};
use crate::quantity::Quantity;
use indexmap::IndexMap;
use serde::de::DeserializeOwned;
use serde_json::{Value, json};

/// Values of a bifurcation diagram when no number is given.
const POINTS: usize = 200;

/// Settings with the defaults of their keys, but for those that are required.
fn defaults<T: DeserializeOwned>(required: Value) -> T {
    serde_json::from_value(required).expect("all keys but the required ones have defaults")
}

/// `with` for settings of an analysis.
macro_rules! settings {
    ($($name:ident),+) => {$(
        impl $name {
            /// Settings after a change.
            #[must_use]
            pub fn with(mut self, change: impl FnOnce(&mut $name)) -> $name {
                change(&mut self);
                self
            }
        }
    )+};
}
settings!(
    FrequencyResponse,
    ParameterResponse,
    Modes,
    EffectiveFrequencies,
    TimeHistory,
    OperatingPoint,
    RunUp,
    PoincareMap,
    BifurcationDiagram,
    ParameterStudy
);

/// Settings shared by both analyses of responses.
macro_rules! responses {
    ($($name:ident),+) => {$(
        impl $name {
            /// Sets the number of harmonics of the excitation frequency.
            #[must_use]
            pub fn harmonics(self, count: usize) -> $name {
                self.with(|settings| settings.harmonics = Harmonics::Count(count))
            }

            /// Selects another method.
            #[must_use]
            pub fn method(self, method: Method) -> $name {
                self.with(|settings| settings.method = Some(method))
            }

            /// Adds a value to solve exactly, every time the branch passes it.
            #[must_use]
            pub fn mark(self, value: impl Into<Quantity>) -> $name {
                self.with(|settings| settings.marks.push(value.into()))
            }
        }
    )+};
}
responses!(FrequencyResponse, ParameterResponse);

impl Default for FrequencyResponse {
    /// All defaults; set `from` and `to`, or `at`.
    fn default() -> FrequencyResponse {
        defaults(json!({}))
    }
}

impl FrequencyResponse {
    /// Response from one excitation frequency to another.
    ///
    /// ```
    /// use gearlash::prelude::*;
    ///
    /// let model = Model::builder()
    ///     .body("wheel", 0.5)
    ///     .ground("shaft", "wheel")
    ///     .stiffness(2e5)
    ///     .law(Backlash::half_gap(1e-3))
    ///     .modal_damping(0.05)
    ///     .load("wheel", Load::mean(20.0).harmonic(1, 30.0))
    ///     .build()?;
    /// let response = FrequencyResponse::between(hertz(150.0), hertz(80.0))
    ///     .harmonics(5)
    ///     .mark(hertz(100.0))
    ///     .with(|settings| settings.max_step = 0.2)
    ///     .run(&model)?;
    /// assert!(response.points().any(|p| (p.frequency_hz() - 100.0).abs() < 1e-9));
    /// # Ok::<(), Error>(())
    /// ```
    pub fn between(from: impl Into<Quantity>, to: impl Into<Quantity>) -> FrequencyResponse {
        FrequencyResponse {
            from: Some(from.into()),
            to: Some(to.into()),
            ..FrequencyResponse::default()
        }
    }
}

impl Default for ParameterResponse {
    /// All defaults; set the parameter, the range and the excitation frequency.
    fn default() -> ParameterResponse {
        defaults(json!({"at": 0, "parameter": ""}))
    }
}

impl ParameterResponse {
    /// Response from one value of a number of the model to another, at an excitation frequency.
    ///
    /// ```
    /// use gearlash::prelude::*;
    ///
    /// let model = Model::builder()
    ///     .body("wheel", 0.5)
    ///     .ground("shaft", "wheel")
    ///     .stiffness(2e5)
    ///     .law(Backlash::half_gap(1e-3))
    ///     .modal_damping(0.05)
    ///     .load("wheel", Load::mean(20.0).harmonic(1, 30.0))
    ///     .build()?;
    /// let response = ParameterResponse::between("shaft.half_gap", 1e-3, 2e-3, hertz(150.0))
    ///     .harmonics(5)
    ///     .run(&model)?;
    /// assert_eq!(response.points().last().map(|p| p.parameter()), Some(2e-3));
    /// # Ok::<(), Error>(())
    /// ```
    pub fn between(
        parameter: impl Into<String>,
        from: impl Into<Quantity>,
        to: impl Into<Quantity>,
        at: impl Into<Quantity>,
    ) -> ParameterResponse {
        ParameterResponse {
            at: at.into(),
            parameter: parameter.into(),
            from: Some(from.into()),
            to: Some(to.into()),
            ..ParameterResponse::default()
        }
    }
}

impl Default for EffectiveFrequencies {
    /// All defaults; set the amplitudes.
    fn default() -> EffectiveFrequencies {
        defaults(json!({"amplitude": [0, 0]}))
    }
}

impl EffectiveFrequencies {
    /// Frequencies from one amplitude of every deformation to another.
    pub fn between(from: impl Into<Quantity>, to: impl Into<Quantity>) -> EffectiveFrequencies {
        EffectiveFrequencies {
            amplitude: [from.into(), to.into()],
            ..EffectiveFrequencies::default()
        }
    }
}

impl Default for TimeHistory {
    /// All defaults; set the excitation frequency or a duration.
    fn default() -> TimeHistory {
        defaults(json!({}))
    }
}

impl TimeHistory {
    /// Motion at an excitation frequency.
    ///
    /// ```
    /// use gearlash::prelude::*;
    ///
    /// let model = Model::builder()
    ///     .body("wheel", 0.5)
    ///     .ground("shaft", "wheel")
    ///     .stiffness(2e5)
    ///     .law(Backlash::half_gap(1e-3))
    ///     .modal_damping(0.05)
    ///     .load("wheel", Load::mean(20.0).harmonic(1, 30.0))
    ///     .build()?;
    /// let history = TimeHistory::at(hertz(100.0))
    ///     .with(|settings| settings.periods = Some(2))
    ///     .run(&model)?;
    /// assert_eq!(history.times().len(), history.column("q.shaft").map_or(0, <[f64]>::len));
    /// # Ok::<(), Error>(())
    /// ```
    pub fn at(frequency: impl Into<Quantity>) -> TimeHistory {
        TimeHistory {
            at: Some(frequency.into()),
            ..TimeHistory::default()
        }
    }

    /// Motion over a duration \[s\] from t = 0; loads may be functions of time.
    pub fn lasting(duration: impl Into<Quantity>) -> TimeHistory {
        TimeHistory {
            duration: Some(duration.into()),
            ..TimeHistory::default()
        }
    }
}

impl Default for OperatingPoint {
    /// All defaults; set the excitation frequency.
    fn default() -> OperatingPoint {
        defaults(json!({"at": 0}))
    }
}

impl OperatingPoint {
    /// Attractor at an excitation frequency, followed from rest.
    ///
    /// ```
    /// use gearlash::prelude::*;
    ///
    /// let model = Model::builder()
    ///     .body("wheel", 0.5)
    ///     .ground("shaft", "wheel")
    ///     .stiffness(2e5)
    ///     .law(Backlash::half_gap(1e-3))
    ///     .modal_damping(0.05)
    ///     .load("wheel", Load::mean(20.0).harmonic(1, 30.0))
    ///     .build()?;
    /// let report = OperatingPoint::at(hertz(100.0)).run(&model)?;
    /// assert_eq!(report.main().map(Table::rows), Some(1));
    /// # Ok::<(), Error>(())
    /// ```
    pub fn at(frequency: impl Into<Quantity>) -> OperatingPoint {
        OperatingPoint {
            at: frequency.into(),
            ..OperatingPoint::default()
        }
    }
}

impl Default for RunUp {
    /// All defaults; set the speeds, and a duration or a rate.
    fn default() -> RunUp {
        defaults(json!({}))
    }
}

impl RunUp {
    /// Run-up of the reference from one speed to another within a duration \[s\].
    pub fn between(
        from: impl Into<Quantity>,
        to: impl Into<Quantity>,
        duration: impl Into<Quantity>,
    ) -> RunUp {
        RunUp {
            from: Some(from.into()),
            to: Some(to.into()),
            duration: Some(duration.into()),
            ..RunUp::default()
        }
    }
}

impl Default for PoincareMap {
    /// All defaults; set the excitation frequency.
    fn default() -> PoincareMap {
        defaults(json!({"at": 0}))
    }
}

impl PoincareMap {
    /// Map at an excitation frequency.
    ///
    /// ```
    /// use gearlash::prelude::*;
    ///
    /// let model = Model::builder()
    ///     .body("wheel", 0.5)
    ///     .ground("shaft", "wheel")
    ///     .stiffness(2e5)
    ///     .law(Backlash::half_gap(1e-3))
    ///     .modal_damping(0.05)
    ///     .load("wheel", Load::mean(20.0).harmonic(1, 30.0))
    ///     .build()?;
    /// let map = PoincareMap::at(hertz(150.0)).with(|settings| settings.periods = 20).run(&model)?;
    /// assert_eq!(map.labels(), ["period 1"]);
    /// # Ok::<(), Error>(())
    /// ```
    pub fn at(frequency: impl Into<Quantity>) -> PoincareMap {
        PoincareMap {
            at: frequency.into(),
            ..PoincareMap::default()
        }
    }
}

impl Default for BifurcationDiagram {
    /// 200 values; set the range, and `at` if the parameter is not the frequency.
    fn default() -> BifurcationDiagram {
        defaults(json!({"from": 0, "to": 0, "points": POINTS}))
    }
}

impl BifurcationDiagram {
    /// Diagram from one excitation frequency to another.
    ///
    /// ```
    /// use gearlash::prelude::*;
    ///
    /// let model = Model::builder()
    ///     .body("wheel", 0.5)
    ///     .ground("shaft", "wheel")
    ///     .stiffness(2e5)
    ///     .law(Backlash::half_gap(1e-3))
    ///     .modal_damping(0.05)
    ///     .load("wheel", Load::mean(20.0).harmonic(1, 30.0))
    ///     .build()?;
    /// let diagram = BifurcationDiagram::between(hertz(150.0), hertz(140.0))
    ///     .with(|settings| settings.points = 3)
    ///     .run(&model)?;
    /// assert_eq!(diagram.labels().len(), 3);
    /// # Ok::<(), Error>(())
    /// ```
    pub fn between(from: impl Into<Quantity>, to: impl Into<Quantity>) -> BifurcationDiagram {
        BifurcationDiagram {
            from: from.into(),
            to: to.into(),
            ..BifurcationDiagram::default()
        }
    }
}

impl Default for ParameterStudy {
    /// Empty study: set the parameters, the analysis and the collected quantities.
    fn default() -> ParameterStudy {
        defaults(json!({"analysis": "", "collect": {}}))
    }
}

impl ParameterStudy {
    /// A study that runs an analysis.
    ///
    /// ```
    /// use gearlash::prelude::*;
    ///
    /// let model = Model::builder()
    ///     .body("wheel", 0.5)
    ///     .ground("shaft", "wheel")
    ///     .stiffness(2e5)
    ///     .law(Backlash::half_gap(1e-3))
    ///     .modal_damping(0.05)
    ///     .load("wheel", Load::mean(20.0).harmonic(1, 30.0))
    ///     .build()?;
    /// let response = FrequencyResponse::between(hertz(150.0), hertz(140.0)).harmonics(3);
    /// let report = ParameterStudy::of(response)
    ///     .over("shaft.stiffness", [2e5, 3e5])
    ///     .collecting("peak", Collected::max("rms.shaft"))
    ///     .run(&model)?;
    /// assert_eq!(report.main().map(Table::rows), Some(2));
    /// # Ok::<(), Error>(())
    /// ```
    pub fn of(analysis: impl Analysis + 'static) -> ParameterStudy {
        let analysis: Box<dyn Analysis> = Box::new(analysis);
        ParameterStudy {
            // What cannot be written is refused as "null" by the check.
            analysis: serde_json::to_value(&analysis).unwrap_or(Value::Null),
            ..ParameterStudy::default()
        }
    }

    /// A study that runs an analysis of the model, by its name.
    pub fn named(analysis: impl Into<String>) -> ParameterStudy {
        ParameterStudy {
            analysis: Value::String(analysis.into()),
            ..ParameterStudy::default()
        }
    }

    /// Varies one more number over values: every combination runs, the last number changes fastest.
    #[must_use]
    pub fn over<Q: Into<Quantity>>(
        self,
        number: impl Into<String>,
        values: impl IntoIterator<Item = Q>,
    ) -> ParameterStudy {
        let values = values
            .into_iter()
            .map(|value| Given::Quantity(value.into()));
        let values = Axis::Values(values.collect());
        self.with(|study| {
            let grid = study.grid.get_or_insert_with(IndexMap::new);
            grid.insert(number.into(), values);
        })
    }

    /// Adds a collected quantity.
    #[must_use]
    pub fn collecting(self, name: impl Into<String>, what: Collected) -> ParameterStudy {
        self.with(|study| {
            study.collect.insert(name.into(), what);
        })
    }
}

impl Collected {
    /// One value of a column of the main table.
    pub fn of(column: impl Into<String>, reduce: Reduce) -> Collected {
        Collected {
            table: "main".into(),
            column: Some(column.into()),
            reduce,
            by: None,
            only: IndexMap::new(),
        }
    }

    /// The largest value of a column of the main table.
    pub fn max(column: impl Into<String>) -> Collected {
        Collected::of(column, Reduce::Max)
    }
}
