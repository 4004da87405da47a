//! Torques on bodies as excitations.

use crate::model::{BodyCourse, Load, LoadPart, start_of};
use crate::numeric::periodic::Periodic;
use crate::system::LoadKind;

/// A part of a load \[N m or N\], over the phase, the speed over omega_c, or omega_c t.
#[derive(Debug, Clone)]
pub struct Torque {
    /// Periodic in the phase.
    pub series: Periodic,
    /// Relation to the torque.
    pub kind: LoadKind,
}

/// The parts of a load, which add up; `w_c`: omega_c \[rad/s\]; revolutions of the reference in one turn of the phase.
pub(super) fn torques(
    load: &Load,
    (w_c, revolutions): (f64, usize),
) -> impl Iterator<Item = Torque> + '_ {
    let own = Torque {
        series: load.series.clone(),
        kind: LoadKind::Value,
    };
    let other = move |part: &LoadPart| match part {
        LoadPart::Cycle(series) => Torque {
            series: series.clone(),
            kind: LoadKind::Value,
        },
        LoadPart::Growing(series, growth, free) => Torque {
            series: series.clone(),
            kind: LoadKind::Orders {
                ratio: free.map_or(1.0, |order| order * revolutions as f64),
                growth: growth.scaled(1.0 / w_c),
            },
        },
        LoadPart::Profile(line) => Torque {
            series: Periodic::Fourier {
                mean: start_of(line),
                harmonics: Vec::new(),
            },
            kind: LoadKind::Timed(line.scaled(w_c, 1.0)),
        },
    };
    std::iter::once(own).chain(load.others.iter().map(other))
}

/// Acceleration of a body with prescribed motion \[rad/s^2; m/s^2\]; `None` where it moves evenly for all that is known.
pub(super) fn course(course: &BodyCourse, w_c: f64) -> Option<Torque> {
    let torque = match course {
        BodyCourse::PerPhase { slope, .. } => Torque {
            series: slope.scaled(w_c * w_c),
            kind: LoadKind::Acceleration,
        },
        BodyCourse::Speed(series) => Torque {
            series: series.scaled(w_c),
            kind: LoadKind::Rate,
        },
        BodyCourse::Timed(_) => Torque {
            series: Periodic::Fourier {
                mean: 0.0,
                harmonics: Vec::new(),
            },
            kind: LoadKind::Timed(course.acceleration_over_time()?.scaled(w_c, 1.0)),
        },
    };
    Some(torque)
}
