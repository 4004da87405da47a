//! Models built in code.

use super::{Load, Model, read};
use crate::element::Element;
use crate::error::{Diagnostic, Error};
use crate::numeric::periodic::{Harmonic, Periodic};
use crate::yaml::{Node, Value, join};
use indexmap::IndexMap;

impl Model {
    /// Empty builder: see [`ModelBuilder`].
    pub fn builder() -> ModelBuilder {
        ModelBuilder::default()
    }
}

impl Load {
    /// A constant torque \[N m\]; a force \[N\] on a translating mass.
    pub fn mean(mean: f64) -> Load {
        let harmonics = Vec::new();
        Load {
            series: Periodic::Fourier { mean, harmonics },
            others: Vec::new(),
        }
    }

    /// The load plus amplitude cos(order phase). `order`: multiple of the excitation frequency, >= 1.
    #[must_use]
    pub fn harmonic(self, order: usize, amplitude: f64) -> Load {
        self.with(order, amplitude, 0.0)
    }

    /// The load plus amplitude cos(order phase + phase_0), phase_0 in rad.
    #[must_use]
    pub fn harmonic_at(self, order: usize, amplitude: f64, phase: f64) -> Load {
        let (sin, cos) = phase.sin_cos();
        self.with(order, amplitude * cos, 0.0 - amplitude * sin)
    }

    fn with(mut self, order: usize, cos: f64, sin: f64) -> Load {
        if let Periodic::Fourier { harmonics, .. } = &mut self.series {
            harmonics.push(Harmonic { order, cos, sin });
        }
        self
    }
}

/// Builder of a model from bodies, connections, damping and loads, in SI units.
///
/// Methods that describe a connection (`stiffness`, `dashpot`, `law`, `length`, `connection_key`) apply to the connection added last.
/// Errors are collected; [`ModelBuilder::build`] reports all of them, with the messages of model files.
///
/// ```
/// use gearlash::prelude::*;
///
/// let model = Model::builder()
///     .body("A", 1e-3)
///     .body("B", 1e-3)
///     .gear("mesh", ("A", 0.05), ("B", 0.05))
///     .stiffness(2e8)
///     .law(Backlash::half_gap(50e-6))
///     .modal_damping(0.05)
///     .load("A", Load::mean(100.0).harmonic(1, 150.0))
///     .load("B", Load::mean(100.0))
///     .build()?;
/// assert_eq!(model.get(&model.knob("mesh.half_gap")?), 50e-6);
/// # Ok::<(), gearlash::Error>(())
/// ```
#[derive(Debug, Clone, Default)]
#[must_use = "a builder makes a model only when `build` is called"]
pub struct ModelBuilder {
    name: Option<String>,
    bodies: IndexMap<String, Node>,
    connections: IndexMap<String, IndexMap<String, Node>>,
    damping: IndexMap<String, Node>,
    loads: IndexMap<String, Node>,
    parts: IndexMap<String, Node>,
    mistakes: Vec<Diagnostic>,
}

impl ModelBuilder {
    /// Name of the model, shown in results.
    pub fn name(mut self, name: impl Into<String>) -> Self {
        self.name = Some(name.into());
        self
    }

    /// Adds a rotating body with its inertia in kg m^2, > 0.
    pub fn body(self, name: &str, inertia: f64) -> Self {
        self.inertia(name, Node::number(inertia))
    }

    /// Adds a sliding mass in kg, > 0.
    pub fn mass(self, name: &str, mass: f64) -> Self {
        self.inertia(name, Node::quoted(format!("{mass:?} kg")))
    }

    fn inertia(mut self, name: &str, inertia: Node) -> Self {
        let body = Node::map([("inertia", inertia)]);
        let before = self.bodies.insert(name.to_owned(), body);
        self.refuse_second(before.is_some(), "bodies", name);
        self
    }

    /// Adds a mesh of two external gears: bodies with their base radii in m.
    pub fn gear(self, name: &str, first: (&str, f64), second: (&str, f64)) -> Self {
        self.connection(name, "gear", wheels(first, second))
    }

    /// Adds a mesh of an external with an internal gear: bodies with their base radii in m.
    pub fn internal_gear(self, name: &str, pinion: (&str, f64), ring: (&str, f64)) -> Self {
        self.connection(name, "internal_gear", wheels(pinion, ring))
    }

    /// Adds a shaft, or a spring between two sliding masses.
    pub fn shaft(self, name: &str, first: &str, second: &str) -> Self {
        let ends = Node::list([Node::quoted(first), Node::quoted(second)]);
        self.connection(name, "shaft", ends)
    }

    /// Adds a connection between a body and ground.
    pub fn ground(self, name: &str, body: &str) -> Self {
        self.connection(name, "ground", Node::quoted(body))
    }

    /// Adds a connection with a lever arm per body, in m.
    pub fn acts_on(self, name: &str, arms: &[(&str, f64)]) -> Self {
        let arms = arms.iter().map(|(body, arm)| (*body, Node::number(*arm)));
        self.connection(name, "acts_on", Node::map(arms))
    }

    fn connection(mut self, name: &str, kind: &str, geometry: Node) -> Self {
        let own = IndexMap::from([(kind.to_owned(), geometry)]);
        let before = self.connections.insert(name.to_owned(), own);
        self.refuse_second(before.is_some(), "connections", name);
        self
    }

    /// Reference stiffness of the last connection: N/m for meshes, N m/rad for shafts; > 0.
    pub fn stiffness(self, stiffness: f64) -> Self {
        self.detail("stiffness", Node::number(stiffness))
    }

    /// Viscous damper parallel to the law of the last connection: N s/m, or N m s/rad; >= 0.
    pub fn dashpot(self, damping: f64) -> Self {
        self.detail("damping", Node::number(damping))
    }

