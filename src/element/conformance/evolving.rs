//! Laws whose memory has a rate: force, rate, partials and programs against each other and against differences.

use super::{COVARIANCE_TOLERANCE, DERIVATIVE_TOLERANCE};
use crate::element::evolving::{Evolution, Evolving, first_loading};
use crate::element::tape::Tape;
use crate::element::traced::Traced;
use crate::element::{Element, Units, nondimensional};
use std::f64::consts::TAU;

const DEFORMATIONS: [f64; 5] = [-2.3, -0.41, 0.0, 0.37, 1.9];
const RATES: [f64; 5] = [-1.7, -0.3, 0.0, 0.45, 2.0];
const MEMORIES: [f64; 7] = [-1.3, -0.6, -0.2, 0.0, 0.15, 0.5, 1.2];
const PHASE: f64 = 0.7;
/// Difference step of the partial derivatives.
const STEP: f64 = 1e-6;
/// Distance on either side of a kink at which force and rate are compared, and the change that a continuous law may make over it.
const NEAR: f64 = 1e-9;
const CONTINUOUS: f64 = 1e-6;
/// Difference allowed between the recorded and the plain computation, relative to the sizes that occur.
const RECORDED: f64 = 1e-12;
/// Steps per turn and turns of the march.
const STEPS: usize = 4000;
const TURNS: usize = 3;
/// Difference of the march in its amplitude and its first memory, and the error of such a difference: a march over kinks is
/// accurate to the square of its step.
const MARCH_STEP: f64 = 1e-4;
const MARCH_TOLERANCE: f64 = 1e-3;
/// Energy that a closed loop may give: the error of the sum along it.
const LOOP: f64 = 1e-2;

/// Everything at fault with such a law.
pub(super) fn check(element: &dyn Element, law: &dyn Evolving, found: &mut Vec<String>) {
    if element.memory_count() != 1 {
        let count = element.memory_count();
        found.push(format!(
            "a law whose memory has a rate has one memory, memory_count says {count}"
        ));
        return;
    }
    let before = found.len();
    finite(law, found);
    kinks(law, found);
    if found.len() > before {
        return;
    }
    statements(element, law, found);
    partials(law, found);
    programs(law, found);
    march(element, law, found);
    for (displacement, frequency) in [(0.37, 1.0), (1.0, 12.5), (4.1e-3, 0.2)] {
        let units = Units {
            displacement,
            frequency,
            force: displacement,
        };
        covariance(element, law, &units, found);
    }
}

fn grid() -> impl Iterator<Item = [f64; 4]> {
    let places = DEFORMATIONS.into_iter();
    let places = places.flat_map(|q| RATES.map(|v| (q, v)));
    places.flat_map(|(q, v)| MEMORIES.map(|z| [q, v, PHASE, z]))
}

fn numbers(at: &Evolution) -> [f64; 8] {
    let ([a, b, c], [d, e, f]) = (at.force_by, at.rate_by);
    [at.force, at.rate, a, b, c, d, e, f]
}

fn finite(law: &dyn Evolving, found: &mut Vec<String>) {
    let is_wrong = |at: &[f64; 4]| !numbers(&law.evolve(*at)).iter().all(|x| x.is_finite());
    if let Some([q, v, _, z]) = grid().find(is_wrong) {
        found.push(format!("not finite at q = {q}, v = {v}, z = {z}"));
    }
}

