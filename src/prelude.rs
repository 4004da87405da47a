//! Everything required to build models and run analyses, in one `use`.
//!
//! ```
//! use gearlash::prelude::*;
//!
//! let model = Model::builder()
//!     .body("wheel", 0.5)
//!     .ground("shaft", "wheel")
//!     .stiffness(2e5)
//!     .build()?;
//! let modes = Modes::default().run(&model)?;
//! assert!(modes.main().is_some_and(|table| table.rows() > 0));
//! # Ok::<(), Error>(())
//! ```

pub use crate::analysis::parameter_study::{Collected, Reduce};
pub use crate::analysis::{
    BifurcationDiagram, Control, EffectiveFrequencies, FrequencyResponse, Method, Modes, Observer,
    OperatingPoint, ParameterResponse, ParameterStudy, PoincareMap, RunUp, TimeHistory,
};
pub use crate::element::{
    Backlash, Cubic, Element, Expression, Linear, OneSided, PiecewiseLinear, Preloaded,
    TanhFriction,
};
pub use crate::error::{Diagnostic, Error};
pub use crate::interrupt::Interrupt;
pub use crate::model::{Knob, Load, Model, NamedNumber};
pub use crate::quantity::{Quantity, hertz, radians_per_second, rpm};
pub use crate::report::{Column, Report, Table, Values};
pub use crate::study::{History, Iterates, ResponseCurves, ResponseEvent, ResponsePoint};
