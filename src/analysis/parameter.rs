//! Parameters of the model that an analysis varies: the excitation frequency, and numbers of the model by name. The scales stay
//! those of the model as written.

use super::{Link, Setting};
use crate::assembly::{Assembly, Scales, assemble, reassemble, renumber};
use crate::element::Relation;
use crate::error::Diagnostic;
use crate::model::{Affected, Follower, FrequencyScale, Knob, Model, Structure};
use crate::quantity::Quantity;
use crate::system::System;
use crate::yaml::Node;

/// Name of the excitation frequency among parameters.
pub(super) const FREQUENCY: &str = "frequency";

/// The varied quantity.
#[derive(Debug, Clone, PartialEq)]
pub enum VariedParameter {
    /// The excitation frequency, with the numbers that follow it.
    Frequency(Vec<Follower>),
    /// A number of the model.
    Number(Box<Knob>),
}

impl VariedParameter {
    /// The parameter that a user names: `frequency`, a dotted path as for `--set`, or a short form of one: some of its steps in
    /// their order, the last one included, such as `mesh_2.half_gap`.
    ///
    /// # Errors
    /// A name of no number of the model, or a short form of several.
    pub fn find(setting: &Setting<'_>, written: &str) -> Result<VariedParameter, String> {
        if written == FREQUENCY {
            return Ok(VariedParameter::Frequency(Vec::new()));
        }
        let knob = setting.model.resolve(written)?;
        Ok(VariedParameter::Number(Box::new(knob)))
    }

    /// The same with the numbers that follow it; `all`: names of all parameters of the analysis.
    ///
    /// # Errors
    /// As [`VariedParameter::find`]; what is wrong with the link.
    pub fn linked(
        setting: &Setting<'_>,
        written: &str,
        (link, all): (&Link, &[&str]),
    ) -> Result<VariedParameter, String> {
        match VariedParameter::find(setting, written)? {
            VariedParameter::Number(knob) => {
                let knob = link.attach(setting, *knob, all)?;
                Ok(VariedParameter::Number(Box::new(knob)))
            }
            VariedParameter::Frequency(_) => {
                let list = link.followers(setting, FREQUENCY, all)?;
                Ok(VariedParameter::Frequency(list))
            }
        }
    }

    /// The only parameter of an analysis.
    ///
    /// # Errors
    /// As [`VariedParameter::linked`].
    pub fn alone(
        setting: &Setting<'_>,
        written: &str,
        link: &Link,
    ) -> Result<VariedParameter, String> {
        VariedParameter::linked(setting, written, (link, &[written]))
    }

    /// Whether it is the excitation frequency.
    pub fn is_frequency(&self) -> bool {
        matches!(self, VariedParameter::Frequency(_))
    }

    /// `frequency`, or the full dotted path.
    pub fn name(&self) -> &str {
        match self {
            VariedParameter::Frequency(_) => FREQUENCY,
            VariedParameter::Number(knob) => knob.name(),
        }
    }

    /// A value of the parameter: omega/omega_c, or SI base units (nondimensional for reduced models).
    ///
    /// # Errors
    /// A frequency without or with a wrong unit.
    pub fn value(&self, setting: &Setting<'_>, written: &Quantity) -> Result<f64, String> {
        match self {
            VariedParameter::Frequency(_) => setting.frequency(written),
            VariedParameter::Number(_) => Ok(written.value),
        }
    }

    /// Unit of the reported values, and the factor to them. `written`: one of the values in the model file.
    pub fn reported(&self, setting: &Setting<'_>, written: &Quantity) -> (String, f64) {
        match self {
            VariedParameter::Frequency(_) if setting.is_si() => {
                ("rad/s".into(), setting.assembly.scales.frequency)
            }
            VariedParameter::Frequency(_) => (String::new(), 1.0),
            VariedParameter::Number(_) => {
                (written.dimension.map_or(String::new(), |d| d.unit()), 1.0)
            }
        }
    }

