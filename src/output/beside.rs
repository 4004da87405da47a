//! Places for short texts beside their markers that cover neither each other nor a marker.

use super::panel::Frame;

/// Distances of the middle of a text from its marker beyond the nearest one, in pixels; a line leads to the marker there.
const RINGS: [f64; 4] = [0.0, 10.0, 21.0, 34.0];
/// Half the size of a marker, in pixels.
const MARKER: f64 = 4.2;
/// Directions, right and down positive, in the order of preference.
const DIRECTIONS: [(f64, f64); 8] = [
    (0.0, -1.0),
    (0.0, 1.0),
    (1.0, 0.0),
    (-1.0, 0.0),
    (0.8, -0.8),
    (-0.8, -0.8),
    (0.8, 0.8),
    (-0.8, 0.8),
];

/// A rectangle by its middle and half its sizes.
#[derive(Debug, Clone, Copy)]
struct Patch {
    middle: (f64, f64),
    half: (f64, f64),
}

impl Patch {
    fn meets(&self, other: &Patch) -> bool {
        (self.middle.0 - other.middle.0).abs() < self.half.0 + other.half.0
            && (self.middle.1 - other.middle.1).abs() < self.half.1 + other.half.1
    }
}

/// What a panel has no room for any more.
#[derive(Debug)]
pub(super) struct TakenRoom {
    patches: Vec<Patch>,
}

/// Place of a text.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(super) struct TextPlace {
    pub middle: (f64, f64),
    /// Whether a line has to lead to the marker.
    pub is_far: bool,
}

impl TakenRoom {
    /// Nothing but markers.
    pub fn by_markers(places: impl Iterator<Item = (f64, f64)>) -> TakenRoom {
        let half = (MARKER, MARKER);
        TakenRoom {
            patches: places.map(|middle| Patch { middle, half }).collect(),
        }
    }

    /// The nearest free place for a text of half these sizes beside the marker at `at`, which is taken from then on. None in a
    /// crowd that leaves no room inside the frame.
    pub fn beside(&mut self, at: (f64, f64), half: (f64, f64), frame: &Frame) -> Option<TextPlace> {
        let candidates = RINGS.iter().flat_map(|ring| {
            DIRECTIONS.iter().map(move |(x, y)| {
                let reach = (MARKER + half.0 + ring, MARKER + half.1 + ring);
                let middle = (at.0 + x * reach.0, at.1 + y * reach.1);
                (Patch { middle, half }, *ring > 0.0)
            })
        });
        let is_free = |patch: &Patch| {
            let corner = |sign: f64| {
                (
                    patch.middle.0 + sign * half.0,
                    patch.middle.1 + sign * half.1,
                )
            };
            frame.holds(corner(-1.0))
                && frame.holds(corner(1.0))
                && !self.patches.iter().any(|other| patch.meets(other))
        };
        let (patch, is_far) = { candidates }.find(|(patch, _)| is_free(patch))?;
        self.patches.push(patch);
        Some(TextPlace {
            middle: patch.middle,
            is_far,
        })
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn numbers_of_a_crowd_cover_neither_each_other_nor_a_marker() {
        let frame = Frame {
            left: 0.0,
            top: 0.0,
            width: 200.0,
            height: 120.0,
            has_x_texts: true,
        };
        let markers: Vec<(f64, f64)> = (0..14)
            .map(|k| (90.0 + 6.0 * f64::from(k % 5), 50.0 + 7.0 * f64::from(k / 5)))
            .collect();
        let mut taken = TakenRoom::by_markers(markers.iter().copied());
        let half = (6.0, 4.0);
        let places: Vec<TextPlace> = markers
            .iter()
            .map(|at| taken.beside(*at, half, &frame).expect("room for all"))
            .collect();
        let patches = |list: Vec<(f64, f64)>, half| {
            let patch = move |middle| Patch { middle, half };
            list.into_iter().map(patch).collect::<Vec<_>>()
        };
        let texts = patches(places.iter().map(|p| p.middle).collect(), half);
        for (k, text) in texts.iter().enumerate() {
            assert!(!texts[..k].iter().any(|other| text.meets(other)), "{k}");
            let marks = patches(markers.clone(), (MARKER, MARKER));
            assert!(!marks.iter().any(|mark| text.meets(mark)), "{k}");
        }
        assert!(places.iter().any(|p| p.is_far));
        let lone =
            TakenRoom::by_markers([(50.0, 3.0)].into_iter()).beside((50.0, 3.0), half, &frame);
        assert_eq!(lone.map(|p| (p.middle.0, p.is_far)), Some((50.0, false)));
    }
}
