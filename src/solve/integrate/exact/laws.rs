//! The laws of a system as the flow sees them: in every region between breakpoints an affine function or a program.

use super::cells::{LawCells, inside};
use super::hidden::{self, HiddenPart};
use crate::element::Element;
use crate::element::automaton::{Automaton, RegionForce, line};
use crate::element::evolving::Evolving;
use crate::element::tape::Tape;
use crate::error::SolveError;
use crate::numeric::taylor::{Affine, Program};
use crate::solve::affine::AffineLaw;
use crate::solve::closed_form::ClosedForm;
use crate::system::System;

/// A law between its breakpoints.
#[derive(Debug, Clone)]
pub struct Law {
    /// Ascending.
    pub breakpoints: Vec<f64>,
    /// Flank in each region, one more than breakpoints.
    pub flanks: Vec<i8>,
    /// Force in each region, without what a memory adds.
    pub pieces: Vec<ForcePiece>,
    /// Guards of regions that are not bounded by breakpoints.
    pub automaton: Option<Automaton>,
    /// Regions of a law whose memory has a rate of its own.
    pub cells: Option<LawCells>,
}

/// The force in one region.
#[derive(Debug, Clone)]
pub(crate) enum ForcePiece {
    /// constant + q x + v dx/dT.
    Affine(Affine),
    /// Anything analytic.
    Smooth(Smooth),
}

/// An analytic force and its partial derivatives.
#[derive(Debug, Clone)]
pub struct Smooth {
    /// f(x, dx/dT, phase); of laws whose memory has a rate f and that rate, with the memory as one argument more.
    pub force: Program,
    /// df/dx, df/dv; with a memory then df/dz and the same three of its rate.
    pub partials: Program,
    /// Quantities that the series of the force may not resolve.
    pub hidden: Vec<HiddenPart>,
}

impl Law {
    /// The parts of a law, each followed once in each region.
    ///
    /// # Errors
    /// Reason why it has no series.
    pub fn parts(element: &dyn Element) -> Result<Vec<Law>, String> {
        match (element.automata(), element.evolving()) {
            (Some(list), _) => Ok(list.into_iter().map(Law::from).collect()),
            (None, Some(law)) => Ok(vec![Law::read_evolving(element, law)?]),
            (None, None) => Ok(vec![Law::read(element)?]),
        }
    }

    /// A law whose memory has a rate, followed once in each of its regions.
    fn read_evolving(element: &dyn Element, law: &dyn Evolving) -> Result<Law, String> {
        let kinks = law.kinks();
        let cells = LawCells {
            levels: [kinks.deformation, kinks.rate, kinks.memory],
        };
        let (mut pieces, mut flanks) = (Vec::new(), Vec::new());
        for region in 0..cells.count() {
            let [q, v, z] = cells.inside(region);
            let smooth = trace_evolving(law, [q, v, 1.0, z])?;
            check_cell(&cells, region, &smooth)?;
            pieces.push(ForcePiece::Smooth(smooth));
            flanks.push(element.flank(q));
        }
        Ok(Law {
            breakpoints: Vec::new(),
            flanks,
            pieces,
            automaton: None,
            cells: Some(cells),
        })
    }

    fn read(element: &dyn Element) -> Result<Law, String> {
        if element.is_piecewise_affine() && !element.depends_on_velocity() {
            let law = AffineLaw::read(element);
            return Ok(match element.is_discontinuous() {
                true => line(&law.breakpoints, (&law.slopes, &law.offsets), &law.flanks).into(),
                false => law.into(),
            });
        }
        if element.has_hidden_jumps() {
            return Err("its force may jump where no breakpoint is known".into());
        }
        let breakpoints = element.breakpoints();
        let (mut pieces, mut flanks) = (Vec::new(), Vec::new());
        for region in 0..=breakpoints.len() {
            let inside = inside(&breakpoints, region);
            pieces.push(trace(element, inside)?);
            flanks.push(element.flank(inside));
        }
        let law = Law {
            breakpoints,
            flanks,
            pieces,
            automaton: None,
            cells: None,
        };
        law.check_ends()?;
        Ok(law)
    }

    /// Borders of a region.
    pub fn borders(&self, region: usize) -> (f64, f64) {
        let low = region.checked_sub(1).map(|k| self.breakpoints[k]);
        let high = self.breakpoints.get(region).copied();
        (
            low.unwrap_or(f64::NEG_INFINITY),
            high.unwrap_or(f64::INFINITY),
        )
    }

    /// Whether the force is a broken line over the deformation alone.
    pub(crate) fn is_affine(&self) -> bool {
        let is_line = |piece: &ForcePiece| matches!(piece, ForcePiece::Affine(a) if a.v == 0.0);
        self.pieces.iter().all(is_line)
    }

