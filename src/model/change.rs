//! Other values for the numbers and parts of a model.

use super::read::cautions;
use super::slot::Slot;
use super::value::unknown;
use super::{Knob, Model, Structure, read};
use crate::error::{Diagnostic, Error};
use crate::yaml::{Node, Value};
use std::sync::Arc;

/// Keys of a document that are not of the mechanics.
const ASIDE: [&str; 2] = ["analyses", "name"];

impl Model {
    /// Copy of the model with other values, by name: full dotted paths, or short forms such as `mesh_2.half_gap`. Values are numbers in SI
    /// units, quantities (`"60 um"`), or whole parts of a model, as with `--set`.
    ///
    /// # Errors
    /// [`Error::Input`]: unknown names, each with the nearest valid name; values out of range.
    ///
    /// ```
    /// use gearlash::prelude::*;
    ///
    /// let model = Model::builder().body("A", 1e-3).ground("spring", "A").stiffness(400.0).build()?;
    /// let stiffer = model.with([("spring.stiffness", "500 N m/rad".into())])?;
    /// assert_eq!(stiffer.get(&stiffer.knob("spring.stiffness")?), 500.0);
    /// # Ok::<(), Error>(())
    /// ```
    pub fn with<'a>(
        &self,
        changes: impl IntoIterator<Item = (&'a str, serde_json::Value)>,
    ) -> Result<Model, Error> {
        let mut mistakes = Vec::new();
        let mut entries = Vec::new();
        for (name, value) in changes {
            let top = name.split('.').next().unwrap_or(name);
            let is_full = self.document.get(top).is_some() || !name.contains('.');
            let path = match is_full {
                true => Ok(name.to_owned()),
                false => self.path_of(name).map_err(|message| unknown(name, message)),
            };
            match path {
                Ok(path) => entries.push((path, Node::from_json(&value))),
                Err(mistake) => mistakes.push(mistake),
            }
        }
        let (document, refused) = self.edited(entries);
        mistakes.extend(refused);
        match mistakes.is_empty() {
            true => self.reread(&document).map_err(Error::Input),
            false => Err(Error::Input(mistakes)),
        }
    }

    /// Copy of the model with other parts, by full path.
    ///
    /// # Errors
    /// Paths that lead nowhere; else everything wrong with the parts.
    pub(crate) fn with_parts(
        &self,
        parts: impl IntoIterator<Item = (String, Node)>,
    ) -> Result<Model, Vec<Diagnostic>> {
        let (document, refused) = self.edited(parts);
        match refused.is_empty() {
            true => self.reread(&document),
            false => Err(refused),
        }
    }

    /// The document with other parts, and what leads nowhere.
    fn edited(&self, parts: impl IntoIterator<Item = (String, Node)>) -> (Node, Vec<Diagnostic>) {
        let mut document = self.document.as_ref().clone();
        let refused = (parts.into_iter())
            .filter_map(|(path, node)| document.set(&path, node).err())
            .collect();
        (document, refused)
    }

    fn reread(&self, document: &Node) -> Result<Model, Vec<Diagnostic>> {
        let mut model = read(document)?;
        if model.name.is_empty() {
            model.name.clone_from(&self.name);
        }
        Ok(model)
    }

    /// Changes a number, in SI units; nondimensional in a reduced model.
    ///
    /// # Errors
    /// [`Error::Input`]: the model rejects the value. The model is then unchanged.
    pub fn set(&mut self, knob: &Knob, value: f64) -> Result<(), Error> {
        *self = self.changed(&[(knob, value)]).map_err(Error::Input)?;
        Ok(())
    }

    /// The model without the keys that say nothing of the mechanics: copies of it are cheaper.
    pub(crate) fn mechanics(&self) -> Model {
        let mut document = self.document.as_ref().clone();
        if let Value::Map(map) = &mut document.value {
            map.retain(|key, _| !ASIDE.contains(&key.as_str()) && !key.starts_with("x-"));
        }
        Model {
            document: Arc::new(document),
            ..self.clone()
        }
    }

    /// Copy of the model with other numbers, all of them changed at once.
    ///
    /// # Errors
    /// What the reader says about the values.
    pub(crate) fn changed(&self, changes: &[(&Knob, f64)]) -> Result<Model, Vec<Diagnostic>> {
        let all = spread(changes);
        let parts = all
            .iter()
            .map(|(knob, x)| (knob.path.clone(), knob.node(*x)));
        let (document, refused) = self.edited(parts);
        if !refused.is_empty() {
            return Err(refused);
        }
        // Wherever a number is refused, or has no place of its own, the reader has the word.
        let Some(structure) = self.rewritten(&all) else {
            return self.reread(&document);
        };
        let before = cautions(&self.structure);
        let mut warnings = self.warnings.clone();
        warnings.retain(|warning| !before.contains(warning));
        warnings.extend(cautions(&structure));
        Ok(Model {
            name: self.name.clone(),
            structure,
            report_units: self.report_units,
            warnings,
            document: Arc::new(document),
            files: self.files.clone(),
        })
    }

