//! Events on a figure: small markers with numbers, one marker where they pile up, and a list of what the numbers mean.

use kuva::render::render::{Scene, TextAnchor};

use super::beside::TakenRoom;
use super::draw::{TextStyle, marker, put_text, stroke};
use super::look::FAINT;
use super::panel::Frame;
use super::series::{DrawnContent, DrawnSeries};
use super::sheet::Sheet;
use super::shown::Shown;
use super::text::text_width;
use crate::report::{Values, readable};

/// Events nearer than this in the first panel, in pixels, are one group.
const NEAR: f64 = 11.0;
/// Relative distance of one event found by two methods.
const SAME: f64 = 3e-4;
/// Groups that are listed.
const MOST: usize = 36;

/// Events at one place of a figure.
#[derive(Debug)]
pub(super) struct EventGroup {
    /// Rows of the table of events.
    pub rows: Vec<usize>,
    kinds: Vec<String>,
    /// Abscissae, in the unit of the axis.
    values: Vec<f64>,
    /// Branches that the events lie on, each until another one has found the same event.
    branches: Vec<Option<f64>>,
    /// Place of the first one in the first panel.
    place: (f64, f64),
}

/// Groups of the events in the first panel that has any; all panels show the same ones.
pub(super) fn of(panels: &[Shown<'_>], frames: &[Frame]) -> Vec<EventGroup> {
    let mut groups: Vec<EventGroup> = Vec::new();
    let Some((panel, frame, series, kinds)) =
        panels.iter().zip(frames).find_map(|(panel, frame)| {
            let (series, kinds) = panel.list.iter().find_map(events)?;
            Some((panel, frame, series, kinds))
        })
    else {
        return groups;
    };
    // Two methods find the same events, each on branches of its own.
    let has_methods = panel.list.iter().any(|s| s.rank.count > 1);
    let branches = series.table.column("branch").filter(|_| has_methods);
    let branch = |row: usize| match branches.map(|column| &column.values) {
        Some(Values::Float(list)) => list.get(row).copied(),
        Some(Values::Integer(list)) => list.get(row).map(|k| *k as f64),
        _ => None,
    };
    let mut rows: Vec<usize> = (0..series.x.len().min(kinds.len())).collect();
    rows.sort_by(|a, b| series.x[*a].total_cmp(&series.x[*b]));
    for row in rows {
        let (x, y) = (series.x[row], series.y[row]);
        let place = frame.at(panel, x, y);
        if !(x.is_finite() && y.is_finite() && frame.holds(place)) {
            continue;
        }
        let is_near = |g: &&mut EventGroup| (g.place.0 - place.0).hypot(g.place.1 - place.1) < NEAR;
        match groups.iter_mut().rev().find(is_near) {
            Some(group) => group.take(row, &kinds[row], x, branch(row)),
            None => groups.push(EventGroup {
                rows: vec![row],
                kinds: vec![kinds[row].clone()],
                values: vec![x],
                branches: vec![branch(row)],
                place,
            }),
        }
    }
    groups
}

fn events<'a, 'b>(series: &'b DrawnSeries<'a>) -> Option<(&'b DrawnSeries<'a>, &'b Vec<String>)> {
    match &series.drawing {
        DrawnContent::Events(kinds) => Some((series, kinds)),
        _ => None,
    }
}

/// Kinds that are drawn, each once; last the sign for several at one place.
pub(super) fn kinds(groups: &[EventGroup]) -> Vec<&str> {
    let mut list: Vec<&str> = Vec::new();
    let own = groups
        .iter()
        .flat_map(|g| g.kinds.iter().map(String::as_str));
    for kind in own.chain(groups.iter().map(EventGroup::shape)) {
        if !list.contains(&kind) {
            list.push(kind);
        }
    }
    list
}

impl EventGroup {
    /// Adds an event. One that another branch has as well counts once; each event has one such twin.
    fn take(&mut self, row: usize, kind: &str, value: f64, branch: Option<f64>) {
        let twin = (0..self.kinds.len()).find(|k| {
            let is_near = (self.values[*k] - value).abs() <= SAME * value.abs();
            let is_other = self.branches[*k].is_some_and(|b| branch.is_some_and(|own| own != b));
            self.kinds[*k] == kind && is_near && is_other
        });
        if let Some(k) = twin {
            self.branches[k] = None;
            return;
        }
        self.rows.push(row);
        self.kinds.push(kind.to_owned());
        self.values.push(value);
        self.branches.push(branch);
    }

    /// Place of the first event that the panel shows.
    fn spot(
        &self,
        frame: &Frame,
        panel: &Shown<'_>,
        series: &DrawnSeries<'_>,
    ) -> Option<(f64, f64)> {
        let rows = self.rows.iter().filter(|row| **row < series.x.len());
        rows.map(|row| frame.at(panel, series.x[*row], series.y[*row]))
            .find(|at| at.0.is_finite() && at.1.is_finite() && frame.holds(*at))
    }

    /// Kind whose marker represents the group.
    fn shape(&self) -> &str {
        match self.kinds.iter().all(|k| *k == self.kinds[0]) {
            true => &self.kinds[0],
            false => SEVERAL,
        }
    }
}

/// Stands for events of several kinds at one place.
pub(super) const SEVERAL: &str = "several";

/// Markers and numbers of one panel.
pub(super) fn draw(
    scene: &mut Scene,
    sheet: &Sheet,
    frame: &Frame,
    panel: &Shown<'_>,
    groups: &[EventGroup],
) {
    let Some((series, _)) = panel.list.iter().find_map(events) else {
        return;
    };
    let spots: Vec<(usize, (f64, f64))> = (groups.iter().enumerate())
        .filter_map(|(number, group)| Some((number, group.spot(frame, panel, series)?)))
        .collect();
    for (number, at) in &spots {
        marker(scene, *at, groups[*number].shape());
    }
    let mut taken = TakenRoom::by_markers(spots.iter().map(|(_, at)| *at));
    let size = sheet.tick - 2;
    let font = f64::from(size);
    for (number, at) in spots.into_iter().filter(|(number, _)| *number < MOST) {
        let text = (number + 1).to_string();
        let half = (0.5 * text_width(&text, font), 0.4 * font);
        let Some(place) = taken.beside(at, half, frame) else {
            continue;
        };
        let (x, y) = place.middle;
        if place.is_far {
            // To the edge of the text: as far as its half width or half height allows.
            let way = (at.0 - x, at.1 - y);
            let share = (half.0 / way.0.abs()).min(half.1 / way.1.abs());
            let (a, b) = (x + share * way.0, y + share * way.1);
            let d = format!("M{:.2} {:.2}L{a:.2} {b:.2}", at.0, at.1);
            stroke(scene, d, FAINT, 0.7, None);
        }
        let style = TextStyle::level(size, TextAnchor::Middle);
        put_text(scene, (x, y + 0.36 * font), &text, style);
    }
}

/// One line per group: its number, what happens, where.
pub(super) fn lines(groups: &[EventGroup]) -> Vec<String> {
    let mut list: Vec<String> = groups.iter().take(MOST).enumerate().map(line).collect();
    if groups.len() > MOST {
        list.push(format!(
            "and {} more in the table of events",
            groups.len() - MOST
        ));
    }
    list
}

fn line((number, group): (usize, &EventGroup)) -> String {
    let mut counts: Vec<(&str, usize)> = Vec::new();
    for kind in &group.kinds {
        match counts.iter_mut().find(|(known, _)| known == kind) {
            Some((_, count)) => *count += 1,
            None => counts.push((kind, 1)),
        }
    }
    let words = counts.iter().map(|(kind, count)| match count {
        1 => short(kind),
        n => format!("{n} {}", short(kind)),
    });
    let words: Vec<String> = words.collect();
    let low = group.values.iter().copied().fold(f64::INFINITY, f64::min);
    let high = group
        .values
        .iter()
        .copied()
        .fold(f64::NEG_INFINITY, f64::max);
    let (a, b) = (digits(low), digits(high));
    let place = if a == b { a } else { format!("{a} to {b}") };
    format!("{}: {}, {place}", number + 1, words.join(", "))
}

/// A kind of event in a few letters, as the legend explains them.
pub(super) fn short(kind: &str) -> String {
    match kind {
        "fold" => "F".into(),
        "branch_point" => "BP".into(),
        "period_doubling" => "PD".into(),
        "neimark_sacker" => "NS".into(),
        "grazing" => "G".into(),
        other => kind_text(other),
    }
}

/// Five significant digits.
fn digits(x: f64) -> String {
    let size = if x == 0.0 {
        0
    } else {
        x.abs().log10().floor() as i32
    };
    let decimals = (4 - size).clamp(0, 12) as usize;
    format!("{x:.decimals$}").replace('-', "\u{2212}")
}

/// Kind of an event as it is said.
pub(super) fn kind_text(kind: &str) -> String {
    match kind.strip_prefix("resonance_") {
        Some(ratio) => format!("resonance {}", ratio.replace('_', ":")),
        None => readable(kind).replace("neimark sacker", "Neimark-Sacker"),
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_group_says_what_and_where() {
        let group = |kinds: &[&str], values: &[f64]| EventGroup {
            rows: (0..kinds.len()).collect(),
            kinds: kinds.iter().map(|k| k.to_string()).collect(),
            values: values.to_vec(),
            branches: vec![Some(0.0); kinds.len()],
            place: (0.0, 0.0),
        };
        let groups = [
            group(&["fold"], &[0.512_345_6]),
            group(&["grazing", "fold", "grazing"], &[1.2, 1.25, 1.21]),
        ];
        assert_eq!(
            lines(&groups),
            ["1: F, 0.51235", "2: 2 G, F, 1.2000 to 1.2500"]
        );
        assert_eq!(kinds(&groups), ["fold", "grazing", SEVERAL]);
        assert_eq!(digits(12345.6), "12346");
        let mut found = group(&["fold"], &[0.5]);
        for (kind, value, branch, count) in [
            ("fold", 0.500_01, 3.0, 1),
            ("fold", 0.5, 3.0, 2),
            ("grazing", 0.5, 3.0, 3),
        ] {
            found.take(9, kind, value, Some(branch));
            assert_eq!(found.kinds.len(), count, "{kind} {value}");
        }
    }
}
