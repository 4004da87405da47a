//! Multipliers that pass the unit circle between two places of a step.

use super::locate::{RootTarget, SearchResult};
use super::pace::WindowPace;
use super::quiet::{MOST, MultiplierSample, Quiet};
use super::spectrum::{CirclePassage, Count, Passing, Sought};
use super::{BifurcationEvent, EventKind, Look, Step};
use crate::error::SolveError;
use crate::numeric::roots;
use crate::solve::residual::Extent;
use std::rc::Rc;

/// Width to which a passage is sought on the interpolant, as a share of the stretch between two looks.
const SKETCH: f64 = 1e-6;
/// Stretches shorter than this share of the step hold nothing.
const SHORTEST: f64 = 1e-9;
/// A passage this near to an end of its smooth stretch, as a share of it, belongs to the grazing there.
const AT_END: f64 = 1e-9;
/// Value of a test function at a root, relative to its largest at the ends: above it the function jumps there.
const VANISHES: f64 = 1e-3;
/// Neighbours of a stretch that are nearer to it than this share of its length say nothing new.
const TOO_NEAR: f64 = 0.1;
/// Neighbours of an interval farther than this multiple of its length are not used.
const TOO_FAR: f64 = 8.0;
/// Share of the arclength of a stretch that counts as its width in the parameter, however little that moves.
const ALONG: f64 = 0.05;

/// A stretch of the step inside which nothing grazes. At a grazing the multipliers vary like a one-sided square root: the
/// stretch is measured in an abscissa in which they are smooth up to its ends.
#[derive(Debug, Clone, Copy)]
struct StepStretch {
    low: f64,
    high: f64,
    grazes_low: bool,
    grazes_high: bool,
}

impl StepStretch {
    fn abscissa(&self, x: f64) -> f64 {
        match (self.grazes_low, self.grazes_high) {
            (false, false) => x,
            (true, false) => (x - self.low).max(0.0).sqrt(),
            (false, true) => -(self.high - x).max(0.0).sqrt(),
            (true, true) => (1.0 - 2.0 * (x - self.low) / (self.high - self.low))
                .clamp(-1.0, 1.0)
                .acos(),
        }
    }

    fn fraction(&self, s: f64) -> f64 {
        match (self.grazes_low, self.grazes_high) {
            (false, false) => s,
            (true, false) => self.low + s * s,
            (false, true) => self.high - s * s,
            (true, true) => self.low + 0.5 * (self.high - self.low) * (1.0 - s.cos()),
        }
    }

    fn is_at_end(&self, fraction: f64) -> bool {
        let width = AT_END * (self.high - self.low);
        (self.grazes_low && fraction - self.low <= width)
            || (self.grazes_high && self.high - fraction <= width)
    }
}

/// A place of a stretch.
#[derive(Debug, Clone)]
struct StretchNode {
    x: f64,
    look: Rc<Look>,
    /// Counts on the side of the stretch before and of the one behind; they differ where something passes.
    before: Count,
    behind: Count,
    /// Whether the corrected path has been there.
    is_solved: bool,
}

/// What is to be done with the stretch between two nodes.
enum PassageVerdict {
    Quiet,
    Halve,
    Locate(Sought),
}

