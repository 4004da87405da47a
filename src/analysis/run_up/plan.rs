//! What the settings of a run-up mean.

use super::orders::OrderSampling;
use super::record::WindowLayout;
use super::signals::{self, Signal};
use super::{RunUp, RunUpTable};
use crate::analysis::transient::{self, SpeedRamp};
use crate::analysis::{Fault, Setting, limits};
use crate::model::Structure;
use crate::numeric::fraction;
use crate::numeric::periodic::Periodic;
use crate::quantity::UnitDimension;
use crate::system::{LoadKind, System};

/// The settings, nondimensional.
pub struct RunUpPlan {
    /// Speed over time.
    pub ramp: SpeedRamp,
    /// Recorded quantities.
    pub signals: Vec<Signal>,
    /// Orders tracked.
    pub orders: Vec<f64>,
    /// Samples per revolution.
    pub samples: usize,
    /// Revolutions from window to window.
    pub hop: usize,
    /// Highest order of the spectra; 0: none.
    pub spectrum: usize,
    /// Bands of frequency over omega_c.
    pub bands: Vec<(f64, f64)>,
    /// Whether switches are written.
    pub writes_switches: bool,
    /// Whether samples are written.
    pub keeps_series: bool,
}

/// Revolutions and samples at most.
const REVOLUTIONS: usize = 100_000;
const SAMPLES: usize = 1 << 16;
/// Samples per revolution at least, and per wave of the highest order, where the settings say nothing.
const FEWEST_SAMPLES: usize = 64;
const PER_WAVE: f64 = 8.0;
/// Orders tracked at most where the loads give them.
const MOST_ORDERS: usize = 24;
/// Highest order tracked where a measured cycle gives them.
const HIGHEST_OF_TABLES: usize = 12;

impl RunUpPlan {
    /// # Errors
    /// Everything wrong with the settings.
    pub fn new(run_up: &RunUp, setting: &Setting<'_>) -> Result<RunUpPlan, Vec<Fault>> {
        let mut faults = Vec::new();
        let ramp = transient::ramp(run_up.ramp_keys(), setting);
        let ramp = ramp.map_err(|list| faults.extend(list));
        let signals = signals::chosen(setting, run_up.signals.as_deref());
        let signals = signals.map_err(|list| faults.extend(list));
        let orders = orders(run_up, setting).map_err(|list| faults.extend(list));
        let hop = run_up.hop.unwrap_or((run_up.window / 2).max(1));
        for (key, found, most) in [
            ("window", run_up.window, REVOLUTIONS),
            ("hop", hop, REVOLUTIONS),
            (
                "samples_per_revolution",
                run_up.samples_per_revolution.unwrap_or(4),
                SAMPLES,
            ),
        ] {
            faults.extend(limits::check(key, found, 1, most));
        }
        let bands = bands(run_up, setting).map_err(|list| faults.extend(list));
        let (Ok(ramp), Ok(signals), Ok(orders), Ok(bands)) = (ramp, signals, orders, bands) else {
            return Err(faults);
        };
        let highest = orders.iter().copied().fold(1.0, f64::max);
        // An order beyond what samples can resolve is refused below.
        let wanted = (PER_WAVE * highest).ceil().min(SAMPLES as f64) as usize;
        let suited = wanted.next_power_of_two();
        let samples = run_up
            .samples_per_revolution
            .unwrap_or(suited.clamp(FEWEST_SAMPLES, SAMPLES));
        if 2.0 * highest >= samples as f64 {
            let message = format!("{samples} must be more than twice the highest order, {highest}");
            faults.push(Fault::new("samples_per_revolution", message));
        }
        let wants = |table| {
            run_up
                .tables
                .as_ref()
                .is_some_and(|list| list.contains(&table))
        };
        let has_spectra =
            run_up.tables.is_none() || wants(RunUpTable::Spectra) || !bands.is_empty();
        let spectrum = match (has_spectra, run_up.spectrum_to) {
            (false, _) => 0,
            (true, Some(to)) => to,
            (true, None) => highest.ceil() as usize,
        };
        if spectrum >= samples.div_ceil(2) {
            let message =
                format!("{spectrum} must be below half of {samples}, the samples per revolution");
            faults.push(Fault::new("spectrum_to", message));
        }
        let (first, last) = ramp.revolutions;
        if faults.is_empty() && last - first < run_up.window as i64 {
            let message = format!(
                "{} revolutions are more than the {} whole ones of the run: choose a shorter window or a longer duration",
                run_up.window,
                (last - first).max(0)
            );
            faults.push(Fault::new("window", message));
        }
        let key = run_up.speed.as_ref().map_or("from", |_| "speed");
        faults.extend(transient::check_speed(setting, &ramp.line, key));
        if !faults.is_empty() {
            return Err(faults);
        }
        Ok(RunUpPlan {
            ramp,
            signals,
            orders,
            samples,
            hop,
            spectrum,
            bands,
            writes_switches: wants(RunUpTable::Switches),
            keeps_series: wants(RunUpTable::Series),
        })
    }

