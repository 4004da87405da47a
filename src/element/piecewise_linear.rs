//! Any continuous broken line: multi-stage clutches, bilinear stops.

use super::number::Number;
use super::traced::Symbol;
use super::{Dimension, Element, InvalidParameter, Parameter, ParameterKind, Response};
use serde::{Deserialize, Serialize};

/// A continuous broken line with f(0) = 0.
///
/// ```text
/// f(q) = s_r q + sum_k (s_{k+1} - s_k) x_k,    x_k = max(q - b_k, 0) for b_k >= 0, max(b_k - q, 0) for b_k < 0
/// ```
///
/// s_k: slopes relative to the reference stiffness, s_r the one at q = 0; b_k: ascending breakpoints. An interval of zero force and zero slope
/// counts as open (no contact).
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct PiecewiseLinear {
    /// Displacements where the slope changes, ascending.
    pub breakpoints: Vec<f64>,
    /// Slopes from left to right, one more than breakpoints, relative to the stiffness.
    pub slopes: Vec<f64>,
}

crate::register_element! {
    tag: "piecewise_linear",
    doc: "continuous broken line through f(0) = 0; multi-stage clutch, bilinear stop",
    parameters: [
        { name: "breakpoints", doc: "displacements where the slope changes, ascending", kind: ParameterKind::List, dimension: Dimension::DISPLACEMENT, default: None },
        { name: "slopes", doc: "slopes relative to the stiffness, one more than breakpoints", kind: ParameterKind::List, dimension: Dimension::NONE, default: None },
    ],
    example: "{type: piecewise_linear, breakpoints: [-0.3, 0.2, 1.0], slopes: [0.8, 0.0, 0.3, 1.0]}",
}

impl PiecewiseLinear {
    fn region(&self, q: f64) -> usize {
        self.breakpoints.iter().take_while(|b| q > **b).count()
    }

    /// Summed outwards from q = 0, so that an open interval carries exactly no force.
    fn force<N: Number>(&self, q: N) -> N {
        let kinks = self.breakpoints.iter().zip(self.slopes.windows(2));
        kinks.fold(q * self.slopes[self.region(0.0)], |f, (b, s)| {
            let beyond = if *b >= 0.0 {
                (q - *b).max(0.0)
            } else {
                (-q + *b).max(0.0)
            };
            f + beyond * (s[1] - s[0])
        })
    }

    /// An interval around q = 0 with slope 0, the only interval on which the force of a monotone law vanishes.
    fn has_open_stretch(&self) -> bool {
        self.slopes[self.region(0.0)] == 0.0
    }
}

#[typetag::serde(name = "piecewise_linear")]
impl Element for PiecewiseLinear {
    fn eval(&self, q: f64, _v: f64, _phase: f64) -> Response {
        Response {
            f: self.force(q),
            df_dq: self.slopes[self.region(q)],
            df_dv: 0.0,
        }
    }

    fn trace<'t>(
        &self,
        q: Symbol<'t>,
        _v: Symbol<'t>,
        _phase: Symbol<'t>,
    ) -> Result<Symbol<'t>, String> {
        Ok(self.force(q))
    }

    fn visit_parameters(&mut self, visit: &mut dyn FnMut(Parameter<'_>)) {
        let lists = [
            (
                "breakpoints",
                Dimension::DISPLACEMENT,
                &mut self.breakpoints,
            ),
            ("slopes", Dimension::NONE, &mut self.slopes),
        ];
        for (name, dimension, list) in lists {
            for (k, value) in list.iter_mut().enumerate() {
                visit(Parameter {
                    name,
                    index: Some(k),
                    dimension,
                    value,
                });
            }
        }
    }

    fn clone_box(&self) -> Box<dyn Element> {
        Box::new(self.clone())
    }

    fn breakpoints(&self) -> Vec<f64> {
        let kinks = self.breakpoints.iter().zip(self.slopes.windows(2));
        kinks
            .filter(|(_, s)| s[0] != s[1])
            .map(|(b, _)| *b)
            .collect()
    }

    fn flank(&self, q: f64) -> i8 {
        if !self.has_open_stretch() {
            return 1;
        }
        let (here, rest) = (self.region(q), self.region(0.0));
        match here.cmp(&rest) {
            std::cmp::Ordering::Less => -1,
            std::cmp::Ordering::Equal => 0,
            std::cmp::Ordering::Greater => 1,
        }
    }

    fn is_piecewise_affine(&self) -> bool {
        true
    }

    fn depends_on_velocity(&self) -> bool {
        false
    }

    fn validate(&self) -> Result<(), InvalidParameter> {
        if self.slopes.len() != self.breakpoints.len() + 1 {
            let wanted = format!(
                "{} values, one more than breakpoints",
                self.breakpoints.len() + 1
            );
            return Err(InvalidParameter::new(
                "slopes",
                format!("{} values", self.slopes.len()),
                wanted,
            ));
        }
        for (k, b) in self.breakpoints.iter().enumerate() {
            super::finite(&format!("breakpoints[{k}]"), *b)?;
            if k > 0 && *b <= self.breakpoints[k - 1] {
                let wanted = format!(
                    "greater than breakpoints[{}] = {}",
                    k - 1,
                    self.breakpoints[k - 1]
                );
                return Err(InvalidParameter::new(
                    format!("breakpoints[{k}]"),
                    b,
                    wanted,
                ));
            }
        }
        self.slopes
            .iter()
            .enumerate()
            .try_for_each(|(k, s)| super::finite(&format!("slopes[{k}]"), *s))
    }
}
