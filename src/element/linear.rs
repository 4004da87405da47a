//! The linear law.

use super::traced::Symbol;
use super::{Element, Parameter, Response};
use serde::{Deserialize, Serialize};

/// f = q: a spring that never lets go.
#[derive(Debug, Clone, Copy, Default, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Linear {}

crate::register_element! {
    tag: "linear",
    doc: "f = q; a spring that is always in contact",
    parameters: [],
    example: "{type: linear}",
}

#[typetag::serde(name = "linear")]
impl Element for Linear {
    fn eval(&self, q: f64, _v: f64, _phase: f64) -> Response {
        Response {
            f: q,
            df_dq: 1.0,
            df_dv: 0.0,
        }
    }

    fn trace<'t>(
        &self,
        q: Symbol<'t>,
        _v: Symbol<'t>,
        _phase: Symbol<'t>,
    ) -> Result<Symbol<'t>, String> {
        Ok(q)
    }

    fn visit_parameters(&mut self, _visit: &mut dyn FnMut(Parameter<'_>)) {}

    fn clone_box(&self) -> Box<dyn Element> {
        Box::new(*self)
    }

    fn is_piecewise_affine(&self) -> bool {
        true
    }

    fn depends_on_velocity(&self) -> bool {
        false
    }
}
