//! A stop that does not yield: impacts with a coefficient of restitution.

use super::automaton::{
    Automaton, Direction, Guard, MemoryRate, Region, RegionForce, Reset, Surface,
};
use super::{
    Dimension, Element, InvalidParameter, Parameter, ParameterKind, ParameterRange, Response, Side,
};
use serde::{Deserialize, Serialize};

/// Rigid stops at q = b, q = -b or both.
///
/// ```text
/// v+ = -r v-  at |q| = b with approach;  q stays at b while the force that holds it there presses
/// ```
///
/// r: coefficient of restitution. Impacts that follow each other ever faster end in a contact that is held. The stiffness of the
/// connection does not count, only the direction in which it acts. A motion that jumps in its velocity has no Fourier series that
/// converges: shooting and integration are the methods.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
#[serde(try_from = "RigidStopKeys", into = "RigidStopKeys")]
pub struct RigidStop {
    /// Distance b from q = 0 to the stop \[displacement\], >= 0.
    pub gap: f64,
    /// The side of a single stop; `None`: one on each side.
    pub side: Option<Side>,
    /// r, 0..1.
    pub restitution: f64,
    /// Impacts slower than this share of the scale of rates are not counted.
    pub least_impact: f64,
}

/// The parameters as a user writes them.
#[derive(Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
struct RigidStopKeys {
    #[serde(skip_serializing_if = "Option::is_none")]
    half_gap: Option<f64>,
    #[serde(skip_serializing_if = "Option::is_none")]
    gap: Option<f64>,
    #[serde(default, skip_serializing_if = "Option::is_none")]
    side: Option<Side>,
    restitution: f64,
    #[serde(default = "least_impact")]
    least_impact: f64,
}

fn least_impact() -> f64 {
    1e-9
}

impl TryFrom<RigidStopKeys> for RigidStop {
    type Error = String;

    fn try_from(written: RigidStopKeys) -> Result<Self, String> {
        let gap = match (written.half_gap, written.gap, written.side) {
            (Some(_), Some(_), _) => {
                return Err(
                    "half_gap and gap exclude each other (without `side`, gap = 2 half_gap)".into(),
                );
            }
            (None, None, _) => {
                return Err(
                    "one of half_gap or gap (with `side`: the distance to one stop) is required"
                        .into(),
                );
            }
            (Some(_), None, Some(_)) => {
                return Err("half_gap has a stop on each side: write `gap` with `side`".into());
            }
            (Some(half), None, None) => half,
            (None, Some(gap), None) => 0.5 * gap,
            (None, Some(gap), Some(_)) => gap,
        };
        Ok(RigidStop {
            gap,
            side: written.side,
            restitution: written.restitution,
            least_impact: written.least_impact,
        })
    }
}

impl From<RigidStop> for RigidStopKeys {
    fn from(law: RigidStop) -> RigidStopKeys {
        let is_single = law.side.is_some();
        RigidStopKeys {
            half_gap: (!is_single).then_some(law.gap),
            gap: is_single.then_some(law.gap),
            side: law.side,
            restitution: law.restitution,
            least_impact: law.least_impact,
        }
    }
}

crate::register_element! {
    tag: "rigid_stop",
    doc: "rigid stops at |q| = b: v+ = -restitution v-, then held contact; the stiffness of the connection has no effect",
    parameters: [
        { name: "half_gap", doc: "distance to a stop on each side", kind: ParameterKind::Number, dimension: Dimension::DISPLACEMENT, default: None, range: ParameterRange::NotNegative, one_of: ["half_gap", "gap"] },
        { name: "gap", doc: "with `side` the distance to the stop, without it the distance between two stops", kind: ParameterKind::Number, dimension: Dimension::DISPLACEMENT, default: None, range: ParameterRange::NotNegative, one_of: ["half_gap", "gap"] },
        { name: "side", doc: "side of a single stop", kind: ParameterKind::Choice(&["positive", "negative"]), dimension: Dimension::NONE, default: Some("null") },
        { name: "restitution", doc: "coefficient of restitution, 0 to 1", kind: ParameterKind::Number, dimension: Dimension::NONE, default: None, range: ParameterRange::NotNegative },
        { name: "least_impact", doc: "slower impacts are not counted; relative to the r.m.s. rate", kind: ParameterKind::Number, dimension: Dimension::NONE, default: Some("1e-9"), range: ParameterRange::NotNegative },
    ],
    example: "{type: rigid_stop, gap: 0.5, side: positive, restitution: 0.6}",
}

/// Force beyond a stop at rest: more than any load.
const WALL: f64 = 1e12;

impl RigidStop {
    /// The stops, from below: their direction and the flank.
    fn stops(&self) -> impl Iterator<Item = (Direction, i8)> {
        let has = |side: Side| self.side.is_none_or(|s| s == side);
        let low = has(Side::Negative).then_some((Direction::Down, -1));
        let high = has(Side::Positive).then_some((Direction::Up, 1));
        low.into_iter().chain(high)
    }
}

