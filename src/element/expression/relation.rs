//! A number that follows another one by a formula.

use super::formula::{Formula, FormulaNode};
use super::program::{FormulaArguments, run};
use super::{FormulaError, reader};

/// A formula of one number x, in the words of the law `expression`.
#[derive(Debug, Clone)]
pub struct Relation {
    text: String,
    formula: Formula,
}

impl PartialEq for Relation {
    fn eq(&self, other: &Relation) -> bool {
        self.text == other.text
    }
}

impl Relation {
    /// Reads a formula of `x`.
    ///
    /// ```
    /// # use gearlash::element::Relation;
    /// assert_eq!(Relation::new("0.4*x + 1")?.value(5.0), 3.0);
    /// assert!(Relation::new("0.4*q").is_err());
    /// # Ok::<(), gearlash::element::FormulaError>(())
    /// ```
    ///
    /// # Errors
    /// What is wrong with it, and where.
    pub fn new(text: &str) -> Result<Relation, FormulaError> {
        let formula = reader::read(text, &["x"])?;
        let foreign = formula
            .nodes
            .iter()
            .position(|node| matches!(node, FormulaNode::Variable(_)));
        if let Some(node) = foreign {
            let message = "only x has a value here, the number that the others follow";
            return Err(FormulaError::new(text, formula.places[node], message));
        }
        Ok(Relation {
            text: text.to_owned(),
            formula,
        })
    }

    /// Its value.
    pub fn value(&self, x: f64) -> f64 {
        let nothing = FormulaArguments {
            q: 0.0,
            v: 0.0,
            phase: 0.0,
        };
        run(&self.formula, &[x], nothing)
    }

    /// As written.
    pub fn text(&self) -> &str {
        &self.text
    }
}
