//! Where a named number lives in the mechanics: written there, it needs no reading of a document.

use super::law::HALF_GAP;
use super::{ModalDamping, Model, ReducedDamping, Structure};
use crate::element::Element;
use crate::numeric::periodic::{Harmonic, Periodic};
use crate::quantity::Quantity;

/// Parts of the system that a number affects, directly or through derived values.
#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord)]
pub enum Affected {
    /// Force laws alone.
    Laws,
    /// Series of loads alone.
    Loads,
    /// Matrices, and through them everything.
    Matrices,
}

/// The place of a number in the mechanics.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(super) enum Slot {
    /// Inertia of a body.
    Inertia(usize),
    /// Reference stiffness of a connection.
    Stiffness(usize),
    /// Dashpot of a connection.
    Dashpot(usize),
    /// A parameter of a law: connection, position among those it offers, factor to the written number.
    Law(usize, usize, f64),
    /// Damping ratio of all elastic modes.
    ModalRatio,
    /// Damping ratio of one elastic mode.
    RatioOfMode(usize),
    /// Share of the stiffness.
    StiffnessShare,
    /// Mean of a load.
    Mean(usize),
    /// Amplitude of a load's harmonic: load, harmonic, phase.
    Amplitude(usize, usize, f64),
    /// Phase of a load's harmonic: load, harmonic, amplitude.
    Phase(usize, usize, f64),
    /// Entry of kappa.
    Kappa(usize, usize),
    /// Entry of Gam.
    Gamma(usize, usize),
}

impl Slot {
    /// The place of the number at a full path; `None` where more than one place follows from it, or it is elsewhere.
    ///
    /// A place counts only where it holds exactly what is written.
    pub(super) fn of(model: &Model, path: &str, written: f64) -> Option<Slot> {
        let steps: Vec<&str> = path.split('.').collect();
        let slot = match &model.structure {
            Structure::Train(_) => of_train(model, &steps)?,
            Structure::Reduced(_) => of_reduced(model, &steps)?,
        };
        let slot = match slot {
            // The whole gap of a law that keeps its half.
            Slot::Law(c, k, _) if steps.last() == Some(&"gap") => Slot::Law(c, k, 0.5),
            slot => slot,
        };
        let mut copy = model.structure.clone();
        slot.write(&mut copy, written)?;
        let same = slot.read(&copy)?.to_bits() == slot.read(&model.structure)?.to_bits();
        same.then_some(slot)
    }

    /// Writes numbers together, so that none meets the old value of another one.
    ///
    /// # Errors
    /// Which of them is refused and what its law says; a place that the mechanics does not have.
    pub(super) fn write_all(
        list: &[(Slot, f64)],
        structure: &mut Structure,
    ) -> Result<(), (usize, String)> {
        for (k, (slot, value)) in list.iter().enumerate() {
            let written = slot.beside(list).write(structure, *value);
            written.ok_or_else(|| (k, "the mechanics has no such number".to_owned()))?;
        }
        for (k, (slot, _)) in list.iter().enumerate() {
            if let Slot::Law(connection, ..) = slot
                && let Some(Err(invalid)) = law(structure, *connection).map(Element::validate)
            {
                return Err((k, invalid.to_string()));
            }
        }
        Ok(())
    }

    /// Amplitude and phase of one harmonic are written as one: what the other is, where it is written too.
    fn beside(self, list: &[(Slot, f64)]) -> Slot {
        let other = |wanted: fn(&Slot) -> Option<(usize, usize)>, place| {
            let found = list.iter().find(|(slot, _)| wanted(slot) == Some(place));
            found.map(|(_, value)| *value)
        };
        match self {
            Slot::Amplitude(load, h, phase) => {
                Slot::Amplitude(load, h, other(Slot::phase_of, (load, h)).unwrap_or(phase))
            }
            Slot::Phase(load, h, amplitude) => Slot::Phase(
                load,
                h,
                other(Slot::amplitude_of, (load, h)).unwrap_or(amplitude),
            ),
            slot => slot,
        }
    }

    fn phase_of(&self) -> Option<(usize, usize)> {
        match self {
            Slot::Phase(load, h, _) => Some((*load, *h)),
            _ => None,
        }
    }