    /// Whether the model takes the value as it is written, unit included.
    ///
    /// # Errors
    /// Errors of the model.
    pub fn check(&self, setting: &Setting<'_>, written: &Quantity) -> Result<(), String> {
        let mut parts = Vec::new();
        match self {
            VariedParameter::Frequency(followers) => {
                let x = setting.frequency(written)? * setting.assembly.scales.frequency;
                for Follower { knob, relation } in followers {
                    parts.extend(entries(knob, relation.value(x)));
                }
            }
            VariedParameter::Number(knob) => {
                parts = entries(knob, written.value);
                if written.dimension.is_some() {
                    parts[0].1 = Node::quoted(written.text.as_str());
                }
            }
        }
        if parts.is_empty() {
            return Ok(());
        }
        let read = setting.model.with_parts(parts);
        let read = read.and_then(|model| framed(model, setting.assembly));
        read.map(|_| ()).map_err(|list| joined(&list))
    }
}

/// A number and those that move with it, as a document writes them.
pub(super) fn entries(knob: &Knob, value: f64) -> Vec<(String, Node)> {
    let all = knob.spread(value).into_iter();
    all.map(|(knob, value)| (knob.name().to_owned(), knob.node(value)))
        .collect()
}

/// Several errors in one text.
pub(super) fn joined(list: &[Diagnostic]) -> String {
    let texts: Vec<String> = list.iter().map(said).collect();
    texts.join("; ")
}

/// An error without its place in the file, which is that of the model and not of the analysis.
pub(super) fn said(mistake: &Diagnostic) -> String {
    let mut text = mistake.message.clone();
    if !mistake.path.is_empty() {
        text = format!("{}: {text}", mistake.path);
    }
    match &mistake.help {
        Some(help) => format!("{text}; {help}"),
        None => text,
    }
}

/// The systems of a model over several parameters at once: the excitation frequency, numbers, or both. Scales, relative
/// coordinates and all other numbers stay as written.
pub struct Systems<'a> {
    variation: Variation<'a>,
    /// Values of the numbers that vary, each from that of one parameter.
    numbers: Vec<Varied>,
    /// Place of the frequency among the parameters.
    frequency: Option<usize>,
    at: f64,
    subharmonic: usize,
    /// The last values of the numbers, and their system.
    last: Option<(Vec<f64>, System)>,
}

/// A number as a function of one of several parameters.
struct Varied {
    /// Place of the parameter.
    parameter: usize,
    /// The number of a follower of the frequency from omega/omega_c; elsewhere the parameter is the number.
    relation: Option<(Relation, f64)>,
}

impl Varied {
    fn value(&self, values: &[f64]) -> f64 {
        let own = values[self.parameter];
        match &self.relation {
            Some((relation, factor)) => relation.value(own * factor),
            None => own,
        }
    }
}

impl<'a> Systems<'a> {
    /// The systems of a setting. `at`: excitation frequency over omega_c where it is none of the parameters.
    pub fn new(
        setting: &Setting<'a>,
        parameters: &[VariedParameter],
        at: f64,
        subharmonic: usize,
    ) -> Systems<'a> {
        let (mut knobs, mut numbers, mut frequency) = (Vec::new(), Vec::new(), None);
        let factor = setting.assembly.scales.frequency;
        for (k, parameter) in parameters.iter().enumerate() {
            match parameter {
                VariedParameter::Frequency(followers) => {
                    frequency = Some(k);
                    for Follower { knob, relation } in followers {
                        knobs.push(knob.clone());
                        numbers.push(Varied {
                            parameter: k,
                            relation: Some((relation.clone(), factor)),
                        });
                    }
                }
                VariedParameter::Number(knob) => {
                    knobs.push(knob.as_ref().clone());
                    numbers.push(Varied {
                        parameter: k,
                        relation: None,
                    });
                }
            }
        }
        Systems {
            variation: Variation::new(setting, knobs),
            numbers,
            frequency,
            at,
            subharmonic,
            last: None,
        }
    }

    /// The place of the frequency among the parameters where nothing else depends on it.
    pub fn lone_frequency(&self) -> Option<usize> {
        let follows = |k: &usize| self.numbers.iter().any(|n| n.parameter == *k);
        self.frequency.filter(|k| !follows(k))
    }

    /// Numbers of the model at values of the parameters.
    pub fn numbers(&self, values: &[f64]) -> Vec<f64> {
        self.numbers.iter().map(|n| n.value(values)).collect()
    }

    /// The model at values of the parameters, with its assembly; its frequency is left as it is.
    ///
    /// # Errors
    /// Errors of the model at these values.
    pub fn model(&mut self, values: &[f64]) -> Result<(Model, Assembly), Vec<Diagnostic>> {
        let numbers = self.numbers(values);
        self.variation.at(&numbers)
    }

    /// The system at values of the parameters, in their order: omega/omega_c, SI numbers (nondimensional in a reduced model).
    ///
    /// # Errors
    /// Errors of the model at these values.
    pub fn at(&mut self, values: &[f64]) -> Result<&System, Vec<Diagnostic>> {
        let numbers = self.numbers(values);
        let known = self.last.take().filter(|(last, _)| *last == numbers);
        let mut system = match known {
            Some((_, system)) => system,
            None => {
                let mut system = self.variation.system(&numbers)?;
                system.set_subharmonic(self.subharmonic);
                system
            }
        };
        system.set_reference_frequency(self.frequency.map_or(self.at, |k| values[k]));
        Ok(&self.last.insert((numbers, system)).1)
    }
}

