//! A clutch disc: a spring of several stages, each with its own dry friction.

mod slider;
mod written;

use super::automaton::{Automaton, line};
use super::{
    Dimension, Element, InvalidParameter, Parameter, ParameterInfo, ParameterKind, ParameterRange,
    PiecewiseLinear, Response,
};
use serde::{Deserialize, Serialize};
use slider::Slider;
use written::ClutchKeys;

/// A broken line with a slider for every stage.
///
/// ```text
/// f = sum_i s_i (q_i),   s_i = k_i q_i / K + a slider of force F_i / K on q_i,   F_i = H_i / 2
/// q_i = clamp(q, -c_i, d_i) - clamp(q, -c_(i-1), d_(i-1))
/// ```
///
/// d_i, c_i: ends of stage i on the drive and on the coast side (the last stage has none), k_i: its stiffness, H_i: the height of its
/// loop, K: stiffness of the connection. A slider moves only while the deformation is within its stage, so that the friction of the
/// main stage makes no loop at idle; the force that it has when the deformation leaves the stage stays. With `everywhere` every
/// slider acts on the whole deformation.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
#[serde(try_from = "ClutchKeys", into = "ClutchKeys")]
pub struct Clutch {
    /// Stages from the middle outwards, q > 0.
    pub drive: Vec<Stage>,
    /// The same, q < 0.
    pub coast: Vec<Stage>,
    /// Whether the sliders act on the whole deformation.
    pub everywhere: bool,
}

/// A stage of one side.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Stage {
    /// End of the stage \[displacement\], > 0; `None` for the last stage.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub to: Option<f64>,
    /// k \[force/displacement\], >= 0.
    pub stiffness: f64,
    /// H \[force\], >= 0: height of the loop of force against deformation.
    #[serde(default)]
    pub hysteresis: f64,
    /// Stiffness of the spring of the slider \[force/displacement\], > 0; that of the connection when absent.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub hysteresis_stiffness: Option<f64>,
}

/// A stiffness.
const STIFFNESS: Dimension = Dimension {
    displacement: -2,
    time: 0,
    force: 2,
};

static STAGE: [ParameterInfo; 4] = [
    ParameterInfo::new(
        "to",
        "deformation at which the stage ends; the last stage has no end",
        ParameterKind::Number,
        Dimension::DISPLACEMENT,
        Some("null"),
    )
    .within(ParameterRange::Positive),
    ParameterInfo::new(
        "stiffness",
        "slope of the stage",
        ParameterKind::Number,
        STIFFNESS,
        None,
    )
    .within(ParameterRange::NotNegative),
    ParameterInfo::new(
        "hysteresis",
        "height of the loop, twice the friction",
        ParameterKind::Number,
        Dimension::FORCE,
        Some("0"),
    )
    .within(ParameterRange::NotNegative),
    ParameterInfo::new(
        "hysteresis_stiffness",
        "slope of the loop's flanks; default: stiffness of the connection",
        ParameterKind::Number,
        STIFFNESS,
        Some("null"),
    )
    .within(ParameterRange::Positive),
];

crate::register_element! {
    tag: "clutch",
    doc: "a broken line through 0 with one slider (Jenkins element) per stage, which moves only within its stage",
    parameters: [
        { name: "stages", doc: "stages from the middle outwards, the same on both sides", kind: ParameterKind::Records(&STAGE), dimension: Dimension::NONE, default: None, one_of: ["stages", "drive"] },
        { name: "drive", doc: "stages of the side q > 0, with `coast`", kind: ParameterKind::Records(&STAGE), dimension: Dimension::NONE, default: None, one_of: ["stages", "drive"] },
        { name: "coast", doc: "stages of the side q < 0, with `drive`", kind: ParameterKind::Records(&STAGE), dimension: Dimension::NONE, default: Some("null") },
        { name: "everywhere", doc: "true: the sliders act on the whole deformation", kind: ParameterKind::Switch, dimension: Dimension::NONE, default: Some("false") },
    ],
    example: "{type: clutch, stages: [{to: 0.5, stiffness: 0.1, hysteresis: 0.04, hysteresis_stiffness: 0.3}, {stiffness: 1, hysteresis: 0.3}]}",
}

/// Where a stage of a side begins and ends; the last one has no end.
fn span(side: &[Stage], k: usize) -> (f64, f64) {
    let end = |k: usize| match side[k].to {
        Some(to) if k + 1 < side.len() => to,
        _ => f64::INFINITY,
    };
    (if k == 0 { 0.0 } else { end(k - 1) }, end(k))
}

/// Force and slope of the spring at a distance from the middle.
fn stretch(side: &[Stage], x: f64) -> (f64, f64) {
    let (mut force, mut slope) = (0.0, 0.0);
    for (k, stage) in side.iter().enumerate() {
        let (begin, end) = span(side, k);
        if x < begin {
            break;
        }
        force += stage.stiffness * (x.min(end) - begin);
        slope = stage.stiffness;
    }
    (force, slope)
}