    /// Displacement scale of the last connection: m or rad, > 0.
    pub fn length(self, length: f64) -> Self {
        self.detail("length", Node::number(length))
    }

    /// Force law of the last connection, with parameters in SI units; default linear.
    pub fn law(mut self, law: impl Element + 'static) -> Self {
        let path = match self.connections.last() {
            Some((name, _)) => join(&join("connections", name), "element"),
            None => "connections".to_owned(),
        };
        if let Err(invalid) = law.validate() {
            self.mistakes.push(mistake(&path, invalid.to_string()));
            return self;
        }
        let law: Box<dyn Element> = Box::new(law);
        match serde_json::to_value(&law) {
            Ok(json) => self.detail("element", without_nulls(Node::from_json(&json))),
            Err(error) => {
                self.mistakes.push(mistake(&path, error.to_string()));
                self
            }
        }
    }

    /// Any key of the last connection, with a value as in a model file.
    pub fn connection_key(self, key: &str, value: &serde_json::Value) -> Self {
        self.detail(key, Node::from_json(value))
    }

    fn detail(mut self, key: &str, value: Node) -> Self {
        let Some((name, own)) = self.connections.last_mut() else {
            let message = format!("`{key}` is about a connection: add one first");
            self.mistakes.push(mistake("connections", message));
            return self;
        };
        if own.insert(key.to_owned(), value).is_some() {
            let path = join(&join("connections", name), key);
            self.mistakes.push(mistake(&path, "is given twice".into()));
        }
        self
    }

    /// Damping ratio of every elastic mode, >= 0.
    pub fn modal_damping(self, ratio: f64) -> Self {
        self.damping("modal_ratio", Node::number(ratio))
    }

    /// Damping ratios of the elastic modes, ascending frequency.
    pub fn modal_ratios(self, ratios: &[f64]) -> Self {
        let list = ratios.iter().map(|ratio| Node::number(*ratio));
        self.damping("modal_ratios", Node::list(list))
    }

    /// Damping proportional to the stiffness: c of C = c K, in s, >= 0.
    pub fn stiffness_proportional_damping(self, share: f64) -> Self {
        self.damping("stiffness_proportional", Node::number(share))
    }

    fn damping(mut self, key: &str, value: Node) -> Self {
        self.damping.insert(key.to_owned(), value);
        self
    }

    /// Load on a body.
    pub fn load(mut self, body: &str, load: Load) -> Self {
        match written(&load) {
            Some(node) => {
                let before = self.loads.insert(body.to_owned(), node);
                self.refuse_second(before.is_some(), "loads", body);
            }
            None => {
                let message = "wanted a mean and harmonics".to_owned();
                self.mistakes.push(mistake(&join("loads", body), message));
            }
        }
        self
    }

    /// Any other top-level key of a model file, such as `reference`, `scaling` or `analyses`.
    pub fn part(mut self, key: &str, value: &serde_json::Value) -> Self {
        self.parts.insert(key.to_owned(), Node::from_json(value));
        self
    }

    /// The model.
    ///
    /// # Errors
    /// [`Error::Input`] with all errors found, by the path of the part.
    pub fn build(self) -> Result<Model, Error> {
        if !self.mistakes.is_empty() {
            return Err(Error::Input(self.mistakes));
        }
        let mut root: IndexMap<String, Node> = IndexMap::new();
        root.extend(
            self.name
                .map(|name| ("name".to_owned(), Node::quoted(name))),
        );
        root.insert("bodies".into(), Node::map(self.bodies));
        let connections = self.connections.into_iter();
        let connections = connections.map(|(name, own)| (name, Node::map(own)));
        root.insert("connections".into(), Node::map(connections));
        for (key, map) in [("damping", self.damping), ("loads", self.loads)] {
            if !map.is_empty() {
                root.insert(key.into(), Node::map(map));
            }
        }
        root.extend(self.parts);
        read(&Node::map(root)).map_err(Error::Input)
    }

    fn refuse_second(&mut self, is_second: bool, part: &str, name: &str) {
        if is_second {
            let path = join(part, name);
            self.mistakes.push(mistake(&path, "is given twice".into()));
        }
    }
}

fn wheels((first, a): (&str, f64), (second, b): (&str, f64)) -> Node {
    // A map would merge two wheels of one name in silence.
    match first == second {
        true => Node::map([(first, Node::number(a))]),
        false => Node::map([(first, Node::number(a)), (second, Node::number(b))]),
    }
}

/// A load as a model file has it; `None` for other series.
fn written(load: &Load) -> Option<Node> {
    let (Periodic::Fourier { mean, harmonics }, []) = (&load.series, load.others.as_slice()) else {
        return None;
    };
    let harmonic = |h: &Harmonic| {
        let order = ("order", Node::scalar(h.order.to_string()));
        match h.sin == 0.0 {
            true => Node::map([order, ("amplitude", Node::number(h.cos))]),
            false => Node::map([
                order,
                ("amplitude", Node::number(h.cos.hypot(h.sin))),
                ("phase", Node::number((0.0 - h.sin).atan2(h.cos))),
            ]),
        }
    };
    let mut load = vec![("mean", Node::number(*mean))];
    if !harmonics.is_empty() {
        load.push(("harmonics", Node::list(harmonics.iter().map(harmonic))));
    }
    Some(Node::map(load))
}

/// A map without its empty entries.
fn without_nulls(mut node: Node) -> Node {
    if let Value::Map(map) = &mut node.value {
        map.retain(|_, entry| !entry.node.is_null());
    }
    node
}

fn mistake(path: &str, message: String) -> Diagnostic {
    Diagnostic {
        location: None,
        path: path.to_owned(),
        message,
        help: None,
    }
}
