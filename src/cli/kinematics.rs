//! Speeds, ratios and orders of a train, for `gearlash check`.

use super::digits::number;
use crate::model::{Connection, Model, Structure, Train};
use comfy_table::{Table, presets};
use std::f64::consts::TAU;
use std::fmt::Write;

/// The mean motion of a model; empty where nothing is known of it.
pub(super) fn text(model: &Model) -> String {
    let Structure::Train(train) = &model.structure else {
        return String::new();
    };
    let mut text = String::new();
    if train.mean_motion.is_some() {
        let _ = writeln!(text, "{}\n", bodies(train));
    }
    if train.connections.values().any(|c| c.teeth.is_some()) {
        let _ = writeln!(text, "{}\n", meshes(train));
    }
    for (body, torque) in &train.balanced {
        let name = train.bodies.get_index(*body).map_or("", |(name, _)| name);
        let _ = writeln!(
            text,
            "balancing mean torque of {name}: {} N m",
            number(*torque)
        );
    }
    if train.revolutions > 1 {
        let _ = writeln!(
            text,
            "base order 1/{0}: everything repeats after {0} revolutions of the reference",
            train.revolutions
        );
    }
    if !text.is_empty() {
        text.push('\n');
    }
    text
}

fn bodies(train: &Train) -> Table {
    let mut table = Table::new();
    table.load_style(presets::UTF8_HORIZONTAL_ONLY);
    table.set_header(["body", "speed [rpm]", "over the reference", "drag [N m]"]);
    for (k, (name, body)) in train.bodies.iter().enumerate() {
        let Some(motion) = &train.mean_motion else {
            continue;
        };
        let (speed, ratio) = (motion.speed_of(k), motion.ratios[k].to_string());
        let drag = body.drag.torque(speed);
        let name = match k == motion.reference {
            true => format!("{name} (reference)"),
            false => name.clone(),
        };
        table.add_row([name, number(speed * 60.0 / TAU), ratio, number(drag)]);
    }
    table
}

fn meshes(train: &Train) -> Table {
    let mut table = Table::new();
    table.load_style(presets::UTF8_HORIZONTAL_ONLY);
    table.set_header([
        "mesh",
        "teeth",
        "base radii [mm]",
        "tooth order",
        "Hz",
        "hunting order",
    ]);
    for (name, connection) in &train.connections {
        table.add_row(mesh(train, name, connection).into_iter().flatten());
    }
    table
}

fn mesh(train: &Train, name: &str, connection: &Connection) -> Option<[String; 6]> {
    let teeth = connection.teeth.as_ref()?;
    let [a, b] = teeth.wheels.map(|(_, z)| z);
    let [r, s] = teeth.base_radii().map(|r| number(1e3 * r));
    let unknown = || "-".to_owned();
    let (order, hertz, hunting) = match &train.mean_motion {
        None => (unknown(), unknown(), unknown()),
        Some(motion) => {
            let order = motion.order(teeth);
            let hertz = motion.mesh_frequency(teeth) / TAU;
            let hunting = teeth.hunting_order(&order);
            (order.to_string(), number(hertz), hunting.to_string())
        }
    };
    let (teeth, radii) = (format!("{a} : {b}"), format!("{r}, {s}"));
    Some([name.to_owned(), teeth, radii, order, hertz, hunting])
}
