//! The number of unstable multipliers, step by step against the events: neither may contradict the other.

use crate::solve::events::{BifurcationEvent, EventKind, Examined, Look, Probe, Verdict};

/// Points of a branch for which a passage of +1 waits for its fold or branch point, and the other way round: a truncated series
/// turns a little beside the place where the multiplier of the flow passes.
const PATIENCE: usize = 3;

/// Change of the parameter, relative to it, below which its direction may be that of the corrector's error.
const STANDS: f64 = 1e-7;

/// Something between two places of a step that no event explains.
#[derive(Debug, Clone, PartialEq)]
pub(super) struct Gap {
    /// What it must be: a period doubling where a continuous multiplier has passed -1, a fold where the parameter turns; else unresolved.
    pub kind: EventKind,
    /// Fractions of the step.
    pub fractions: (f64, f64),
    /// Parameters.
    lambdas: (f64, f64),
    /// Unstable multipliers that the events lead to, and those that are there; `None` for a fold.
    pub unstable: Option<(usize, usize)>,
}

impl Gap {
    /// The event of a step behind a point.
    pub(crate) fn as_event(&self, after_point: usize) -> BifurcationEvent {
        let (from, to) = self.lambdas;
        let change = self.unstable.map_or(1, |(a, b)| a.abs_diff(b));
        BifurcationEvent {
            kind: self.kind,
            lambda: 0.5 * (from + to),
            method_lambda: 0.5 * (from + to),
            verdict: Verdict::NotTried,
            bracket: (from.min(to), from.max(to)),
            multiplicity: change,
            unstable: self.unstable,
            after_point,
            fraction: 0.5 * (self.fractions.0 + self.fractions.1),
            point: None,
            breakpoint: None,
            doubt: 0.0,
            recorded: Vec::new(),
        }
    }
}

/// Changes between neighbouring points of a step that its events do not explain. Events whose own change was not known take
/// it over where it fits: one multiplier at a fold or branch point, any number where a force jumps at a grazing.
pub(super) fn unexplained(
    (a, b): (&Probe, &Probe),
    examined: &mut Examined,
    may_break: bool,
) -> Vec<Gap> {
    let Examined {
        events,
        marks,
        owed,
    } = examined;
    let looks: Vec<&Look> = [a]
        .into_iter()
        .chain(marks.iter())
        .chain([b])
        .map(|p| &p.look)
        .collect();
    let mut gaps = Vec::new();
    for (k, pair) in looks.windows(2).enumerate() {
        if k == 0 && a.point.orientation == 0 {
            // Where another branch is left a multiplier is 1: it counts on neither side.
            continue;
        }
        let (from, to) = (pair[0].fraction, pair[1].fraction);
        let is_last = k + 2 == looks.len();
        let is_here =
            |e: &BifurcationEvent| (e.fraction >= from || k == 0) && (e.fraction < to || is_last);
        let (Some(before), Some(behind)) = (pair[0].count(), pair[1].count()) else {
            continue;
        };
        let (before, behind) = (before.outside, behind.outside);
        let expected = |events: &[BifurcationEvent], counts: fn(&BifurcationEvent) -> bool| {
            let listed = events.iter().filter(|e| counts(e)).chain(&*owed);
            let changes = listed.filter(|e| is_here(e)).filter_map(|e| e.unstable);
            changes.fold(before as i64, |n, (x, y)| n + y as i64 - x as i64)
        };
        let all = expected(events, |_| true);
        if all == behind as i64 {
            continue;
        }
        let sure = match may_break {
            true => all,
            false => expected(events, |e| !is_guess(e)),
        };
        let drop_guesses = |events: &mut Vec<BifurcationEvent>| {
            events.retain(|e| sure == all || !(is_here(e) && is_guess(e)));
        };
        let missing = (behind as i64 - sure).abs();
        let takes = |e: &BifurcationEvent| match e.kind {
            EventKind::Fold | EventKind::BranchPoint => missing == 1,
            EventKind::Grazing { .. } | EventKind::SlipOnset { .. } => may_break,
            _ => false,
        };
        let unstable = (sure.max(0) as usize, behind);
        let mut here = events.iter_mut().filter(|e| is_here(e));
        if let Some(event) = here.find(|e| e.unstable.is_none() && takes(e)) {
            event.unstable = Some(unstable);
            drop_guesses(events);
            continue;
        }
        let doublings = events.iter().filter(|e| is_here(e) && !is_guess(e));
        let doubles = !may_break && missing == 1 && passes_minus_one(pair, doublings);
        let (kind, unstable) = match doubles {
            true => (EventKind::PeriodDoubling, unstable),
            false => (EventKind::Unresolved, (all.max(0) as usize, behind)),
        };
        if doubles {
            drop_guesses(events);
        }
        gaps.push(Gap {
            kind,
            fractions: (from, to),
            lambdas: (pair[0].lambda, pair[1].lambda),
            unstable: Some(unstable),
        });
    }
    gaps
}

