//! Units: the table, and expressions such as `N m/rad`, `kg*m^2`, `1/(m s)`.

use super::dimension::UnitDimension;
use crate::error::nearest;
use std::f64::consts::PI;

/// A unit in SI base units: factor = numerator 10^exponent pi^pi / denominator root, kept in whole numbers so that decimal
/// quantities convert without rounding twice; root is 1 but for half powers of units such as mm.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(super) struct Unit {
    pub dimension: UnitDimension,
    pub numerator: u128,
    pub exponent: i32,
    pub pi: i32,
    pub denominator: u128,
    pub root: f64,
}

/// The unit expressions may nest and chain this far.
const MAX_FACTORS: usize = 16;
/// Largest power.
const MAX_POWER: i16 = 9;
/// Raised digits, 0 first.
const SUPERSCRIPTS: [char; 10] = ['⁰', '¹', '²', '³', '⁴', '⁵', '⁶', '⁷', '⁸', '⁹'];
/// What some write for a unit, and its symbol.
const WORDS: [(&str, &str); 24] = [
    ("sec", "s"),
    ("second", "s"),
    ("seconds", "s"),
    ("meter", "m"),
    ("metre", "m"),
    ("micron", "um"),
    ("microns", "um"),
    ("inch", "in"),
    ("inches", "in"),
    ("feet", "ft"),
    ("foot", "ft"),
    ("degree", "deg"),
    ("degrees", "deg"),
    ("radian", "rad"),
    ("radians", "rad"),
    ("newton", "N"),
    ("newtons", "N"),
    ("hertz", "Hz"),
    ("gram", "g"),
    ("kilogram", "kg"),
    ("lbs", "lb"),
    ("lbm", "lb"),
    ("kp", "kgf"),
    ("turns", "rev"),
];

impl Unit {
    const ONE: Unit = si(UnitDimension::NUMBER);

    fn times(self, other: Unit) -> Option<Unit> {
        let numerator = self.numerator.checked_mul(other.numerator)?;
        let denominator = self.denominator.checked_mul(other.denominator)?;
        let common = gcd(numerator, denominator);
        Some(Unit {
            dimension: self.dimension.times(other.dimension),
            numerator: numerator / common,
            exponent: self.exponent + other.exponent,
            pi: self.pi + other.pi,
            denominator: denominator / common,
            root: self.root * other.root,
        })
    }

    fn inverse(self) -> Unit {
        Unit {
            dimension: self.dimension.power(-1),
            numerator: self.denominator,
            exponent: -self.exponent,
            pi: -self.pi,
            denominator: self.numerator,
            root: 1.0 / self.root,
        }
    }

    /// The power of an exponent counted in halves.
    fn power(self, halves: i16) -> Option<Unit> {
        let base = if halves < 0 { self.inverse() } else { self };
        let count = halves.unsigned_abs();
        let times = |count: u16| (0..count).try_fold(Unit::ONE, |p, _| p.times(base));
        if count.is_multiple_of(2) {
            times(count / 2)
        } else {
            times(count)?.square_root()
        }
    }

    /// `None` where a dimension would be a quarter.
    fn square_root(self) -> Option<Unit> {
        let (exponent, pi) = (self.exponent.div_euclid(2), self.pi.div_euclid(2));
        let ten = if self.exponent % 2 == 0 { 1.0 } else { 10.0 };
        let circle = if self.pi % 2 == 0 { 1.0 } else { PI };
        let ratio = self.numerator as f64 / self.denominator as f64;
        Some(Unit {
            dimension: self.dimension.square_root()?,
            numerator: 1,
            exponent,
            pi,
            denominator: 1,
            root: (ratio * ten * circle * self.root).sqrt(),
        })
    }
}

fn gcd(mut a: u128, mut b: u128) -> u128 {
    while b > 0 {
        (a, b) = (b, a % b);
    }
    a.max(1)
}

const fn si(dimension: UnitDimension) -> Unit {
    decimal(dimension, 1, 0)
}

const fn decimal(dimension: UnitDimension, numerator: u128, exponent: i32) -> Unit {
    Unit {
        dimension,
        numerator,
        exponent,
        pi: 0,
        denominator: 1,
        root: 1.0,
    }
}

