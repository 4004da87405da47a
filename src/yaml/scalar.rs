//! Interpretation of scalars by the YAML core schema; booleans and numbers are read only where the reader wants them.

/// A number as written.
#[derive(Debug, Clone, Copy, PartialEq)]
pub enum WrittenNumber {
    /// A whole number >= 0.
    Unsigned(u64),
    /// A whole number < 0.
    Signed(i64),
    /// Anything else; may be infinite or not a number.
    Float(f64),
}

impl WrittenNumber {
    /// The number as f64; whole numbers beyond 2^53 are rounded.
    pub fn as_f64(self) -> f64 {
        match self {
            WrittenNumber::Unsigned(n) => n as f64,
            WrittenNumber::Signed(n) => n as f64,
            WrittenNumber::Float(x) => x,
        }
    }

    /// The same number as a whole number where it is one: `5.0` and `1e3` count as whole.
    pub fn whole(self) -> WrittenNumber {
        /// Every whole number below 2^53 has a double of its own.
        const EXACT: f64 = 9_007_199_254_740_992.0;
        match self {
            WrittenNumber::Float(x) if x.fract() == 0.0 && x.abs() < EXACT => {
                if x < 0.0 {
                    WrittenNumber::Signed(x as i64)
                } else {
                    WrittenNumber::Unsigned(x as u64)
                }
            }
            other => other,
        }
    }
}

/// Whether an unquoted scalar is null.
pub fn is_null(text: &str) -> bool {
    matches!(text, "" | "~" | "null" | "Null" | "NULL")
}

/// The boolean value of an unquoted scalar. `yes`, `on` and the like are ordinary words.
pub fn boolean(text: &str) -> Option<bool> {
    match text {
        "true" => Some(true),
        "false" => Some(false),
        _ => None,
    }
}

/// The numeric value of a scalar in the YAML core schema: `12`, `-3`, `0x1F`, `0o17`, `.5`, `1e5`, `4e-05`, `.inf`.
pub fn number(text: &str) -> Option<WrittenNumber> {
    if let Some(digits) = text.strip_prefix("0x") {
        return radix(digits, 16);
    }
    if let Some(digits) = text.strip_prefix("0o") {
        return radix(digits, 8);
    }
    let (negative, unsigned) = match text.as_bytes().first()? {
        b'-' => (true, &text[1..]),
        b'+' => (false, &text[1..]),
        _ => (false, text),
    };
    match unsigned {
        ".inf" | ".Inf" | ".INF" if negative => {
            return Some(WrittenNumber::Float(f64::NEG_INFINITY));
        }
        ".inf" | ".Inf" | ".INF" => return Some(WrittenNumber::Float(f64::INFINITY)),
        _ if matches!(text, ".nan" | ".NaN" | ".NAN") => {
            return Some(WrittenNumber::Float(f64::NAN));
        }
        _ => {}
    }
    if decimal_length(text) != Some(text.len()) {
        return None;
    }
    if unsigned.bytes().all(|b| b.is_ascii_digit()) {
        let whole = if negative {
            text.parse().map(WrittenNumber::Signed).ok()
        } else {
            unsigned.parse().map(WrittenNumber::Unsigned).ok()
        };
        if whole.is_some() && text != "-0" {
            return whole;
        }
    }
    text.parse().map(WrittenNumber::Float).ok()
}

fn radix(digits: &str, base: u32) -> Option<WrittenNumber> {
    // from_str_radix takes a sign, the core schema does not.
    if !digits.bytes().all(|b| b.is_ascii_hexdigit()) {
        return None;
    }
    u64::from_str_radix(digits, base)
        .map(WrittenNumber::Unsigned)
        .ok()
}

/// Length in bytes of the decimal number that a text starts with; `None` when it starts with none.
///
/// ```text
/// [-+]? ( \. [0-9]+ | [0-9]+ ( \. [0-9]* )? ) ( [eE] [-+]? [0-9]+ )?
/// ```
pub(crate) fn decimal_length(text: &str) -> Option<usize> {
    let bytes = text.as_bytes();
    let digits = |from: usize| {
        bytes[from..]
            .iter()
            .take_while(|b| b.is_ascii_digit())
            .count()
    };
    let signed = |at: usize| usize::from(matches!(bytes.get(at), Some(b'-' | b'+')));
    let mut end = signed(0);
    let whole = digits(end);
    end += whole;
    if bytes.get(end) == Some(&b'.') {
        let fraction = digits(end + 1);
        if whole + fraction == 0 {
            return None;
        }
        end += 1 + fraction;
    } else if whole == 0 {
        return None;
    }
    if matches!(bytes.get(end), Some(b'e' | b'E')) {
        let start = end + 1 + signed(end + 1);
        let exponent = digits(start);
        if exponent > 0 {
            end = start + exponent;
        }
    }
    Some(end)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn core_schema_numbers() {
        let float = |text| number(text).map(WrittenNumber::as_f64);
        for (text, value) in [
            ("1e5", 1e5),
            ("4e-05", 4e-5),
            (".5", 0.5),
            ("5.", 5.0),
            ("+1.5E+3", 1500.0),
            ("-12", -12.0),
            ("0x1F", 31.0),
            ("0o17", 15.0),
            ("007", 7.0),
            ("18446744073709551616", 18446744073709551616.0),
            ("-.inf", f64::NEG_INFINITY),
        ] {
            assert_eq!(float(text), Some(value), "{text}");
        }
        for text in [
            "", ".", "-", "e5", "1_000", "0x", "0x-1", "-0x1", "1e", "5 um", "inf", "nan", "1.2.3",
            "٣", "-.nan",
        ] {
            assert_eq!(number(text), None, "{text}");
        }
        assert!(float("-0").is_some_and(|x| x.is_sign_negative()));
        assert_eq!(
            number("1e3").map(WrittenNumber::whole),
            Some(WrittenNumber::Unsigned(1000))
        );
    }
}