    fn amplitude_of(&self) -> Option<(usize, usize)> {
        match self {
            Slot::Amplitude(load, h, _) => Some((*load, *h)),
            _ => None,
        }
    }

    /// What changes with it.
    pub(super) fn reach(self) -> Affected {
        match self {
            Slot::Law(..) => Affected::Laws,
            Slot::Mean(_) | Slot::Amplitude(..) | Slot::Phase(..) => Affected::Loads,
            _ => Affected::Matrices,
        }
    }

    /// What the place holds, of a harmonic one of its parts.
    fn read(self, structure: &Structure) -> Option<f64> {
        let mut copy = None;
        match (self, structure) {
            (Slot::Law(c, k, _), _) => {
                let mut law = law(structure, c)?.clone_box();
                let mut position = 0;
                law.visit_parameters(&mut |p| {
                    copy = if position == k { Some(*p.value) } else { copy };
                    position += 1;
                });
            }
            (Slot::Inertia(k), Structure::Train(train)) => {
                copy = train.bodies.get_index(k).map(|(_, body)| body.inertia);
            }
            (Slot::Stiffness(k), Structure::Train(train)) => {
                copy = train.connections.get_index(k).map(|(_, c)| c.stiffness);
            }
            (Slot::Dashpot(k), Structure::Train(train)) => {
                copy = train.connections.get_index(k).map(|(_, c)| c.damping);
            }
            (Slot::ModalRatio, Structure::Train(train)) => {
                if let Some(ModalDamping::Uniform(ratio)) = &train.damping.modal {
                    copy = Some(*ratio);
                }
            }
            (Slot::RatioOfMode(k), Structure::Train(train)) => {
                if let Some(ModalDamping::PerMode(list)) = &train.damping.modal {
                    copy = list.get(k).copied();
                }
            }
            (Slot::StiffnessShare, Structure::Train(train)) => {
                copy = Some(train.damping.stiffness_proportional);
            }
            (Slot::Mean(k), _) => copy = Some(series(structure, k)?.mean()),
            (Slot::Amplitude(k, h, _) | Slot::Phase(k, h, _), _) => {
                if let Periodic::Fourier { harmonics, .. } = series(structure, k)? {
                    // Both parts in one number: they are compared, not used.
                    let part = harmonics.get(h)?;
                    copy = Some(part.cos + std::f64::consts::SQRT_2 * part.sin);
                }
            }
            (Slot::Kappa(i, j), Structure::Reduced(reduced)) => {
                copy = reduced.stiffness.get((i, j)).copied();
            }
            (Slot::ModalRatio | Slot::StiffnessShare, Structure::Reduced(reduced)) => {
                copy = match &reduced.damping {
                    ReducedDamping::ModalRatio(x) | ReducedDamping::StiffnessProportional(x) => {
                        Some(*x)
                    }
                    ReducedDamping::Matrix(_) => None,
                };
            }
            (Slot::Gamma(i, j), Structure::Reduced(reduced)) => {
                if let ReducedDamping::Matrix(gamma) = &reduced.damping {
                    copy = gamma.get((i, j)).copied();
                }
            }
            _ => {}
        }
        copy
    }

    /// Writes a number into its place; `None` if the mechanics does not have it.
    fn write(self, structure: &mut Structure, value: f64) -> Option<()> {
        match self {
            Slot::Law(c, k, factor) => {
                let mut position = 0;
                law_mut(structure, c)?.visit_parameters(&mut |p| {
                    if position == k {
                        *p.value = factor * value;
                    }
                    position += 1;
                });
            }
            Slot::Mean(k) => match series_mut(structure, k)? {
                Periodic::Fourier { mean, .. } => *mean = value,
                _ => return None,
            },
            Slot::Amplitude(k, h, phase) => wave(structure, (k, h), (value, phase))?,
            Slot::Phase(k, h, amplitude) => wave(structure, (k, h), (amplitude, value))?,
            slot => *slot.plain_mut(structure)? = value,
        }
        Some(())
    }

