//! What the first coefficients of polynomials say about their passages of a level on [0, 1], for several polynomials at a time.
//!
//! Most polynomials stay on their side of a level, or rise, or are convex or concave throughout. Twelve Bernstein coefficients with
//! bounds on the other terms prove that, and then the values at both ends decide. Only the rest is left to `first_passage`.

use super::bernstein::{Direction, binomial, evaluate, first_passage, reciprocal};
use super::roots::newton_from;
use pulp::Simd;

/// Coefficients in Bernstein form.
const HEAD: usize = 12;

/// SHARE[k][j] = C(j, k) / C(HEAD - 1, k).
static SHARE: [[f64; HEAD]; HEAD] = {
    let (binomial, reciprocal) = (binomial(), reciprocal());
    let mut table = [[0.0; HEAD]; HEAD];
    let mut k = 0;
    while k < HEAD {
        let mut j = k;
        while j < HEAD {
            table[k][j] = binomial[k][j] * reciprocal[HEAD - 1][k];
            j += 1;
        }
        k += 1;
    }
    table
};

/// Bernstein coefficients of the first terms of L polynomials, and bounds on the other terms.
#[derive(Debug, Clone, Copy)]
pub(crate) struct Outline<const L: usize> {
    head: [[f64; L]; HEAD],
    /// Values at 1.
    end: [f64; L],
    /// Bounds on the other terms; on their first derivative over HEAD - 1; on their second one over (HEAD - 1)(HEAD - 2).
    rest: [[f64; L]; 3],
}

/// A level, the way in which it is passed, and how far beyond it a polynomial has to go.
#[derive(Debug, Clone, Copy)]
pub(crate) struct Gate {
    /// The level.
    pub level: f64,
    /// Way.
    pub direction: Direction,
    /// Distance beyond the level; less is no passage.
    pub tolerance: f64,
}

impl Gate {
    /// Whether values up to an extreme one leave it alone; an infinite level is far.
    #[inline(always)]
    pub(crate) fn is_out_of_reach(&self, extreme: f64) -> bool {
        self.direction.sign() * (extreme - self.level) < self.tolerance
    }
}

impl<const L: usize> Outline<L> {
    /// Of polynomials: `coefficients[k][l]` belongs to x^k in the one with number l.
    #[inline(always)]
    pub fn new<const N: usize>(coefficients: &[[f64; L]; N]) -> Outline<L> {
        let mut head = [coefficients[0]; HEAD];
        for k in 1..HEAD {
            // Of one polynomial, zeros below the diagonal keep the length of the loop fixed.
            let first = if L == 1 { 0 } else { k };
            for j in first..HEAD {
                let share = SHARE[k][j];
                for l in 0..L {
                    head[j][l] += share * coefficients[k][l];
                }
            }
        }
        let (mut end, mut rest) = (head[HEAD - 1], [[0.0; L]; 3]);
        let n = (HEAD - 1) as f64;
        for (k, c) in coefficients.iter().enumerate().skip(HEAD) {
            let order = k as f64;
            let (first, second) = (order / n, order * (order - 1.0) / (n * (n - 1.0)));
            for l in 0..L {
                let size = c[l].abs();
                end[l] += c[l];
                rest[0][l] += size;
                rest[1][l] += first * size;
                rest[2][l] += second * size;
            }
        }
        Outline { head, end, rest }
    }

    /// Lowest and highest values that the polynomials can have.
    #[inline(always)]
    pub(crate) fn hull(&self) -> ([f64; L], [f64; L]) {
        let (mut low, mut high) = (self.head[0], self.head[0]);
        for b in &self.head[1..] {
            for l in 0..L {
                low[l] = if b[l] < low[l] { b[l] } else { low[l] };
                high[l] = if b[l] > high[l] { b[l] } else { high[l] };
            }
        }
        for l in 0..L {
            (low[l], high[l]) = (low[l] - self.rest[0][l], high[l] + self.rest[0][l]);
        }
        (low, high)
    }

    /// `first_passage` of polynomial l, decided by the outline where that is possible; its coefficients are made where they are needed.
    pub fn passage<const N: usize>(
        &self,
        l: usize,
        gate: Gate,
        coefficients: impl FnOnce() -> [f64; N],
    ) -> Option<f64> {
        self.look(l, gate).resolve(gate, coefficients)
    }