    /// Registers that the programs need at most.
    pub fn registers(&self) -> usize {
        let size = |piece: &ForcePiece| match piece {
            ForcePiece::Affine(_) => 0,
            ForcePiece::Smooth(smooth) => smooth.force.ops.len().max(smooth.partials.ops.len()),
        };
        self.pieces.iter().map(size).max().unwrap_or(0)
    }

    /// Whether a phase enters anywhere.
    pub(crate) fn reads_phase(&self) -> bool {
        self.pieces.iter().any(|piece| match piece {
            ForcePiece::Affine(_) => false,
            ForcePiece::Smooth(smooth) => {
                smooth.force.reads_phase() || smooth.partials.reads_phase()
            }
        })
    }

    /// Moduli of the slopes df/dx and df/dv, chosen among the regions; of smooth forces the largest ones seen at breakpoints and one
    /// displacement beyond them, at rest and in motion.
    pub fn slopes(&self, chosen: fn(f64, f64) -> f64) -> (f64, f64) {
        let slopes = (0..self.pieces.len()).map(|region| self.steepest(region));
        let both = |a: (f64, f64), b: (f64, f64)| (chosen(a.0, b.0), chosen(a.1, b.1));
        slopes.reduce(both).unwrap_or((0.0, 0.0))
    }

    fn steepest(&self, region: usize) -> (f64, f64) {
        let piece = &self.pieces[region];
        match (piece, &self.cells) {
            (ForcePiece::Affine(affine), _) => return (affine.q.abs(), affine.v.abs()),
            (ForcePiece::Smooth(smooth), Some(cells)) => return slopes_of(cells, smooth, region),
            (ForcePiece::Smooth(_), None) => {}
        }
        let (low, high) = self.borders(region);
        let ends = [low, low + 1.0, high - 1.0, high];
        let ends = ends.map(|x| if x.is_finite() { x } else { 0.0 });
        let middle = inside(&self.breakpoints, region);
        let places = ends.into_iter().chain([middle - 1.0, middle, middle + 1.0]);
        let places = places.map(|x| x.clamp(low, high));
        let larger = |most: f64, x: f64| {
            if x.is_finite() {
                most.max(x.abs())
            } else {
                most
            }
        };
        let states = places.flat_map(|x| [-1.0, 0.0, 1.0].map(|v| (x, v)));
        states.fold((0.0, 0.0), |most, (x, v)| {
            let (q, v) = piece.partials(x, v);
            (larger(most.0, q), larger(most.1, v))
        })
    }

    /// A motion that enters a region starts at its border: the force has to have a series there.
    fn check_ends(&self) -> Result<(), String> {
        for (region, piece) in self.pieces.iter().enumerate() {
            let (low, high) = self.borders(region);
            for level in [low, high].into_iter().filter(|x| x.is_finite()) {
                if !piece.is_analytic_at(level) {
                    return Err(format!(
                        "its force is not analytic at the breakpoint {level}, where motions start"
                    ));
                }
            }
        }
        Ok(())
    }
}

impl ForcePiece {
    fn partials(&self, x: f64, v: f64) -> (f64, f64) {
        match self {
            ForcePiece::Affine(affine) => (affine.q, affine.v),
            ForcePiece::Smooth(smooth) => {
                let values = smooth.partials.values([x, v, 0.0, 0.0]);
                (values[0], values[1])
            }
        }
    }

    /// Whether a motion through x has a finite series of the force.
    fn is_analytic_at(&self, x: f64) -> bool {
        let ForcePiece::Smooth(smooth) = self else {
            return true;
        };
        [&smooth.force, &smooth.partials]
            .into_iter()
            .all(|program| {
                let at = [(x, 1.0), (0.3, 0.2), (0.0, 0.0), (1.0, 1.0)];
                program.is_analytic_along(at)
            })
    }
}

impl From<AffineLaw> for Law {
    fn from(law: AffineLaw) -> Law {
        let lines = law.slopes.iter().zip(&law.offsets);
        let pieces = lines.map(|(slope, offset)| {
            ForcePiece::Affine(Affine {
                constant: *offset,
                q: *slope,
                v: 0.0,
            })
        });
        Law {
            pieces: pieces.collect(),
            breakpoints: law.breakpoints,
            flanks: law.flanks,
            automaton: None,
            cells: None,
        }
    }
}

