//! Columns in words: what the axes of figures say.

/// Names of quantities, the part of a column's name before the point, and what they are called, symbols included.
const QUANTITIES: &[(&str, &str)] = &[
    ("q", "deformation q"),
    ("v", "rate of deformation v"),
    ("r", "relative coordinate r"),
    ("dr", "rate of the relative coordinate"),
    ("f", "force f"),
    ("acceleration", "acceleration"),
    ("peak_acceleration", "peak acceleration"),
    ("dte", "dynamic transmission error"),
    ("dte_rms", "r.m.s. dynamic transmission error"),
    (
        "dte_peak_to_peak",
        "dynamic transmission error, peak to peak",
    ),
    ("mean", "mean deformation"),
    ("rms", "r.m.s. deformation"),
    ("min", "least deformation"),
    ("max", "largest deformation"),
    ("rms_velocity", "r.m.s. rate of deformation"),
    ("effective_stiffness", "effective stiffness \u{3ba}"),
    (
        "effective_stiffness_dc",
        "effective stiffness to the mean load",
    ),
    ("contact_ratio", "contact ratio"),
    ("contact_loss", "fraction in free flight"),
    ("contact_front", "fraction on the front flank"),
    ("contact_back", "fraction on the back flank"),
    ("impacts", "impacts per period"),
    ("impacts_front", "impacts per period, front flank"),
    ("impacts_back", "impacts per period, back flank"),
    ("impacts_per_s", "impacts per second"),
    ("impact_velocity_max", "largest impact velocity"),
    ("impact_velocity_mean", "mean impact velocity"),
    ("impact_energy", "impact energy per period"),
    ("impact_energy_max", "energy of the hardest impact"),
    ("impact_energy_per_s", "impact power"),
    ("impulse", "impulse per period"),
    ("regime", "regime (0 none, 1 single, 2 double-sided)"),
    ("force_mean", "mean force"),
    ("force_max", "largest force"),
    ("force_min", "least force"),
    ("force_std", "standard deviation of the force"),
    ("force_peak", "peak force"),
    ("force_peak_factor", "peak factor of the force"),
    ("rattle_index", "rattle index"),
    ("effective_frequency", "effective natural frequency"),
    ("natural_frequency", "natural frequency"),
    ("amplitude", "amplitude"),
    ("phase", "phase"),
    ("frequency_hz", "excitation frequency"),
    ("speed_rpm", "speed"),
    ("omega", "excitation frequency \u{3c9}/\u{3c9}c"),
    ("T", "time T"),
    ("t", "time t"),
    ("tau", "phase \u{3c4}"),
    ("multiplier_modulus", "modulus of the largest multiplier"),
    ("lyapunov_1", "largest Lyapunov exponent"),
    ("period", "period"),
];

/// Steps of a path that say nothing that its other steps do not.
const CONTAINERS: &[&str] = &[
    "bodies",
    "connections",
    "loads",
    "reduced",
    "element",
    "elements",
    "damping",
    "reference",
];

/// A column's name in words.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct Words {
    /// The quantity with its symbol: `deformation q`.
    pub quantity: String,
    /// Connection, body or mode; empty where there is none.
    pub subject: String,
}

impl Words {
    /// Of the column `name`, such as `q.mesh_1`. A quantity that nobody knows keeps its name.
    pub fn of(name: &str) -> Words {
        let (quantity, subject) = name.split_once('.').unwrap_or((name, ""));
        if let ("level", true) = (quantity, subject.contains('.')) {
            return Words {
                quantity: "level".into(),
                subject: Words::of(subject).axis(""),
            };
        }
        let known = QUANTITIES.iter().find(|(key, _)| *key == quantity);
        match known {
            Some((_, words)) => Words {
                quantity: (*words).into(),
                subject: match subject.parse::<usize>() {
                    Ok(number) => format!("mode {number}"),
                    Err(_) => readable(subject),
                },
            },
            None if name.contains('.') => Words::of_path(name),
            // A name of the user's.
            None => Words {
                quantity: readable(name),
                subject: String::new(),
            },
        }
    }

    /// Of a number of the model, by its path: the quantity and what it belongs to, each list with its place counted from 1.
    fn of_path(path: &str) -> Words {
        let mut parts: Vec<String> = Vec::new();
        for step in path.split('.') {
            match (step.parse::<usize>(), parts.last_mut()) {
                (Ok(place), Some(list)) => {
                    let one = list.strip_suffix('s').filter(|one| *one != "co");
                    *list = format!("{} {}", one.unwrap_or(list), place + 1);
                }
                _ => parts.push(readable(step)),
            }
        }
        let last = parts.pop().unwrap_or_default();
        let is_load = parts.iter().any(|part| part == "loads");
        let quantity = match last.as_str() {
            "mean" | "amplitude" | "phase" if is_load => format!("{last} of the load"),
            part if is_load && ["cos ", "sin "].iter().any(|f| part.starts_with(f)) => {
                format!("load, {} part {}", &part[..3], &part[4..])
            }
            "modal ratio" => "modal damping ratio".into(),
            "stiffness proportional" => "stiffness-proportional damping".into(),
            _ => last,
        };
        parts.retain(|part| !CONTAINERS.contains(&part.as_str()));
        Words {
            quantity,
            subject: parts.join(", "),
        }
    }

    /// Text of an axis of values that are given to a number of the model, or to the excitation frequency.
    pub fn of_number(path: &str, unit: &str) -> String {
        match (path, unit) {
            ("frequency", "") => "excitation frequency \u{3c9}/\u{3c9}c".into(),
            ("frequency", unit) => format!("excitation frequency [{unit}]"),
            _ => Words::of(path).axis(unit),
        }
    }

    /// Text of an axis: quantity, subject, unit.
    pub fn axis(&self, unit: &str) -> String {
        let text = match self.subject.as_str() {
            "" => self.quantity.clone(),
            subject => format!("{}, {subject}", self.quantity),
        };
        match unit {
            "" => text,
            unit => format!("{text} [{unit}]"),
        }
    }
}

/// A name as it is read: blanks for underscores.
pub fn readable(name: &str) -> String {
    name.replace('_', " ")
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn columns_are_said_in_words() {
        let axis = |name, unit| Words::of(name).axis(unit);
        assert_eq!(axis("q.mesh_1", "m"), "deformation q, mesh 1 [m]");
        assert_eq!(axis("natural_frequency.2", ""), "natural frequency, mode 2");
        assert_eq!(axis("largest_force", "N"), "largest force [N]");
        assert_eq!(axis("bodies.a_1.inertia", ""), "inertia, a 1");
        assert_eq!(axis("stop.gap", "m"), "gap, stop [m]");
        assert_eq!(axis("level.q.m_0", "dB"), "level, deformation q, m 0 [dB]");
        let path = "connections.clutch.element.stages.0.hysteresis";
        assert_eq!(axis(path, "N m"), "hysteresis, clutch, stage 1 [N m]");
        let path = "loads.A.harmonics.1.amplitude";
        assert_eq!(
            axis(path, "N m"),
            "amplitude of the load, A, harmonic 2 [N m]"
        );
        let path = "reduced.loads.harmonics.0.cos.1";
        assert_eq!(axis(path, ""), "load, cos part 2, harmonic 1");
        assert_eq!(axis("damping.modal_ratio", ""), "modal damping ratio");
    }
}