    /// Whether polynomial l passes a gate.
    ///
    /// Where the polynomial rises, is convex or is concave throughout, what is at the ends decides.
    #[inline(always)]
    pub fn look(&self, l: usize, gate: Gate) -> Outlook {
        let sign = gate.direction.sign();
        let mut f: [f64; HEAD] = std::array::from_fn(|j| sign * (self.head[j][l] - gate.level));
        // What starts beyond the level does so by rounding.
        let over = if f[0] > 0.0 { f[0] } else { 0.0 };
        f.iter_mut().for_each(|f| *f -= over);
        let [rest, slopes, bends] = self.rest.map(|r| r[l]);
        let mut stays = true;
        for j in 1..HEAD {
            stays &= (f[j] - f[0]) * SPREAD[j] + rest <= 0.0;
        }
        if stays {
            return Outlook::Never;
        }
        let rise: [f64; HEAD - 1] = std::array::from_fn(|j| f[j + 1] - f[j]);
        let (mut rises, mut is_convex, mut is_concave) = (true, true, true);
        for rise in &rise {
            rises &= *rise > slopes;
        }
        for j in 1..HEAD - 1 {
            let bend = rise[j] - rise[j - 1];
            is_convex &= bend > bends;
            is_concave &= bend < -bends;
        }
        let end = sign * (self.end[l] - gate.level) - over;
        let passes = end > gate.tolerance;
        match (rises || is_convex, is_concave) {
            (true, _) if !passes => return Outlook::Never,
            (true, _) => {}
            (false, true) if passes => {}
            _ => return Outlook::Unclear,
        }
        let beyond = |j: &usize| f[*j] > gate.tolerance;
        let at = (1..HEAD).find(beyond).unwrap_or(HEAD - 1);
        let (below, above) = (f[at - 1] - gate.tolerance, f[at] - gate.tolerance);
        let guess = (at as f64 - above / (above - below)) / (HEAD - 1) as f64;
        Outlook::Once {
            guess: guess.clamp(0.0, 1.0),
            start: f[0],
        }
    }
}

/// What outlines say about passages, for as many polynomials as registers hold.
#[derive(Debug, Clone, Copy)]
pub(crate) struct PassageSurvey<const L: usize> {
    /// 0: there is none; 1: there is exactly one; 2: the polynomial has to be looked at as a whole.
    kind: [f64; L],
    guess: [f64; L],
    start: [f64; L],
}

impl<const L: usize> PassageSurvey<L> {
    /// Of polynomial l.
    #[inline(always)]
    pub(crate) fn look(&self, l: usize) -> Outlook {
        match self.kind[l] {
            0.0 => Outlook::Never,
            1.0 => Outlook::Once {
                guess: self.guess[l],
                start: self.start[l],
            },
            _ => Outlook::Unclear,
        }
    }
}

impl<const L: usize> Outline<L> {
    /// [`Outline::look`] of all polynomials at once, with gates in one direction, to the bit.
    #[inline(always)]
    pub(crate) fn survey<S: Simd>(
        &self,
        simd: S,
        direction: Direction,
        (level, tolerance): (&[f64; L], &[f64; L]),
    ) -> PassageSurvey<L> {
        let mut survey = PassageSurvey {
            kind: [0.0; L],
            guess: [0.0; L],
            start: [0.0; L],
        };
        let (level, tolerance) = (S::as_simd_f64s(level).0, S::as_simd_f64s(tolerance).0);
        for part in 0..level.len() {
            self.survey_part(
                simd,
                part,
                direction,
                (level[part], tolerance[part]),
                &mut survey,
            );
        }
        survey
    }

