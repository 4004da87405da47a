//! Numbers of the model that follow the one that an analysis varies.

use super::Setting;
use crate::element::Relation;
use crate::error::did_you_mean;
use crate::model::{Follower, Knob};
use indexmap::IndexMap;
use schemars::JsonSchema;
use serde::{Deserialize, Serialize};

/// Further numbers by name with formulas of x, the value of the varied parameter in SI units (rad/s for the excitation frequency):
/// `{gear_2.drag: "0.4*x"}`. An analysis of
/// two parameters has such a map for each of them: `{gear_1.drag: {gear_2.drag: "0.4*x"}}`.
#[derive(Debug, Clone, Default, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(transparent)]
pub struct Link(IndexMap<String, LinkEntry>);

/// A formula, or formulas for the followers of one parameter.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(untagged)]
pub enum LinkEntry {
    /// The same at every value.
    Number(f64),
    /// A formula of x.
    Formula(String),
    /// Followers of the parameter that the key names.
    Of(IndexMap<String, Followed>),
}

/// What a follower is.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(untagged)]
pub enum Followed {
    /// The same at every value.
    Number(f64),
    /// A formula of x.
    Formula(String),
}

impl Followed {
    fn text(&self) -> String {
        match self {
            Followed::Number(value) => format!("{value:?}"),
            Followed::Formula(text) => text.clone(),
        }
    }
}

impl Link {
    /// Whether nothing follows.
    pub fn is_empty(&self) -> bool {
        self.0.is_empty()
    }

    /// The number with those that follow it. `all`: names of all parameters of the analysis.
    ///
    /// # Errors
    /// Unknown names and parameters, formulas that cannot be read.
    pub fn attach(&self, setting: &Setting<'_>, knob: Knob, all: &[&str]) -> Result<Knob, String> {
        let list = self.followers(setting, knob.name(), all)?;
        Ok(knob.followed_by(list))
    }

    /// The followers of a parameter, by its full path; `frequency` for the excitation frequency.
    ///
    /// # Errors
    /// As [`Link::attach`].
    pub fn followers(
        &self,
        setting: &Setting<'_>,
        path: &str,
        all: &[&str],
    ) -> Result<Vec<Follower>, String> {
        let mut list = Vec::new();
        for (name, entry) in &self.0 {
            match entry {
                LinkEntry::Of(own) => {
                    let is_this = name == path
                        || setting.model.path_of(name).is_ok_and(|known| known == path);
                    let is_known = is_this || all.contains(&name.as_str());
                    if !is_known {
                        let hint = did_you_mean(name, all.iter().copied());
                        return Err(format!("link.{name}: is none of the parameters; {hint}"));
                    }
                    for (follower, formula) in own.iter().filter(|_| is_this) {
                        list.push(one(setting, follower, &formula.text(), path)?);
                    }
                }
                LinkEntry::Number(_) | LinkEntry::Formula(_) if all.len() > 1 => {
                    let example = all.first().copied().unwrap_or_default();
                    return Err(format!(
                        "link.{name}: the analysis has {} parameters, so say which one is x: link: {{{example}: {{{name}: ..}}}}",
                        all.len()
                    ));
                }
                LinkEntry::Number(value) => {
                    list.push(one(setting, name, &format!("{value:?}"), path)?)
                }
                LinkEntry::Formula(text) => list.push(one(setting, name, text, path)?),
            }
        }
        Ok(list)
    }
}

/// A number that follows the one at `path`.
fn one(setting: &Setting<'_>, name: &str, text: &str, path: &str) -> Result<Follower, String> {
    let knob = setting
        .model
        .resolve(name)
        .map_err(|message| format!("link.{name}: {message}"))?;
    if knob.name() == path {
        return Err(format!("link.{name}: is the parameter itself"));
    }
    let relation = Relation::new(text).map_err(|fault| {
        format!("link.{name}: `{text}`: {fault}; wanted a formula of x, such as \"0.4*x\"")
    })?;
    Ok(Follower { knob, relation })
}
