//! Galerkin branches taken through the flow: verdicts of their events, digits that the two methods share.

mod row;

use super::guarded::Guarded;
use super::{BranchSettings, Swept};
use crate::analysis::branch_table::rms;
use crate::analysis::columns::{float, integer, text};
use crate::error::SolveError;
use crate::postprocess::measures::Meter;
use crate::report::Table;
use crate::solve::branch::confirm::{ConfirmOptions, Confirmed, ErrorSpread, confirm};
use crate::solve::branch::{Branch, Recorder};
use crate::solve::events::{BifurcationEvent, Verdict};
use crate::solve::residual::PeriodicResidual;
use crate::solve::shooting::Shooting;
use row::{ALL_DIGITS, FlowAnswer, PointCheck};
pub(super) use row::{FlowRow, recorded};
use serde_json::{Value, json};

/// Fewer common digits than these are a warning.
const FEW_DIGITS: f64 = 2.0;

/// Events by verdict.
#[derive(Default)]
struct Verdicts {
    confirmed: usize,
    refuted: usize,
    added: usize,
}

/// How a branch is taken through the flow.
pub(super) struct TakenBranch {
    /// Its number.
    pub number: usize,
    /// Which points.
    pub spread: ErrorSpread,
    /// Whether it leaves another branch.
    pub begins_at_crossing: bool,
    /// Steps of the flow per response period, estimated.
    pub steps: f64,
}

/// What the flow said of all branches.
pub(super) struct Verification {
    rows: Vec<FlowRow>,
    verdicts: Verdicts,
    integrator: &'static str,
    /// Why nothing was taken through the flow.
    left_out: Option<String>,
}

impl Verification {
    /// No points yet.
    pub fn new() -> Verification {
        Verification {
            rows: Vec::new(),
            verdicts: Verdicts::default(),
            integrator: "",
            left_out: None,
        }
    }