    #[inline(always)]
    fn survey_part<S: Simd>(
        &self,
        simd: S,
        part: usize,
        direction: Direction,
        (level, tolerance): (S::f64s, S::f64s),
        out: &mut PassageSurvey<L>,
    ) {
        let number = |x: f64| simd.splat_f64s(x);
        let of = |each: &[f64; L]| S::as_simd_f64s(each).0[part];
        let (zero, sign) = (number(0.0), number(direction.sign()));
        let mut f = [zero; HEAD];
        f[0] = simd.mul_f64s(sign, simd.sub_f64s(of(&self.head[0]), level));
        // What starts beyond the level does so by rounding.
        let over = simd.select_f64s(simd.greater_than_f64s(f[0], zero), f[0], zero);
        f[0] = simd.sub_f64s(f[0], over);
        let [rest, slopes, bends] = [of(&self.rest[0]), of(&self.rest[1]), of(&self.rest[2])];
        let mut stays = simd.less_than_or_equal_f64s(zero, zero);
        for j in 1..HEAD {
            let height = simd.mul_f64s(sign, simd.sub_f64s(of(&self.head[j]), level));
            f[j] = simd.sub_f64s(height, over);
            let rise = simd.mul_f64s(simd.sub_f64s(f[j], f[0]), number(SPREAD[j]));
            let highest = simd.add_f64s(rise, rest);
            stays = simd.and_m64s(stays, simd.less_than_or_equal_f64s(highest, zero));
        }
        let always = simd.less_than_or_equal_f64s(zero, zero);
        let (mut rises, mut is_convex, mut is_concave) = (always, always, always);
        let mut before = simd.sub_f64s(f[1], f[0]);
        rises = simd.and_m64s(rises, simd.greater_than_f64s(before, slopes));
        let fallen = simd.neg_f64s(bends);
        for j in 1..HEAD - 1 {
            let rise = simd.sub_f64s(f[j + 1], f[j]);
            let bend = simd.sub_f64s(rise, before);
            rises = simd.and_m64s(rises, simd.greater_than_f64s(rise, slopes));
            is_convex = simd.and_m64s(is_convex, simd.greater_than_f64s(bend, bends));
            is_concave = simd.and_m64s(is_concave, simd.less_than_f64s(bend, fallen));
            before = rise;
        }
        let end = simd.mul_f64s(sign, simd.sub_f64s(of(&self.end), level));
        let passes = simd.greater_than_f64s(simd.sub_f64s(end, over), tolerance);
        // The first coefficient beyond the level, and the one before it.
        let last = HEAD - 1;
        let (mut at, mut above, mut below) = (number(last as f64), f[last], f[last - 1]);
        for j in (1..last).rev() {
            let is_beyond = simd.greater_than_f64s(f[j], tolerance);
            at = simd.select_f64s(is_beyond, number(j as f64), at);
            above = simd.select_f64s(is_beyond, f[j], above);
            below = simd.select_f64s(is_beyond, f[j - 1], below);
        }
        let (above, below) = (
            simd.sub_f64s(above, tolerance),
            simd.sub_f64s(below, tolerance),
        );
        let share = simd.div_f64s(above, simd.sub_f64s(above, below));
        let guess = simd.div_f64s(simd.sub_f64s(at, share), number(last as f64));
        let guess = simd.select_f64s(simd.less_than_f64s(guess, zero), zero, guess);
        let one = number(1.0);
        let guess = simd.select_f64s(simd.greater_than_f64s(guess, one), one, guess);
        // Once: it passes, and rises, is convex or is concave. Never: it stays, or rises or is convex and does not pass.
        let is_plain = simd.or_m64s(rises, is_convex);
        let once = simd.and_m64s(passes, simd.or_m64s(is_plain, is_concave));
        let kind = simd.select_f64s(once, one, number(2.0));
        let below = simd.select_f64s(passes, kind, zero);
        let kind = simd.select_f64s(is_plain, below, kind);
        let kind = simd.select_f64s(stays, zero, kind);
        S::as_mut_simd_f64s(&mut out.kind).0[part] = kind;
        S::as_mut_simd_f64s(&mut out.guess).0[part] = guess;
        S::as_mut_simd_f64s(&mut out.start).0[part] = f[0];
    }
}

/// What an outline says about a passage.
#[derive(Debug, Clone, Copy)]
pub(crate) enum Outlook {
    /// There is none.
    Never,
    /// There is exactly one.
    Once {
        /// About where.
        guess: f64,
        /// Distance beyond the level, in the direction of the gate, with which the polynomial starts; at most 0.
        start: f64,
    },
    /// The polynomial has to be looked at as a whole.
    Unclear,
}

impl Outlook {
    /// The abscissa of the passage, from the coefficients of the polynomial.
    pub fn resolve<const N: usize>(
        self,
        gate: Gate,
        coefficients: impl FnOnce() -> [f64; N],
    ) -> Option<f64> {
        match self {
            Outlook::Never => None,
            Outlook::Once { guess, start } => {
                let sign = gate.direction.sign();
                let mut beyond = coefficients().map(|c| sign * c);
                beyond[0] = start;
                let value = |x: f64| evaluate(&beyond, x);
                Some(newton_from(value, guess, (0.0, -1.0), 1.0))
            }
            Outlook::Unclear => {
                let (level, direction) = (gate.level, gate.direction);
                first_passage(&coefficients(), level, direction, gate.tolerance)
            }
        }
    }
}

