//! Contacts, impacts and forces of every connection: what rattle is judged by.

use super::{ColumnHeading, Measure, ReportedUnits, Solved};
use crate::postprocess::connection::Measures;
use crate::postprocess::contacts::{Contacts, effective_mass};

/// `contact_ratio.c, contact_loss.c, ..`: the columns of the table `rattle`, connection by connection.
#[derive(Debug)]
pub(crate) struct ContactMetrics;

impl Measure for ContactMetrics {
    fn headings(&self, units: &ReportedUnits<'_>) -> Vec<ColumnHeading> {
        let one = |(e, c): (usize, &String)| {
            let others = [
                units.energy(format!("impact_energy_max.{c}"), e),
                units.energy(format!("impact_energy.{c}"), e),
                ColumnHeading::code(format!("regime.{c}")),
                units.force(format!("force_mean.{c}"), e),
                units.force(format!("force_std.{c}"), e),
                units.force(format!("force_min.{c}"), e),
                units.force(format!("force_peak.{c}"), e),
                ColumnHeading::number(format!("force_peak_factor.{c}")),
            ];
            contact_headings(units, (e, c)).into_iter().chain(others)
        };
        let connections = units.connections().iter().enumerate();
        connections.flat_map(one).collect()
    }

    fn measure(&mut self, at: &Solved<'_>, out: &mut Vec<f64>) {
        for (e, m) in at.connections.iter().enumerate() {
            out.extend(contact_values(&m.contacts));
            out.extend(impact_energies(at, e));
            out.push(f64::from(m.contacts.regime().code()));
            out.extend(force_values(m));
        }
    }
}

/// The columns of [`ContactMetrics`] that need no force and no mass: contacts alone are read.
#[derive(Debug)]
pub(crate) struct ContactColumns;

impl Measure for ContactColumns {
    fn headings(&self, units: &ReportedUnits<'_>) -> Vec<ColumnHeading> {
        let connections = units.connections().iter().enumerate();
        let one = |connection| contact_headings(units, connection);
        connections.flat_map(one).collect()
    }

    fn measure(&mut self, at: &Solved<'_>, out: &mut Vec<f64>) {
        let connections = at.connections.iter();
        out.extend(connections.flat_map(|m| contact_values(&m.contacts)));
    }
}

fn contact_headings(units: &ReportedUnits<'_>, (e, c): (usize, &String)) -> [ColumnHeading; 9] {
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
    ]
}

fn contact_values(contacts: &Contacts) -> [f64; 9] {
    [
        contacts.ratio(),
        1.0 - contacts.ratio(),
        contacts.front.share,
        contacts.back.share,
        contacts.impacts(),
        contacts.front.impacts,
        contacts.back.impacts,
        match contacts.impacts() > 0.0 {
            true => contacts.speed_max,
            false => f64::NAN,
        },
        contacts.speed_mean().unwrap_or(f64::NAN),
    ]
}

/// Largest energy of an impact, and the energy per excitation period.
fn impact_energies(at: &Solved<'_>, e: usize) -> [f64; 2] {
    let contacts = &at.connections[e].contacts;
    let mass = effective_mass(at.system, e).map(|mass| mass * at.stiffening[e]);
    let half_mass = 0.5 * mass.unwrap_or(f64::NAN);
    let largest = half_mass * contacts.speed_max * contacts.speed_max;
    [
        match contacts.impacts() > 0.0 {
            true => largest,
            false => f64::NAN,
        },
        half_mass * contacts.speed_square_sum,
    ]
}

fn force_values(m: &Measures) -> [f64; 5] {
    let peak = m.force_max.abs().max(m.force_min.abs());
    let force_rms = m.force_mean.hypot(m.force_std);
    [
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
