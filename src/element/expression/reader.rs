//! Formulas: from text to a tree and to instructions, in one pass (Pratt's method).
//!
//! No crate that was looked at does this as needed. exmex 0.21 reads `-q^2` as (-q)^2, `2^3^2` as 64 and `1e5` not at all;
//! evalexpr is under the AGPL and has no derivatives; fasteval and meval are no longer kept and have none. A generator of
//! parsers would save the sixty lines that read operators, not the limits, the places and the words of the messages.

use super::formula::{
    Binary, COMPARISON, FUNCTIONS, Formula, FormulaNode, Instruction, NOT, SIGN, Unary, VARIABLES,
    WORDS, strength,
};
use super::token::{self, Token, TokenKind};
use super::{FormulaError, MAX_DEPTH, MAX_STACK, MAX_SWITCHES, MAX_TEXT};
use crate::error::did_you_mean;

/// Reads a formula; `parameters` are the names it may use besides q, v and phase.
pub(super) fn read(text: &str, parameters: &[&str]) -> Result<Formula, FormulaError> {
    if text.len() > MAX_TEXT {
        let message = format!("the formula has {} bytes, at most {MAX_TEXT}", text.len());
        return Err(FormulaError::new("", 0, message));
    }
    let mut reader = FormulaReader {
        text,
        parameters,
        token: token::next(text, 0)?,
        formula: Formula::default(),
        depth: 0,
        waiting: 0,
    };
    let value = reader.expression(0)?;
    match reader.token.kind {
        TokenKind::End => {}
        TokenKind::Sign(")") => return reader.fail("this bracket closes nothing"),
        _ => return reader.fail(reader.no_operator()),
    }
    if value.sort == Sort::Condition {
        let message =
            "found a condition, wanted a force; use `if` to turn a condition into a number";
        return Err(reader.fault(value.start, message));
    }
    let nodes = reader.formula.nodes.iter().zip(&reader.formula.places);
    let mut switches = nodes.filter(|(node, _)| node.is_switch());
    match switches.nth(MAX_SWITCHES) {
        Some((_, place)) => {
            let what = "of abs, sign, min, max and comparisons";
            Err(reader.fault(*place, format!("more than {MAX_SWITCHES} {what}")))
        }
        None => Ok(reader.formula),
    }
}

/// Kind of value of an expression.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
enum Sort {
    Number,
    Condition,
}

/// An expression: its node, its kind of value, its first character.
#[derive(Debug, Clone, Copy)]
struct ReadExpression {
    node: usize,
    sort: Sort,
    start: usize,
}

struct FormulaReader<'t> {
    text: &'t str,
    parameters: &'t [&'t str],
    token: Token<'t>,
    formula: Formula,
    depth: usize,
    /// Values on the stack when the next instruction runs.
    waiting: usize,
}

impl<'t> FormulaReader<'t> {
    /// An expression whose operators hold more than `least`.
    fn expression(&mut self, least: u8) -> Result<ReadExpression, FormulaError> {
        self.depth += 1;
        if self.depth > MAX_DEPTH {
            return self.fail(format!("nested deeper than {MAX_DEPTH}"));
        }
        let mut left = self.first()?;
        while let Some((strength, right, operator)) = strength(self.token.text) {
            if strength < least {
                break;
            }
            left = self.operation(left, operator, right)?;
            let chained = strength == COMPARISON
                && matches!(self::strength(self.token.text), Some((COMPARISON, ..)));
            if chained {
                return self.fail("comparisons do not chain; write `a < b and b < c`");
            }
        }
        self.depth -= 1;
        Ok(left)
    }

    /// A number, a name, a call, a bracket or a sign with what it belongs to.
    fn first(&mut self) -> Result<ReadExpression, FormulaError> {
        let token = self.token;
        match token.kind {
            TokenKind::Number(value) => {
                self.advance()?;
                self.leaf(
                    FormulaNode::Number(value),
                    Instruction::Number(value),
                    token,
                )
            }
            TokenKind::Name("not") => {
                self.advance()?;
                let value = self.expression(NOT)?;
                self.condition(value, "`not`")?;
                self.formula.code.push(Instruction::Unary(Unary::Not));
                Ok(self.node(
                    FormulaNode::Unary(Unary::Not, value.node),
                    Sort::Condition,
                    token.start,
                ))
            }
            TokenKind::Name(name) => self.name(name, token),
            TokenKind::Sign("-") => {
                self.advance()?;
                let value = self.expression(SIGN)?;
                self.formula.code.push(Instruction::Unary(Unary::Negative));
                let node = FormulaNode::Unary(Unary::Negative, value.node);
                Ok(self.node(node, Sort::Number, token.start))
            }
            TokenKind::Sign("+") => {
                self.advance()?;
                self.expression(SIGN)
            }
            TokenKind::Sign("(") => {
                self.advance()?;
                let value = self.expression(0)?;
                self.close(token)?;
                Ok(value)
            }
            TokenKind::Sign(sign) => {
                self.fail(format!("found `{sign}`, wanted a number, a name or `(`"))
            }
            TokenKind::End => self.fail("the formula ends here, wanted a number, a name or `(`"),
        }
    }

