//! Laws whose memory has a rate of its own: their regions, bounded by levels of deformation, rate and memory.

use super::acting::Acting;
use super::hidden;
use super::laws::{Law, Piece, Smooth, inside};
use super::part::{Exits, Watched};
use super::regions::{ROUNDING, Regions, departs, size};
use super::series::Series;
use crate::element::Element;
use crate::element::evolving::Evolving;
use crate::element::tape::Tape;
use crate::numeric::bernstein::{Direction, evaluate};
use crate::numeric::taylor::{COUNT, Polynomial};

/// Regions between levels of three quantities: deformation, rate, memory.
#[derive(Debug, Clone)]
pub struct Cells {
    levels: [Vec<f64>; 3],
}

/// The three quantities, in the order of the levels.
pub const AXES: [Watched; 3] = [Watched::Level, Watched::Rate, Watched::Memory];

impl Cells {
    fn count(&self) -> usize {
        self.levels.iter().map(|l| l.len() + 1).product()
    }

    /// Numbers of a region along the axes.
    fn place(&self, region: usize) -> [usize; 3] {
        let [_, v, z] = self.strides();
        [region / (v * z), region / z % v, region % z]
    }

    fn strides(&self) -> [usize; 3] {
        let [q, v, z] = &self.levels;
        [q.len() + 1, v.len() + 1, z.len() + 1]
    }

    fn region(&self, [q, v, z]: [usize; 3]) -> usize {
        let [_, by_v, by_z] = self.strides();
        (q * by_v + v) * by_z + z
    }

    /// A point inside a region.
    fn inside(&self, region: usize) -> [f64; 3] {
        let place = self.place(region);
        std::array::from_fn(|axis| match self.levels[axis].is_empty() {
            // Off the zeros of rate and memory, where formulas may lose a factor.
            true => 0.3,
            false => inside(&self.levels[axis], place[axis]),
        })
    }

    /// Borders of a region along an axis.
    pub fn borders(&self, region: usize, axis: usize) -> (f64, f64) {
        let (levels, place) = (&self.levels[axis], self.place(region)[axis]);
        let low = place.checked_sub(1).map(|k| levels[k]);
        let high = levels.get(place).copied();
        (
            low.unwrap_or(f64::NEG_INFINITY),
            high.unwrap_or(f64::INFINITY),
        )
    }

    /// The region beside another one.
    pub fn beside(&self, region: usize, watched: Watched, direction: Direction) -> usize {
        let mut place = self.place(region);
        let axis = AXES.iter().position(|w| *w == watched).unwrap_or(0);
        match direction {
            Direction::Up => place[axis] += 1,
            Direction::Down => place[axis] -= 1,
        }
        self.region(place)
    }

    /// The region of deformation, rate and memory, on a level that below it; whether one of them is on a level.
    pub fn find(&self, at: [f64; 3], tolerance: impl Fn(usize, f64) -> f64) -> (usize, bool) {
        let (mut place, mut stands) = ([0; 3], false);
        for axis in 0..3 {
            for level in &self.levels[axis] {
                let distance = at[axis] - level;
                let tolerance = tolerance(axis, *level);
                place[axis] += usize::from(distance > tolerance);
                stands |= distance.abs() <= tolerance;
            }
        }
        (self.region(place), stands)
    }

    /// The region into which a motion on levels is about to move from the one below; `series`: of the three quantities.
    pub fn leave(
        &self,
        mut region: usize,
        series: [&Polynomial; 3],
        tolerance: impl Fn(usize, f64) -> f64,
    ) -> usize {
        for (axis, polynomial) in series.into_iter().enumerate() {
            let (_, high) = self.borders(region, axis);
            let tolerance = tolerance(axis, high);
            let stands = high.is_finite() && (polynomial[0] - high).abs() <= tolerance;
            if stands && departs(polynomial, tolerance, Direction::Up) {
                region = self.beside(region, AXES[axis], Direction::Up);
            }
        }
        region
    }

    /// The ends of a region.
    pub fn exits(&self, region: usize, exits: &mut Exits) {
        (exits.low, exits.high) = self.borders(region, 0);
        exits.rates = self.borders(region, 1);
        exits.memories = self.borders(region, 2);
    }

    /// Moduli of the slopes of the force in a region by the deformation, its change with the memory included, and by the rate.
    pub fn slopes(&self, smooth: &Smooth, region: usize) -> (f64, f64) {
        let [q, v, z] = self.inside(region);
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
}

impl Regions {
    /// Puts a part whose memory has a rate into the region of its deformation, rate and memory, on a level into the one below; whether it
    /// is where it may leave.
    pub fn place_cell(
        &mut self,
        series: &Series,
        state: &[f64],
        k: usize,
        motion: [f64; 2],
    ) -> bool {
        let size = size(series, state);
        let part = &mut self.parts[k];
        let Some(cells) = &part.law.cells else {
            return false;
        };
        let [x, rate] = motion;
        let sizes = [size, size / series.unit, size];
        let tolerance = |axis: usize, level: f64| ROUNDING * (level.abs() + sizes[axis]);
        let (region, stands) = cells.find([x, rate, part.z], tolerance);
        part.enter(region);
        stands
    }

    /// Takes over the series of the memories that have a rate.
    pub fn take_courses(&mut self, acting: &Acting) {
        for (k, part) in self.parts.iter_mut().enumerate() {
            if part.evolves() {
                part.course = *acting.memory(k);
            }
        }
    }

    /// Takes the memories that have a rate along to theta.
    pub fn evolve(&mut self, theta: f64) {
        for part in self.parts.iter_mut().filter(|p| p.evolves()) {
            part.z = evaluate(&part.course, theta).0;
        }
    }
}

/// dx/dT of a deformation, in powers of theta.
pub fn rate_of(series: &Series, deformation: &Polynomial) -> Polynomial {
    let mut rate = [0.0; COUNT];
    for k in 1..COUNT {
        rate[k - 1] = k as f64 * deformation[k] / series.unit;
    }
    rate
}

/// Follows a law once in each of its regions.
///
/// # Errors
/// Reason why it has no series.
pub fn read(element: &dyn Element, law: &dyn Evolving) -> Result<Law, String> {
    let kinks = law.kinks();
    let cells = Cells {
        levels: [kinks.deformation, kinks.rate, kinks.memory],
    };
    let (mut pieces, mut flanks) = (Vec::new(), Vec::new());
    for region in 0..cells.count() {
        let [q, v, z] = cells.inside(region);
        let smooth = trace(law, [q, v, 1.0, z])?;
        check(&cells, region, &smooth)?;
        pieces.push(Piece::Smooth(smooth));
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

/// The operations of force and rate at a place.
fn trace(law: &dyn Evolving, at: [f64; 4]) -> Result<Smooth, String> {
    let tape = Tape::default();
    let [force, rate] = law.trace(tape.inputs_with_memory(at))?;
    let [force_z, rate_z] = law.trace(tape.inputs_by_memory(at))?;
    let program = tape.program(&[force.value, rate.value]);
    let partials = [force.dq, force.dv, force_z.dq, rate.dq, rate.dv, rate_z.dq];
    Ok(Smooth {
        hidden: hidden::find(&program),
        force: program,
        partials: tape.program(&partials),
    })
}

/// A motion that enters a region starts on its border: force and rate have to have a series there.
fn check(cells: &Cells, region: usize, smooth: &Smooth) -> Result<(), String> {
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
