//! Contacts, impacts and forces of every connection: what rattle is judged by.

use super::{ColumnHeading, Measure, ReportedUnits, Solved};
use crate::postprocess::connection::Measures;
use crate::postprocess::contacts::effective_mass;

/// `contact_ratio.c, contact_loss.c, ..`: the columns of the table `rattle`, connection by connection.
#[derive(Debug)]
pub(crate) struct ContactMetrics;

impl Measure for ContactMetrics {
    fn headings(&self, units: &ReportedUnits<'_>) -> Vec<ColumnHeading> {
        let one = |(e, c): (usize, &String)| {
            [
                ColumnHeading::number(format!("contact_ratio.{c}")),
                ColumnHeading::number(format!("contact_loss.{c}")),
                ColumnHeading::number(format!("contact_front.{c}")),
                ColumnHeading::number(format!("contact_back.{c}")),
                ColumnHeading::number(format!("impacts.{c}")),
                ColumnHeading::number(format!("impacts_front.{c}")),
                ColumnHeading::number(format!("impacts_back.{c}")),
                units.rate(format!("impact_velocity_max.{c}"), e),
                units.rate(format!("impact_velocity_mean.{c}"), e),
                units.energy(format!("impact_energy_max.{c}"), e),
                units.energy(format!("impact_energy.{c}"), e),
                ColumnHeading::code(format!("regime.{c}")),
                units.force(format!("force_mean.{c}"), e),
                units.force(format!("force_std.{c}"), e),
                units.force(format!("force_min.{c}"), e),
                units.force(format!("force_peak.{c}"), e),
                ColumnHeading::number(format!("force_peak_factor.{c}")),
            ]
        };
        units
            .connections()
            .iter()
            .enumerate()
            .flat_map(one)
            .collect()
    }

    fn measure(&mut self, at: &Solved<'_>, out: &mut Vec<f64>) {
        for (e, (m, stiffening)) in at.connections.iter().zip(at.stiffening).enumerate() {
            let mass = effective_mass(at.system, e).map(|mass| mass * stiffening);
            out.extend(metrics(m, mass));
        }
    }
}

fn metrics(m: &Measures, mass: Option<f64>) -> [f64; 17] {
    let contacts = &m.contacts;
    let has_impacts = contacts.impacts() > 0.0;
    let empty_without = |x: f64| if has_impacts { x } else { f64::NAN };
    let half_mass = 0.5 * mass.unwrap_or(f64::NAN);
    let peak = m.force_max.abs().max(m.force_min.abs());
    let force_rms = m.force_mean.hypot(m.force_std);
    [
        contacts.ratio(),
        1.0 - contacts.ratio(),
        contacts.front.share,
        contacts.back.share,
        contacts.impacts(),
        contacts.front.impacts,
        contacts.back.impacts,
        empty_without(contacts.speed_max),
        contacts.speed_mean().unwrap_or(f64::NAN),
        empty_without(half_mass * contacts.speed_max * contacts.speed_max),
        half_mass * contacts.speed_square_sum,
        f64::from(contacts.regime().code()),
        m.force_mean,
        m.force_std,
        m.force_min,
        peak,
        // Without any force there is no factor.
        if force_rms > 0.0 {
            peak / force_rms
        } else {
            f64::NAN
        },
    ]
}