impl From<Automaton> for Law {
    fn from(automaton: Automaton) -> Law {
        let piece = |force: &RegionForce| match *force {
            RegionForce::Affine { constant, q, v, .. } => Affine { constant, q, v },
            RegionForce::Held { .. } => Affine::default(),
        };
        let regions = automaton.regions.iter();
        Law {
            breakpoints: Vec::new(),
            flanks: regions.clone().map(|r| r.contact).collect(),
            pieces: regions
                .map(|r| ForcePiece::Affine(piece(&r.force)))
                .collect(),
            automaton: Some(automaton),
            cells: None,
        }
    }
}

/// The operations of a law at a displacement, at rest.
fn trace(element: &dyn Element, q: f64) -> Result<ForcePiece, String> {
    let tape = Tape::default();
    let [q, v, phase] = tape.inputs(q, 0.0, 1.0);
    let force = element.trace(q, v, phase)?;
    Ok(match force.value.affine() {
        Some(affine) => ForcePiece::Affine(affine),
        None => {
            let program = tape.program(&[force.value.form()]);
            ForcePiece::Smooth(Smooth {
                hidden: hidden::find(&program),
                force: program,
                partials: tape.program(&[force.dq, force.dv].map(|traced| traced.form())),
            })
        }
    })
}

/// A part of the law of a connection.
#[derive(Debug, Clone)]
pub(crate) struct LawPart {
    /// Connection.
    pub connection: usize,
    /// Place of its memory among those of the system.
    pub memory: Option<usize>,
    /// The part.
    pub law: Law,
}

/// The laws of every connection, part by part.
///
/// # Errors
/// A connection whose law or series cannot be expanded, named by its number.
pub fn read(system: &System) -> Result<Vec<LawPart>, SolveError> {
    let (mut parts, mut memories) = (Vec::new(), 0);
    for (connection, mount) in system.mounts().iter().enumerate() {
        let refuse = |reason| SolveError::Unsupported { connection, reason };
        if let Some(reason) = ClosedForm::Series.refusal(mount) {
            return Err(refuse(reason));
        }
        let laws = Law::parts(mount.element.as_ref())
            .map_err(|reason| refuse(format!("no series: {reason}")))?;
        for law in laws {
            let remembers =
                law.cells.is_some() || law.automaton.as_ref().is_some_and(|a| a.has_memory);
            parts.push(LawPart {
                connection,
                memory: remembers.then_some(memories),
                law,
            });
            memories += usize::from(remembers);
        }
    }
    Ok(parts)
}

/// Moduli of the slopes of the force in a region by the deformation, its change with the memory included, and by the rate.
fn slopes_of(cells: &LawCells, smooth: &Smooth, region: usize) -> (f64, f64) {
    let [q, v, z] = cells.inside(region);
    let places = [[q, v, z], [q, v, 0.0], [q, 0.0, z], [q, 0.0, 0.0]];
    places
        .into_iter()
        .fold((0.0_f64, 0.0_f64), |most, [q, v, z]| {
            let by = smooth.partials.values([q, v, z, 0.0]);
            let (slope, damping) = ((by[0] + by[2] * by[4]).abs(), by[1].abs());
            let larger = |most: f64, x: f64| if x.is_finite() { most.max(x) } else { most };
            (larger(most.0, slope), larger(most.1, damping))
        })
}

/// The operations of force and rate at a place.
fn trace_evolving(law: &dyn Evolving, at: [f64; 4]) -> Result<Smooth, String> {
    let tape = Tape::default();
    let [force, rate] = law.trace(tape.inputs_with_memory(at))?;
    let [force_z, rate_z] = law.trace(tape.inputs_by_memory(at))?;
    let program = tape.program(&[force.value, rate.value].map(|traced| traced.form()));
    let partials = [force.dq, force.dv, force_z.dq, rate.dq, rate.dv, rate_z.dq];
    Ok(Smooth {
        hidden: hidden::find(&program),
        force: program,
        partials: tape.program(&partials.map(|traced| traced.form())),
    })
}

/// A motion that enters a region starts on its border: force and rate have to have a series there.
fn check_cell(cells: &LawCells, region: usize, smooth: &Smooth) -> Result<(), String> {
    let inside = cells.inside(region);
    let names = ["deformation", "rate", "memory"];
    for (axis, name) in names.into_iter().enumerate() {
        let (low, high) = cells.borders(region, axis);
        for level in [low, high].into_iter().filter(|x| x.is_finite()) {
            let mut place = inside;
            place[axis] = level;
            let at = [
                (place[0], 0.7),
                (place[1], 0.2),
                (place[2], 0.4),
                (1.0, 1.0),
            ];
            let programs = [&smooth.force, &smooth.partials];
            if !programs.into_iter().all(|p| p.is_analytic_along(at)) {
                return Err(format!(
                    "its force or the rate of its memory is not analytic at the {name} {level}, where motions start"
                ));
            }
        }
    }
    Ok(())
}
