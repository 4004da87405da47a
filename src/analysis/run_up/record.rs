//! What is kept of a run-up while it runs: sums, extremes and impacts revolution by revolution; windows as they end.

use super::orders::{OrderSampling, OrderSums, Wave};
use super::signals::{Signal, SignalProbe};
use crate::analysis::Setting;
use crate::numeric::bernstein::{SIZE, hull, sign_changes};
use crate::numeric::fourier::Fourier;
use crate::postprocess::contacts::effective_mass;
use crate::solve::integrate::{FlowObserver, Segment, Switch, SwitchKind};
use crate::system::{Course, Scratch, System};
use std::collections::VecDeque;
use std::f64::consts::TAU;

/// Positions of the windows.
#[derive(Debug, Clone, Copy)]
pub struct WindowLayout {
    /// First revolution that begins in the run, and the one behind the last whole one.
    pub revolutions: (i64, i64),
    /// Revolutions from window to window.
    pub hop: usize,
    /// Highest order of the spectra; 0: none.
    pub spectrum: usize,
    /// Whether samples are kept as a time series.
    pub keeps_series: bool,
}

/// A finished window.
#[derive(Debug, Clone)]
pub struct Window {
    /// Its first revolution.
    pub first: i64,
    /// Time and reference speed over omega_c where the phase is in its middle.
    pub middle: (f64, f64),
    /// R.m.s. without mean, least and largest value of every signal.
    pub ranges: Vec<[f64; 3]>,
    /// Order tracks of every signal.
    pub waves: Vec<Vec<Wave>>,
    /// Amplitudes of the spectrum of every signal.
    pub spectra: Vec<Vec<f64>>,
    /// Distance of the lines of the spectra, in orders.
    pub resolution: f64,
    /// Contacts made per omega_c t, and their energy over K l^2 per omega_c t, of every connection.
    pub impacts: Vec<[f64; 2]>,
}

/// Statistics of one revolution.
#[derive(Debug, Clone)]
struct Revolution {
    sums: Vec<OrderSums>,
    squares: Vec<f64>,
    ranges: Vec<(f64, f64)>,
    /// Largest and least deformation seen, of every connection of a signal.
    seen: Vec<(f64, f64)>,
    impacts: Vec<[f64; 2]>,
    /// Impacts on stops, which count if they are faster than a share of the r.m.s. rate: connection and speed.
    hits: Vec<(usize, f64)>,
    /// Integral of the square of the rate of every connection with a stop, and its time.
    rates: Vec<[f64; 2]>,
    samples: Vec<f64>,
}

/// The observer of a run-up.
pub struct RunUpRecord<'a> {
    system: &'a System,
    course: &'a Course,
    signals: &'a [Signal],
    pub orders: OrderSampling,
    layout: WindowLayout,
    probe: SignalProbe<'a>,
    fourier: Option<Fourier>,
    half_mass: Vec<f64>,
    /// Share of the r.m.s. rate below which an impact does not count, of every connection; 0 without a stop.
    least: Vec<f64>,
    scratch: Scratch,
    /// Values at the start, from which sums count.
    origin: Vec<f64>,
    /// The revolution at hand and the next sample in it, with its time.
    revolution: i64,
    next: usize,
    next_time: f64,
    current: Revolution,
    /// Revolutions that later windows need, the first one, and the latest.
    kept: VecDeque<Revolution>,
    /// Share of the step at hand whose extremes are known.
    looked: f64,
    state: Vec<f64>,
    values: Vec<f64>,
    pub windows: Vec<Window>,
    pub switches: Vec<(f64, Switch)>,
    /// Time and values, sample by sample.
    pub series: Vec<f64>,
    /// Time reached.
    pub reached: f64,
}

