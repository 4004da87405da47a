//! Where a formula is not smooth: the displacements at which `abs`, `sign`, `min`, `max` and conditions switch.
//!
//! A function switches where its argument (of `min`, `max` and comparisons: the difference of their arguments) passes 0. Where that is
//! affine in q between the places found so far, and depends on nothing else, the place follows exactly. Other switches
//! stay hidden.

use super::formula::{Binary, Formula, FormulaNode, Unary, Variable};
use super::program::{FormulaArguments, values};
use crate::element::derivatives::Dual;

/// Dependence of a node on q, v and phase between two switches.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
struct NodeShape {
    /// 0 constant, 1 affine in (q, v), 2 anything else.
    degree: u8,
    on_velocity: bool,
    on_phase: bool,
}

/// A switch that could not be placed.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(super) struct HiddenSwitch {
    /// Bytes of the text before it.
    pub(super) place: usize,
    /// Whether the value may jump there; else only its slope does.
    pub(super) may_jump: bool,
}

/// Switches of a formula, for given parameters.
#[derive(Debug, Clone, Default)]
pub(super) struct FoundKinks {
    /// Displacements, ascending.
    pub(super) levels: Vec<f64>,
    /// The others.
    pub(super) hidden: Vec<HiddenSwitch>,
    /// Whether the value is affine in q between the levels and depends on nothing else.
    pub(super) is_affine: bool,
    /// Whether the value depends on v.
    pub(super) on_velocity: bool,
    /// Whether the value depends on the phase.
    pub(super) on_phase: bool,
}

/// Levels closer to each other than this share of their size are one.
const SAME: f64 = 1e-12;

/// Finds the switches.
pub(super) fn find(formula: &Formula, parameters: &[f64]) -> FoundKinks {
    let mut search = KinkSearch {
        formula,
        parameters,
        shapes: Vec::with_capacity(formula.nodes.len()),
        kinks: FoundKinks::default(),
    };
    for node in 0..formula.nodes.len() {
        let shape = search.shape(node);
        search.shapes.push(shape);
    }
    let KinkSearch {
        shapes, mut kinks, ..
    } = search;
    if let Some(value) = shapes.last() {
        (kinks.on_velocity, kinks.on_phase) = (value.on_velocity, value.on_phase);
        kinks.is_affine = value.degree <= 1 && !value.on_velocity && !value.on_phase;
    }
    if kinks.is_affine {
        forget_smooth(formula, parameters, &mut kinks.levels);
    }
    kinks
}

/// The regions between levels, the outer ones cut off at the size of the levels.
pub(super) fn regions(levels: &[f64]) -> Vec<(f64, f64)> {
    let (Some(first), Some(last)) = (levels.first(), levels.last()) else {
        return vec![(-1.0, 1.0)];
    };
    let size = match first.abs().max(last.abs()) {
        0.0 => 1.0,
        size => size,
    };
    let mut list = vec![(first - 2.0 * size, *first)];
    list.extend(levels.windows(2).map(|w| (w[0], w[1])));
    list.push((*last, last + 2.0 * size));
    list
}

/// A displacement inside each region between levels.
pub(super) fn insides(levels: &[f64]) -> impl Iterator<Item = f64> {
    regions(levels)
        .into_iter()
        .map(|(low, high)| 0.5 * (low + high))
}

struct KinkSearch<'f> {
    formula: &'f Formula,
    parameters: &'f [f64],
    shapes: Vec<NodeShape>,
    kinks: FoundKinks,
}

