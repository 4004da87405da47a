//! What the user writes, in SI units: bodies, connections, loads, damping, scaling; or a reduced, nondimensional system.

mod arms;
mod builder;
mod change;
mod connection;
mod cycle;
mod drawing;
mod fields;
mod geometry;
pub mod kinematics;
mod law;
mod load;
mod matrices;
mod mean_motion;
mod measured;
mod motion;
mod names;
mod orders;
mod planets;
mod profile;
mod read;
mod reduced;
mod series;
mod slot;
mod teeth;
mod train;
mod value;

pub use arms::Teeth;
pub use builder::ModelBuilder;
pub use fields::{NAMES, check_name, is_name};
pub use geometry::GEOMETRY;
pub use mean_motion::MeanMotion;
pub use measured::columns_of;
pub use motion::{BodyCourse, BodyMotion};
pub use read::{SCHEMA, locate, read};
pub use slot::Affected;
pub use value::{Follower, Knob, NamedNumber};

use crate::element::Element;
use crate::numeric::broken_line::BrokenLine;
use crate::numeric::growth::Growth;
use crate::numeric::periodic::Periodic;
use crate::quantity::UnitDimension;
use crate::yaml::Node;
use indexmap::IndexMap;
use nalgebra::DMatrix;
use std::path::PathBuf;
use std::sync::Arc;

/// A valid model: mechanics and analyses, a value whose numbers have names.
///
/// ```
/// use gearlash::model::Model;
///
/// let mut model = Model::from_yaml(
///     "bodies: {A: {inertia: 1 kg m^2}}\n\
///      connections:\n  spring: {ground: A, stiffness: 4 N m/rad, element: {type: backlash, half_gap: 1 mrad}}\n",
/// )?;
/// let gap = model.knob("spring.half_gap")?;
/// assert_eq!(model.get(&gap), 1e-3);
/// model.set(&gap, 2e-3)?;
/// assert_eq!(gap.unit(), "rad");
/// assert!(model.set(&gap, -1.0).is_err());
/// # Ok::<(), gearlash::error::Error>(())
/// ```
#[derive(Debug, Clone)]
#[non_exhaustive]
pub struct Model {
    /// Name of the model.
    pub name: String,
    /// The mechanics.
    pub structure: Structure,
    /// Units of the results.
    pub report_units: ReportUnits,
    /// Warnings.
    pub warnings: Vec<String>,
    /// The tree that it was read from: names and analyses.
    document: Arc<Node>,
    /// Tables beside the model file that are part of it.
    pub files: Vec<PathBuf>,
}

impl Model {
    /// A model of mechanics that were put together by hand: its numbers have no names, and it has no analyses.
    pub fn of(name: impl Into<String>, structure: Structure, report_units: ReportUnits) -> Model {
        Model {
            name: name.into(),
            structure,
            report_units,
            files: Vec::new(),
            warnings: Vec::new(),
            document: Arc::default(),
        }
    }

    /// Units of deformation and force of a connection, by its number: `("m", "N")` or `("rad", "N m")`.
    pub fn units_of(&self, connection: usize) -> (&'static str, &'static str) {
        let unit = match &self.structure {
            Structure::Train(train) => train.connections.get_index(connection).map(|(_, c)| c.unit),
            Structure::Reduced(_) => None,
        };
        match unit {
            Some(DeformationUnit::Metre) => ("m", "N"),
            Some(DeformationUnit::Radian) => ("rad", "N m"),
            None => ("", ""),
        }
    }
}

/// Units of the results.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum ReportUnits {
    /// Displacements over l, frequencies over omega_c.
    Nondimensional,
    /// m, rad, N, N m, Hz.
    Si,
}

/// The two front doors.
#[derive(Debug, Clone)]
pub enum Structure {
    /// Bodies and connections, SI.
    Train(Train),
    /// Matrices of a published nondimensional system.
    Reduced(Reduced),
}

/// A train of bodies and connections, SI units.
#[derive(Debug, Clone)]
pub struct Train {
    /// Inertias by name, in the order of the file.
    pub bodies: IndexMap<String, Body>,
    /// Connections by name, in the order of the file, which chooses the relative coordinates.
    pub connections: IndexMap<String, Connection>,
    /// Damping of the whole train.
    pub damping: Damping,
    /// External torques (forces on translating masses) by body.
    pub loads: IndexMap<String, Load>,
    /// Bodies whose motion is prescribed.
    pub motions: Vec<BodyMotion>,
    /// Characteristic values.
    pub scaling: Scaling,
    /// Speeds of all bodies; `None` without a reference shaft.
    pub mean_motion: Option<MeanMotion>,
    /// Bodies whose mean torque \[N m\] balances all others.
    pub balanced: Vec<(usize, f64)>,
    /// Revolutions of the reference (periods of the excitation frequency) in one period of everything that excites.
    pub revolutions: usize,
    /// Coordinates that matrices couple.
    pub parts: Vec<MatrixPart>,
}

