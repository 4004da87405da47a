//! The characteristic polynomial of the multipliers on the unit circle.

use num_complex::Complex;

/// Multipliers at one place of a smooth stretch of the path.
#[derive(Debug, Clone, Copy)]
pub struct MultiplierSample<'a> {
    /// Abscissa in which P varies smoothly.
    pub x: f64,
    /// All multipliers, by falling modulus.
    pub list: &'a [Complex<f64>],
}

impl<'a> MultiplierSample<'a> {
    /// A place with its multipliers, by falling modulus.
    pub fn new(x: f64, list: &'a [Complex<f64>]) -> MultiplierSample<'a> {
        MultiplierSample { x, list }
    }
}

/// P at one place, on the unit circle, up to a power of z that is common to all places.
///
/// Two multipliers a and b, conjugate or both real, share a factor with real numbers, z = e^(i angle):
///
/// ```text
/// (z - a) (z - b) / z = (1 + a b) cos(angle) - (a + b) + i (1 - a b) sin(angle)
/// ```
#[derive(Debug, Default)]
pub(crate) struct CharacteristicPolynomial {
    /// Abscissa of the place.
    pub x: f64,
    /// 1 + a b, a + b, 1 - a b.
    pairs: Vec<[f64; 3]>,
    /// The real multiplier that is left when their number is odd.
    single: Option<f64>,
    /// What P is divided by.
    pub scale: f64,
}

impl CharacteristicPolynomial {
    /// Number of zeros.
    pub fn degree(&self) -> usize {
        2 * self.pairs.len() + usize::from(self.single.is_some())
    }

    /// Takes the multipliers of a place, of which the first `outside` scale P. False if they are no zeros of a real polynomial, or
    /// if P overflows.
    pub fn set(&mut self, place: &MultiplierSample<'_>, outside: usize) -> bool {
        self.x = place.x;
        self.single = None;
        self.pairs.clear();
        let mut balance = 0;
        for mu in place.list {
            let (sum, product) = match mu.im {
                im if im > 0.0 => (2.0 * mu.re, mu.norm_sqr()),
                im if im < 0.0 => {
                    balance -= 1;
                    continue;
                }
                _ => match self.single.take() {
                    Some(other) => (other + mu.re, other * mu.re),
                    None => {
                        self.single = Some(mu.re);
                        continue;
                    }
                },
            };
            balance += i32::from(mu.im > 0.0);
            self.pairs.push([1.0 + product, sum, 1.0 - product]);
        }
        self.scale = place.list[..outside].iter().map(|mu| mu.norm()).product();
        balance == 0 && self.scale.is_finite()
    }

    /// P at z = e^(i angle).
    pub fn at(&self, z: Complex<f64>) -> Complex<f64> {
        let mut value = Complex::new(1.0 / self.scale, 0.0);
        for [cosine, sum, sine] in &self.pairs {
            value *= Complex::new(cosine * z.re - sum, sine * z.im);
        }
        match self.single {
            Some(mu) => value * (z - mu),
            None => value,
        }
    }
}
