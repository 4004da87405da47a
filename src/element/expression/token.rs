//! The words of a formula.

use super::FormulaError;
use crate::yaml::scalar;

/// Kind of a word.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(super) enum TokenKind<'t> {
    Number(f64),
    Name(&'t str),
    /// An operator, a bracket or a comma.
    Sign(&'t str),
    End,
}

/// A word with its place.
#[derive(Debug, Clone, Copy)]
pub(super) struct Token<'t> {
    pub(super) kind: TokenKind<'t>,
    /// Bytes before it.
    pub(super) start: usize,
    pub(super) text: &'t str,
}

/// Longer ones first.
const SIGNS: [&str; 16] = [
    "<=", ">=", "==", "!=", "<", ">", "+", "-", "*", "/", "^", "(", ")", ",", "·", "×",
];

/// What people write elsewhere, and what it is called here.
const ELSEWHERE: [(&str, &str); 9] = [
    ("**", "a power is written `^`"),
    ("&&", "write `and`"),
    ("||", "write `or`"),
    ("&", "write `and`"),
    ("|", "write `abs(x)`, or `or`"),
    ("=", "equality is written `==`"),
    ("!", "write `not`"),
    ("[", "use round brackets"),
    ("{", "use round brackets"),
];

/// The word that begins at or behind a place.
pub(super) fn next(text: &str, from: usize) -> Result<Token<'_>, FormulaError> {
    let rest = text[from..].trim_start();
    let start = text.len() - rest.len();
    let token = |kind, length: usize| {
        Ok(Token {
            kind,
            start,
            text: &rest[..length],
        })
    };
    let Some(first) = rest.chars().next() else {
        return token(TokenKind::End, 0);
    };
    if first.is_ascii_digit() || first == '.' {
        let length = scalar::decimal_length(rest)
            .ok_or_else(|| FormulaError::new(text, start, "a number has digits"))?;
        return match rest[..length].parse::<f64>() {
            Ok(value) if value.is_finite() => token(TokenKind::Number(value), length),
            _ => Err(FormulaError::new(text, start, "the number is not finite")),
        };
    }
    if is_letter(first) {
        let length = rest.find(|c| !is_letter(c) && !c.is_ascii_digit());
        let length = length.unwrap_or(rest.len());
        return token(TokenKind::Name(&rest[..length]), length);
    }
    let elsewhere = ELSEWHERE.iter().find(|(sign, _)| rest.starts_with(sign));
    let sign = SIGNS.iter().find(|sign| rest.starts_with(**sign));
    match (sign, elsewhere) {
        (Some(sign), None) => token(TokenKind::Sign(&rest[..sign.len()]), sign.len()),
        (Some(sign @ (&"==" | &"!=")), _) => token(TokenKind::Sign(sign), sign.len()),
        (_, Some((sign, help))) => {
            let message = format!("`{sign}` has no meaning here; {help}");
            Err(FormulaError::new(text, start, message))
        }
        (None, None) => {
            let message = format!("`{}` has no meaning here", first.escape_debug());
            Err(FormulaError::new(text, start, message))
        }
    }
}

fn is_letter(c: char) -> bool {
    c.is_ascii_alphabetic() || c == '_'
}
