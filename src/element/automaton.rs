//! Automata of affine regions: the structure of laws with memory, impacts or held contact.
//!
//! In a region the force is affine in the deformation q, its rate v and the memory z of the automaton; z is kept or follows the
//! deformation. A region is left at a guard. A law may be a sum of automata, each with at most one memory.
//!
//! ```text
//! f = constant + k q + c v + h z        z' = 0 or z = q + offset
//! ```

pub use crate::numeric::bernstein::Direction;

/// A law, or a part of one, as an automaton.
#[derive(Debug, Clone, PartialEq)]
pub struct Automaton {
    /// Regions; those that keep the memory cover every deformation, and a motion starts in one of them.
    pub regions: Vec<Region>,
    /// Whether there is a memory z.
    pub has_memory: bool,
}

impl Automaton {
    /// df/dq of an automaton without memory at a deformation; 0 where it is held.
    pub fn slope_at(&self, q: f64) -> f64 {
        let contains = |region: &&Region| {
            region
                .guards
                .iter()
                .all(|g| match (g.surface, g.direction) {
                    (Surface::Deformation { level, .. }, Direction::Up) => q <= level,
                    (Surface::Deformation { level, .. }, Direction::Down) => q >= level,
                    _ => true,
                })
        };
        match self.regions.iter().find(contains).map(|r| r.force) {
            Some(RegionForce::Affine { q, .. }) => q,
            _ => 0.0,
        }
    }

    /// The region in which a motion starts at a deformation, on a fixed border the one below; `tolerance`: rounding of a level.
    /// Beyond a stop the first one: the caller moves the deformation back.
    pub(crate) fn home(&self, q: f64, tolerance: impl Fn(f64) -> f64) -> usize {
        let is_home = |region: &Region| region.is_home(q, &tolerance);
        self.regions.iter().position(is_home).unwrap_or(0)
    }
}

impl Region {
    /// Whether a motion may start in it at a deformation: it keeps its memory, and no guard at a fixed level is passed by more than
    /// `tolerance` of the level.
    fn is_home(&self, q: f64, tolerance: impl Fn(f64) -> f64) -> bool {
        self.memory == MemoryRate::Kept
            && matches!(self.force, RegionForce::Affine { .. })
            && self.guards.iter().all(|g| match (g.surface, g.direction) {
                (Surface::Deformation { level, gain: 0.0 }, Direction::Up) => {
                    q - level <= tolerance(level)
                }
                (Surface::Deformation { level, gain: 0.0 }, Direction::Down) => {
                    level - q <= tolerance(level)
                }
                _ => true,
            })
    }
}

/// A region with one affine force.
#[derive(Debug, Clone, PartialEq)]
pub struct Region {
    /// The force.
    pub force: RegionForce,
    /// Evolution of the memory.
    pub memory: MemoryRate,
    /// Guards at which the region is left.
    pub guards: Vec<Guard>,
    /// Flank -1, 0 (open) or 1; of sliders the number of the region.
    pub contact: i8,
}

/// Force in a region.
#[derive(Debug, Clone, Copy, PartialEq)]
pub enum RegionForce {
    /// constant + k q + c v + h z.
    Affine {
        /// Force at rest in the origin.
        constant: f64,
        /// df/dq.
        q: f64,
        /// df/dv.
        v: f64,
        /// df/dz.
        z: f64,
    },
    /// The deformation stays at a level; the system finds the force.
    Held {
        /// The level.
        level: f64,
    },
}

impl RegionForce {
    /// A force that depends on the deformation alone.
    pub fn line(constant: f64, slope: f64) -> RegionForce {
        RegionForce::Affine {
            constant,
            q: slope,
            v: 0.0,
            z: 0.0,
        }
    }
}

/// Evolution of the memory in a region.
#[derive(Debug, Clone, Copy, PartialEq)]
pub enum MemoryRate {
    /// z' = 0.
    Kept,
    /// z = q + offset.
    Follows {
        /// The offset.
        offset: f64,
    },
}

/// A guard at which a region is left.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Guard {
    /// Monitored quantity.
    pub surface: Surface,
    /// Direction of the passage.
    pub direction: Direction,
    /// Region behind it.
    pub to: usize,
    /// Action at the passage.
    pub reset: Reset,
}

/// Quantity monitored by a guard.
#[derive(Debug, Clone, Copy, PartialEq)]
pub enum Surface {
    /// q = level + gain z.
    Deformation {
        /// Constant part.
        level: f64,
        /// Share of the memory: 0 or 1.
        gain: f64,
    },
    /// v = 0.
    Rate,
    /// The force in a held region.
    HoldingForce(f64),
}

/// Action at a guard.
#[derive(Debug, Clone, Copy, PartialEq)]
pub enum Reset {
    /// Nothing: deformation, rate and memory are continuous.
    None,
    /// An impact: the rate is reversed and multiplied by the coefficient.
    Restitution {
        /// 0 (plastic) to 1 (elastic).
        coefficient: f64,
        /// Region in which the contact rests when the impacts have died out.
        held: usize,
    },
    /// A jump of the force, on which the deformation can rest where both sides press against it.
    Jump {
        /// Region in which it rests.
        held: usize,
    },
}

/// A law without memory that is affine between breakpoints: regions from below, then one for each breakpoint where the force
/// rises by a jump, on which the deformation can rest.
pub fn line(breakpoints: &[f64], (slopes, offsets): (&[f64], &[f64]), flanks: &[i8]) -> Automaton {
    let lines = slopes.iter().zip(offsets).zip(flanks);
    let region = |((slope, offset), contact): ((&f64, &f64), &i8)| Region {
        force: RegionForce::line(*offset, *slope),
        memory: MemoryRate::Kept,
        guards: Vec::new(),
        contact: *contact,
    };
    let mut regions: Vec<Region> = lines.map(region).collect();
    for (k, level) in breakpoints.iter().enumerate() {
        let force = |r: usize| slopes[r] * level + offsets[r];
        let (below, above) = (force(k), force(k + 1));
        let held = regions.len();
        let size = below.abs().max(above.abs());
        let holds = above - below > ROUNDING * size;
        let guard = |direction: Direction, to: usize| Guard {
            surface: Surface::Deformation {
                level: *level,
                gain: 0.0,
            },
            direction,
            to,
            reset: if holds {
                Reset::Jump { held }
            } else {
                Reset::None
            },
        };
        regions[k].guards.push(guard(Direction::Up, k + 1));
        regions[k + 1].guards.push(guard(Direction::Down, k));
        if holds {
            let release = |force: f64, direction: Direction, to: usize| Guard {
                surface: Surface::HoldingForce(force),
                direction,
                to,
                reset: Reset::None,
            };
            let towards_contact = if flanks[k] == 0 {
                flanks[k + 1]
            } else {
                flanks[k]
            };
            regions.push(Region {
                force: RegionForce::Held { level: *level },
                memory: MemoryRate::Kept,
                guards: vec![
                    release(above, Direction::Up, k + 1),
                    release(below, Direction::Down, k),
                ],
                contact: towards_contact,
            });
        }
    }
    Automaton {
        regions,
        has_memory: false,
    }
}

/// Share of a force within which two sides of a breakpoint are equal.
const ROUNDING: f64 = 1e-13;