/// The stops at rest: nothing before them, any force beyond.
#[derive(Debug, Clone, Copy, Serialize, Deserialize)]
struct Wall {
    stop: RigidStop,
}

#[typetag::serde(name = "rigid_stop_at_rest")]
impl Element for Wall {
    fn eval(&self, q: f64, _v: f64, _phase: f64) -> Response {
        Response {
            f: WALL * f64::from(self.stop.flank(q)),
            ..Response::default()
        }
    }

    fn visit_parameters(&mut self, visit: &mut dyn FnMut(Parameter<'_>)) {
        self.stop.visit_parameters(visit);
    }

    fn clone_box(&self) -> Box<dyn Element> {
        Box::new(*self)
    }

    fn breakpoints(&self) -> Vec<f64> {
        self.stop.breakpoints()
    }

    fn flank(&self, q: f64) -> i8 {
        self.stop.flank(q)
    }

    fn is_piecewise_affine(&self) -> bool {
        true
    }

    fn is_discontinuous(&self) -> bool {
        true
    }

    fn is_spring(&self) -> bool {
        false
    }

    fn depends_on_velocity(&self) -> bool {
        false
    }
}

#[typetag::serde(name = "rigid_stop")]
impl Element for RigidStop {
    /// Nothing: the forces of impacts and of held contact are the system's.
    fn eval(&self, _q: f64, _v: f64, _phase: f64) -> Response {
        Response::default()
    }

    fn first_loading(&self) -> Option<Box<dyn Element>> {
        Some(Box::new(Wall { stop: *self }))
    }

    fn automata(&self) -> Option<Vec<Automaton>> {
        let mut free = Vec::new();
        let mut regions = vec![Region {
            force: RegionForce::line(0.0, 0.0),
            memory: MemoryRate::Kept,
            guards: Vec::new(),
            contact: 0,
        }];
        for (direction, flank) in self.stops() {
            let (level, held) = (direction.sign() * self.gap, regions.len());
            free.push(Guard {
                surface: Surface::Deformation { level, gain: 0.0 },
                direction,
                to: 0,
                reset: Reset::Restitution {
                    coefficient: self.restitution,
                    held,
                },
            });
            let release = match direction {
                Direction::Up => Direction::Down,
                Direction::Down => Direction::Up,
            };
            regions.push(Region {
                force: RegionForce::Held { level },
                memory: MemoryRate::Kept,
                guards: vec![Guard {
                    surface: Surface::HoldingForce(0.0),
                    direction: release,
                    to: 0,
                    reset: Reset::None,
                }],
                contact: flank,
            });
        }
        regions[0].guards = free;
        Some(vec![Automaton {
            regions,
            has_memory: false,
        }])
    }

    fn visit_parameters(&mut self, visit: &mut dyn FnMut(Parameter<'_>)) {
        let name = if self.side.is_some() {
            "gap"
        } else {
            "half_gap"
        };
        for (name, dimension, value) in [
            (name, Dimension::DISPLACEMENT, &mut self.gap),
            ("restitution", Dimension::NONE, &mut self.restitution),
            ("least_impact", Dimension::NONE, &mut self.least_impact),
        ] {
            visit(Parameter {
                name,
                index: None,
                dimension,
                value,
            });
        }
    }

    fn clone_box(&self) -> Box<dyn Element> {
        Box::new(*self)
    }

    fn breakpoints(&self) -> Vec<f64> {
        self.stops().map(|(d, _)| d.sign() * self.gap).collect()
    }

    fn flank(&self, q: f64) -> i8 {
        let beyond = |(d, flank): (Direction, i8)| (d.sign() * q > self.gap).then_some(flank);
        self.stops().find_map(beyond).unwrap_or(0)
    }

    fn least_impact(&self) -> Option<f64> {
        Some(self.least_impact)
    }

    fn is_piecewise_affine(&self) -> bool {
        true
    }

    fn is_discontinuous(&self) -> bool {
        true
    }

    fn is_spring(&self) -> bool {
        false
    }

    fn depends_on_velocity(&self) -> bool {
        false
    }

    fn cautions(&self) -> Vec<String> {
        match self.restitution == 1.0 {
            true => vec![
                "restitution 1 dissipates no energy: without other damping motions never settle"
                    .into(),
            ],
            false => Vec::new(),
        }
    }

    fn validate(&self) -> Result<(), InvalidParameter> {
        let name = if self.side.is_some() {
            "gap"
        } else {
            "half_gap"
        };
        super::not_negative(name, self.gap)?;
        super::not_negative("restitution", self.restitution)?;
        if self.restitution > 1.0 {
            let wanted = "from 0 (plastic) to 1 (elastic)";
            return Err(InvalidParameter::new(
                "restitution",
                self.restitution,
                wanted,
            ));
        }
        super::not_negative("least_impact", self.least_impact)
    }
}
