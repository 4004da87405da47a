//! Legend of a static figure: entries in columns below the panels, where they cannot cover a curve.

use super::series::{Drawing, Series, State};

/// Sample drawn before the text of an entry.
#[derive(Debug, Clone, PartialEq, Eq)]
pub(super) enum Sample {
    Stroke(State),
    Cross,
    Dot,
    Patch(String),
    Event(String),
}

#[derive(Debug, Clone, PartialEq, Eq)]
pub(super) struct Entry {
    pub sample: Sample,
    pub color: &'static str,
    pub text: String,
}

/// Colour of what belongs to no curve: events, the meaning of dashes.
pub(super) const NEUTRAL: &str = "#222222";

/// Width of the sample with its gap, in pixels.
pub(super) const SAMPLE_WIDTH: f64 = 40.0;

/// Entries in order of appearance: curves, then the meaning of the strokes, then the kinds of events.
pub(super) fn entries(panels: &[Vec<Series>]) -> Vec<Entry> {
    let (mut curves, mut states, mut events) = (Vec::new(), Vec::new(), Vec::new());
    for series in panels.iter().flatten() {
        let sample = match &series.drawing {
            Drawing::Runs(runs) => {
                states.extend(runs.iter().map(|r| r.state));
                Sample::Stroke(State::Plain)
            }
            Drawing::Crosses => Sample::Cross,
            Drawing::Dots => Sample::Dot,
            Drawing::Cells(raster) => {
                for level in raster.legend() {
                    let sample = Sample::Patch(level.color.clone());
                    push(&mut curves, sample, NEUTRAL, &level.text);
                }
                continue;
            }
            Drawing::Events(kinds) => {
                events.extend(visible_kinds(series, kinds));
                continue;
            }
        };
        push(&mut curves, sample, series.color(), &series.curve.label);
    }
    for (state, text) in [
        (State::Stable, "stable"),
        (State::Unstable, "unstable"),
        (State::Unknown, "stability unknown"),
    ] {
        if states.contains(&state) {
            push(&mut curves, Sample::Stroke(state), NEUTRAL, text);
        }
    }
    for kind in events {
        let text = kind_text(&kind);
        push(&mut curves, Sample::Event(kind), NEUTRAL, &text);
    }
    curves
}

/// Kind of an event as it is said.
pub(super) fn kind_text(kind: &str) -> String {
    match kind {
        "neimark_sacker" => "Neimark-Sacker".to_string(),
        other => other.replace('_', " "),
    }
}

fn visible_kinds(series: &Series, kinds: &[String]) -> Vec<String> {
    let drawn = |k: usize| series.x[k].is_finite() && series.y[k].is_finite();
    (0..kinds.len().min(series.y.len()))
        .filter(|&k| drawn(k))
        .map(|k| kinds[k].clone())
        .collect()
}

/// Adds an entry; one that says the same in another colour, as panels do, becomes neutral instead.
fn push(list: &mut Vec<Entry>, sample: Sample, color: &'static str, text: &str) {
    let same = |e: &&mut Entry| e.sample == sample && e.text == text;
    match list.iter_mut().find(same) {
        Some(entry) if entry.color != color => entry.color = NEUTRAL,
        Some(_) => {}
        None if text.is_empty() => {}
        None => list.push(Entry {
            sample,
            color,
            text: text.to_string(),
        }),
    }
}

/// Columns of equal width that hold the entries; texts too long for the page are cut.
pub(super) fn columns(entries: &mut [Entry], width: f64, font: f64) -> usize {
    let room = ((width - SAMPLE_WIDTH) / (CHARACTER * font)) as usize;
    for entry in entries.iter_mut() {
        if entry.text.chars().count() > room {
            entry.text = entry.text.chars().take(room.saturating_sub(1)).collect();
            entry.text.push('…');
        }
    }
    let widest = entries.iter().map(|e| text_width(&e.text, font));
    let widest = widest.fold(0.0, f64::max) + SAMPLE_WIDTH + 16.0;
    ((width / widest) as usize).clamp(1, entries.len().max(1))
}

/// Mean width of a character over the font size, for the wide fonts among those asked for.
const CHARACTER: f64 = 0.6;

/// Estimated width of a text.
pub(super) fn text_width(text: &str, font: f64) -> f64 {
    text.chars().count() as f64 * CHARACTER * font
}
