//! Colours and strokes: one colour per connection, methods told apart in grey print too.

/// Colours that stay apart for colour-blind readers (Okabe and Ito), without the two that are weak on white; then others, so that
/// bodies, modes and orders beside many connections have colours of their own; then the same, darker and lighter.
pub(super) const PALETTE: [&str; 24] = [
    "#0072B2", "#D55E00", "#009E73", "#CC79A7", "#E69F00", "#56B4E9", "#7B4F9D", "#8C6D31",
    "#5F6A72", "#A6192E", "#5C8A00", "#1F2A6B", "#004F7A", "#F7BC8C", "#00543E", "#7A3F60",
    "#8F6200", "#A9DAF5", "#A98BE0", "#4A3813", "#C9CFD4", "#FF8A80", "#A8CC5C", "#6478DC",
];

/// Colour of what belongs to no curve: events, the meaning of dashes.
pub(super) const NEUTRAL: &str = "#222222";
/// Colour of the backbone: a hint behind the curves.
pub(super) const FAINT: &str = "#9aa3ad";
/// Dashes of what is unstable, for strokes of usual width.
pub(super) const DASHES: &str = "6 3.5";

/// Colours of a scale from low to high; the lightness rises all along, so that it survives grey print (viridis).
const SCALE: [(f64, f64, f64); 9] = [
    (68.0, 1.0, 84.0),
    (71.0, 44.0, 122.0),
    (59.0, 81.0, 139.0),
    (44.0, 113.0, 142.0),
    (33.0, 144.0, 141.0),
    (39.0, 173.0, 129.0),
    (92.0, 200.0, 99.0),
    (170.0, 220.0, 50.0),
    (253.0, 231.0, 37.0),
];

/// Colour at a share of the scale, 0..1.
pub(super) fn scale_color(share: f64) -> String {
    let place = share.clamp(0.0, 1.0) * (SCALE.len() - 1) as f64;
    let k = (place as usize).min(SCALE.len() - 2);
    let mix = |a: f64, b: f64| a + (place - k as f64) * (b - a);
    let (a, b) = (SCALE[k], SCALE[k + 1]);
    hex([mix(a.0, b.0), mix(a.1, b.1), mix(a.2, b.2)])
}

/// A colour mixed with white.
pub(super) fn tint(color: &str, share: f64) -> String {
    hex(channels(color).map(|c| c + share * (255.0 - c)))
}

/// A colour mixed with black.
pub(super) fn shade(color: &str, share: f64) -> String {
    hex(channels(color).map(|c| c * (1.0 - share)))
}

fn channels(color: &str) -> [f64; 3] {
    [1, 3, 5].map(|at| {
        let digits = color.get(at..at + 2).unwrap_or("00");
        u8::from_str_radix(digits, 16).map_or(0.0, f64::from)
    })
}

fn hex(channels: [f64; 3]) -> String {
    let [r, g, b] = channels.map(|c| c.round() as u8);
    format!("#{r:02x}{g:02x}{b:02x}")
}

/// Place of a curve among those of one panel that show the same quantity drawn alike, such as the results of several methods.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(super) struct Rank {
    /// From 0.
    pub place: usize,
    /// How many there are.
    pub count: usize,
}

/// Mark on a curve.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(super) enum Mark {
    None,
    Circle,
    Square,
}

/// Style of a line.
#[derive(Debug, Clone, PartialEq)]
pub(super) struct Stroke {
    pub width: f64,
    pub color: String,
    pub mark: Mark,
}

/// Curves of one quantity lie on each other where methods agree: the first is broad and light, the others are thin, dark and
/// marked on top of it.
pub(super) fn stroke(color: &str, rank: Rank) -> Stroke {
    let (width, color, mark) = match (rank.count, rank.place) {
        (0 | 1, _) => (1.6, color.to_string(), Mark::None),
        (_, 0) => (4.6, tint(color, 0.6), Mark::None),
        (_, 1) => (1.2, shade(color, 0.35), Mark::Circle),
        _ => (1.2, NEUTRAL.to_string(), Mark::Square),
    };
    Stroke { width, color, mark }
}

/// Stability of a run of points.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(super) enum StabilityState {
    Stable,
    Unstable,
    Unknown,
    /// The curve has no stability.
    Plain,
}

/// Width and dashes of a stroke for a state of stability.
pub(super) fn state_stroke(width: f64, state: StabilityState) -> (f64, Option<&'static str>) {
    match state {
        StabilityState::Stable | StabilityState::Plain => (width, None),
        StabilityState::Unstable => (width, Some(DASHES)),
        StabilityState::Unknown => (0.5 * width, None),
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_scale_grows_lighter_all_along() {
        let lightness = |share: f64| {
            let [r, g, b] = channels(&scale_color(share));
            0.2126 * r + 0.7152 * g + 0.0722 * b
        };
        let list: Vec<f64> = (0..=20).map(|k| lightness(f64::from(k) / 20.0)).collect();
        assert!(list.windows(2).all(|w| w[1] > w[0]), "{list:?}");
    }

    #[test]
    fn no_two_colours_of_the_palette_are_close() {
        for (k, a) in PALETTE.iter().enumerate() {
            for b in &PALETTE[..k] {
                let (a, b) = (channels(a), channels(b));
                let apart = (0..3).map(|c| (a[c] - b[c]).powi(2)).sum::<f64>().sqrt();
                assert!(apart > 45.0, "{a:?} {b:?}: {apart}");
            }
        }
    }

    #[test]
    fn two_methods_differ_in_lightness_and_width() {
        let ranks = [0, 1].map(|place| stroke(PALETTE[0], Rank { place, count: 2 }));
        assert!(ranks[0].width > 3.0 * ranks[1].width);
        assert_eq!(tint("#000000", 1.0), "#ffffff");
        assert_eq!(shade("#ffffff", 1.0), "#000000");
        assert_eq!(ranks[1].mark, Mark::Circle);
    }
}