/// Bodies whose inertias are a matrix, and the dampers of the connections that hold them together.
#[derive(Debug, Clone, PartialEq)]
pub struct MatrixPart {
    /// Bodies, the coordinates of the part.
    pub bodies: Vec<usize>,
    /// M, symmetric and positive definite; its diagonal is what the bodies have as inertia.
    pub inertia: DMatrix<f64>,
    /// Connections that its stiffness matrix became.
    pub connections: Vec<usize>,
    /// S: forces of these connections per rate of their deformations.
    pub damping: Option<DMatrix<f64>>,
}

impl Train {
    /// Whether the motion of a body is prescribed.
    pub fn is_moved(&self, body: usize) -> bool {
        self.motions.iter().any(|motion| motion.body == body)
    }

    /// A body whose prescribed motion is a function of time.
    pub fn moved_over_time(&self) -> Option<&BodyMotion> {
        let is_timed = |motion: &&BodyMotion| matches!(motion.course, BodyCourse::Timed(_));
        self.motions.iter().find(is_timed)
    }
}

/// An inertia.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Body {
    /// kg m^2, or kg for a translating mass; > 0.
    pub inertia: f64,
    /// Whether the body turns or slides.
    pub motion: Motion,
    /// Drag that opposes its mean rotation.
    pub drag: Drag,
}

/// A torque that opposes the mean rotation of a body.
///
/// ```text
/// T = -sign(w) (constant + viscous |w|)
/// ```
#[derive(Debug, Clone, Copy, Default, PartialEq)]
pub struct Drag {
    /// N m (N for a translating mass), >= 0.
    pub constant: f64,
    /// N m s/rad, >= 0: follows the mean speed.
    pub viscous: f64,
}

impl Drag {
    /// The torque at a mean speed \[rad/s\].
    pub fn torque(&self, speed: f64) -> f64 {
        match speed == 0.0 {
            true => 0.0,
            false => -speed.signum() * (self.constant + self.viscous * speed.abs()),
        }
    }
}

/// Motion of a body.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Motion {
    /// Angle \[rad\], torque \[N m\].
    Rotation,
    /// Displacement \[m\], force \[N\].
    Translation,
}

/// Unit of a connection's deformation.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum DeformationUnit {
    /// m; force in N, stiffness in N/m.
    Metre,
    /// rad; moment in N m, stiffness in N m/rad.
    Radian,
}

impl DeformationUnit {
    /// Unit of a deformation between bodies of that motion with lever arms 1.
    pub fn of(motion: Motion) -> DeformationUnit {
        match motion {
            Motion::Rotation => DeformationUnit::Radian,
            Motion::Translation => DeformationUnit::Metre,
        }
    }

    /// Of the deformation: m or rad.
    pub fn dimension(self) -> UnitDimension {
        match self {
            DeformationUnit::Metre => UnitDimension::LENGTH,
            DeformationUnit::Radian => UnitDimension::ANGLE,
        }
    }

    /// Of the stiffness: N/m or N m/rad.
    pub fn stiffness(self) -> UnitDimension {
        match self {
            DeformationUnit::Metre => UnitDimension::STIFFNESS,
            DeformationUnit::Radian => UnitDimension::TORSIONAL_STIFFNESS,
        }
    }

    /// Of a dashpot: N s/m or N m s/rad.
    pub fn damping(self) -> UnitDimension {
        match self {
            DeformationUnit::Metre => UnitDimension::DAMPING,
            DeformationUnit::Radian => UnitDimension::TORSIONAL_DAMPING,
        }
    }
}

/// A compliant connection: one row of lever arms, a stiffness and a law.
#[derive(Debug, Clone)]
pub struct Connection {
    /// Lever arms: body index and arm (m, or 1 for shafts and masses).
    pub arms: Vec<(usize, f64)>,
    /// Unit of the deformation.
    pub unit: DeformationUnit,
    /// The wheels of a mesh that is given by tooth numbers.
    pub teeth: Option<Teeth>,
    /// Reference stiffness K [N/m or N m/rad], > 0. Where the law is not a spring it cancels in the force.
    pub stiffness: f64,
    /// Viscous damper parallel to the law [N s/m or N m s/rad], >= 0.
    pub damping: f64,
    /// The law, parameters in SI units.
    pub element: Box<dyn Element>,
    /// Relative stiffness against the excitation phase, mean 1.
    pub stiffness_variation: Option<Periodic>,
    /// Static transmission error [m or rad] against the excitation phase.
    pub transmission_error: Option<Periodic>,
    /// Own displacement scale l [m or rad].
    pub length: Option<f64>,
}

impl Connection {
    /// Stiffness in full contact: K, and 0 where the law is not a spring.
    pub fn contact_stiffness(&self) -> f64 {
        if self.element.is_spring() {
            self.stiffness
        } else {
            0.0
        }
    }
}

/// Damping of the whole train; each adds to the connections' own dampers.
#[derive(Debug, Clone, Default, PartialEq)]
pub struct Damping {
    /// Ratio of every elastic mode, or one ratio a mode, ascending.
    pub modal: Option<ModalDamping>,
    /// c of C = c K \[s\].
    pub stiffness_proportional: f64,
}