    /// A number that appears in the mechanics as written.
    fn plain_mut(self, structure: &mut Structure) -> Option<&mut f64> {
        match structure {
            Structure::Train(train) => {
                let modal = &mut train.damping.modal;
                match self {
                    Slot::Inertia(k) => train.bodies.get_index_mut(k).map(|b| &mut b.1.inertia),
                    Slot::Stiffness(k) => {
                        (train.connections.get_index_mut(k)).map(|c| &mut c.1.stiffness)
                    }
                    Slot::Dashpot(k) => {
                        (train.connections.get_index_mut(k)).map(|c| &mut c.1.damping)
                    }
                    Slot::StiffnessShare => Some(&mut train.damping.stiffness_proportional),
                    Slot::ModalRatio => match modal {
                        Some(ModalDamping::Uniform(ratio)) => Some(ratio),
                        _ => None,
                    },
                    Slot::RatioOfMode(k) => match modal {
                        Some(ModalDamping::PerMode(list)) => list.get_mut(k),
                        _ => None,
                    },
                    _ => None,
                }
            }
            Structure::Reduced(reduced) => match (self, &mut reduced.damping) {
                (Slot::Kappa(i, j), _) => reduced.stiffness.get_mut((i, j)),
                (Slot::ModalRatio, ReducedDamping::ModalRatio(x))
                | (Slot::StiffnessShare, ReducedDamping::StiffnessProportional(x)) => Some(x),
                (Slot::Gamma(i, j), ReducedDamping::Matrix(gamma)) => gamma.get_mut((i, j)),
                _ => None,
            },
        }
    }
}

fn of_train(model: &Model, steps: &[&str]) -> Option<Slot> {
    let Structure::Train(train) = &model.structure else {
        return None;
    };
    match steps {
        ["bodies", name, "inertia"] => train.bodies.get_index_of(*name).map(Slot::Inertia),
        ["connections", name, "stiffness"] => {
            train.connections.get_index_of(*name).map(Slot::Stiffness)
        }
        ["connections", name, "damping"] => {
            train.connections.get_index_of(*name).map(Slot::Dashpot)
        }
        ["connections", name, "element", rest @ ..] => of_law(
            &model.structure,
            train.connections.get_index_of(*name)?,
            rest,
        ),
        ["damping", "modal_ratio"] => Some(Slot::ModalRatio),
        ["damping", "modal_ratios", k] => k.parse().ok().map(Slot::RatioOfMode),
        ["damping", "stiffness_proportional"] => Some(Slot::StiffnessShare),
        // What balances the others follows from all means.
        ["loads", name, "mean"] if train.balanced.is_empty() => {
            train.loads.get_index_of(*name).map(Slot::Mean)
        }
        ["loads", name, "harmonics", h, key] => {
            let load = train.loads.get_index_of(*name)?;
            of_harmonic(model, steps, (load, h.parse().ok()?), key)
        }
        _ => None,
    }
}

fn of_reduced(model: &Model, steps: &[&str]) -> Option<Slot> {
    let Structure::Reduced(reduced) = &model.structure else {
        return None;
    };
    match steps {
        ["reduced", "stiffness", i, j] => Some(Slot::Kappa(i.parse().ok()?, j.parse().ok()?)),
        ["reduced", "damping", "modal_ratio"] => Some(Slot::ModalRatio),
        ["reduced", "damping", "stiffness_proportional"] => Some(Slot::StiffnessShare),
        ["reduced", "damping", "matrix", i, j] => {
            Some(Slot::Gamma(i.parse().ok()?, j.parse().ok()?))
        }
        ["reduced", "elements", name, rest @ ..] => of_law(
            &model.structure,
            reduced.elements.get_index_of(*name)?,
            rest,
        ),
        ["reduced", "loads", "mean", k] => k.parse().ok().map(Slot::Mean),
        _ => None,
    }
}

/// A parameter that the law offers under the written name.
fn of_law(structure: &Structure, connection: usize, rest: &[&str]) -> Option<Slot> {
    let (wanted, index) = match rest {
        ["gap"] => (HALF_GAP, None),
        [name] => (*name, None),
        [name, k] => (*name, Some(k.parse().ok()?)),
        _ => return None,
    };
    let mut law = law(structure, connection)?.clone_box();
    let (mut position, mut found) = (0, None);
    law.visit_parameters(&mut |p| {
        if p.name == wanted && p.index == index && found.is_none() {
            found = Some(position);
        }
        position += 1;
    });
    // A law that is scaled as a whole has more to it than the numbers it offers.
    let is_whole = law.scale_mut().is_none();
    found
        .filter(|_| is_whole)
        .map(|k| Slot::Law(connection, k, 1.0))
}

