//! Exact fractions: ratios of tooth numbers and what follows from them.

use num_bigint::BigInt;
use num_traits::{One, Signed, ToPrimitive, Zero};

/// A fraction of whole numbers of any size, in lowest terms.
pub type Fraction = num_rational::BigRational;

/// Decimal places of a written number that are kept exactly.
const LONGEST: usize = 40;
/// A floating-point number this close to a simpler fraction, relative to its size, is taken as that fraction.
const SAME: f64 = 4.0 * f64::EPSILON;
/// Terms of a continued fraction: those of a double run out before.
const TERMS: usize = 64;

/// A whole number.
pub fn whole(value: i64) -> Fraction {
    Fraction::from_integer(BigInt::from(value))
}

/// Divisors of a number, falling.
pub(crate) fn divisors(of: usize) -> impl Iterator<Item = usize> {
    (1..=of)
        .rev()
        .filter(move |divisor| of.is_multiple_of(*divisor))
}

/// The simplest fraction within rounding of a finite floating-point number: 1/3 for 0.333.., 9/200 for 0.045.
pub fn nearest(x: f64) -> Fraction {
    let Some(exact) = Fraction::from_float(x) else {
        return Fraction::zero();
    };
    // Convergents p/q of the continued fraction of the exact value.
    let (mut p, mut q) = (
        (BigInt::one(), BigInt::zero()),
        (BigInt::zero(), BigInt::one()),
    );
    let mut rest = exact.clone();
    for _ in 0..TERMS {
        let term = rest.floor().to_integer();
        p = (&term * &p.0 + &p.1, p.0);
        q = (&term * &q.0 + &q.1, q.0);
        let convergent = Fraction::new(p.0.clone(), q.0.clone());
        let gap = to_f64(&(&convergent - &exact)).abs();
        if gap <= SAME * x.abs() {
            return convergent;
        }
        let fractional = rest - Fraction::from_integer(term);
        if fractional.is_zero() {
            break;
        }
        rest = fractional.recip();
    }
    exact
}

/// A written fraction or decimal number, `35/47`, `0.5`, `-2`, exactly; `None` for any other text.
pub fn parse(text: &str) -> Option<Fraction> {
    let text = text.trim();
    let Some((above, below)) = text.split_once('/') else {
        return decimal(text);
    };
    let below = decimal(below.trim()).filter(|below| !below.is_zero())?;
    Some(decimal(above.trim())? / below)
}

fn decimal(text: &str) -> Option<Fraction> {
    let (sign, digits) = match text.strip_prefix('-') {
        Some(rest) => (-1, rest),
        None => (1, text.strip_prefix('+').unwrap_or(text)),
    };
    let (front, back) = digits.split_once('.').unwrap_or((digits, ""));
    let is_number = |part: &str| part.bytes().all(|b| b.is_ascii_digit());
    let length = front.len() + back.len();
    if length == 0 || length > LONGEST || !is_number(front) || !is_number(back) {
        return None;
    }
    let value: BigInt = format!("{front}{back}").parse().ok()?;
    let scale = BigInt::from(10).pow(u32::try_from(back.len()).ok()?);
    Some(Fraction::new(value * sign, scale))
}

/// The nearest floating-point number; infinite beyond its range.
pub(crate) fn to_f64(fraction: &Fraction) -> f64 {
    let infinite = f64::INFINITY.copysign(if fraction.is_negative() { -1.0 } else { 1.0 });
    fraction.to_f64().unwrap_or(infinite)
}

/// Least common multiple of the denominators; `None` above `most`.
pub(crate) fn common_denominator<'f>(
    fractions: impl IntoIterator<Item = &'f Fraction>,
    most: usize,
) -> Option<usize> {
    fractions.into_iter().try_fold(1_usize, |common, fraction| {
        let denominator = fraction.denom().to_usize()?;
        let multiple = (common / gcd(common, denominator)).checked_mul(denominator)?;
        (multiple <= most).then_some(multiple)
    })
}

/// Greatest common divisor.
pub(crate) fn gcd(a: usize, b: usize) -> usize {
    if b == 0 { a } else { gcd(b, a % b) }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn decimals_stand_for_simple_fractions() {
        for (x, above, below) in [
            (0.045, 9, 200),
            (1.0 / 3.0, 1, 3),
            (-2.0, -2, 1),
            (0.063432, 7929, 125_000),
            (0.0, 0, 1),
        ] {
            assert_eq!(nearest(x), Fraction::new(above.into(), below.into()), "{x}");
        }
        let pi = nearest(std::f64::consts::PI);
        assert!((to_f64(&pi) - std::f64::consts::PI).abs() < 1e-14);
    }

    #[test]
    fn written_fractions_are_exact() {
        assert_eq!(parse("35/47"), Some(Fraction::new(35.into(), 47.into())));
        assert_eq!(parse(" -0.50 "), Some(Fraction::new((-1).into(), 2.into())));
        for wrong in ["", "1/0", "x", "1e3", "1/2/3", "."] {
            assert_eq!(parse(wrong), None, "{wrong}");
        }
    }

    #[test]
    fn denominators_have_a_common_multiple() {
        let list = [parse("1/6"), parse("0.25"), parse("3")].map(Option::unwrap);
        assert_eq!(common_denominator(&list, 100), Some(12));
        assert_eq!(common_denominator(&list, 11), None);
    }
}
