//! Contacts made in a motion over time: a list with speeds and energies, and the rattle metrics of every connection.

use super::rows::{connection_column, time_column, units_of};
use crate::analysis::columns::{float, integer};
use crate::analysis::{Setting, columns};
use crate::measure::ColumnHeading;
use crate::numeric::roots;
use crate::postprocess::connection::is_clearance;
use crate::postprocess::contacts::effective_mass;
use crate::report::Table;
use crate::solve::integrate::{Segment, Switch, SwitchKind};
use crate::system::{Scratch, System};

/// Watches contacts and forces.
pub struct Impacts<'a> {
    setting: &'a Setting<'a>,
    system: &'a System,
    /// Half the mass that the deformation of each connection feels, over K l^2; NaN where there is none.
    half_mass: Vec<f64>,
    /// When, on which connection, to which flank, how fast.
    list: Vec<(f64, Switch)>,
    contacts: Vec<Contact>,
    scratch: Scratch,
    state: Vec<f64>,
}

/// Statistics of the contacts of one connection.
#[derive(Debug, Clone, Default)]
struct Contact {
    flank: i8,
    since: f64,
    /// Time in contact.
    held: f64,
    force: (f64, f64),
    /// Integral of the square of the rate, and its time.
    square: (f64, f64),
}

/// Instants per step at which forces are compared.
const LOOKS: usize = 8;
/// A look within this share of the range from the largest force so far may be beside a larger one.
const BESIDE: f64 = 0.15;

impl<'a> Impacts<'a> {
    /// From a state on, at a time, which the solvers call `tau`.
    pub fn new(
        setting: &'a Setting<'a>,
        system: &'a System,
        (time, tau): (f64, f64),
        state: &[f64],
    ) -> Self {
        let mut scratch = system.scratch();
        system.respond(tau, state, &mut scratch);
        let contact = |(mount, (x, f)): (&crate::system::Mount, (&f64, f64))| Contact {
            flank: mount.element.flank(*x),
            since: time,
            held: 0.0,
            force: match mount.element.least_impact() {
                None => (f, f),
                // A stop has impulses.
                Some(_) => (f64::NAN, f64::NAN),
            },
            square: (0.0, 0.0),
        };
        let seen = scratch
            .deformation
            .iter()
            .zip(scratch.response.iter().map(|r| r.f));
        let contacts = system.mounts().iter().zip(seen).map(contact).collect();
        let half = |k| 0.5 * effective_mass(system, k).unwrap_or(f64::NAN);
        Impacts {
            half_mass: (0..system.element_count()).map(half).collect(),
            setting,
            system,
            list: Vec::new(),
            contacts,
            state: vec![0.0; system.state_size()],
            scratch,
        }
    }

    /// A step of the integrator.
    pub fn segment(&mut self, segment: &Segment<'_>) {
        for k in 1..=LOOKS {
            let x = k as f64 / LOOKS as f64;
            segment.state(x, self.system.omega(), &mut self.state);
            let tau = segment.tau + x * segment.width;
            self.system.respond(tau, &self.state, &mut self.scratch);
            for e in 0..self.contacts.len() {
                let (square, time) = &mut self.contacts[e].square;
                *square += self.scratch.rate[e].powi(2) * segment.width;
                *time += segment.width;
                if !self.contacts[e].force.0.is_nan() {
                    self.compare(segment, e, x);
                }
            }
        }
    }

    /// The force of a connection at a look, followed to its extreme where that may be a new one.
    fn compare(&mut self, segment: &Segment<'_>, e: usize, x: f64) {
        let f = self.scratch.response[e].f;
        let (low, high) = self.contacts[e].force;
        let near = BESIDE * (high - low).max(f.abs());
        if f <= high - near && f >= low + near {
            return;
        }
        let width = 1.0 / LOOKS as f64;
        let ends = ((x - width).max(0.0), (x + width).min(1.0));
        let (mut state, mut scratch) = (self.state.clone(), self.system.scratch());
        let mut force = |sign: f64| {
            let mut at = |x: f64| {
                segment.state(x, self.system.omega(), &mut state);
                self.system
                    .respond(segment.tau + x * segment.width, &state, &mut scratch);
                sign * scratch.response[e].f
            };
            roots::summit(&mut at, (x, sign * f), ends, 0.0)
        };
        let highest = if f > high - near { force(1.0) } else { f };
        let lowest = if f < low + near { -force(-1.0) } else { f };
        self.contacts[e].force = (low.min(lowest), high.max(highest));
    }

    /// Whether a switch tells anything: a contact that is held over the end of a period comes to rest again when the next begins.
    pub fn is_news(&self, switch: &Switch) -> bool {
        switch.kind != SwitchKind::Holding || self.contacts[switch.connection].flank != switch.to
    }

    /// A passage of a breakpoint at a time.
    pub fn switch(&mut self, time: f64, switch: &Switch) {
        if switch.makes_contact() {
            self.list.push((time, *switch));
        }
        // An impact is over at once; the regions of sliders are no flanks.
        if matches!(switch.kind, SwitchKind::Impact | SwitchKind::Memory) {
            return;
        }
        let contact = &mut self.contacts[switch.connection];
        if contact.flank != 0 && switch.to != contact.flank {
            contact.held += time - contact.since;
        }
        if switch.to != contact.flank {
            (contact.flank, contact.since) = (switch.to, time);
        }
    }