    /// Positions of the windows of a number of revolutions.
    pub fn layout(&self, window: usize) -> (OrderSampling, WindowLayout) {
        let layout = WindowLayout {
            revolutions: self.ramp.revolutions,
            hop: self.hop,
            spectrum: self.spectrum,
            keeps_series: self.keeps_series,
        };
        (
            OrderSampling::new(self.orders.clone(), self.samples, window),
            layout,
        )
    }
}

fn bands(run_up: &RunUp, setting: &Setting<'_>) -> Result<Vec<(f64, f64)>, Vec<Fault>> {
    let (mut list, mut faults) = (Vec::new(), Vec::new());
    for (k, (low, high)) in run_up.bands.iter().flatten().enumerate() {
        let read = |quantity: &crate::quantity::Quantity| match quantity.dimension {
            None if !setting.is_si() => Ok(quantity.value),
            None if quantity.value == 0.0 => Ok(0.0),
            None => setting.frequency(quantity),
            Some(_) => {
                Ok(quantity.si(UnitDimension::FREQUENCY)? / setting.assembly.scales.frequency)
            }
        };
        match (read(low), read(high)) {
            (Ok(low), Ok(high)) if low >= 0.0 && high > low => list.push((low, high)),
            (Ok(_), Ok(_)) => {
                let message = "wanted a lower and a higher frequency";
                faults.push(Fault::new(format!("bands.{k}"), message));
            }
            (low, high) => {
                let message = low.err().or(high.err()).unwrap_or_default();
                faults.push(Fault::new(format!("bands.{k}"), message));
            }
        }
    }
    if faults.is_empty() {
        Ok(list)
    } else {
        Err(faults)
    }
}

/// The requested orders; default: those of the loads.
fn orders(run_up: &RunUp, setting: &Setting<'_>) -> Result<Vec<f64>, Vec<Fault>> {
    let Some(written) = &run_up.orders else {
        return Ok(orders_of_loads(&setting.assembly.system));
    };
    let (mut list, mut faults) = (Vec::new(), Vec::new());
    for (k, order) in written.iter().enumerate() {
        match order.value(setting) {
            Ok(value) if list.contains(&value) => {
                let message = format!("{value} is listed twice");
                faults.push(Fault::new(format!("orders.{k}"), message));
            }
            Ok(value) => list.push(value),
            Err(message) => faults.push(Fault::new(format!("orders.{k}"), message)),
        }
    }
    if list.is_empty() && faults.is_empty() {
        faults.push(Fault::new("orders", "none: wanted at least one"));
    }
    if faults.is_empty() {
        Ok(list)
    } else {
        Err(faults)
    }
}

/// A fraction, or the tooth-passing order of a mesh.
pub fn named(setting: &Setting<'_>, text: &str) -> Option<f64> {
    if let Some(fraction) = fraction::parse(text) {
        return Some(fraction::to_f64(&fraction));
    }
    let Structure::Train(train) = &setting.model.structure else {
        return None;
    };
    let teeth = train.connections.get(text)?.teeth.as_ref()?;
    let order = train.mean_motion.as_ref()?.order(teeth);
    Some(fraction::to_f64(&order))
}

/// Orders of the loads, ascending; order 1 where they have none.
pub fn orders_of_loads(system: &System) -> Vec<f64> {
    let base = 1.0 / system.revolutions() as f64;
    let mut list = Vec::new();
    for load in system.loads() {
        let ratio = match load.kind {
            LoadKind::Orders { ratio, .. } => ratio,
            LoadKind::Rate | LoadKind::Timed(_) => continue,
            LoadKind::Value | LoadKind::Acceleration => 1.0,
        };
        match &load.series {
            Periodic::Fourier { harmonics, .. } => {
                let present = harmonics.iter().filter(|h| h.cos != 0.0 || h.sin != 0.0);
                list.extend(present.map(|h| h.order as f64 * ratio * base));
            }
            series if series.is_constant() => {}
            _ => {
                let count = HIGHEST_OF_TABLES * system.revolutions().min(2);
                let step = 1.0 / system.revolutions().min(2) as f64;
                list.extend((1..=count).map(|k| k as f64 * step));
            }
        }
    }
    list.sort_by(f64::total_cmp);
    list.dedup();
    list.truncate(MOST_ORDERS);
    if list.is_empty() {
        list.push(1.0);
    }
    list
}