    fn operation(
        &mut self,
        left: ReadExpression,
        operator: Binary,
        right: u8,
    ) -> Result<ReadExpression, FormulaError> {
        let token = self.token;
        let is_logic = matches!(operator, Binary::And | Binary::Or);
        self.advance()?;
        let second = self.expression(right)?;
        if is_logic {
            let of = format!("`{}`", token.text);
            self.condition(left, &of)?;
            self.condition(second, &of)?;
        }
        self.combine(operator, second);
        let gives_condition = is_logic || operator.is_comparison();
        let sort = if gives_condition {
            Sort::Condition
        } else {
            Sort::Number
        };
        let node = FormulaNode::Binary(operator, left.node, second.node);
        let read = self.node(node, sort, token.start);
        Ok(ReadExpression {
            start: left.start,
            ..read
        })
    }

    /// A variable, a constant, a parameter or a call.
    fn name(&mut self, name: &'t str, token: Token<'t>) -> Result<ReadExpression, FormulaError> {
        self.advance()?;
        if let Some(k) = self.parameters.iter().position(|known| *known == name) {
            return self.leaf(FormulaNode::Parameter(k), Instruction::Parameter(k), token);
        }
        if let Some((_, variable)) = VARIABLES.iter().find(|(known, _)| *known == name) {
            return self.leaf(
                FormulaNode::Variable(*variable),
                Instruction::Variable(*variable),
                token,
            );
        }
        if name == "pi" {
            let pi = std::f64::consts::PI;
            return self.leaf(FormulaNode::Number(pi), Instruction::Number(pi), token);
        }
        let function = FUNCTIONS.iter().find(|(known, _)| *known == name);
        if function.is_none() && !["min", "max", "if"].contains(&name) {
            return Err(self.unknown(name, token));
        }
        if self.token.kind != TokenKind::Sign("(") {
            return self.fail(format!("wanted `(` after the function `{name}`"));
        }
        let bracket = self.token;
        self.advance()?;
        if name == "if" {
            return self.choice(token, bracket);
        }
        if let Some((_, function)) = function {
            let value = self.argument(name, 1, 1)?;
            self.close(bracket)?;
            self.formula.code.push(Instruction::Unary(*function));
            return Ok(self.node(
                FormulaNode::Unary(*function, value.node),
                Sort::Number,
                token.start,
            ));
        }
        let operator = if name == "min" {
            Binary::Min
        } else {
            Binary::Max
        };
        let mut value = self.argument(name, 1, 2)?;
        for count in 2.. {
            self.comma(name, count - 1, 2)?;
            let next = self.argument(name, count, usize::MAX)?;
            self.combine(operator, next);
            let node = FormulaNode::Binary(operator, value.node, next.node);
            value = self.node(node, Sort::Number, token.start);
            if self.token.kind != TokenKind::Sign(",") {
                break;
            }
        }
        self.close(bracket)?;
        Ok(value)
    }

    /// if(condition, then, else): only the branch that counts is evaluated.
    fn choice(
        &mut self,
        token: Token<'t>,
        bracket: Token<'t>,
    ) -> Result<ReadExpression, FormulaError> {
        let condition = self.expression(0)?;
        self.condition(condition, "`if`")?;
        let leave = self.formula.code.len();
        self.formula.code.push(Instruction::SkipUnless(0));
        self.waiting -= 1;
        self.comma("if", 1, 3)?;
        let then = self.argument("if", 2, 3)?;
        let skip = self.formula.code.len();
        self.formula.code.push(Instruction::Skip(0));
        self.waiting -= 1;
        self.comma("if", 2, 3)?;
        let otherwise = self.argument("if", 3, 3)?;
        self.close(bracket)?;
        let end = self.formula.code.len();
        self.formula.code[leave] = Instruction::SkipUnless(skip + 1);
        self.formula.code[skip] = Instruction::Skip(end);
        let node = FormulaNode::If(condition.node, then.node, otherwise.node);
        Ok(self.node(node, Sort::Number, token.start))
    }