/// The other half of a harmonic is read from the document.
fn of_harmonic(
    model: &Model,
    steps: &[&str],
    (load, h): (usize, usize),
    key: &str,
) -> Option<Slot> {
    let front = steps[..steps.len() - 1].join(".");
    let number = |key: &str| {
        let path = format!("{front}.{key}");
        let node = model.document.at(&path)?;
        Quantity::from_node(node, &path).ok().map(|q| q.value)
    };
    // Harmonics that grow with the speed are kept elsewhere, and the others counted without them.
    let list = model
        .document
        .at(front.rsplit_once('.')?.0)?
        .as_list("")
        .ok()?
        .len();
    let kept = match series(&model.structure, load)? {
        Periodic::Fourier { harmonics, .. } => harmonics.len(),
        _ => return None,
    };
    if list != kept {
        return None;
    }
    match key {
        "amplitude" => Some(Slot::Amplitude(load, h, number("phase").unwrap_or(0.0))),
        "phase" => Some(Slot::Phase(load, h, number("amplitude")?)),
        _ => None,
    }
}

fn law(structure: &Structure, k: usize) -> Option<&dyn Element> {
    match structure {
        Structure::Train(train) => (train.connections.get_index(k)).map(|c| c.1.element.as_ref()),
        Structure::Reduced(reduced) => {
            (reduced.elements.get_index(k)).map(|e| e.1.element.as_ref())
        }
    }
}

fn law_mut(structure: &mut Structure, k: usize) -> Option<&mut Box<dyn Element>> {
    match structure {
        Structure::Train(train) => (train.connections.get_index_mut(k)).map(|c| &mut c.1.element),
        Structure::Reduced(reduced) => {
            (reduced.elements.get_index_mut(k)).map(|e| &mut e.1.element)
        }
    }
}

fn series(structure: &Structure, k: usize) -> Option<&Periodic> {
    match structure {
        Structure::Train(train) => train.loads.get_index(k).map(|load| &load.1.series),
        Structure::Reduced(reduced) => reduced.loads.get(k),
    }
}

fn series_mut(structure: &mut Structure, k: usize) -> Option<&mut Periodic> {
    match structure {
        Structure::Train(train) => train.loads.get_index_mut(k).map(|load| &mut load.1.series),
        Structure::Reduced(reduced) => reduced.loads.get_mut(k),
    }
}

/// Writes a harmonic by amplitude and phase.
fn wave(
    structure: &mut Structure,
    (load, h): (usize, usize),
    (amplitude, phase): (f64, f64),
) -> Option<()> {
    let part = harmonic_mut(structure, load, h)?;
    let (sin, cos) = phase.sin_cos();
    (part.cos, part.sin) = (amplitude * cos, 0.0 - amplitude * sin);
    Some(())
}

fn harmonic_mut(structure: &mut Structure, k: usize, h: usize) -> Option<&mut Harmonic> {
    match series_mut(structure, k)? {
        Periodic::Fourier { harmonics, .. } => harmonics.get_mut(h),
        _ => None,
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn what_is_followed_most_has_a_place_of_its_own() {
        let text = "bodies: {A: {inertia: 1}, B: {inertia: 1}}\n\
            connections: {c: {shaft: [A, B], stiffness: 4, element: {type: backlash, gap: 2}}}\n\
            loads: {A: {mean: 1, harmonics: [{order: 1, amplitude: 2, phase: 0.3}]}}\n";
        let model = Model::from_yaml(text).unwrap();
        for (name, reach) in [
            ("A.inertia", Some(Affected::Matrices)),
            ("c.stiffness", Some(Affected::Matrices)),
            ("c.gap", Some(Affected::Laws)),
            ("c.impact_damping", Some(Affected::Laws)),
            ("A.mean", Some(Affected::Loads)),
            ("A.amplitude", Some(Affected::Loads)),
            ("A.phase", Some(Affected::Loads)),
        ] {
            assert_eq!(model.knob(name).unwrap().reach(), reach, "{name}");
        }
    }
}