impl<'a> RunUpRecord<'a> {
    /// From a state at time 0.
    pub fn new(
        setting: &'a Setting<'a>,
        (system, course): (&'a System, &'a Course),
        signals: &'a [Signal],
        (orders, layout): (OrderSampling, WindowLayout),
        state: &[f64],
    ) -> RunUpRecord<'a> {
        let mut probe = SignalProbe::new(setting, system, signals);
        let mut origin = vec![0.0; signals.len()];
        probe.read(0.0, state, &mut origin);
        let half = |k| 0.5 * effective_mass(system, k).unwrap_or(f64::NAN);
        let window = orders.window * orders.samples;
        let empty = Revolution::empty(&orders, signals.len(), system.element_count());
        let mut record = RunUpRecord {
            half_mass: (0..system.element_count()).map(half).collect(),
            least: (system.mounts().iter())
                .map(|m| m.element.least_impact().unwrap_or(0.0))
                .collect(),
            scratch: system.scratch(),
            fourier: (layout.spectrum > 0).then(|| Fourier::new(window)),
            course,
            signals,
            probe,
            revolution: layout.revolutions.0,
            next: 0,
            next_time: 0.0,
            current: empty,
            kept: VecDeque::new(),
            looked: 0.0,
            state: vec![0.0; system.state_size()],
            values: origin.clone(),
            origin,
            windows: Vec::new(),
            switches: Vec::new(),
            series: Vec::new(),
            reached: 0.0,
            system,
            orders,
            layout,
        };
        record.next_time = record.time_of_sample();
        record
    }

    /// The end of the run: a revolution that ends with it, to rounding, is a whole one.
    pub fn finish(&mut self) {
        let is_due = self.next == 0 && self.revolution == self.layout.revolutions.1;
        let begun = self.revolution > self.layout.revolutions.0;
        if is_due && begun && self.next_time <= self.reached * (1.0 + ROUNDING) {
            self.turn();
        }
    }

    /// Time of the next sample.
    fn time_of_sample(&self) -> f64 {
        let share = self.next as f64 / self.orders.samples as f64;
        let phase = TAU * (self.revolution as f64 + share);
        self.course
            .time_of(phase / self.system.revolutions() as f64)
    }

    fn sample(&mut self, segment: &Segment<'_>) {
        let time = self.next_time;
        let x = ((time - segment.tau) / segment.width).clamp(0.0, 1.0);
        segment.state(x, self.system.omega(), &mut self.state);
        self.probe.read(time, &self.state, &mut self.values);
        if self.next == 0 {
            self.widen(segment, x);
            // What has been read is that of the sample again.
            segment.state(x, self.system.omega(), &mut self.state);
            self.probe.read(time, &self.state, &mut self.values);
            self.turn();
        }
        let current = &mut self.current;
        for (s, value) in self.values.iter().enumerate() {
            let from_origin = value - self.origin[s];
            self.orders
                .add(self.next, from_origin, &mut current.sums[s]);
            current.squares[s] += from_origin * from_origin;
            widen(&mut current.ranges[s], *value);
        }
        if self.fourier.is_some() {
            current.samples.extend_from_slice(&self.values);
        }
        if self.layout.keeps_series {
            self.series.push(time);
            self.series.extend_from_slice(&self.values);
        }
        self.next += 1;
        if self.next == self.orders.samples {
            (self.next, self.revolution) = (0, self.revolution + 1);
        }
        self.next_time = self.time_of_sample();
    }

    /// A revolution begins; the one before it, if it was a whole one, is kept.
    fn turn(&mut self) {
        let empty = Revolution::empty(
            &self.orders,
            self.signals.len(),
            self.system.element_count(),
        );
        let mut done = std::mem::replace(&mut self.current, empty);
        self.count_hits(&mut done);
        if self.revolution == self.layout.revolutions.0 {
            return;
        }
        self.kept.push_back(done);
        let window = self.orders.window;
        if self.kept.len() < window {
            return;
        }
        let first = self.revolution - window as i64;
        let begun = first - self.layout.revolutions.0;
        if begun % self.layout.hop as i64 == 0 {
            let done = self.window(first);
            self.windows.push(done);
        }
        self.kept.pop_front();
    }

    /// Counts the impacts on stops of a revolution that are fast enough.
    fn count_hits(&self, revolution: &mut Revolution) {
        for (k, speed) in std::mem::take(&mut revolution.hits) {
            let [square, time] = revolution.rates[k];
            let least = self.least[k] * (square / time.max(f64::MIN_POSITIVE)).sqrt();
            if speed >= least {
                revolution.impacts[k][0] += 1.0;
                revolution.impacts[k][1] += self.half_mass[k] * speed * speed;
            }
        }
    }

    /// Squares of the rates at stops on a step.
    fn add_rates(&mut self, segment: &Segment<'_>) {
        if self.least.iter().all(|l| *l == 0.0) {
            return;
        }
        for look in 0..LOOKS {
            let x = (look as f64 + 0.5) / LOOKS as f64;
            segment.state(x, self.system.omega(), &mut self.state);
            let time = segment.tau + x * segment.width;
            (self.system).respond(time, &self.state, &mut self.scratch);
            for (sum, rate) in self.current.rates.iter_mut().zip(&self.scratch.rate) {
                sum[0] += rate * rate * segment.width;
                sum[1] += segment.width;
            }
        }
    }

    fn window(&mut self, first: i64) -> Window {
        let length = self.orders.window;
        let scale = 1.0 / self.system.revolutions() as f64;
        let at = |turns: f64| self.course.time_of(TAU * (first as f64 + turns) * scale);
        let middle = at(0.5 * length as f64);
        let duration = at(length as f64) - at(0.0);
        let speed = self.course.moment_on(middle, middle).frequency / scale;
        let count = (length * self.orders.samples) as f64;
        let signal = |s: usize| {
            let plain: f64 = self.kept.iter().map(|r| r.sums[s].plain).sum();
            let squares: f64 = self.kept.iter().map(|r| r.squares[s]).sum();
            let mean = plain / count;
            let rms = (squares / count - mean * mean).max(0.0).sqrt();
            let ranges = self.kept.iter().map(|r| r.ranges[s]);
            let (low, high) = ranges.fold(EMPTY, |a, b| (a.0.min(b.0), a.1.max(b.1)));
            [rms, low, high]
        };
        let signals = 0..self.signals.len();
        let waves = |s: usize| self.orders.fit(first, self.kept.iter().map(|r| &r.sums[s]));
        let impacts = |k: usize| {
            let sum = |i: usize| self.kept.iter().map(|r| r.impacts[k][i]).sum::<f64>();
            [sum(0) / duration, sum(1) / duration]
        };
        Window {
            first,
            middle: (middle, speed),
            ranges: signals.clone().map(signal).collect(),
            waves: signals.clone().map(waves).collect(),
            impacts: (0..self.system.element_count()).map(impacts).collect(),
            resolution: 1.0 / length as f64,
            spectra: self.spectra(),
        }
    }

    /// Amplitudes at multiples of 1 / window up to the highest order, from order 1 / window on.
    fn spectra(&mut self) -> Vec<Vec<f64>> {
        let Some(fourier) = &mut self.fourier else {
            return Vec::new();
        };
        let signals = self.signals.len();
        let lines = self.layout.spectrum * self.orders.window;
        let mut coefficients = vec![0.0; 2 * lines + 1];
        let one = |s: usize| {
            let samples = self
                .kept
                .iter()
                .flat_map(|r| r.samples.iter().skip(s).step_by(signals));
            let samples: Vec<f64> = samples.map(|x| x - self.origin[s]).collect();
            fourier.to_coefficients(&samples, &mut coefficients);
            let pairs = coefficients[1..].chunks_exact(2);
            pairs.map(|pair| pair[0].hypot(pair[1])).collect()
        };
        (0..signals).map(one).collect()
    }

    /// Extremes of the deformations inside a step up to x, and what the signals are there.
    fn widen(&mut self, segment: &Segment<'_>, end: f64) {
        let begin = std::mem::replace(&mut self.looked, end);
        for s in 0..self.signals.len() {
            let Some(k) = self.signals[s].connection() else {
                continue;
            };
            if self.system.mounts()[k].transmission_error.is_some() {
                continue;
            }
            let mut polynomial = [0.0; SIZE];
            for (i, w) in self.system.element_map_row(k) {
                let own = &segment.coefficients[i * segment.count..(i + 1) * segment.count];
                polynomial
                    .iter_mut()
                    .zip(own)
                    .for_each(|(p, c)| *p += w * c);
            }
            let (least, most) = hull(&polynomial);
            let seen = self.current.seen[s];
            if least >= seen.0 && most <= seen.1 {
                continue;
            }
            let mut derivative = [0.0; SIZE];
            for (d, (k, c)) in derivative
                .iter_mut()
                .zip(polynomial.iter().enumerate().skip(1))
            {
                *d = k as f64 * c;
            }
            let inside = |x: &f64| (begin..=end).contains(x);
            let places = sign_changes(&derivative).into_iter().chain([end]);
            for x in places.filter(inside) {
                let time = segment.tau + x * segment.width;
                segment.state(x, self.system.omega(), &mut self.state);
                self.probe.read(time, &self.state, &mut self.values);
                widen(&mut self.current.ranges[s], self.values[s]);
                let value = polynomial.iter().rev().fold(0.0, |sum, c| sum * x + c);
                widen(&mut self.current.seen[s], value);
            }
        }
    }
}