    /// An argument of a function that takes `most`, counted from 1.
    fn argument(
        &mut self,
        name: &str,
        count: usize,
        most: usize,
    ) -> Result<ReadExpression, FormulaError> {
        if self.token.kind == TokenKind::Sign(")") {
            return self.fail(arity(name, count - 1));
        }
        let value = self.expression(0)?;
        if count == most && self.token.kind == TokenKind::Sign(",") {
            return self.fail(format!("one argument too many: {}", arity(name, count + 1)));
        }
        Ok(value)
    }

    fn comma(&mut self, name: &str, given: usize, wanted: usize) -> Result<(), FormulaError> {
        match self.token.kind {
            TokenKind::Sign(",") => self.advance(),
            TokenKind::Sign(")") if given < wanted => self.fail(arity(name, given)),
            TokenKind::End => self.fail(format!("the formula ends within `{name}(..)`")),
            _ => self.fail(self.no_operator()),
        }
    }

    fn close(&mut self, bracket: Token<'t>) -> Result<(), FormulaError> {
        match self.token.kind {
            TokenKind::Sign(")") => self.advance(),
            TokenKind::End => Err(self.fault(bracket.start, "this bracket is not closed")),
            _ => self.fail(self.no_operator()),
        }
    }

    fn leaf(
        &mut self,
        node: FormulaNode,
        op: Instruction,
        token: Token<'t>,
    ) -> Result<ReadExpression, FormulaError> {
        self.formula.code.push(op);
        self.waiting += 1;
        self.formula.stack = self.formula.stack.max(self.waiting);
        if self.waiting > MAX_STACK {
            let message = format!("more than {MAX_STACK} intermediate values at once");
            return Err(self.fault(token.start, message));
        }
        Ok(self.node(node, Sort::Number, token.start))
    }

    /// The instruction of two arguments; a power with a small whole number as exponent has one of its own.
    fn combine(&mut self, operator: Binary, second: ReadExpression) {
        const LARGEST: f64 = 64.0;
        self.waiting -= 1;
        let code = &mut self.formula.code;
        match self.formula.nodes[second.node] {
            FormulaNode::Number(n)
                if operator == Binary::Power && n.fract() == 0.0 && n.abs() <= LARGEST =>
            {
                // The number is the last instruction.
                code.pop();
                code.push(Instruction::Power(n as i32));
            }
            _ => code.push(Instruction::Binary(operator)),
        }
    }

    fn node(&mut self, node: FormulaNode, sort: Sort, start: usize) -> ReadExpression {
        self.formula.nodes.push(node);
        self.formula.places.push(start);
        let node = self.formula.nodes.len() - 1;
        ReadExpression { node, sort, start }
    }

    /// Numbers are not conditions; conditions are numbers, 1 and 0: (q > b)*(q - b).
    fn condition(&self, value: ReadExpression, of: &str) -> Result<(), FormulaError> {
        match value.sort {
            Sort::Condition => Ok(()),
            Sort::Number => {
                let message = format!("{of} wants a condition such as `q > 0`, found a number");
                Err(self.fault(value.start, message))
            }
        }
    }

    fn advance(&mut self) -> Result<(), FormulaError> {
        let behind = self.token.start + self.token.text.len();
        self.token = token::next(self.text, behind)?;
        Ok(())
    }

    /// What to say where an operator was wanted.
    fn no_operator(&self) -> String {
        let found = self.token.text;
        match self.token.kind {
            TokenKind::Name(_) | TokenKind::Number(_) | TokenKind::Sign("(") => {
                format!("wanted an operator before `{found}`; a product is written `*`")
            }
            _ => format!("found `{found}`, wanted an operator or `)`"),
        }
    }

    fn unknown(&self, name: &str, token: Token<'t>) -> FormulaError {
        let known = self.parameters.iter().copied();
        let known = known.chain(VARIABLES.iter().map(|(name, _)| *name));
        let known = known.chain(FUNCTIONS.iter().map(|(name, _)| *name));
        let help = match name {
            "ln" => "the natural logarithm is `log`".to_owned(),
            "pow" => "a power is written `^`".to_owned(),
            "sgn" | "signum" => "write `sign`".to_owned(),
            _ => did_you_mean(name, known.chain(WORDS)),
        };
        self.fault(token.start, format!("unknown name `{name}`; {help}"))
    }

    fn fault(&self, start: usize, message: impl Into<String>) -> FormulaError {
        FormulaError::new(self.text, start, message)
    }

    fn fail<T>(&self, message: impl Into<String>) -> Result<T, FormulaError> {
        Err(self.fault(self.token.start, message))
    }
}

fn arity(name: &str, found: usize) -> String {
    let wanted = match name {
        "if" => "three arguments, `if(condition, then, else)`",
        "min" | "max" => "two arguments or more",
        _ => "one argument",
    };
    format!("`{name}` takes {wanted}; found {found}")
}