/// The model with some numbers changed and everything else, its scales too, as written.
pub struct Variation<'a> {
    unchanged: &'a Assembly,
    knobs: Vec<Knob>,
    /// Scales frozen; the numbers as they were last.
    model: Model,
    /// What the numbers enter; `None` if one of them has no place of its own in the mechanics.
    reach: Option<Affected>,
}

impl<'a> Variation<'a> {
    /// The model of a setting, to be varied in some numbers.
    pub fn new(setting: &Setting<'a>, knobs: Vec<Knob>) -> Variation<'a> {
        let reaches: Option<Vec<Affected>> = knobs.iter().map(Knob::reach).collect();
        // A document that is copied for every value holds no more than it must.
        let model = match &reaches {
            Some(_) => setting.model.clone(),
            None => setting.model.mechanics(),
        };
        Variation {
            unchanged: setting.assembly,
            reach: reaches.map(|list| list.into_iter().max().unwrap_or(Affected::Laws)),
            knobs,
            model: frozen(model, &setting.assembly.scales),
        }
    }

    /// The system at values of the numbers.
    ///
    /// # Errors
    /// Errors of the model at these values.
    pub fn system(&mut self, values: &[f64]) -> Result<System, Vec<Diagnostic>> {
        let Some(reach) = self.reach else {
            return Ok(self.at(values)?.1.system);
        };
        self.model.write(&paired(&self.knobs, values))?;
        renumber(&self.model, self.unchanged, reach)
    }

    /// The model at values of the numbers and its assembly.
    ///
    /// # Errors
    /// Errors of the model at these values.
    pub fn at(&mut self, values: &[f64]) -> Result<(Model, Assembly), Vec<Diagnostic>> {
        let changes = paired(&self.knobs, values);
        if self.reach.is_none() {
            return framed(self.model.changed(&changes)?, self.unchanged);
        }
        self.model.write(&changes)?;
        let assembly = reassemble(&self.model, self.unchanged)?;
        Ok((self.model.clone(), assembly))
    }
}

fn paired<'k>(knobs: &'k [Knob], values: &[f64]) -> Vec<(&'k Knob, f64)> {
    knobs.iter().zip(values.iter().copied()).collect()
}

/// A changed model and its assembly, with the scales and relative coordinates of the unchanged one.
///
/// # Errors
/// What the assembly refuses, and a change of the relative coordinates.
pub(super) fn framed(
    model: Model,
    unchanged: &Assembly,
) -> Result<(Model, Assembly), Vec<Diagnostic>> {
    let model = frozen(model, &unchanged.scales);
    let assembly = assemble(&model)?;
    if assembly.coordinates != unchanged.coordinates {
        return Err(vec![Diagnostic {
            location: None,
            path: String::new(),
            message: format!(
                "the relative coordinates change from ({}) to ({})",
                unchanged.coordinates.join(", "),
                assembly.coordinates.join(", ")
            ),
            help: Some("vary a number that keeps the topology".into()),
        }]);
    }
    Ok((model, assembly))
}

/// A model with characteristic frequency and displacements as given, whatever it would choose.
pub(super) fn frozen(mut model: Model, scales: &Scales) -> Model {
    if let Structure::Train(train) = &mut model.structure {
        train.scaling.frequency = FrequencyScale::Value(scales.frequency);
        for (connection, l) in train.connections.values_mut().zip(&scales.displacement) {
            connection.length = Some(*l);
        }
    }
    model
}