/// A passage seen on the interpolant of the step only: it gives way to one that the multipliers at both ends prove.
fn is_guess(event: &BifurcationEvent) -> bool {
    let is_passage = matches!(
        event.kind,
        EventKind::PeriodDoubling | EventKind::NeimarkSacker
    );
    is_passage && event.point.is_none()
}

/// Whether an odd number of multipliers has passed -1 between two places besides those of the events there: multipliers of continuous
/// forces are continuous, and complex ones come in pairs.
fn passes_minus_one<'a>(
    pair: &[&Look],
    events: impl Iterator<Item = &'a BifurcationEvent>,
) -> bool {
    let doublings = events.filter(|e| e.kind == EventKind::PeriodDoubling);
    let listed: usize = doublings.map(|e| e.multiplicity).sum();
    let (from, to) = (pair[0].count(), pair[1].count());
    from.zip(to)
        .is_some_and(|(a, b)| a.passes_minus_one(b) == listed.is_multiple_of(2))
}

/// Folds that the direction of the parameter along the path requires and that are not listed.
pub(super) fn missing_folds((a, b): (&Probe, &Probe), examined: &Examined) -> Vec<Gap> {
    let mut gaps = Vec::new();
    if a.point.orientation == 0 {
        return gaps;
    }
    let places: Vec<&Probe> = [a]
        .into_iter()
        .chain(examined.marks.iter())
        .chain([b])
        .collect();
    for (k, pair) in places.windows(2).enumerate() {
        let (from, to) = (pair[0], pair[1]);
        let fractions = (from.look.fraction, to.look.fraction);
        let here = |kind: EventKind| {
            let is_here = |e: &&BifurcationEvent| {
                let (low, high) = fractions;
                (e.fraction >= low || k == 0)
                    && (e.fraction < high || k + 2 == places.len())
                    && e.kind == kind
            };
            examined.events.iter().filter(is_here).count()
        };
        // At a branch point the path may turn, and tangents of other branches are near.
        if here(EventKind::BranchPoint) > 0 {
            continue;
        }
        let folds = here(EventKind::Fold);
        let turns = from.point.tangent_lambda * to.point.tangent_lambda < 0.0;
        let rise = to.look.lambda - from.look.lambda;
        let is_backwards =
            rise.abs() > STANDS * to.look.lambda.abs() && rise * from.point.tangent_lambda < 0.0;
        let missing = match turns == folds.is_multiple_of(2) {
            true => 1,
            false if folds == 0 && is_backwards => 2,
            false => 0,
        };
        let gap = Gap {
            kind: EventKind::Fold,
            fractions,
            lambdas: (from.look.lambda, to.look.lambda),
            unstable: None,
        };
        gaps.extend(std::iter::repeat_n(gap, missing));
    }
    gaps
}

/// Passages of +1 whose fold or branch point has not come yet.
#[derive(Debug, Default)]
pub(super) struct Ledger {
    owed: Vec<BifurcationEvent>,
}

impl Ledger {
    /// Matches passages and turns of neighbouring steps; `past`: events of the steps before.
    pub fn settle(
        &mut self,
        past: &mut Vec<BifurcationEvent>,
        present: &mut [BifurcationEvent],
        owed: Vec<BifurcationEvent>,
    ) {
        let is_open = |e: &&mut BifurcationEvent| {
            matches!(e.kind, EventKind::Fold | EventKind::BranchPoint) && e.unstable.is_none()
        };
        for turn in present.iter_mut().filter(is_open) {
            if let Some(one) = self.owed.pop() {
                (turn.unstable, turn.multiplicity) = (one.unstable, one.multiplicity);
            }
        }
        for one in owed {
            let recent = |e: &&mut BifurcationEvent| e.after_point + PATIENCE >= one.after_point;
            match past.iter_mut().rev().filter(is_open).find(recent) {
                Some(turn) => (turn.unstable, turn.multiplicity) = (one.unstable, one.multiplicity),
                None => self.owed.push(one),
            }
        }
        let Some(last) = present.last().map(|e| e.after_point) else {
            return;
        };
        let is_late = |one: &mut BifurcationEvent| one.after_point + PATIENCE < last;
        let late: Vec<_> = self.owed.extract_if(.., is_late).collect();
        late.into_iter().for_each(|one| give_up(past, one));
    }

    /// Nothing comes any more.
    pub fn close(&mut self, past: &mut Vec<BifurcationEvent>) {
        self.owed.drain(..).for_each(|one| give_up(past, one));
    }
}

/// A passage that nothing explains, at its place among the events.
fn give_up(past: &mut Vec<BifurcationEvent>, one: BifurcationEvent) {
    let place = |e: &BifurcationEvent| (e.after_point, e.fraction);
    let at = past.partition_point(|e| place(e) < place(&one));
    let unresolved = BifurcationEvent {
        kind: EventKind::Unresolved,
        point: None,
        ..one
    };
    past.insert(at, unresolved);
}
