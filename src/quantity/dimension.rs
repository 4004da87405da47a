//! What a quantity measures.

/// Exponents of kilogram, metre, second and radian, counted in halves, so that laws with roots have a dimension too.
///
/// The radian counts as a unit of its own: N m and N m/rad, 1/s and rad/s are different.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash)]
pub struct UnitDimension {
    /// Half powers of the kilogram.
    pub mass: i16,
    /// Half powers of the metre.
    pub length: i16,
    /// Half powers of the second.
    pub time: i16,
    /// Half powers of the radian.
    pub angle: i16,
}

impl UnitDimension {
    /// A pure number.
    pub const NUMBER: Self = Self::new(0, 0, 0, 0);
    /// m
    pub const LENGTH: Self = Self::new(0, 1, 0, 0);
    /// rad
    pub const ANGLE: Self = Self::new(0, 0, 0, 1);
    /// kg
    pub const MASS: Self = Self::new(1, 0, 0, 0);
    /// kg m^2
    pub const INERTIA: Self = Self::new(1, 2, 0, 0);
    /// s
    pub const TIME: Self = Self::new(0, 0, 1, 0);
    /// rad/s: angular frequency and angular velocity
    pub const FREQUENCY: Self = Self::new(0, 0, -1, 1);
    /// m/s
    pub const VELOCITY: Self = Self::new(0, 1, -1, 0);
    /// N
    pub const FORCE: Self = Self::new(1, 1, -2, 0);
    /// N m
    pub const MOMENT: Self = Self::new(1, 2, -2, 0);
    /// N/m
    pub const STIFFNESS: Self = Self::new(1, 0, -2, 0);
    /// N m/rad
    pub const TORSIONAL_STIFFNESS: Self = Self::new(1, 2, -2, -1);
    /// N s/m
    pub const DAMPING: Self = Self::new(1, 0, -1, 0);
    /// N m s/rad
    pub const TORSIONAL_DAMPING: Self = Self::new(1, 2, -1, -1);

    /// Dimension with whole exponents.
    pub const fn new(mass: i16, length: i16, time: i16, angle: i16) -> Self {
        Self {
            mass: 2 * mass,
            length: 2 * length,
            time: 2 * time,
            angle: 2 * angle,
        }
    }

    /// Dimension of a parameter of a law: exponents in halves of displacement, time and force, where a displacement is a
    /// length or an angle as given, and a force then N or N m.
    pub fn of_law(displacement: i8, time: i8, force: i8, deformation: Self) -> Self {
        let load = if deformation == Self::ANGLE {
            Self::MOMENT
        } else {
            Self::FORCE
        };
        let half = |d: Self, n: i8| d.map(|exponent| exponent / 2 * i16::from(n));
        half(deformation, displacement)
            .times(half(Self::TIME, time))
            .times(half(load, force))
    }

    /// Dimension of a product.
    #[must_use]
    pub fn times(self, other: Self) -> Self {
        Self {
            mass: self.mass.saturating_add(other.mass),
            length: self.length.saturating_add(other.length),
            time: self.time.saturating_add(other.time),
            angle: self.angle.saturating_add(other.angle),
        }
    }

    /// Dimension of a power.
    #[must_use]
    pub fn power(self, exponent: i16) -> Self {
        self.map(|own| own.saturating_mul(exponent))
    }

    /// Dimension of the square root; `None` where an exponent would be a quarter.
    #[must_use]
    pub fn square_root(self) -> Option<Self> {
        let is_even = [self.mass, self.length, self.time, self.angle]
            .iter()
            .all(|halves| halves % 2 == 0);
        is_even.then(|| self.map(|own| own / 2))
    }

    fn map(self, f: impl Fn(i16) -> i16) -> Self {
        Self {
            mass: f(self.mass),
            length: f(self.length),
            time: f(self.time),
            angle: f(self.angle),
        }
    }

    /// Whether a quantity of this dimension is taken where another is wanted: they agree, or the radian was left out
    /// (`1e4 N m` for a stiffness in N m/rad, `0.01 m/m` for an angle) or is given where a pure number is wanted.
    ///
    /// Not for angular frequencies: `25 1/s` could mean 25 rad/s or 25 Hz. A radian too many in any other place is refused:
    /// N m/rad where N m is wanted is a stiffness in the place of a moment.
    pub fn fits(self, wanted: Self) -> bool {
        let left_out = Self { angle: 0, ..wanted } == self && wanted != Self::FREQUENCY;
        self == wanted || left_out || (wanted == Self::NUMBER && self == Self::ANGLE)
    }

