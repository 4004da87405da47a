//! Mean motion as plain data for `gearlash check --json`.

use crate::model::{Connection, Train};
use serde_json::{Map, Value, json};
use std::f64::consts::TAU;

/// Speeds, ratios and orders by name; orders and ratios as exact fractions.
///
/// `speeds_rpm`, `ratios`, `mesh_orders`, `hunting_orders` are empty without a reference shaft; `base_radii` \[m\] by connection
/// and body; `balanced` \[N m\].
pub(super) fn kinematics(train: &Train) -> Map<String, Value> {
    let name = |body: usize| {
        train
            .bodies
            .get_index(body)
            .map_or("", |(name, _)| name.as_str())
    };
    let bodies = || train.bodies.keys().enumerate();
    let by_body = |of: &dyn Fn(usize) -> Value| -> Value {
        let list = bodies().map(|(k, name)| (name.clone(), of(k)));
        Value::Object(list.collect())
    };
    let by_mesh = |of: &dyn Fn(&Connection) -> Option<Value>| -> Value {
        let list = train.connections.iter();
        let list = list.filter_map(|(name, c)| Some((name.clone(), of(c)?)));
        Value::Object(list.collect())
    };
    let mut map = Map::new();
    if let Some(motion) = &train.mean_motion {
        let rpm = |body| json!(motion.speed_of(body) * 60.0 / TAU);
        map.insert("speeds_rpm".into(), by_body(&rpm));
        let ratio = |body: usize| json!(motion.ratios[body].to_string());
        map.insert("ratios".into(), by_body(&ratio));
        let order = |c: &Connection| Some(json!(motion.order(c.teeth.as_ref()?).to_string()));
        map.insert("mesh_orders".into(), by_mesh(&order));
        let hunting = |c: &Connection| {
            let teeth = c.teeth.as_ref()?;
            Some(json!(teeth.hunting_order(&motion.order(teeth)).to_string()))
        };
        map.insert("hunting_orders".into(), by_mesh(&hunting));
    }
    let base = match train.revolutions {
        1 => "1".to_owned(),
        revolutions => format!("1/{revolutions}"),
    };
    map.insert("base_order".into(), json!(base));
    let radii = |c: &Connection| {
        let teeth = c.teeth.as_ref()?;
        let wheels = teeth.wheels.iter().zip(teeth.base_radii());
        let list = wheels.map(|((body, _), radius)| (name(*body).to_owned(), json!(radius)));
        Some(Value::Object(list.collect()))
    };
    map.insert("base_radii".into(), by_mesh(&radii));
    let balanced = train.balanced.iter();
    let balanced = balanced.map(|(body, torque)| (name(*body).to_owned(), json!(torque)));
    map.insert("balanced".into(), Value::Object(balanced.collect()));
    map
}