    /// Takes one branch through the flow: its events, and the points of a spread by shooting from the state of the Galerkin orbit at
    /// phase 0. Returns what has to be warned of.
    ///
    /// # Errors
    /// The flow cannot take the system.
    pub fn add(
        &mut self,
        (settings, swept): (&BranchSettings, &Swept<'_>),
        galerkin: &mut dyn PeriodicResidual,
        TakenBranch {
            number,
            spread,
            begins_at_crossing,
            steps,
        }: TakenBranch,
        branch: &mut Branch,
        recorder: &mut dyn Recorder,
    ) -> Result<Vec<String>, SolveError> {
        let Some(first) = branch.points.first().map(|p| p.lambda) else {
            return Ok(Vec::new());
        };
        let system = galerkin.system_at(first)?;
        let (nu, weight) = (system.subharmonic(), 0.5 * super::trace::weight(system));
        let mut shooting = Shooting::new(swept.family_for(nu)?, first, settings.flow())?;
        self.integrator = shooting.integrator();
        let options = ConfirmOptions {
            spread,
            begins_at_crossing,
            steps,
            weight,
            range: swept.range,
            resolution: swept.resolution(settings.stability_resolution),
            newton: settings.shooting_newton(),
            most_work: settings.most_work(),
            keep_going: &|| !swept.setting.control.is_interrupted(),
        };
        let Confirmed { checked, is_spent } =
            confirm(galerkin, &mut shooting, branch, recorder, &options)?;
        self.note_verdicts(branch);
        let mut continuation = settings.continuation(swept.range, weight);
        continuation.newton = settings.shooting_newton();
        let mut guarded = Guarded(&mut shooting);
        let mut check = PointCheck {
            galerkin,
            shooting: &mut guarded,
            meter: Meter::new(settings.size_for(nu).samples),
            options: continuation,
            points: &branch.points,
            events: &branch.events,
            swept,
        };
        let begin = self.rows.len();
        for point in checked {
            self.rows.push(check.row(number, &point)?);
        }
        let mut list = warnings(swept, &self.rows[begin..], branch);
        list.extend(is_spent.then(|| unfinished(branch)));
        Ok(list)
    }

    fn note_verdicts(&mut self, branch: &Branch) {
        for event in branch.events.iter().chain(&branch.refuted) {
            match event.verdict {
                Verdict::Confirmed if event.method_lambda.is_nan() => self.verdicts.added += 1,
                Verdict::Confirmed => self.verdicts.confirmed += 1,
                Verdict::Refuted => self.verdicts.refuted += 1,
                Verdict::NotTried => {}
            }
        }
    }

    /// Notes why a branch is not taken through the flow.
    pub fn leave_out(&mut self, reason: Option<String>) {
        self.left_out = reason;
    }

    /// Whether any branch was taken through the flow, or there is a reason why not.
    pub fn has_message(&self) -> bool {
        self.is_done() || self.left_out.is_some()
    }

    fn is_done(&self) -> bool {
        !self.integrator.is_empty()
    }

    /// The checked points of one branch.
    pub fn of_branch(&self, branch: usize) -> impl Iterator<Item = &FlowRow> {
        self.rows.iter().filter(move |r| r.branch == branch)
    }

    /// One row per checked point.
    pub fn table(&self, swept: &Swept<'_>) -> Table {
        let of = |f: &dyn Fn(&FlowRow) -> f64| self.rows.iter().map(f).collect::<Vec<f64>>();
        let count = |f: &dyn Fn(&FlowRow) -> usize| self.rows.iter().map(|r| f(r) as i64).collect();
        let mut columns = vec![
            integer("branch", count(&|r| r.branch)),
            integer("point", count(&|r| r.point)),
            float("omega", "", of(&|r| swept.excitation(r.lambda))),
            float("parameter", &swept.unit, of(&|r| swept.value(r.lambda))),
            integer("converged", count(&|r| r.is_converged().into())),
            integer("iterations", count(&|r| r.iterations())),
            float("digits", "", of(&|r| r.digits)),
            text("reason", self.rows.iter().map(FlowRow::reason).collect()),
            float(
                "exact_fold",
                &swept.unit,
                of(&|r| r.fold().map_or(f64::NAN, |x| swept.value(x))),
            ),
        ];
        for (k, (_, heading)) in rms(swept).into_iter().enumerate() {
            let value = |r: &FlowRow| r.exactly.get(k).map_or(f64::NAN, |x| x.rms);
            columns.push(heading.column(of(&value)));
        }
        columns.push(float("multiplier_error", "", of(&|r| r.multiplier_error)));
        Table {
            name: "verify".into(),
            columns,
        }
    }

    /// Entries of the JSON file.
    pub fn as_value(&self) -> Value {
        if !self.is_done() {
            return json!({ "message": self.left_out });
        }
        let (least, median) = self.quantiles();
        json!({
            "integrator": self.integrator,
            "events_confirmed": self.verdicts.confirmed,
            "events_refuted": self.verdicts.refuted,
            "events_added": self.verdicts.added,
            "points": self.rows.len(),
            "converged": self.converged(),
            "beyond_fold": self.beyond_fold().count(),
            "digits_least": least,
            "digits_median": median,
            "message": self.message(),
        })
    }

    /// The same for people.
    pub fn message(&self) -> String {
        if !self.is_done() {
            return self.left_out.clone().unwrap_or_default();
        }
        let (total, converged) = (self.rows.len(), self.converged());
        let shared = match self.quantiles() {
            (Some(least), Some(median)) => format!(
                "the r.m.s. deformations of the two methods share at least {least:.1} digits, {median:.1} in the median"
            ),
            _ => "no point could be compared".into(),
        };
        let beyond = match self.beyond_fold().count() {
            0 => String::new(),
            count => {
                let gaps = self
                    .beyond_fold()
                    .map(|(lambda, fold)| (lambda - fold).abs());
                let largest = gaps.fold(0.0, f64::max);
                format!(
                    "; {count} points lie beyond a fold of the exact branch, by at most {largest:.1e} of the continued \
                     parameter, where there is no orbit"
                )
            }
        };
        let failed = match total - converged - self.beyond_fold().count() {
            0 => String::new(),
            failed => format!("; the flow finds no orbit at {failed} points"),
        };
        let Verdicts {
            confirmed,
            refuted,
            added,
        } = self.verdicts;
        let events = format!("{confirmed} of {} events confirmed", confirmed + refuted);
        let added = match added {
            0 => String::new(),
            added => format!(", {added} more found on the flow's branch"),
        };
        format!(
            "{total} points of Galerkin branches verified by the flow: {shared}{beyond}{failed}; {events}{added}."
        )
    }

    /// Parameters of the points beyond a fold, with those of the folds.
    fn beyond_fold(&self) -> impl Iterator<Item = (f64, f64)> {
        self.rows.iter().filter_map(|r| Some((r.lambda, r.fold()?)))
    }

    fn converged(&self) -> usize {
        self.rows.iter().filter(|r| r.is_converged()).count()
    }

    /// Least and median digits.
    fn quantiles(&self) -> (Option<f64>, Option<f64>) {
        let converged = self.rows.iter().filter(|r| r.is_converged());
        let mut list: Vec<f64> = converged.map(|r| r.digits).collect();
        list.sort_by(f64::total_cmp);
        (list.first().copied(), list.get(list.len() / 2).copied())
    }
}

/// What is said where the confirmation by default would have taken too long.
fn unfinished(branch: &Branch) -> String {
    let (events, refuted) = (&branch.events, branch.refuted.len());
    let tried = events.iter().filter(|e| e.verdict != Verdict::NotTried);
    format!(
        "galerkin: the flow was asked about {} of {} events only, since each takes long in this train; the other events and the \
         stability between them are the series' own: set `confirm: events` to confirm all of them, `confirm: none` for none",
        refuted + tried.count(),
        refuted + events.len()
    )
}

/// What has to be said of one branch: few digits, no orbit, refuted events.
fn warnings(swept: &Swept<'_>, rows: &[FlowRow], branch: &Branch) -> Vec<String> {
    let mut list = Vec::new();
    let between = |lambdas: &[f64]| swept.between(lambdas.iter().copied());
    let few = rows.iter().filter(|r| r.digits < FEW_DIGITS);
    let few: Vec<f64> = few.map(|r| r.lambda).collect();
    if !few.is_empty() {
        let least = rows.iter().map(|r| r.digits).fold(ALL_DIGITS, f64::min);
        list.push(format!(
            "galerkin: at {} of {} checked points, {}, series and flow share fewer than {FEW_DIGITS} digits ({least:.1} at least): \
             use more `harmonics`, or the method `shooting`",
            few.len(),
            rows.len(),
            between(&few),
        ));
    }
    let lost = rows.iter().filter(|r| r.found == FlowAnswer::Nothing);
    let lost: Vec<f64> = lost.map(|r| r.lambda).collect();
    if !lost.is_empty() {
        list.push(format!(
            "galerkin: at {} of {} checked points, {}, the flow finds no orbit: use more `harmonics`, or the method \
             `shooting`",
            lost.len(),
            rows.len(),
            between(&lost),
        ));
    }
    let total = branch.events.len() + branch.refuted.len();
    let open = branch.events.iter();
    let open = open.filter(|e| e.verdict == Verdict::Refuted).collect();
    let told: [(Vec<&BifurcationEvent>, &str, &str); 2] = [
        (
            branch.refuted.iter().collect(),
            "the flow refutes",
            ": they do not exist and are listed as refuted, apart from the events",
        ),
        (open, "the flow does not confirm", ""),
    ];
    for (events, what, end) in told.iter().filter(|told| !told.0.is_empty()) {
        let kinds: Vec<&str> = events.iter().map(|e| e.kind.word()).collect();
        let at: Vec<f64> = events.iter().map(|e| e.lambda).collect();
        let (count, tally, place) = (events.len(), tally(&kinds), between(&at));
        list.push(format!(
            "galerkin: {what} {count} of {total} events ({tally}), {place}{end}"
        ));
    }
    list
}

/// `2 fold, 1 grazing`, in the order of the first of each.
fn tally(words: &[&str]) -> String {
    let mut counts: Vec<(&str, usize)> = Vec::new();
    for word in words {
        match counts.iter_mut().find(|(known, _)| known == word) {
            Some((_, count)) => *count += 1,
            None => counts.push((word, 1)),
        }
    }
    let one = |(word, count): &(&str, usize)| format!("{count} {word}");
    counts.iter().map(one).collect::<Vec<_>>().join(", ")
}
