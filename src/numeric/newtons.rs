//! Newton's method inside brackets for several functions at once.

use super::roots::MOST_NEWTON;
use pulp::Simd;

/// [`BracketedNewton`](super::roots::BracketedNewton) of several functions at once, to the bit.
#[derive(Debug, Clone)]
pub(crate) struct Newtons<const L: usize> {
    /// Where each function is wanted next; in the end its root.
    pub x: [f64; L],
    /// 1 where a root is sought, else 0.
    sought: [f64; L],
    negative: [f64; L],
    positive: [f64; L],
    width: [f64; L],
    before: [f64; L],
    left: u32,
}

impl<const L: usize> Default for Newtons<L> {
    #[inline(always)]
    fn default() -> Self {
        Newtons {
            x: [0.0; L],
            sought: [0.0; L],
            negative: [0.0; L],
            positive: [1.0; L],
            width: [1.0; L],
            before: [f64::NAN; L],
            left: MOST_NEWTON,
        }
    }
}

impl<const L: usize> Newtons<L> {
    /// Seeks the root of a function that rises from below 0 at 0, on [0, 1], from a guess.
    #[inline(always)]
    pub(crate) fn seek(&mut self, l: usize, guess: f64) {
        (self.x[l], self.sought[l]) = (guess, 1.0);
    }

    /// Whether nothing is left to be found.
    #[inline(always)]
    pub(crate) fn is_over(&self) -> bool {
        self.sought == [0.0; L]
    }

    /// Takes values and derivatives at x.
    #[inline(always)]
    pub(crate) fn step<S: Simd>(&mut self, simd: S, (value, slope): (&[f64; L], &[f64; L])) {
        self.left -= 1;
        let number = |x: f64| simd.splat_f64s(x);
        let less = |a: S::f64s, b: S::f64s| simd.less_than_f64s(a, b);
        let at_most = |a: S::f64s, b: S::f64s| simd.less_than_or_equal_f64s(a, b);
        let mul = |a: S::f64s, b: S::f64s| simd.mul_f64s(a, b);
        for part in 0..L / S::F64_LANES {
            let of = |each: &[f64; L]| S::as_simd_f64s(each).0[part];
            let (x, value, zero, one) = (of(&self.x), of(value), number(0.0), number(1.0));
            let (before, is_below) = (of(&self.before), less(value, zero));
            let negative = simd.select_f64s(is_below, x, of(&self.negative));
            let positive = simd.select_f64s(is_below, of(&self.positive), x);
            let newton = simd.sub_f64s(x, simd.div_f64s(value, of(slope)));
            let is_ordered = less(negative, positive);
            let low = simd.select_f64s(is_ordered, negative, positive);
            let high = simd.select_f64s(is_ordered, positive, negative);
            let length = simd.abs_f64s(simd.sub_f64s(newton, x));
            let is_inside = simd.and_m64s(less(low, newton), less(newton, high));
            let is_short = at_most(length, mul(number(0.5), of(&self.width)));
            let converges = simd.and_m64s(is_inside, is_short);
            let middle = mul(number(0.5), simd.add_f64s(low, high));
            let next = simd.select_f64s(converges, newton, middle);
            let width = simd.abs_f64s(simd.sub_f64s(next, x));
            let size = simd.abs_f64s(x);
            let size = simd.select_f64s(less(size, one), one, size);
            let resolution = mul(number(2.0 * f64::EPSILON), size);
            let limit = mul(mul(mul(number(0.25), resolution), before), before);
            let is_last = simd.and_m64s(
                less(length, mul(number(1e-4), before)),
                at_most(mul(mul(length, length), length), limit),
            );
            let is_root = simd.equal_f64s(value, zero);
            let is_over = simd.or_m64s(
                at_most(width, resolution),
                simd.and_m64s(converges, is_last),
            );
            let is_over = simd.or_m64s(is_over, is_root);
            let next = simd.select_f64s(is_root, x, next);
            let sought = of(&self.sought);
            let next = simd.select_f64s(less(zero, sought), next, x);
            let before = simd.select_f64s(converges, length, number(f64::NAN));
            let sought = match self.left {
                0 => zero,
                _ => simd.select_f64s(is_over, zero, sought),
            };
            S::as_mut_simd_f64s(&mut self.x).0[part] = next;
            S::as_mut_simd_f64s(&mut self.negative).0[part] = negative;
            S::as_mut_simd_f64s(&mut self.positive).0[part] = positive;
            S::as_mut_simd_f64s(&mut self.width).0[part] = width;
            S::as_mut_simd_f64s(&mut self.before).0[part] = before;
            S::as_mut_simd_f64s(&mut self.sought).0[part] = sought;
        }
    }
}