/// Stiffness and reach of the slider of a stage.
fn friction(stage: &Stage) -> (f64, f64) {
    let stiffness = stage.hysteresis_stiffness.unwrap_or(1.0);
    (stiffness, 0.5 * stage.hysteresis / stiffness)
}

impl Clutch {
    /// The sliders, stage by stage. A stage with the same friction on both sides has one slider.
    fn sliders(&self) -> impl Iterator<Item = Slider> + '_ {
        let stages = 0..self.drive.len().max(self.coast.len());
        let list = stages.flat_map(|k| self.sliders_of(k));
        list.flatten().filter(|slider| slider.reach > 0.0)
    }

    fn sliders_of(&self, k: usize) -> [Option<Slider>; 2] {
        let make = |windows: [Option<(f64, f64)>; 2], (stiffness, reach): (f64, f64)| Slider {
            windows: match self.everywhere {
                true => [Some((f64::NEG_INFINITY, f64::INFINITY)), None],
                false => windows,
            },
            stiffness,
            reach,
        };
        let up = self
            .drive
            .get(k)
            .map(|s| (span(&self.drive, k), friction(s)));
        let down = self
            .coast
            .get(k)
            .map(|s| (span(&self.coast, k), friction(s)));
        let down = down.map(|((begin, end), friction)| ((-end, -begin), friction));
        match (up, down) {
            (Some((a, own)), Some((b, other))) if own == other => {
                let windows = match k {
                    0 => [Some((b.0, a.1)), None],
                    _ => [Some(b), Some(a)],
                };
                [Some(make(windows, own)), None]
            }
            (up, down) => [down, up]
                .map(|side| side.map(|(window, friction)| make([Some(window), None], friction))),
        }
    }

    /// Force and slope of the spring.
    fn pull(&self, q: f64) -> Response {
        let (f, df_dq) = match q >= 0.0 {
            true => stretch(&self.drive, q),
            false => {
                let (force, slope) = stretch(&self.coast, -q);
                (-force, slope)
            }
        };
        Response {
            f,
            df_dq,
            df_dv: 0.0,
        }
    }

    /// The spring without friction.
    fn spring(&self) -> PiecewiseLinear {
        let ends = |side: &[Stage]| {
            (0..side.len())
                .map(|k| span(side, k).1)
                .collect::<Vec<f64>>()
        };
        let mut breakpoints: Vec<f64> = ends(&self.coast).iter().rev().map(|c| -c).collect();
        let mut slopes: Vec<f64> = self.coast.iter().rev().map(|s| s.stiffness).collect();
        breakpoints.push(0.0);
        slopes.extend(self.drive.iter().map(|s| s.stiffness));
        breakpoints.extend(ends(&self.drive));
        breakpoints.retain(|b| b.is_finite());
        joined(&breakpoints, &slopes)
    }

    /// The whole law on its first loading.
    fn first(&self) -> PiecewiseLinear {
        let spring = self.spring();
        let sliders: Vec<Slider> = self.sliders().collect();
        let mut breakpoints = spring.breakpoints.clone();
        for slider in &sliders {
            breakpoints.extend(slider.edges());
            for (low, high) in slider.windows() {
                let origin = 0.0_f64.clamp(*low, *high);
                breakpoints.extend([origin - slider.reach, origin + slider.reach]);
            }
        }
        breakpoints.sort_by(f64::total_cmp);
        breakpoints.dedup();
        let middle = |k: usize| match (k.checked_sub(1).map(|j| breakpoints[j]), breakpoints.get(k))
        {
            (None, None) => 0.0,
            (Some(low), None) => low + 1.0,
            (None, Some(high)) => high - 1.0,
            (Some(low), Some(high)) => 0.5 * (low + high),
        };
        let slope = |k: usize| {
            let q = middle(k);
            let sum = sliders
                .iter()
                .map(|s| s.respond(q, 0.0, 0.0).df_dq)
                .sum::<f64>();
            spring.eval(q, 0.0, 0.0).df_dq + sum
        };
        let slopes: Vec<f64> = (0..=breakpoints.len()).map(slope).collect();
        joined(&breakpoints, &slopes)
    }
}

/// A broken line without the breakpoints at which nothing changes.
fn joined(breakpoints: &[f64], slopes: &[f64]) -> PiecewiseLinear {
    let mut law = PiecewiseLinear {
        breakpoints: Vec::new(),
        slopes: vec![slopes[0]],
    };
    for (b, pair) in breakpoints.iter().zip(slopes.windows(2)) {
        if pair[0] != pair[1] {
            law.breakpoints.push(*b);
            law.slopes.push(pair[1]);
        }
    }
    law
}