/// Modal damping ratios.
#[derive(Debug, Clone, PartialEq)]
pub enum ModalDamping {
    /// The same for every elastic mode.
    Uniform(f64),
    /// One for each elastic mode, ascending frequency.
    PerMode(Vec<f64>),
}

/// A torque: mean + sum of amplitude cos(order phase + phase), and a measured cycle.
#[derive(Debug, Clone, PartialEq)]
pub struct Load {
    /// N m, or N on a translating mass; always `Periodic::Fourier`.
    pub series: Periodic,
    /// Further parts, in the same units.
    pub others: Vec<LoadPart>,
}

/// A part of a load.
#[derive(Debug, Clone, PartialEq)]
pub enum LoadPart {
    /// A broken line over a cycle.
    Cycle(Periodic),
    /// Harmonics whose amplitude depends on the speed of the reference \[rad/s\], or a drag, whose mean does; with an order of the
    /// reference where they have no common period with the rest, order 1 of the series.
    Growing(Periodic, Growth, Option<f64>),
    /// A broken line over time \[s\]. Where there is no time it is what it was before t = 0.
    Profile(BrokenLine),
}

impl Load {
    /// Mean torque over a period.
    pub fn mean_torque(&self) -> f64 {
        let part = |part: &LoadPart| match part {
            LoadPart::Cycle(series) | LoadPart::Growing(series, ..) => series.mean(),
            LoadPart::Profile(line) => start_of(line),
        };
        self.series.mean() + self.others.iter().map(part).sum::<f64>()
    }

    /// Bound on the distance from the mean.
    pub fn swing(&self) -> f64 {
        let part = |part: &LoadPart| match part {
            LoadPart::Cycle(series) | LoadPart::Growing(series, ..) => series.swing(),
            LoadPart::Profile(line) => 2.0 * line.largest(),
        };
        self.series.swing() + self.others.iter().map(part).sum::<f64>()
    }

    /// Whether it is the same at every phase.
    pub fn is_constant(&self) -> bool {
        let part = |part: &LoadPart| match part {
            LoadPart::Cycle(series) | LoadPart::Growing(series, ..) => series.is_constant(),
            LoadPart::Profile(line) => line.points().len() == 1,
        };
        self.series.is_constant() && self.others.iter().all(part)
    }

    /// Orders that have no common period with the rest.
    pub fn free_orders(&self) -> impl Iterator<Item = f64> + '_ {
        self.others.iter().filter_map(|part| match part {
            LoadPart::Growing(_, _, free) => *free,
            LoadPart::Cycle(_) | LoadPart::Profile(_) => None,
        })
    }

    /// Whether it is a function of time.
    pub fn has_profile(&self) -> bool {
        let mut parts = self.others.iter();
        parts.any(|part| matches!(part, LoadPart::Profile(_)))
    }
}

/// Value of a function of time before t = 0.
pub fn start_of(line: &BrokenLine) -> f64 {
    line.on(0.0, -f64::MIN_POSITIVE).value
}

/// Characteristic frequency and displacement.
#[derive(Debug, Clone, PartialEq)]
pub struct Scaling {
    /// Choice of omega_c.
    pub frequency: FrequencyScale,
    /// l for every connection without its own `length`; per connection its first nonzero breakpoint when absent.
    pub length: Option<f64>,
}

/// Choice of the characteristic frequency.
#[derive(Debug, Clone, Copy, PartialEq)]
pub enum FrequencyScale {
    /// First elastic natural frequency in full contact.
    FirstMode,
    /// Natural frequency of the first connection alone between its bodies: omega_c^2 = K_1 sum(arm^2 / inertia).
    FirstConnection,
    /// A value [rad/s].
    Value(f64),
}

/// A nondimensional system as published: omega_c = 1.
#[derive(Debug, Clone)]
pub struct Reduced {
    /// kappa, n x e.
    pub stiffness: DMatrix<f64>,
    /// W, e x n.
    pub element_map: DMatrix<f64>,
    /// Gam.
    pub damping: ReducedDamping,
    /// Laws by name, e of them.
    pub elements: IndexMap<String, ReducedElement>,
    /// Loads by coordinate, n of them; `Periodic::Fourier`.
    pub loads: Vec<Periodic>,
    /// Periods of the excitation frequency in one period of everything that excites.
    pub revolutions: usize,
}

/// A law of a reduced system.
#[derive(Debug, Clone)]
pub struct ReducedElement {
    /// The law, nondimensional.
    pub element: Box<dyn Element>,
    /// Relative stiffness against the excitation phase, mean 1.
    pub stiffness_variation: Option<Periodic>,
    /// Transmission error against the excitation phase.
    pub transmission_error: Option<Periodic>,
}

/// Damping of a reduced system.
#[derive(Debug, Clone, PartialEq)]
pub enum ReducedDamping {
    /// Gam = 2 zeta (kappa W)^(1/2).
    ModalRatio(f64),
    /// Gam itself, n x n.
    Matrix(DMatrix<f64>),
    /// Gam = c kappa W.
    StiffnessProportional(f64),
}