impl Step<'_> {
    /// Scans the stretches between the grazings `knots`; `solved` are places of the corrected path inside the step. Returns what
    /// passes +1, to be told into folds and branch points.
    pub(super) fn passages(
        &mut self,
        before: &[Look],
        (a, b): (&Look, &Look),
        (knots, solved): (Vec<Look>, &[Look]),
    ) -> Result<Vec<BifurcationEvent>, SolveError> {
        let pace = WindowPace::of(self.problem.system_at(a.lambda)?);
        let places: Vec<Look> = [a].into_iter().chain(&knots).chain([b]).cloned().collect();
        let mut ones = Vec::new();
        for (k, pair) in places.windows(2).enumerate() {
            let (low, high) = (pair[0].fraction, pair[1].fraction);
            let stretch = StepStretch {
                low,
                high,
                grazes_low: k > 0,
                grazes_high: k < knots.len(),
            };
            if high - low <= SHORTEST {
                continue;
            }
            let inside = solved
                .iter()
                .filter(|look| look.fraction > low && look.fraction < high);
            let behind = before.iter().filter(|_| k == 0);
            let looks: Vec<(&Look, bool)> = behind
                .map(|look| (look, false))
                .chain([(&pair[0], true)])
                .chain(inside.map(|look| (look, true)))
                .chain([(&pair[1], true)])
                .collect();
            self.scan(stretch, &looks, &pace, &mut ones)?;
        }
        Ok(ones)
    }

    /// Looks between the places of one stretch until nothing is left that could have happened unseen. Places before the step are
    /// the first ones of the list.
    fn scan(
        &mut self,
        stretch: StepStretch,
        looks: &[(&Look, bool)],
        pace: &WindowPace,
        ones: &mut Vec<BifurcationEvent>,
    ) -> Result<(), SolveError> {
        let mut nodes = Vec::with_capacity(looks.len());
        for (look, is_solved) in looks {
            let Some(node) = node(&stretch, (*look).clone(), *is_solved) else {
                // Nobody knows the multipliers there.
                return Ok(());
            };
            nodes.push(node);
        }
        let earlier = looks.iter().filter(|(look, _)| look.fraction < stretch.low);
        let mut k = earlier.count();
        if k == 0 && stretch.low == 0.0 && self.path.origin().orientation == 0 {
            // The path leaves a crossing: what passes there has passed.
            let Some(behind) = self.node_at(&stretch, BEHIND_CROSSING * stretch.high)? else {
                return Ok(());
            };
            nodes.insert(1, behind);
            k = 1;
        }
        let mut quiet = Quiet::default();
        while k + 1 < nodes.len() {
            match self.judge(&nodes, k, pace, &mut quiet) {
                PassageVerdict::Quiet => k += 1,
                PassageVerdict::Halve => {
                    let middle = stretch.fraction(0.5 * (nodes[k].x + nodes[k + 1].x));
                    match self.node_at(&stretch, middle)? {
                        Some(node) => nodes.insert(k + 1, node),
                        None => k += 1,
                    }
                }
                PassageVerdict::Locate(sought) => {
                    let pair = (&nodes[k].clone(), &nodes[k + 1].clone());
                    match self.locate_passage(&stretch, pair, sought, ones)? {
                        Some(node) => nodes.insert(k + 1, node),
                        None => k += 1,
                    }
                }
            }
        }
        Ok(())
    }

    fn node_at(
        &mut self,
        stretch: &StepStretch,
        fraction: f64,
    ) -> Result<Option<StretchNode>, SolveError> {
        let look = self.look(fraction, Extent::Stability)?;
        Ok(node(stretch, look, false))
    }

    fn judge(
        &self,
        nodes: &[StretchNode],
        k: usize,
        pace: &WindowPace,
        quiet: &mut Quiet,
    ) -> PassageVerdict {
        let (a, b) = (&nodes[k], &nodes[k + 1]);
        let share = b.look.fraction - a.look.fraction;
        let is_same = a.behind == b.before;
        let along = ALONG * share * self.path.chord();
        let width = (b.look.lambda - a.look.lambda).abs().max(along);
        let middle = 0.5 * (b.look.lambda + a.look.lambda);
        let is_finest =
            width < 0.5 * self.resolution.width(middle) || share < SHORTEST || self.looks_left == 0;
        match () {
            _ if is_same && have_same_exponents(a, b) => PassageVerdict::Quiet,
            _ if !is_finest && pace.is_too_fast(&a.look, &b.look) => PassageVerdict::Halve,
            _ if !is_same && (share < SHORTEST || self.looks_left == 0) => PassageVerdict::Quiet,
            _ if !is_same => PassageVerdict::Locate(a.behind.sought(b.before)),
            _ if is_finest || self.is_quiet(nodes, k, (pace, quiet)) => PassageVerdict::Quiet,
            _ => PassageVerdict::Halve,
        }
    }

    /// Whether nothing passes between two nodes with the same count.
    fn is_quiet(
        &self,
        nodes: &[StretchNode],
        k: usize,
        (pace, quiet): (&WindowPace, &mut Quiet),
    ) -> bool {
        let (a, b) = (&nodes[k], &nodes[k + 1]);
        let place = |node: &StretchNode| (node.x, node.look.survey.multipliers.len());
        let whole = pace.states();
        if place(a).1 < whole || place(b).1 < whole {
            return is_far_inside(a, b);
        }
        let length = b.x - a.x;
        let gap = |node: &StretchNode| (a.x - node.x).max(node.x - b.x);
        let mut others: Vec<&StretchNode> = nodes[..k].iter().chain(&nodes[k + 2..]).collect();
        others.retain(|node| {
            let gap = gap(node);
            gap > TOO_NEAR * length && gap < TOO_FAR * length && place(node).1 == whole
        });
        others.sort_by(|p, q| gap(p).total_cmp(&gap(q)));
        let mut places: Vec<MultiplierSample<'_>> = Vec::with_capacity(MOST);
        for node in [a, b].into_iter().chain(others) {
            let is_apart = |p: &MultiplierSample<'_>| (p.x - node.x).abs() > TOO_NEAR * length;
            if places.len() < MOST && places.iter().all(is_apart) {
                places.push(MultiplierSample::new(node.x, &node.look.survey.multipliers));
            }
        }
        quiet.holds(&places)
    }

    /// Locates what passes between two nodes, and returns the place on the interpolant.
    fn locate_passage(
        &mut self,
        stretch: &StepStretch,
        (a, b): (&StretchNode, &StretchNode),
        sought: Sought,
        ones: &mut Vec<BifurcationEvent>,
    ) -> Result<Option<StretchNode>, SolveError> {
        let value = |look: &Look| sought.value(&look.survey.multipliers);
        let values = signed(sought, (a, b), (value(&a.look), value(&b.look)));
        let mut seen = vec![(a.look.fraction, values.0), (b.look.fraction, values.1)];
        let mut looks: Vec<Rc<Look>> = Vec::new();
        let sketch = roots::bracketed(
            |s| {
                let look = self.look(stretch.fraction(s), Extent::Stability)?;
                let value = value(&look);
                seen.push((look.fraction, value));
                looks.push(Rc::new(look));
                Ok::<f64, SolveError>(value)
            },
            (a.x, values.0),
            (b.x, values.1),
            SKETCH * (b.x - a.x),
        )?;
        let guess = stretch.fraction(sketch.root);
        let near = |x: f64| {
            let apart = |p: &&(f64, f64)| (p.0 - stretch.fraction(x)).abs();
            let nearest = seen.iter().min_by(|p, q| apart(p).total_cmp(&apart(q)));
            nearest.map_or(f64::NAN, |p| p.1)
        };
        let ends = (near(sketch.low), near(sketch.high));
        let target = RootTarget {
            limits: (stretch.low, stretch.high),
            guess,
            slope: slope_near(&mut seen.clone(), guess),
            extent: Some(Extent::Stability),
            values: (a.is_solved && b.is_solved)
                .then_some(((a.look.fraction, values.0), (b.look.fraction, values.1))),
        };
        let found = self.locate(&target, |_, _, survey| {
            survey.map_or(f64::NAN, |s| sought.value(&s.multipliers))
        })?;
        let here = looks.into_iter().find(|look| look.fraction == guess);
        let here = here.filter(|look| Count::of(&look.survey.multipliers).is_some());
        let (place, look, ends) = match (here, &found) {
            (Some(look), _) => (guess, look, ends),
            // Beside a grazing the sketch jumps where the path does not.
            (None, SearchResult::Root(root))
                if root.fraction > a.look.fraction && root.fraction < b.look.fraction =>
            {
                let Some(look) = root.look() else {
                    return Ok(None);
                };
                (root.fraction, Rc::new(look), root.values)
            }
            _ => return Ok(None),
        };
        let passing = Passing::at(&look.survey.multipliers, ends, sought);
        let largest = values.0.abs().max(values.1.abs());
        let located = match &found {
            SearchResult::Root(root) if root.value.abs() < VANISHES * largest => {
                let list = root.survey.as_ref().map(|s| s.multipliers.as_slice());
                let located = list.map(|list| Passing::at(list, root.values, sought));
                // Where several pass +1 the corrector is singular and parts them; the interpolant keeps equal ones equal.
                located.map(|one| {
                    match passing.number(CirclePassage::PlusOne)
                        > one.number(CirclePassage::PlusOne)
                    {
                        true => passing.clone(),
                        false => one,
                    }
                })
            }
            // The test function jumps: at a grazing of a force that jumps.
            SearchResult::Root(_) => None,
            // Between two interpolated places the corrected path has the last word.
            SearchResult::Nothing if !(a.is_solved && b.is_solved) => None,
            SearchResult::Nothing | SearchResult::Lost => Some(passing.clone()),
        };
        let is_event = located.is_some() && !stretch.is_at_end(place);
        if let Some(located) = located.filter(|_| is_event) {
            let ends = (a.look.lambda, b.look.lambda);
            self.report_passing(&located, ends, place, found, ones);
        }
        Ok(Some(StretchNode {
            x: stretch.abscissa(place),
            look,
            before: passing.before,
            behind: passing.behind,
            is_solved: false,
        }))
    }

    /// One event for every group that passes.
    fn report_passing(
        &mut self,
        passing: &Passing,
        ends: (f64, f64),
        guess: f64,
        found: SearchResult,
        ones: &mut Vec<BifurcationEvent>,
    ) {
        let mut outside = passing.before.outside as i64;
        let sign = (passing.behind.outside as i64 - outside).signum();
        for group in &passing.groups {
            let (kind, number) = match group.gate {
                CirclePassage::PlusOne => (EventKind::BranchPoint, group.multiplicity),
                CirclePassage::MinusOne => (EventKind::PeriodDoubling, group.multiplicity),
                CirclePassage::Pairs => (EventKind::NeimarkSacker, 2 * group.multiplicity),
            };
            let behind = outside + sign * number as i64;
            let event = BifurcationEvent {
                multiplicity: group.multiplicity,
                unstable: Some((outside.max(0) as usize, behind.max(0) as usize)),
                ..self.event(kind, ends, guess, &found)
            };
            outside = behind;
            match group.gate {
                CirclePassage::PlusOne => ones.push(event),
                _ => self.add(event),
            }
        }
    }
}