#[typetag::serde(name = "clutch")]
impl Element for Clutch {
    fn eval(&self, q: f64, v: f64, _phase: f64) -> Response {
        let mut response = self.pull(q);
        for slider in self.sliders() {
            let own = slider.respond(q, v, 0.0);
            response.f += own.f;
            response.df_dq += own.df_dq;
        }
        response
    }

    fn respond(&self, q: f64, v: f64, _phase: f64, memory: &[f64]) -> Response {
        let mut response = self.pull(q);
        for (slider, z) in self.sliders().zip(memory) {
            let own = slider.respond(q, v, *z);
            response.f += own.f;
            response.df_dq += own.df_dq;
        }
        response
    }

    fn memory_count(&self) -> usize {
        self.sliders().count()
    }

    fn slip_excess(&self, low: f64, high: f64) -> Vec<f64> {
        let excess = |s: Slider| s.seen(high) - s.seen(low) - 2.0 * s.reach;
        self.sliders().map(excess).collect()
    }

    fn project(&self, q: f64, memory: &mut [f64]) {
        for (slider, z) in self.sliders().zip(memory) {
            let seen = slider.seen(q);
            *z = z.clamp(seen - slider.reach, seen + slider.reach);
        }
    }

    fn automata(&self) -> Option<Vec<Automaton>> {
        let spring = self.spring();
        let mut offsets = Vec::new();
        for (k, slope) in spring.slopes.iter().enumerate() {
            let at = match spring.breakpoints.get(k) {
                Some(b) => *b,
                None => spring.breakpoints.last().copied().unwrap_or(0.0),
            };
            offsets.push(spring.eval(at, 0.0, 0.0).f - slope * at);
        }
        let breakpoints = &spring.breakpoints;
        let flanks: Vec<i8> = (0..spring.slopes.len())
            .map(
                |k| match (k.checked_sub(1).map(|j| breakpoints[j]), breakpoints.get(k)) {
                    (None, None) => self.flank(0.0),
                    (Some(low), None) => self.flank(low + 1.0),
                    (None, Some(high)) => self.flank(high - 1.0),
                    (Some(low), Some(high)) => self.flank(0.5 * (low + high)),
                },
            )
            .collect();
        let mut parts = vec![line(breakpoints, (&spring.slopes, &offsets), &flanks)];
        parts.extend(self.sliders().map(|slider| slider.automaton()));
        Some(parts)
    }

    fn first_loading(&self) -> Option<Box<dyn Element>> {
        Some(Box::new(self.first()))
    }

    fn visit_parameters(&mut self, visit: &mut dyn FnMut(Parameter<'_>)) {
        for (k, stage) in self.drive.iter_mut().chain(&mut self.coast).enumerate() {
            let fields = [
                ("to", Dimension::DISPLACEMENT, stage.to.as_mut()),
                ("stiffness", STIFFNESS, Some(&mut stage.stiffness)),
                ("hysteresis", Dimension::FORCE, Some(&mut stage.hysteresis)),
                (
                    "hysteresis_stiffness",
                    STIFFNESS,
                    stage.hysteresis_stiffness.as_mut(),
                ),
            ];
            for (name, dimension, value) in fields {
                if let Some(value) = value {
                    visit(Parameter {
                        name,
                        index: Some(k),
                        dimension,
                        value,
                    });
                }
            }
        }
    }

    fn clone_box(&self) -> Box<dyn Element> {
        Box::new(self.clone())
    }

    fn breakpoints(&self) -> Vec<f64> {
        self.spring().breakpoints
    }

    fn flank(&self, q: f64) -> i8 {
        let is_free =
            |s: Option<&Stage>| s.is_some_and(|s| s.stiffness == 0.0 && s.hysteresis == 0.0);
        let (drive, coast) = (self.drive.first(), self.coast.first());
        match q >= 0.0 {
            _ if !is_free(drive) || !is_free(coast) => 1,
            true => i8::from(q > span(&self.drive, 0).1),
            false => -i8::from(-q > span(&self.coast, 0).1),
        }
    }

    fn depends_on_velocity(&self) -> bool {
        false
    }

    fn validate(&self) -> Result<(), InvalidParameter> {
        let is_one = self.drive == self.coast;
        let sides: &[(&str, &[Stage])] = match is_one {
            true => &[("stages", &self.drive)],
            false => &[("drive", &self.drive), ("coast", &self.coast)],
        };
        for (key, stages) in sides {
            written::check(key, stages)?;
        }
        let first = |side: &[Stage]| side.first().map(friction);
        if first(&self.drive) != first(&self.coast) {
            let message = "the first stage has one slider for both sides: write the same hysteresis and hysteresis_stiffness in drive[0] and coast[0]";
            return Err(InvalidParameter::about("drive", message));
        }
        Ok(())
    }
}