/// A fraction of pi.
const fn circular(dimension: UnitDimension, numerator: u128, denominator: u128) -> Unit {
    Unit {
        dimension,
        numerator,
        exponent: 0,
        pi: 1,
        denominator,
        root: 1.0,
    }
}

const LENGTH: UnitDimension = UnitDimension::LENGTH;
const ANGLE: UnitDimension = UnitDimension::ANGLE;
const MASS: UnitDimension = UnitDimension::MASS;
const TIME: UnitDimension = UnitDimension::TIME;
const FREQUENCY: UnitDimension = UnitDimension::FREQUENCY;
const FORCE: UnitDimension = UnitDimension::FORCE;
const MOMENT: UnitDimension = UnitDimension::MOMENT;
const POWER: UnitDimension = UnitDimension::new(1, 2, -3, 0);

/// Every unit with its symbol. Hertz and revolutions count in radians: 1 Hz = 2 pi rad/s.
const UNITS: &[(&str, Unit)] = &[
    ("m", si(LENGTH)),
    ("nm", decimal(LENGTH, 1, -9)),
    ("um", decimal(LENGTH, 1, -6)),
    ("µm", decimal(LENGTH, 1, -6)),
    ("μm", decimal(LENGTH, 1, -6)),
    ("mm", decimal(LENGTH, 1, -3)),
    ("cm", decimal(LENGTH, 1, -2)),
    ("km", decimal(LENGTH, 1, 3)),
    ("in", decimal(LENGTH, 254, -4)),
    ("ft", decimal(LENGTH, 3048, -4)),
    ("mil", decimal(LENGTH, 254, -7)),
    ("thou", decimal(LENGTH, 254, -7)),
    ("rad", si(ANGLE)),
    ("mrad", decimal(ANGLE, 1, -3)),
    ("urad", decimal(ANGLE, 1, -6)),
    ("µrad", decimal(ANGLE, 1, -6)),
    ("μrad", decimal(ANGLE, 1, -6)),
    ("deg", circular(ANGLE, 1, 180)),
    ("°", circular(ANGLE, 1, 180)),
    ("arcmin", circular(ANGLE, 1, 10_800)),
    ("arcsec", circular(ANGLE, 1, 648_000)),
    ("rev", circular(ANGLE, 2, 1)),
    ("s", si(TIME)),
    ("ms", decimal(TIME, 1, -3)),
    ("us", decimal(TIME, 1, -6)),
    ("µs", decimal(TIME, 1, -6)),
    ("μs", decimal(TIME, 1, -6)),
    ("min", decimal(TIME, 60, 0)),
    ("h", decimal(TIME, 3600, 0)),
    ("kg", si(MASS)),
    ("g", decimal(MASS, 1, -3)),
    ("mg", decimal(MASS, 1, -6)),
    ("t", decimal(MASS, 1, 3)),
    ("lb", decimal(MASS, 45_359_237, -8)),
    ("oz", decimal(MASS, 28_349_523_125, -12)),
    ("N", si(FORCE)),
    ("mN", decimal(FORCE, 1, -3)),
    ("kN", decimal(FORCE, 1, 3)),
    ("MN", decimal(FORCE, 1, 6)),
    ("GN", decimal(FORCE, 1, 9)),
    ("lbf", decimal(FORCE, 44_482_216_152_605, -13)),
    ("ozf", decimal(FORCE, 27_801_385_095_378_125, -17)),
    ("kgf", decimal(FORCE, 980_665, -5)),
    ("Nm", si(MOMENT)),
    ("mNm", decimal(MOMENT, 1, -3)),
    ("Nmm", decimal(MOMENT, 1, -3)),
    ("kNm", decimal(MOMENT, 1, 3)),
    ("MNm", decimal(MOMENT, 1, 6)),
    ("J", si(MOMENT)),
    ("mJ", decimal(MOMENT, 1, -3)),
    ("kJ", decimal(MOMENT, 1, 3)),
    ("W", si(POWER)),
    ("kW", decimal(POWER, 1, 3)),
    ("Hz", circular(FREQUENCY, 2, 1)),
    ("kHz", circular(FREQUENCY, 2000, 1)),
    ("MHz", circular(FREQUENCY, 2_000_000, 1)),
    ("rpm", circular(FREQUENCY, 1, 30)),
    ("krpm", circular(FREQUENCY, 100, 3)),
    ("1", Unit::ONE),
];

