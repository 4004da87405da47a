//! Legend of a static figure: entries in columns below the panels, where they cannot cover a curve.

use kuva::render::render::{Scene, TextAnchor};

use super::draw::{TextStyle, crosses, dots, fill, marker, marks, put_text, stroke};
use super::groups::{self, EventGroup, SEVERAL, kind_text};
use super::look::{self, FAINT, NEUTRAL, Rank, StabilityState, tint};
use super::room::Room;
use super::series::{DrawnContent, DrawnSeries};
use super::sheet::Sheet;
use super::shown::Shown;
use super::text::{cut, text_width};
use crate::report::readable;

/// Sample drawn before the text of an entry.
#[derive(Debug, Clone, PartialEq, Eq)]
enum LegendSample {
    /// A curve of this rank.
    Curve(Rank),
    /// What a stroke means.
    State(StabilityState),
    Cross,
    Dot,
    Halo,
    Patch(String),
    Event(String),
}

#[derive(Debug, Clone, PartialEq, Eq)]
struct LegendEntry {
    sample: LegendSample,
    color: &'static str,
    text: String,
}

/// Width of the sample with its gap, in pixels.
const SAMPLE_WIDTH: f64 = 32.0;

/// Entries in order of appearance: curves, then the meaning of the strokes, then the kinds of events.
fn entries(panels: &[Shown<'_>], groups: &[EventGroup]) -> Vec<LegendEntry> {
    let (mut list, mut states) = (Vec::new(), Vec::new());
    for panel in panels {
        for series in &panel.list {
            if let DrawnContent::Runs(runs) = &series.drawing {
                states.extend(runs.iter().map(|r| r.state));
            }
            if let DrawnContent::Cells(raster) = &series.drawing
                && !raster.is_continuous
            {
                for level in raster.legend() {
                    push(
                        &mut list,
                        LegendSample::Patch(level.color.clone()),
                        NEUTRAL,
                        &level.text,
                    );
                }
            }
            // A panel says itself what its only curve is.
            let label = readable(&series.curve.label);
            if label != panel.panel.heading || label.is_empty() {
                push_curve(&mut list, panel, series, &label);
            }
        }
    }
    for (state, text) in [
        (StabilityState::Stable, "stable"),
        (StabilityState::Unstable, "unstable"),
        (StabilityState::Unknown, "stability unknown"),
    ] {
        if states.contains(&state) {
            push(&mut list, LegendSample::State(state), NEUTRAL, text);
        }
    }
    for kind in groups::kinds(groups) {
        let text = match kind {
            SEVERAL => "several events".to_string(),
            kind if groups::short(kind) == kind_text(kind) => kind_text(kind),
            kind => format!("{} ({})", kind_text(kind), groups::short(kind)),
        };
        push(
            &mut list,
            LegendSample::Event(kind.to_string()),
            NEUTRAL,
            &text,
        );
    }
    list
}

fn push_curve(
    list: &mut Vec<LegendEntry>,
    panel: &Shown<'_>,
    series: &DrawnSeries<'_>,
    label: &str,
) {
    let has_lines = || {
        panel
            .list
            .iter()
            .any(|s| matches!(s.drawing, DrawnContent::Runs(_)))
    };
    match &series.drawing {
        DrawnContent::Runs(_) => push(list, LegendSample::Curve(series.rank), series.color, label),
        DrawnContent::Crosses => push(list, LegendSample::Cross, FAINT, label),
        DrawnContent::Dots if series.rank.place > 0 => {
            push(list, LegendSample::Halo, series.color, label)
        }
        DrawnContent::Dots if has_lines() => push(list, LegendSample::Dot, NEUTRAL, label),
        DrawnContent::Dots => push(list, LegendSample::Dot, series.color, label),
        DrawnContent::Coloured(_) | DrawnContent::Cells(_) | DrawnContent::Bars(_) => {}
        DrawnContent::Tornado(_) | DrawnContent::Events(_) => {}
    }
}

/// Adds an entry; one that says the same in another colour, as panels do, becomes neutral instead.
fn push(list: &mut Vec<LegendEntry>, sample: LegendSample, color: &'static str, text: &str) {
    let same = |e: &&mut LegendEntry| e.sample == sample && e.text == text;
    match list.iter_mut().find(same) {
        Some(entry) if entry.color != color => entry.color = NEUTRAL,
        Some(_) => {}
        None if text.is_empty() => {}
        None => list.push(LegendEntry {
            sample,
            color,
            text: text.to_string(),
        }),
    }
}

/// Draws the legend and moves the top of the room below it.
pub(super) fn draw(
    scene: &mut Scene,
    sheet: &Sheet,
    panels: &[Shown<'_>],
    groups: &[EventGroup],
    room: &mut Room,
) {
    let mut entries = entries(panels, groups);
    let font = f64::from(sheet.tick);
    let row = 1.55 * font;
    let mut widest = 0.0_f64;
    for entry in &mut entries {
        entry.text = cut(&entry.text, font, room.width - SAMPLE_WIDTH);
        widest = widest.max(text_width(&entry.text, font));
    }
    let columns =
        ((room.width / (widest + SAMPLE_WIDTH + 14.0)) as usize).clamp(1, entries.len().max(1));
    for (index, entry) in entries.iter().enumerate() {
        let x = room.left + (index % columns) as f64 * room.width / columns as f64;
        let y = room.top + (index / columns) as f64 * row + 5.0;
        sample(scene, entry, (x, y));
        let at = (x + SAMPLE_WIDTH, y + 0.36 * font);
        put_text(
            scene,
            at,
            &entry.text,
            TextStyle::level(sheet.tick, TextAnchor::Start),
        );
    }
    room.top += entries.len().div_ceil(columns) as f64 * row + 3.0;
}

fn sample(scene: &mut Scene, entry: &LegendEntry, (x, y): (f64, f64)) {
    let length = SAMPLE_WIDTH - 8.0;
    let middle = (x + length / 2.0, y);
    let line = format!("M{x:.2} {y:.2}h{length:.2}");
    match &entry.sample {
        LegendSample::Curve(rank) => {
            let look = look::stroke(entry.color, *rank);
            stroke(scene, line, &look.color, look.width, None);
            marks(scene, &[middle], look.mark, &look.color);
        }
        LegendSample::State(state) => {
            let (width, dashes) = look::state_stroke(1.6, *state);
            stroke(scene, line, entry.color, width, dashes);
        }
        LegendSample::Cross => crosses(scene, &[middle], entry.color),
        LegendSample::Dot => dots(scene, &[middle], entry.color, 3.6),
        LegendSample::Halo => dots(scene, &[middle], &tint(entry.color, 0.62), 7.9),
        LegendSample::Patch(color) => {
            let d = format!("M{x:.2} {:.2}h{length:.2}v9h-{length:.2}Z", y - 4.5);
            fill(scene, d, color, None);
        }
        LegendSample::Event(kind) => marker(scene, middle, kind),
    }
}