/// Levels of deformation, rate and memory, with the place of the quantity among the arguments.
fn levels(law: &dyn Evolving) -> [(usize, &'static str, Vec<f64>); 3] {
    let kinks = law.kinks();
    [
        (0, "q", kinks.deformation),
        (1, "v", kinks.rate),
        (3, "z", kinks.memory),
    ]
}

/// Whether the levels ascend, and force and rate are continuous there.
fn kinks(law: &dyn Evolving, found: &mut Vec<String>) {
    for (place, name, list) in levels(law) {
        if list.windows(2).any(|w| w[0] >= w[1]) || list.iter().any(|x| !x.is_finite()) {
            found.push(format!(
                "kinks {list:?} of {name} are not finite and ascending"
            ));
            return;
        }
        for (level, at) in list.iter().flat_map(|l| grid().map(move |at| (*l, at))) {
            let beside = |sign: f64| {
                let mut at = at;
                at[place] = level + sign * NEAR;
                let here = law.evolve(at);
                [here.force, here.rate]
            };
            let (below, above) = (beside(-1.0), beside(1.0));
            let jumps = |(a, b): (&f64, &f64)| (a - b).abs() > CONTINUOUS * (1.0 + a.abs());
            if below.iter().zip(&above).any(jumps) {
                found.push(format!(
                    "force or rate jumps at {name} = {level}: {below:?}, {above:?}"
                ));
                return;
            }
        }
    }
}

/// `respond`, `eval` and the first loading.
fn statements(element: &dyn Element, law: &dyn Evolving, found: &mut Vec<String>) {
    let differs = |[q, v, phase, z]: &[f64; 4]| {
        element.respond(*q, *v, *phase, &[*z]) != law.evolve([*q, *v, *phase, *z]).response()
    };
    if let Some([q, v, _, z]) = grid().find(differs) {
        found.push(format!(
            "respond is not the force of evolve at q = {q}, v = {v}, z = {z}"
        ));
    }
    for q in DEFORMATIONS {
        let (own, wanted) = (
            element.eval(q, 0.0, PHASE),
            first_loading(law, q, 0.0, PHASE),
        );
        if (own.f - wanted.f).abs() > DERIVATIVE_TOLERANCE * (1.0 + own.f.abs()) {
            found.push(format!(
                "eval gives {} at q = {q}, the first loading {}",
                own.f, wanted.f
            ));
            return;
        }
    }
    if law.loaded(0.0) != 0.0 {
        found.push(format!(
            "loaded(0) = {}: a law without load remembers 0",
            law.loaded(0.0)
        ));
    }
}

/// Whether the difference of an argument would look across one of its kinks.
fn is_near_kink(law: &dyn Evolving, at: &[f64; 4]) -> bool {
    let reach = 3.0 * STEP;
    let mut levels = levels(law).into_iter();
    levels.any(|(place, _, list)| {
        list.iter()
            .any(|l| (at[place] - l).abs() <= reach * (1.0 + l.abs()))
    })
}

fn partials(law: &dyn Evolving, found: &mut Vec<String>) {
    for at in grid().filter(|at| !is_near_kink(law, at)) {
        let here = law.evolve(at);
        for (k, (place, name)) in [(0, "q"), (1, "v"), (3, "z")].into_iter().enumerate() {
            let beside = |sign: f64| {
                let mut at = at;
                at[place] += sign * STEP;
                law.evolve(at)
            };
            let (above, below) = (beside(1.0), beside(-1.0));
            let by = |a: f64, b: f64| (a - b) / (2.0 * STEP);
            let gaps = [
                ("df", here.force_by[k], by(above.force, below.force)),
                ("dg", here.rate_by[k], by(above.rate, below.rate)),
            ];
            for (what, exact, difference) in gaps {
                let size = 1.0 + exact.abs() + here.force.abs() + here.rate.abs();
                if (exact - difference).abs() > DERIVATIVE_TOLERANCE * size {
                    let [q, v, _, z] = at;
                    found.push(format!(
                        "{what}/d{name} at q = {q}, v = {v}, z = {z}: {exact} is not {difference}; a kink that is not listed?"
                    ));
                    return;
                }
            }
        }
    }
}

/// The region of a place: how many kinks of each quantity are below.
fn region(law: &dyn Evolving, at: &[f64; 4]) -> [usize; 3] {
    levels(law).map(|(place, _, list)| list.iter().filter(|l| at[place] > **l).count())
}

/// Follows the law once in every region and compares with `evolve` all over it.
fn programs(law: &dyn Evolving, found: &mut Vec<String>) {
    let places: Vec<[f64; 4]> = grid().filter(|at| !is_near_kink(law, at)).collect();
    for at in &places {
        let own = region(law, at);
        let first = places.iter().find(|p| region(law, p) == own);
        let Some(first) = first.filter(|p| *p != at) else {
            continue;
        };
        let tape = Tape::default();
        let recorded = (
            law.trace(tape.inputs_with_memory(*first)),
            law.trace(tape.inputs_by_memory(*first)),
        );
        // A law may have no series.
        let (Ok([force, rate]), Ok([force_z, rate_z])) = recorded else {
            return;
        };
        let outputs = [force.value, rate.value, force.dq, force.dv, force_z.dq];
        let outputs = [&outputs[..], &[rate.dq, rate.dv, rate_z.dq]].concat();
        let outputs: Vec<_> = outputs.iter().map(Traced::form).collect();
        let program = tape.program(&outputs);
        let [q, v, phase, z] = *at;
        let (plain, recorded) = (numbers(&law.evolve(*at)), program.values([q, v, z, phase]));
        let size = plain.iter().fold(1.0, |m: f64, x| m.max(x.abs()));
        let is_far = |(a, b): (&f64, &f64)| (a - b).abs() > RECORDED * size;
        if plain.iter().zip(&recorded).any(is_far) {
            found.push(format!(
                "trace gives {recorded:?} at q = {q}, v = {v}, z = {z}, evolve {plain:?}"
            ));
            return;
        }
    }
}

/// What a march gives: the last memory, its partials by the first one and by the amplitude, the work of the last turn.
struct EvolvingMarch {
    memory: f64,
    by_first: f64,
    by_amplitude: f64,
    work: f64,
}

/// The memory and its partials along q = A sin t, by Runge and Kutta's rule.
fn follow(law: &dyn Evolving, amplitude: f64, first: f64) -> EvolvingMarch {
    let h = TAU / STEPS as f64;
    let rates = |t: f64, [z, by_first, by_amplitude]: [f64; 3]| {
        let (sin, cos) = t.sin_cos();
        let here = law.evolve([amplitude * sin, amplitude * cos, PHASE, z]);
        let [by_q, by_v, by_z] = here.rate_by;
        let moved = by_q * sin + by_v * cos;
        [here.rate, by_z * by_first, moved + by_z * by_amplitude]
    };
    let plus = |y: [f64; 3], h: f64, r: [f64; 3]| std::array::from_fn(|i| y[i] + h * r[i]);
    let (mut y, mut work) = ([first, 1.0, 0.0], 0.0);
    let force = |t: f64, z: f64| {
        let (sin, cos) = t.sin_cos();
        let at = [amplitude * sin, amplitude * cos, PHASE, z];
        law.evolve(at).force * amplitude * cos
    };
    for k in 0..TURNS * STEPS {
        let t = h * k as f64;
        let power = force(t, y[0]);
        let a = rates(t, y);
        let b = rates(t + 0.5 * h, plus(y, 0.5 * h, a));
        let c = rates(t + 0.5 * h, plus(y, 0.5 * h, b));
        let d = rates(t + h, plus(y, h, c));
        y = std::array::from_fn(|i| y[i] + h / 6.0 * (a[i] + 2.0 * (b[i] + c[i]) + d[i]));
        if k >= (TURNS - 1) * STEPS {
            work += 0.5 * h * (power + force(t + h, y[0]));
        }
    }
    EvolvingMarch {
        memory: y[0],
        by_first: y[1],
        by_amplitude: y[2],
        work,
    }
}

/// The partials of a whole march against its differences, and the energy of its last turn.
fn march(element: &dyn Element, law: &dyn Evolving, found: &mut Vec<String>) {
    for (amplitude, first) in [(0.4, 0.1), (1.6, -0.2)] {
        let own = follow(law, amplitude, first);
        let by = |low: EvolvingMarch, high: EvolvingMarch| {
            (high.memory - low.memory) / (2.0 * MARCH_STEP)
        };
        let gaps = [
            (
                "the first memory",
                own.by_first,
                by(
                    follow(law, amplitude, first - MARCH_STEP),
                    follow(law, amplitude, first + MARCH_STEP),
                ),
            ),
            (
                "the amplitude",
                own.by_amplitude,
                by(
                    follow(law, amplitude - MARCH_STEP, first),
                    follow(law, amplitude + MARCH_STEP, first),
                ),
            ),
        ];
        for (name, exact, difference) in gaps {
            if (exact - difference).abs() > MARCH_TOLERANCE * (1.0 + exact.abs()) {
                found.push(format!(
                    "along a march of amplitude {amplitude} the memory changes with {name} by {difference}, its partials say {exact}"
                ));
            }
        }
        if element.is_passive() && own.work < -LOOP {
            found.push(format!("a closed loop gives the energy {}", -own.work));
        }
    }
}

/// Whether scaling changes force and rate as the dimensions say.
fn covariance(element: &dyn Element, law: &dyn Evolving, units: &Units, found: &mut Vec<String>) {
    let scaled = nondimensional(element, units);
    let Some(other) = scaled.evolving() else {
        found.push("the scaled law has no rate of its memory".into());
        return;
    };
    let (l, w) = (units.displacement, units.frequency);
    for [q, v, phase, z] in grid() {
        let own = law.evolve([q, v, phase, z]);
        let got = other.evolve([q / l, v / (l * w), phase, z / l]);
        let size = 1.0 + own.force.abs() + own.rate.abs();
        let gaps = [
            ("force", got.force * l, own.force),
            ("rate", got.rate * l * w, own.rate),
        ];
        for (name, got, wanted) in gaps {
            if (got - wanted).abs() > COVARIANCE_TOLERANCE * size {
                found.push(format!(
                    "scaling by {units:?} gives the {name} {got} at q = {q}, v = {v}, z = {z}, wanted {wanted}: a parameter's dimension is wrong"
                ));
                return;
            }
        }
    }
}