impl KinkSearch<'_> {
    fn shape(&mut self, node: usize) -> NodeShape {
        let place = self.formula.places[node];
        match self.formula.nodes[node] {
            FormulaNode::Number(_) | FormulaNode::Parameter(_) => NodeShape::CONSTANT,
            FormulaNode::Variable(variable) => NodeShape::of(variable),
            FormulaNode::Unary(Unary::Negative, x) => self.shapes[x],
            FormulaNode::Unary(Unary::Abs, x) => {
                let shape = self.shapes[x];
                let is_placed = self.place(shape, |all| all[x], place, false);
                shape.if_placed(is_placed)
            }
            FormulaNode::Unary(Unary::Sign, x) => {
                let shape = self.shapes[x];
                let is_placed = self.place(shape, |all| all[x], place, true);
                NodeShape { degree: 0, ..shape }.if_placed(is_placed)
            }
            FormulaNode::Unary(_, x) => self.shapes[x].smooth(),
            FormulaNode::Binary(operator, a, b) => self.binary(operator, (a, b), place),
            FormulaNode::If(condition, a, b) => {
                let (condition, value) =
                    (self.shapes[condition], self.shapes[a].and(self.shapes[b]));
                let degree = if condition.degree == 0 {
                    value.degree
                } else {
                    2
                };
                NodeShape {
                    degree,
                    ..value.and(condition)
                }
            }
        }
    }

    fn binary(&mut self, operator: Binary, (a, b): (usize, usize), place: usize) -> NodeShape {
        let (x, y) = (self.shapes[a], self.shapes[b]);
        let both = x.and(y);
        let exponent = self.constant(b);
        let degree = match operator {
            Binary::Min | Binary::Max => {
                let is_placed = self.place(both, |all| all[a] - all[b], place, false);
                return both.if_placed(is_placed);
            }
            operator if operator.is_comparison() => {
                let is_placed = self.place(both, |all| all[a] - all[b], place, true);
                return NodeShape { degree: 0, ..both }.if_placed(is_placed);
            }
            Binary::Add | Binary::Subtract => both.degree,
            Binary::Multiply => (x.degree + y.degree).min(2),
            Binary::Divide if y.degree == 0 => x.degree,
            Binary::Power if exponent == Some(1.0) => x.degree,
            _ if both.degree == 0 => 0,
            _ => 2,
        };
        NodeShape { degree, ..both }
    }

    /// Value of a node that is one number whatever q, v and phase.
    fn constant(&self, node: usize) -> Option<f64> {
        match self.formula.nodes[node] {
            FormulaNode::Number(value) => Some(value),
            FormulaNode::Parameter(k) => Some(self.parameters[k]),
            _ => None,
        }
    }

    /// Places a switch where a function of the nodes passes 0; false when it stays hidden.
    fn place(
        &mut self,
        shape: NodeShape,
        function: impl Fn(&[Dual]) -> Dual,
        place: usize,
        may_jump: bool,
    ) -> bool {
        if shape.degree == 0 {
            // Constant between the levels: it switches at one of them, if at all.
            return true;
        }
        if shape.degree > 1 || shape.on_velocity || shape.on_phase {
            self.kinks.hidden.push(HiddenSwitch { place, may_jump });
            return false;
        }
        let at = |q: f64| {
            let point = FormulaArguments::at_rest(q);
            // Arguments precede the current node, which has no shape yet.
            let nodes = &self.formula.nodes[..self.shapes.len()];
            function(&values(nodes, self.parameters, point))
        };
        let levels = &self.kinks.levels;
        let mut found = Vec::new();
        for (region, inside) in insides(levels).enumerate() {
            let low = region
                .checked_sub(1)
                .map_or(f64::NEG_INFINITY, |k| levels[k]);
            let high = levels.get(region).copied().unwrap_or(f64::INFINITY);
            if let Some(root) = root(&at, inside, (low, high)) {
                found.push(root);
            }
        }
        self.kinks.levels.extend(found);
        self.kinks.levels.sort_by(f64::total_cmp);
        (self.kinks.levels).dedup_by(|b, a| (*b - *a).abs() <= SAME * a.abs().max(b.abs()));
        true
    }
}

/// Root of an affine function strictly between two ends; the second step takes the rounding of the first one away.
fn root(at: &impl Fn(f64) -> Dual, inside: f64, (low, high): (f64, f64)) -> Option<f64> {
    let mut x = inside;
    for _ in 0..2 {
        let here = at(x);
        if here.dq == 0.0 {
            return None;
        }
        x -= here.value / here.dq;
        let is_inside = x > low && x < high;
        if !is_inside || !x.is_finite() {
            return None;
        }
    }
    // A negative zero would sort and print like another place.
    Some(x + 0.0)
}

/// Drops levels at which a piecewise affine function goes straight on.
fn forget_smooth(formula: &Formula, parameters: &[f64], levels: &mut Vec<f64>) {
    let affine = |q: f64| {
        let point = FormulaArguments::at_rest(q);
        let all = values(&formula.nodes, parameters, point);
        let value = all.last().copied().unwrap_or_default();
        (value.dq, value.value - value.dq * q)
    };
    let lines: Vec<(f64, f64)> = insides(levels).map(affine).collect();
    let mut pairs = lines.windows(2);
    levels.retain(|b| {
        pairs.next().is_none_or(|pair| {
            let ((slope, offset), (next_slope, next_offset)) = (pair[0], pair[1]);
            let size =
                (slope.abs() + next_slope.abs()) * b.abs() + offset.abs() + next_offset.abs();
            let turns = (next_slope - slope).abs() > SAME * (slope.abs() + next_slope.abs());
            turns || (next_offset - offset).abs() > SAME * size
        })
    });
}

impl NodeShape {
    const CONSTANT: NodeShape = NodeShape {
        degree: 0,
        on_velocity: false,
        on_phase: false,
    };

    fn of(variable: Variable) -> NodeShape {
        let none = NodeShape::CONSTANT;
        match variable {
            Variable::Displacement => NodeShape { degree: 1, ..none },
            Variable::Velocity => NodeShape {
                degree: 1,
                on_velocity: true,
                ..none
            },
            Variable::Phase => NodeShape {
                degree: 2,
                on_phase: true,
                ..none
            },
        }
    }

    fn and(self, other: NodeShape) -> NodeShape {
        NodeShape {
            degree: self.degree.max(other.degree),
            on_velocity: self.on_velocity || other.on_velocity,
            on_phase: self.on_phase || other.on_phase,
        }
    }

    /// A smooth function of it.
    fn smooth(self) -> NodeShape {
        let degree = if self.degree == 0 { 0 } else { 2 };
        NodeShape { degree, ..self }
    }

    fn if_placed(self, is_placed: bool) -> NodeShape {
        let degree = if is_placed { self.degree } else { 2 };
        NodeShape { degree, ..self }
    }
}