    /// In words with the SI unit, such as `a force [N]`.
    pub fn describe(self) -> String {
        match NAMED.iter().find(|named| named.0 == self) {
            Some((_, words, _)) => (*words).to_owned(),
            None => format!("a quantity in {}", self.unit()),
        }
    }

    /// A quantity of this dimension as a user may write it.
    pub fn example(self) -> Option<&'static str> {
        let named = NAMED.iter().find(|named| named.0 == self);
        named.map(|(_, _, example)| *example)
    }

    /// SI unit, such as `N m` or, where no customary name is known, `kg m/s^3`; `1` for a pure number.
    pub fn unit(self) -> String {
        let named = NAMED.iter().find(|named| named.0 == self);
        let bracketed = named.and_then(|(_, words, _)| words.split_once('[')?.1.strip_suffix(']'));
        if let Some(unit) = bracketed {
            return unit.to_owned();
        }
        let bases = [
            (self.mass, "kg"),
            (self.length, "m"),
            (self.time, "s"),
            (self.angle, "rad"),
        ];
        let power = |symbol: &str, halves: i16| match halves {
            2 => symbol.to_owned(),
            h if h % 2 == 0 => format!("{symbol}^{}", h / 2),
            h => format!("{symbol}^({h}/2)"),
        };
        let above = bases.iter().filter(|(halves, _)| *halves > 0);
        let above: Vec<String> = above.map(|(halves, s)| power(s, *halves)).collect();
        let mut text = if above.is_empty() {
            "1".to_owned()
        } else {
            above.join(" ")
        };
        for (halves, symbol) in bases.iter().filter(|(halves, _)| *halves < 0) {
            text.push('/');
            text.push_str(&power(symbol, -halves));
        }
        text
    }
}

/// N/m^1.5 and N m/rad^1.5: Hertz's law of a point contact.
const CONTACT: UnitDimension = UnitDimension {
    mass: 2,
    length: -1,
    time: -4,
    angle: 0,
};
const TORSIONAL_CONTACT: UnitDimension = UnitDimension {
    mass: 2,
    length: 4,
    time: -4,
    angle: -3,
};

/// Dimensions with a name, and an example of each.
const NAMED: [(UnitDimension, &str, &str); 21] = [
    (CONTACT, "a contact coefficient [N/m^1.5]", "1e10 N/m^1.5"),
    (
        TORSIONAL_CONTACT,
        "a contact coefficient [N m/rad^1.5]",
        "1e6 N m/rad^1.5",
    ),
    (UnitDimension::NUMBER, "a pure number", "0.5"),
    (UnitDimension::LENGTH, "a length [m]", "50 um"),
    (UnitDimension::ANGLE, "an angle [rad]", "0.5 deg"),
    (UnitDimension::MASS, "a mass [kg]", "2 kg"),
    (
        UnitDimension::INERTIA,
        "a moment of inertia [kg m^2]",
        "1e-3 kg m^2",
    ),
    (UnitDimension::TIME, "a time [s]", "3 ms"),
    (
        UnitDimension::FREQUENCY,
        "an angular frequency [rad/s]",
        "25 Hz",
    ),
    (UnitDimension::new(0, 0, -1, 0), "a rate [1/s]", "25 1/s"),
    (UnitDimension::VELOCITY, "a velocity [m/s]", "20 mm/s"),
    (UnitDimension::FORCE, "a force [N]", "100 N"),
    (UnitDimension::MOMENT, "a moment [N m]", "100 N m"),
    (UnitDimension::STIFFNESS, "a stiffness [N/m]", "2.4e8 N/m"),
    (
        UnitDimension::TORSIONAL_STIFFNESS,
        "a torsional stiffness [N m/rad]",
        "1e4 N m/rad",
    ),
    (UnitDimension::DAMPING, "a damping [N s/m]", "2 N s/m"),
    (
        UnitDimension::TORSIONAL_DAMPING,
        "a torsional damping [N m s/rad]",
        "0.2 N m s/rad",
    ),
    (
        UnitDimension::new(0, -1, 1, 0),
        "an impact damping [s/m]",
        "0.5 s/m",
    ),
    (
        UnitDimension::new(0, 0, 1, -1),
        "an impact damping [s/rad]",
        "0.5 s/rad",
    ),
    (
        UnitDimension::new(0, -2, 0, 0),
        "a cubic coefficient [1/m^2]",
        "1e8 1/m^2",
    ),
    (
        UnitDimension::new(0, 0, 0, -2),
        "a cubic coefficient [1/rad^2]",
        "100 1/rad^2",
    ),
];