    /// The mechanics with other numbers; `None` if they do not take them as they are.
    fn rewritten(&self, all: &[(&Knob, f64)]) -> Option<Structure> {
        let is_plain = |(knob, value): &(&Knob, f64)| {
            knob.slot.is_some() && knob.range().refusal(*value).is_none()
        };
        if !all.iter().all(is_plain) {
            return None;
        }
        let mut list = Vec::with_capacity(all.len());
        for (knob, value) in all {
            // The number may have been resolved in another model.
            list.push((Slot::of(self, &knob.path, self.get(knob))?, *value));
        }
        let mut structure = self.structure.clone();
        Slot::write_all(&list, &mut structure).ok()?;
        Some(structure)
    }

    /// Writes numbers of this model into the mechanics and leaves the document as it was: for models that only serve to be assembled.
    ///
    /// # Errors
    /// Values out of range; a number that has no place of its own.
    pub(crate) fn write(&mut self, changes: &[(&Knob, f64)]) -> Result<(), Vec<Diagnostic>> {
        let all = spread(changes);
        let mut list = Vec::with_capacity(all.len());
        let mut wrong = Vec::new();
        for (knob, value) in &all {
            match (knob.range().refusal(*value), knob.slot) {
                (Some(wanted), _) => {
                    let message = format!("found {value}, must be {wanted}");
                    wrong.push(unknown(&knob.path, message));
                }
                (None, None) => wrong.push(unknown(&knob.path, "follows from others".into())),
                (None, Some(slot)) => list.push((slot, *value)),
            }
        }
        if !wrong.is_empty() {
            return Err(wrong);
        }
        let refuse = |(k, message): (usize, String)| vec![unknown(&all[k].0.path, message)];
        Slot::write_all(&list, &mut self.structure).map_err(refuse)
    }
}

/// Numbers with all those that move with them.
fn spread<'k>(changes: &[(&'k Knob, f64)]) -> Vec<(&'k Knob, f64)> {
    let each = changes.iter().flat_map(|(knob, value)| knob.spread(*value));
    each.collect()
}

#[cfg(test)]
mod tests {
    use super::*;

    const PAIR: &str = "bodies: {A: {inertia: 1}, B: {inertia: 1}}\n\
        connections: {c: {shaft: [A, B], stiffness: 4, element: {type: piecewise_linear, breakpoints: [-1, 1], slopes: [1, 0.5, 1]}}}\n\
        loads: {A: {mean: 0, harmonics: [{order: 1, amplitude: 2, phase: 0.3}]}}\n";

    fn pair() -> Model {
        Model::from_yaml(PAIR).unwrap()
    }

    fn shown(model: &Model) -> String {
        format!("{:?}", model.structure)
    }

    /// Values that exclude each other only while one of them is the old one, and numbers that share a place.
    #[test]
    fn numbers_that_change_together_never_meet_the_old_value_of_another() {
        let model = pair();
        for changes in [
            [("c.breakpoints.0", 3.0), ("c.breakpoints.1", 5.0)],
            [("A.amplitude", 7.0), ("A.phase", 1.2)],
            [("A.phase", 1.2), ("A.amplitude", 7.0)],
        ] {
            let knobs = changes.map(|(name, value)| (model.knob(name).unwrap(), value));
            let pairs: Vec<(&Knob, f64)> = knobs.iter().map(|(knob, x)| (knob, *x)).collect();
            let values = changes.map(|(name, value)| (name, value.into()));
            let wanted = shown(&model.with(values).unwrap());
            assert_eq!(shown(&model.changed(&pairs).unwrap()), wanted);
            let mut written = model.clone();
            written.write(&pairs).unwrap();
            assert_eq!(shown(&written), wanted);
            // Again from other values.
            written.write(&[(pairs[0].0, 0.0)]).unwrap();
            written.write(&pairs).unwrap();
            assert_eq!(shown(&written), wanted);
        }
    }

    #[test]
    fn a_number_of_another_model_is_found_by_its_name() {
        let gap = pair().knob("c.breakpoints.1").unwrap();
        let text = PAIR.replace(
            "connections: {",
            "connections: {b: {ground: A, stiffness: 1}, ",
        );
        let mut other = Model::from_yaml(&text).unwrap();
        other.set(&gap, 2.0).unwrap();
        let wanted = other.with([("c.breakpoints.1", 2.0.into())]).unwrap();
        assert_eq!(shown(&other), shown(&wanted));
    }
}