    /// Leaves out impacts on stops that are slower than their share of the r.m.s. rate.
    fn drop_faint(&mut self) {
        let least: Vec<f64> = (self.contacts.iter().zip(self.system.mounts()))
            .map(|(contact, mount)| {
                let (square, time) = contact.square;
                let share = mount.element.least_impact().unwrap_or(0.0);
                share * (square / time.max(f64::MIN_POSITIVE)).sqrt()
            })
            .collect();
        let counts =
            |s: &Switch| s.kind != SwitchKind::Impact || s.velocity.abs() >= least[s.connection];
        self.list.retain(|(_, s)| counts(s));
    }

    /// Energy of an impact over K l^2.
    fn energy(&self, switch: &Switch) -> f64 {
        self.half_mass[switch.connection] * switch.velocity * switch.velocity
    }

    /// `impacts`: one row per contact made; `rattle`: one row per connection with a gap, between two times.
    pub fn tables(mut self, (begin, end): (f64, f64)) -> Vec<Table> {
        for contact in self.contacts.iter_mut().filter(|c| c.flank != 0) {
            contact.held += end - contact.since;
        }
        self.drop_faint();
        vec![self.list_table(), self.rattle_table(end - begin)]
    }

    fn list_table(&self) -> Table {
        let setting = self.setting;
        let count = setting.assembly.connections.len();
        let rates: Vec<ColumnHeading> = (0..count).map(|k| columns::rate(setting, k)).collect();
        let energies: Vec<ColumnHeading> =
            (0..count).map(|k| setting.units().energy("", k)).collect();
        let of = |f: &dyn Fn(&Switch) -> f64| self.list.iter().map(|(_, s)| f(s)).collect();
        let speed = |s: &Switch| s.velocity.abs() * rates[s.connection].factor;
        let energy = |s: &Switch| self.energy(s) * energies[s.connection].factor;
        let flanks = self.list.iter().map(|(_, s)| i64::from(s.to)).collect();
        Table {
            name: "impacts".into(),
            columns: vec![
                time_column(setting, self.list.iter().map(|i| i.0)),
                connection_column(setting, self.list.iter().map(|i| i.1.connection)),
                integer("flank", flanks),
                float("speed", units_of(&rates), of(&speed)),
                float("energy", units_of(&energies[..1.min(count)]), of(&energy)),
            ],
        }
    }

    fn rattle_table(&self, duration: f64) -> Table {
        let setting = self.setting;
        let units = setting.units();
        let mounts = self.system.mounts();
        let gaps = (0..mounts.len()).filter(|k| is_clearance(mounts[*k].element.as_ref()));
        let gaps: Vec<usize> = gaps.collect();
        let rates: Vec<ColumnHeading> = gaps.iter().map(|k| units.rate("", *k)).collect();
        let forces: Vec<ColumnHeading> = gaps.iter().map(|k| units.force("", *k)).collect();
        let per_time = duration * columns::time(setting).factor;
        let own = |k: usize| {
            self.list
                .iter()
                .map(|i| &i.1)
                .filter(move |s| s.connection == k)
        };
        let of = |f: &dyn Fn(usize, usize) -> f64| {
            let values = gaps.iter().enumerate().map(|(place, k)| f(place, *k));
            values.collect::<Vec<f64>>()
        };
        let count = |k: usize| own(k).count() as f64;
        let energy =
            |k: usize| own(k).fold(0.0, |sum, s| sum + self.energy(s)) * units.energy("", k).factor;
        let fastest = |k: usize| own(k).map(|s| s.velocity.abs()).fold(f64::NAN, f64::max);
        let strongest = |k: usize| own(k).map(|s| self.energy(s)).fold(f64::NAN, f64::max);
        let flank = |side: i8| {
            let on = |k: &usize| own(*k).filter(|s| s.to == side).count() as i64;
            gaps.iter().map(on).collect::<Vec<i64>>()
        };
        let energy_unit = units.energy("", 0).unit;
        let time_unit = columns::time(setting).unit;
        let per = |unit: &str| match time_unit.as_str() {
            "" => unit.to_owned(),
            time if unit.is_empty() => format!("1/{time}"),
            time => format!("{unit}/{time}"),
        };
        let force = |f: &dyn Fn(&Contact) -> f64| {
            of(&|place, k| f(&self.contacts[k]) * forces[place].factor)
        };
        Table {
            name: "rattle".into(),
            columns: vec![
                connection_column(setting, gaps.iter().copied()),
                float(
                    "contact_ratio",
                    "",
                    of(&|_, k| self.contacts[k].held / duration),
                ),
                integer(
                    "impacts",
                    gaps.iter().map(|k| own(*k).count() as i64).collect(),
                ),
                integer("impacts_front", flank(1)),
                integer("impacts_back", flank(-1)),
                float("impacts_per_s", per(""), of(&|_, k| count(k) / per_time)),
                float(
                    "impact_velocity_max",
                    units_of(&rates),
                    of(&|p, k| fastest(k) * rates[p].factor),
                ),
                float(
                    "impact_energy_max",
                    energy_unit.clone(),
                    of(&|_, k| strongest(k) * units.energy("", k).factor),
                ),
                float("impact_energy", energy_unit.clone(), of(&|_, k| energy(k))),
                float(
                    "impact_energy_per_s",
                    per(&energy_unit),
                    of(&|_, k| energy(k) / per_time),
                ),
                float("force_min", units_of(&forces), force(&|c| c.force.0)),
                float("force_max", units_of(&forces), force(&|c| c.force.1)),
            ],
        }
    }
}