/// (HEAD - 1) / j.
const SPREAD: [f64; HEAD] = {
    let mut list = [0.0; HEAD];
    let mut j = 1;
    while j < HEAD {
        list[j] = (HEAD - 1) as f64 / j as f64;
        j += 1;
    }
    list
};

#[cfg(test)]
mod tests {
    use super::*;
    use rand::{RngExt, SeedableRng};
    use rand_chacha::ChaCha8Rng;

    const LANES: usize = 8;

    /// Looks at several polynomials at once are those at one of them; half of the batch is passed in each direction.
    fn agree(batch: &[([f64; 24], f64, Outlook); LANES]) {
        struct All<'a>(&'a [([f64; 24], f64, Outlook); LANES], Direction);
        impl pulp::WithSimd for All<'_> {
            type Output = PassageSurvey<LANES>;

            fn with_simd<S: Simd>(self, simd: S) -> PassageSurvey<LANES> {
                let coefficients: [[f64; LANES]; 24] =
                    std::array::from_fn(|k| self.0.map(|(c, ..)| c[k]));
                let level = self.0.map(|(_, level, _)| level);
                Outline::new(&coefficients).survey(simd, self.1, (&level, &[1e-13; LANES]))
            }
        }
        for (parity, direction) in [Direction::Up, Direction::Down].into_iter().enumerate() {
            let survey = pulp::Arch::new().dispatch(All(batch, direction));
            for l in (0..LANES).filter(|l| l % 2 == parity) {
                let (one, wanted) = (survey.look(l), batch[l].2);
                assert_eq!(format!("{one:?}"), format!("{wanted:?}"));
            }
        }
    }

    /// Motions as steps have them: terms that fall like those of an exponential, and starts on the level and away from it.
    #[test]
    fn passages_are_those_of_the_whole_polynomial() {
        let mut random = ChaCha8Rng::seed_from_u64(7);
        let mut draw = || random.random_range(-1.0..1.0);
        let mut decided = [0; 3];
        let mut batch = [([0.0; 24], 0.0, Outlook::Never); LANES];
        for case in 0..20_000 {
            let theta: f64 = 3.0 + 2.9 * draw();
            let mut power = 1.0;
            let mut c = [0.0; 24];
            for (k, c) in c.iter_mut().enumerate() {
                *c = draw() * power;
                power *= theta / (k + 1) as f64;
            }
            let direction = [Direction::Up, Direction::Down][case % 2];
            let level = match case % 3 {
                0 => c[0],
                _ => c[0] + direction.sign() * draw().abs(),
            };
            let gate = Gate {
                level,
                direction,
                tolerance: 1e-13,
            };
            let outline = Outline::new(&c.map(|c| [c]));
            let (low, high) = outline.hull();
            let wanted = first_passage(&c, level, direction, 1e-13);
            let found = outline.passage(0, gate, || c);
            let apart = match (found, wanted) {
                (None, None) => 0.0,
                (Some(a), Some(b)) => evaluate(&c, a).0 - evaluate(&c, b).0,
                _ => f64::INFINITY,
            };
            assert!(
                apart.abs() < 1e-12,
                "{case}: {found:?}, not {wanted:?}: {c:?}"
            );
            batch[case % LANES] = (c, level, outline.look(0, gate));
            if case % LANES == LANES - 1 {
                agree(&batch);
            }
            decided[match outline.look(0, gate) {
                Outlook::Never => 0,
                Outlook::Once { .. } => 1,
                Outlook::Unclear => 2,
            }] += 1;
            // Sums of this many terms round relative to their sizes.
            let rounding = 1e-15 * c.iter().map(|c| c.abs()).sum::<f64>();
            for x in [0.0, 0.3, 0.7, 1.0] {
                let value = evaluate(&c, x).0;
                assert!(value >= low[0] - rounding && value <= high[0] + rounding);
            }
        }
        assert!(decided.iter().all(|n| *n > 1000), "{decided:?}");
    }
}