/// The symbols of all units.
pub fn symbols() -> impl Iterator<Item = &'static str> {
    let written = UNITS.iter().map(|(symbol, _)| *symbol);
    written.filter(|symbol| *symbol != "1")
}

/// A unit expression. Factors are joined by spaces, `*`, `.`, `·` or `⋅`; each `/` divides by the next factor.
///
/// # Errors
/// What is wrong, and what to write instead.
pub(super) fn parse(text: &str) -> Result<Unit, String> {
    let text = text.replace("**", "^");
    let mut expression = UnitExpression {
        rest: &text,
        factors: 0,
    };
    let unit = expression.product(false)?;
    match expression.rest.chars().next() {
        None => Ok(unit),
        Some(c) => Err(format!(
            "`{c}` has no meaning in the unit `{}`",
            text.trim()
        )),
    }
}

struct UnitExpression<'t> {
    rest: &'t str,
    factors: usize,
}

impl UnitExpression<'_> {
    /// factor (join factor | / factor)*, up to the end or a closing bracket.
    fn product(&mut self, bracketed: bool) -> Result<Unit, String> {
        let mut product = Unit::ONE;
        let mut divided = false;
        let mut first = true;
        loop {
            let joined = self.join();
            if self.rest.is_empty() || (bracketed && self.rest.starts_with(')')) {
                return match joined {
                    Some(sign) => Err(format!("a unit is missing after `{sign}`")),
                    None if first => Err("a unit is missing".to_owned()),
                    None => Ok(product),
                };
            }
            let divide = joined == Some('/');
            if first && joined.is_some() && !divide {
                return Err("a unit is missing before the product".to_owned());
            }
            if divided && !divide {
                return Err(
                    "a product after `/` can be read in two ways; use brackets, `N/(m s)`, or one more `/`"
                        .to_owned(),
                );
            }
            let factor = self.factor()?;
            let factor = if divide { factor.inverse() } else { factor };
            product = product.times(factor).ok_or_else(too_involved)?;
            divided |= divide;
            first = false;
        }
    }

    /// Skips spaces and at most one sign; returns the sign.
    fn join(&mut self) -> Option<char> {
        self.rest = self.rest.trim_start();
        let sign = self.rest.chars().next();
        let sign = sign.filter(|c| matches!(c, '*' | '.' | '·' | '⋅' | '/'))?;
        self.rest = self.rest[sign.len_utf8()..].trim_start();
        Some(sign)
    }

    fn factor(&mut self) -> Result<Unit, String> {
        self.factors += 1;
        if self.factors > MAX_FACTORS {
            return Err(too_involved());
        }
        let unit = if let Some(rest) = self.rest.strip_prefix('(') {
            self.rest = rest;
            let unit = self.product(true)?;
            let closed = self.rest.strip_prefix(')');
            self.rest = closed.ok_or("a bracket is not closed in the unit")?;
            unit
        } else {
            self.symbol()?
        };
        unit.power(self.exponent()?).ok_or_else(too_involved)
    }

    fn symbol(&mut self) -> Result<Unit, String> {
        let is_part = |c: char| c.is_alphabetic() || c == '°' || c == '%' || c == '_';
        let end = self.rest.find(|c| !is_part(c)).unwrap_or(self.rest.len());
        let end = match end {
            0 => self
                .rest
                .find(|c: char| !c.is_ascii_digit())
                .unwrap_or(self.rest.len()),
            end => end,
        };
        let (symbol, rest) = self.rest.split_at(end);
        self.rest = rest;
        if symbol.is_empty() {
            let c = rest.chars().next().unwrap_or(' ');
            return Err(format!("`{c}` has no meaning in a unit"));
        }
        match UNITS.iter().find(|(known, _)| *known == symbol) {
            Some((_, unit)) => Ok(*unit),
            None => Err(unknown(symbol)),
        }
    }

    /// A power in raised digits, such as `⁻¹`.
    fn superscript(&mut self) -> Option<Result<i16, String>> {
        let digits = |text: &str| -> String {
            let raised = text.chars().map_while(|c| match c {
                '⁻' => Some('-'),
                '⁺' => Some('+'),
                _ => SUPERSCRIPTS
                    .iter()
                    .position(|s| *s == c)
                    .map(|d| char::from(b'0' + d as u8)),
            });
            raised.collect()
        };
        let number = digits(self.rest);
        let end = self.rest.char_indices().nth(number.len());
        self.rest = &self.rest[end.map_or(self.rest.len(), |(at, _)| at)..];
        (!number.is_empty()).then(|| power_of(&number))
    }

    /// An exponent in halves: `^2`, `^1.5`, `^(3/2)`, `²`.
    fn exponent(&mut self) -> Result<i16, String> {
        if let Some(power) = self.superscript() {
            return power;
        }
        let Some(rest) = self.rest.trim_start().strip_prefix('^') else {
            return match self.rest.chars().next() {
                Some(c) if c.is_ascii_digit() => Err(format!(
                    "a power is written with `^`, such as `m^2`; found `{c}`"
                )),
                _ => Ok(2),
            };
        };
        let rest = rest.trim_start();
        let (number, rest) = match rest.strip_prefix('(') {
            Some(inner) => {
                let closed = inner.split_once(')');
                closed.ok_or("a bracket is not closed in the unit")?
            }
            None => {
                let sign = usize::from(rest.starts_with(['-', '+']));
                let digits = |from: usize| {
                    let digits = rest[from..].bytes().take_while(u8::is_ascii_digit);
                    digits.count()
                };
                let whole = sign + digits(sign);
                // A point that no digit follows joins the next factor: m^2.kg
                let fraction = match rest[whole..].strip_prefix('.') {
                    Some(_) if digits(whole + 1) > 0 => 1 + digits(whole + 1),
                    _ => 0,
                };
                rest.split_at(whole + fraction)
            }
        };
        self.rest = rest;
        power_of(number)
    }
}

