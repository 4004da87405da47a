//! The number of unstable multipliers, step by step against the events: neither may contradict the other.

use crate::solve::events::{
    BifurcationEvent, EventKind, Examined, Look, Probe, Verdict, is_outside,
};

/// Points of a branch for which a passage of +1 waits for its fold or branch point, and the other way round: a truncated series
/// turns a little beside the place where the multiplier of the flow passes.
const PATIENCE: usize = 3;

/// A change of the number of unstable multipliers that no event explains.
#[derive(Debug, Clone, PartialEq)]
pub(super) struct Gap {
    /// Fractions of the step.
    fractions: (f64, f64),
    /// Parameters.
    lambdas: (f64, f64),
    /// What the events lead to, and what is there.
    unstable: (usize, usize),
}

impl Gap {
    /// The event of a step behind a point.
    pub(crate) fn as_event(&self, after_point: usize) -> BifurcationEvent {
        let (from, to) = self.lambdas;
        BifurcationEvent {
            kind: EventKind::Unresolved,
            lambda: 0.5 * (from + to),
            method_lambda: 0.5 * (from + to),
            verdict: Verdict::NotTried,
            bracket: (from.min(to), from.max(to)),
            multiplicity: self.unstable.0.abs_diff(self.unstable.1),
            unstable: Some(self.unstable),
            after_point,
            fraction: 0.5 * (self.fractions.0 + self.fractions.1),
            point: None,
            breakpoint: None,
            doubt: 0.0,
            recorded: Vec::new(),
        }
    }
}

/// Multipliers outside the unit circle; `None` where they are not known.
fn outside(look: &Look) -> Option<usize> {
    let list = &look.survey.multipliers;
    (!list.is_empty()).then(|| list.iter().filter(|mu| is_outside(**mu)).count())
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
        let (Some(before), Some(behind)) = (outside(pair[0]), outside(pair[1])) else {
            continue;
        };
        let here: Vec<&mut BifurcationEvent> = events.iter_mut().filter(|e| is_here(e)).collect();
        let known = here
            .iter()
            .map(|e| e.unstable)
            .chain(owed.iter().filter(|e| is_here(e)).map(|e| e.unstable));
        let change = |(x, y): (usize, usize)| y as i64 - x as i64;
        let sum: i64 = known.flatten().map(change).sum();
        let missing = behind as i64 - before as i64 - sum;
        if missing == 0 {
            continue;
        }
        let takes = |e: &BifurcationEvent| match e.kind {
            EventKind::Fold | EventKind::BranchPoint => missing.abs() == 1,
            EventKind::Grazing { .. } | EventKind::SlipOnset { .. } => may_break,
            _ => false,
        };
        let expected = (before as i64 + sum).max(0) as usize;
        match here.into_iter().find(|e| e.unstable.is_none() && takes(e)) {
            Some(event) => event.unstable = Some((expected, behind)),
            None => gaps.push(Gap {
                fractions: (from, to),
                lambdas: (pair[0].lambda, pair[1].lambda),
                unstable: (expected, behind),
            }),
        }
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
