//! Contacts of one connection along an orbit: how long, how often, how fast, on which flank.

use crate::solve::integrate::SwitchKind;
use crate::solve::orbit::Crossing;
use crate::system::System;
use std::f64::consts::TAU;

/// Kind of impacts in one response period.
#[derive(Debug, Clone, Copy, Default, PartialEq, Eq)]
pub enum Regime {
    /// No contact is made: permanent contact, or none at all.
    #[default]
    NoImpact,
    /// Contact is lost and made again on one flank.
    SingleSided,
    /// Contact is made on both flanks.
    DoubleSided,
}

impl Regime {
    /// 0, 1, 2 in result tables.
    pub fn code(self) -> u8 {
        self as u8
    }
}

/// One flank of a connection.
#[derive(Debug, Clone, Copy, Default, PartialEq)]
pub struct FlankContacts {
    /// Share of the response period in contact.
    pub share: f64,
    /// Contacts made (open to contact) per excitation period.
    pub impacts: f64,
}

/// Contacts of one connection over one response period, nondimensional.
#[derive(Debug, Clone, Copy, Default, PartialEq)]
pub struct Contacts {
    /// The flank q > 0; laws without a gap are on it always.
    pub front: FlankContacts,
    /// The flank q < 0.
    pub back: FlankContacts,
    /// Largest speed of deformation at which contact is made, d/d(omega_c t); 0 without impacts.
    pub speed_max: f64,
    /// Sum of these speeds per excitation period.
    pub speed_sum: f64,
    /// Sum of their squares per excitation period.
    pub speed_square_sum: f64,
}

impl Contacts {
    /// Contacts from the passages of breakpoints of one connection, in the order of time; `mean`: the mean deformation,
    /// which decides where nothing passes; `nu`: excitation periods in a response period.
    pub fn new(
        system: &System,
        connection: usize,
        crossings: &[Crossing],
        mean: f64,
        nu: f64,
    ) -> Contacts {
        let mut contacts = Contacts::default();
        if crossings.is_empty() {
            let flank = system.mounts()[connection].element.flank(mean);
            if let Some(side) = contacts.side(flank) {
                side.share = 1.0;
            }
            return contacts;
        }
        let makes_contact = |c: &&Crossing| c.kind.makes_contact((c.from, c.to));
        for made in crossings.iter().filter(makes_contact) {
            contacts.hit(made, nu);
        }
        let stays = |c: &&Crossing| c.kind != SwitchKind::Impact;
        let crossings: Vec<&Crossing> = crossings.iter().filter(stays).collect();
        if crossings.is_empty() {
            return contacts;
        }
        // What a stretch of a motion that is not periodic begins with is not what it ends with.
        if let Some(side) = contacts.side(crossings[0].from) {
            side.share += crossings[0].tau / TAU;
        }
        let following = crossings.iter().skip(1).map(|c| c.tau);
        let ends = following.chain([TAU]);
        for (crossing, end) in crossings.iter().zip(ends) {
            let Some(side) = contacts.side(crossing.to) else {
                continue;
            };
            side.share += (end - crossing.tau) / TAU;
        }
        contacts
    }

    /// Counts a contact that is made.
    fn hit(&mut self, crossing: &Crossing, nu: f64) {
        if let Some(side) = self.side(crossing.to) {
            side.impacts += 1.0 / nu;
        }
        let speed = crossing.velocity.abs();
        self.speed_max = self.speed_max.max(speed);
        self.speed_sum += speed / nu;
        self.speed_square_sum += speed * speed / nu;
    }

    fn side(&mut self, flank: i8) -> Option<&mut FlankContacts> {
        match flank {
            0 => None,
            1.. => Some(&mut self.front),
            _ => Some(&mut self.back),
        }
    }

    /// Share of the response period in contact with either flank.
    pub fn ratio(&self) -> f64 {
        self.front.share + self.back.share
    }

    /// Contacts made per excitation period, over both flanks.
    pub fn impacts(&self) -> f64 {
        self.front.impacts + self.back.impacts
    }

    /// Mean speed at which contact is made; `None` without impacts.
    pub fn speed_mean(&self) -> Option<f64> {
        (self.impacts() > 0.0).then(|| self.speed_sum / self.impacts())
    }

    /// Flanks that are hit.
    pub fn regime(&self) -> Regime {
        match (self.front.impacts > 0.0, self.back.impacts > 0.0) {
            (false, false) => Regime::NoImpact,
            (true, true) => Regime::DoubleSided,
            _ => Regime::SingleSided,
        }
    }
}

/// Mass that the deformation of a connection feels while every other connection is open, times omega_c^2 over the stiffness.
///
/// ```text
/// m_j = 1 / (B_j M^-1 B_j^T),    m_j omega_c^2 / K_j = 1 / (W kappa)_jj
/// ```
///
/// For an external mesh m = 1 / (R_A^2/I_A + R_B^2/I_B). Half of it times the square of an impact speed is the kinetic
/// energy of the relative motion at the impact, over K_j l_j^2. `None` where (W kappa)_jj is not positive: a reduced system of
/// no mechanical origin.
pub fn effective_mass(system: &System, connection: usize) -> Option<f64> {
    let mobility = system.mobility(connection, connection);
    (mobility > 0.0).then(|| 1.0 / mobility)
}