/// Times closer than this, relative, are the same.
const ROUNDING: f64 = 1e-9;
/// Instants per step at which rates are read.
const LOOKS: usize = 4;
/// The range of nothing.
const EMPTY: (f64, f64) = (f64::INFINITY, f64::NEG_INFINITY);

fn widen(range: &mut (f64, f64), value: f64) {
    *range = (range.0.min(value), range.1.max(value));
}

impl Revolution {
    fn empty(orders: &OrderSampling, signals: usize, connections: usize) -> Revolution {
        Revolution {
            sums: vec![orders.sums(); signals],
            squares: vec![0.0; signals],
            ranges: vec![EMPTY; signals],
            seen: vec![EMPTY; signals],
            impacts: vec![[0.0; 2]; connections],
            hits: Vec::new(),
            rates: vec![[0.0; 2]; connections],
            samples: Vec::new(),
        }
    }
}

impl FlowObserver for RunUpRecord<'_> {
    fn segment(&mut self, segment: &Segment<'_>) {
        let end = segment.tau + segment.width;
        let last = self.layout.revolutions.1;
        // The first sample behind the last whole revolution ends that one.
        while self.next_time <= end
            && (self.revolution < last || self.next == 0 && self.revolution == last)
        {
            self.sample(segment);
        }
        self.add_rates(segment);
        self.widen(segment, 1.0);
        self.looked = 0.0;
        self.reached = end;
    }

    fn switch(&mut self, switch: &Switch) {
        self.switches.push((switch.tau, *switch));
        let k = switch.connection;
        if switch.kind == SwitchKind::Impact {
            self.current.hits.push((k, switch.velocity.abs()));
        } else if switch.makes_contact() {
            let energy = self.half_mass[k] * switch.velocity * switch.velocity;
            self.current.impacts[k][0] += 1.0;
            self.current.impacts[k][1] += energy;
        }
    }
}
