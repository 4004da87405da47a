//! Motion, stiffness and force of every connection.

use super::{ColumnHeading, Measure, ReportedUnits, Solved};
use crate::postprocess::connection::Measures;

/// `mean.c, rms.c, min.c, ..`: the columns of the main table, connection by connection.
#[derive(Debug)]
pub struct Connections;

impl Measure for Connections {
    fn headings(&self, units: &ReportedUnits<'_>) -> Vec<ColumnHeading> {
        let one = |(e, c): (usize, &String)| {
            [
                units.displacement(format!("mean.{c}"), e),
                units.displacement(format!("rms.{c}"), e),
                units.displacement(format!("min.{c}"), e),
                units.displacement(format!("max.{c}"), e),
                units.rate(format!("rms_velocity.{c}"), e),
                ColumnHeading::number(format!("effective_stiffness.{c}")),
                ColumnHeading::number(format!("effective_stiffness_dc.{c}")),
                ColumnHeading::number(format!("contact_ratio.{c}")),
                ColumnHeading::number(format!("impacts.{c}")),
                units.force(format!("force_mean.{c}"), e),
                units.force(format!("force_max.{c}"), e),
                units.force(format!("force_std.{c}"), e),
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
        let one = |m: &Measures| {
            [
                m.mean,
                m.rms,
                m.min,
                m.max,
                m.rms_velocity,
                m.effective_stiffness.unwrap_or(f64::NAN),
                m.effective_stiffness_dc.unwrap_or(f64::NAN),
                m.contacts.ratio(),
                m.contacts.impacts(),
                m.force_mean,
                m.force_max,
                m.force_std,
            ]
        };
        out.extend(at.connections.iter().flat_map(one));
    }
}