/// Where a path that leaves a crossing is looked at first: multipliers of the crossing itself are on the circle.
const BEHIND_CROSSING: f64 = 0.02;

fn node(stretch: &StepStretch, look: Look, is_solved: bool) -> Option<StretchNode> {
    let count = Count::of(&look.survey.multipliers)?;
    Some(StretchNode {
        x: stretch.abscissa(look.fraction),
        look: Rc::new(look),
        before: count,
        behind: count,
        is_solved,
    })
}

/// Whether the multipliers at two nodes are exp(lambda T) with the same lambda: whatever T is, none passes the circle.
fn have_same_exponents(a: &StretchNode, b: &StretchNode) -> bool {
    let [a, b] = [a, b].map(|node| node.look.survey.exponents.as_ref());
    a.is_some_and(|a| b.is_some_and(|b| a == b))
}

/// Values of a test function at two nodes, with the signs that their counts ask for: where something has just passed, rounding
/// has no say.
fn signed(sought: Sought, (a, b): (&StretchNode, &StretchNode), values: (f64, f64)) -> (f64, f64) {
    let Sought::Rank(_) = sought else {
        return values;
    };
    let sign = match a.behind.outside < b.before.outside {
        true => 1.0,
        false => -1.0,
    };
    let least = f64::MIN_POSITIVE;
    (
        -sign * (-sign * values.0).max(least),
        sign * (sign * values.1).max(least),
    )
}

/// Where only the leading multipliers are known: whether those nearest to the circle on either side of it move less than they
/// are away from it.
fn is_far_inside(a: &StretchNode, b: &StretchNode) -> bool {
    let ranks = [a.behind.outside.checked_sub(1), Some(a.behind.outside)];
    ranks.into_iter().flatten().all(|rank| {
        let value = |node: &StretchNode| Sought::Rank(rank).value(&node.look.survey.multipliers);
        let (from, to) = (value(a), value(b));
        (to - from).abs() < from.abs().min(to.abs())
    })
}

/// Slope between the two places nearest to an abscissa.
pub(super) fn slope_near(seen: &mut [(f64, f64)], x: f64) -> f64 {
    seen.sort_by(|a, b| (a.0 - x).abs().total_cmp(&(b.0 - x).abs()));
    let (p, q) = (seen[0], seen[1]);
    (q.1 - p.1) / (q.0 - p.0)
}
