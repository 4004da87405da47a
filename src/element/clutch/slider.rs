//! A slider that moves while the deformation is within its windows.

use crate::element::Response;
use crate::element::automaton::{
    Automaton, Direction, Guard, MemoryRate, Region, RegionForce, Reset, Surface,
};
use crate::element::jenkins::ROUNDING;

/// A slider on windows of the deformation.
#[derive(Debug, Clone, Copy)]
pub(super) struct Slider {
    /// Windows within which it moves, ascending.
    pub(super) windows: [Option<(f64, f64)>; 2],
    pub(super) stiffness: f64,
    /// Deformation of its spring at which it slips.
    pub(super) reach: f64,
}

impl Slider {
    pub(super) fn windows(&self) -> impl Iterator<Item = &(f64, f64)> {
        self.windows.iter().flatten()
    }

    /// The part of a deformation that it sees.
    pub(super) fn seen(&self, q: f64) -> f64 {
        let part = |(low, high): &(f64, f64)| q.clamp(*low, *high) - 0.0_f64.clamp(*low, *high);
        self.windows().map(part).sum()
    }

    pub(super) fn is_within(&self, q: f64) -> bool {
        self.windows().any(|(low, high)| *low <= q && q <= *high)
    }

    /// Ends of the windows.
    pub(super) fn edges(&self) -> Vec<f64> {
        let ends = self.windows().flat_map(|(low, high)| [*low, *high]);
        ends.filter(|x| x.is_finite()).collect()
    }

    /// Regions stretch by stretch: where it moves it sticks or slips up or down, elsewhere it is at rest.
    pub(super) fn automaton(&self) -> Automaton {
        let edges = self.edges();
        let middle = |k: usize| match (k.checked_sub(1).map(|j| edges[j]), edges.get(k)) {
            (None, None) => 0.0,
            (Some(low), None) => low + 1.0,
            (None, Some(high)) => high - 1.0,
            (Some(low), Some(high)) => 0.5 * (low + high),
        };
        let moves: Vec<bool> = (0..=edges.len())
            .map(|k| self.is_within(middle(k)))
            .collect();
        let first: Vec<usize> = (0..=edges.len())
            .map(|k| moves[..k].iter().map(|m| if *m { 3 } else { 1 }).sum())
            .collect();
        let mut regions = Vec::new();
        for k in 0..=edges.len() {
            let border = |level: f64, direction: Direction, to: usize| Guard {
                surface: Surface::Deformation { level, gain: 0.0 },
                direction,
                to,
                reset: Reset::None,
            };
            let mut borders = Vec::new();
            if k > 0 {
                borders.push(border(edges[k - 1], Direction::Down, first[k - 1]));
            }
            if k < edges.len() {
                borders.push(border(edges[k], Direction::Up, first[k + 1]));
            }
            // q_i = q + shift, or the shift alone.
            let shift = self.seen(middle(k)) - if moves[k] { middle(k) } else { 0.0 };
            regions.extend(match moves[k] {
                true => self.moving(first[k], shift, borders),
                false => vec![self.resting(shift, borders)],
            });
        }
        Automaton {
            regions,
            has_memory: true,
        }
    }

    /// The slider outside its windows.
    fn resting(&self, shift: f64, guards: Vec<Guard>) -> Region {
        Region {
            force: RegionForce::Affine {
                constant: self.stiffness * shift,
                q: 0.0,
                v: 0.0,
                z: -self.stiffness,
            },
            memory: MemoryRate::Kept,
            guards,
            contact: 0,
        }
    }

    /// Sticking, slipping up, slipping down on a stretch; `stick`: number of the first of them.
    fn moving(&self, stick: usize, shift: f64, borders: Vec<Guard>) -> Vec<Region> {
        let limit = |direction: Direction, to: usize| Guard {
            surface: Surface::Deformation {
                level: direction.sign() * self.reach - shift,
                gain: 1.0,
            },
            direction,
            to,
            reset: Reset::None,
        };
        let mut guards = vec![
            limit(Direction::Up, stick + 1),
            limit(Direction::Down, stick + 2),
        ];
        guards.extend(borders.iter().copied());
        let stuck = Region {
            force: RegionForce::Affine {
                constant: self.stiffness * shift,
                q: self.stiffness,
                v: 0.0,
                z: -self.stiffness,
            },
            memory: MemoryRate::Kept,
            guards,
            contact: 0,
        };
        let slip = |direction: Direction, back: Direction, contact: i8| {
            let mut guards = vec![Guard {
                surface: Surface::Rate,
                direction: back,
                to: stick,
                reset: Reset::None,
            }];
            guards.extend(borders.iter().filter(|b| b.direction == direction));
            Region {
                force: RegionForce::line(direction.sign() * self.stiffness * self.reach, 0.0),
                memory: MemoryRate::Follows {
                    offset: shift - direction.sign() * self.reach,
                },
                guards,
                contact,
            }
        };
        vec![
            stuck,
            slip(Direction::Up, Direction::Down, 1),
            slip(Direction::Down, Direction::Up, 2),
        ]
    }

    pub(super) fn respond(&self, q: f64, v: f64, z: f64) -> Response {
        let stretch = self.seen(q) - z;
        let rounding = ROUNDING * (q.abs() + self.reach);
        let slips = stretch.abs() > self.reach + rounding
            || stretch.abs() >= self.reach - rounding && stretch * v > 0.0;
        let slope = if self.is_within(q) && !slips {
            self.stiffness
        } else {
            0.0
        };
        Response {
            f: self.stiffness * stretch.clamp(-self.reach, self.reach),
            df_dq: slope,
            df_dv: 0.0,
        }
    }
}