/// A power as written, in halves.
fn power_of(number: &str) -> Result<i16, String> {
    let (above, below) = number.split_once('/').unwrap_or((number, "1"));
    let part = |text: &str| text.trim().parse::<f64>().ok();
    let halves = match (part(above), part(below)) {
        (Some(above), Some(below)) if below != 0.0 => 2.0 * above / below,
        _ => f64::NAN,
    };
    if halves.abs() > f64::from(2 * MAX_POWER) {
        Err(too_involved())
    } else if halves.fract() == 0.0 {
        Ok(halves as i16)
    } else {
        Err("wanted a whole number or a half as a power, such as `m^2` or `m^1.5`".to_owned())
    }
}

fn unknown(symbol: &str) -> String {
    let shown: String = symbol.chars().take(30).collect();
    let word = WORDS
        .iter()
        .find(|(word, _)| symbol.to_lowercase() == *word);
    if let (None, Some((first, second))) = (word, joined(symbol)) {
        return format!(
            "unknown unit `{shown}`; write `{first} {second}`, with a space between the factors"
        );
    }
    let help = match word
        .map(|(_, unit)| *unit)
        .or_else(|| nearest(symbol, symbols()))
    {
        Some(near) => format!("did you mean `{near}`?"),
        None if symbol == "%" => "write a pure number, 5 % as 0.05".to_owned(),
        None => "known are m, mm, um, in, rad, deg, s, ms, kg, g, N, kN, Nm, lbf, Hz, rpm and more"
            .to_owned(),
    };
    format!("unknown unit `{shown}`; {help}")
}

/// The two units that were written without a space, such as `kgm`.
fn joined(symbol: &str) -> Option<(&str, &str)> {
    let cuts = symbol
        .char_indices()
        .skip(1)
        .map(|(at, _)| symbol.split_at(at));
    let is_unit = |text: &str| symbols().any(|known| known == text);
    cuts.filter(|(a, b)| is_unit(a) && is_unit(b)).last()
}

fn too_involved() -> String {
    "the unit has too many or too high powers".to_owned()
}
