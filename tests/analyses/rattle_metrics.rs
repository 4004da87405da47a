//! Rattle metrics against closed forms: a prescribed motion through both flanks, a bouncing mass, a gear that stays in contact;
//! and what the table of a run says about itself.

use crate::common::{backlash, load};
use crate::time_domain_support::{floats, names, run};
use gearlash::element::{OneSided, Side};
use gearlash::postprocess::connection::Measures;
use gearlash::postprocess::contacts::{Regime, effective_mass};
use gearlash::postprocess::measures::Meter;
use gearlash::solve::integrate::{IntegrationEnd, IntegratorChoice, choose};
use gearlash::solve::orbit::{FourierOrbit, Orbit};
use gearlash::solve::segment_orbit::SegmentOrbit;
use gearlash::system::{Mount, System};
use nalgebra::DMatrix;
use std::f64::consts::{PI, TAU};

fn one(value: f64) -> DMatrix<f64> {
    DMatrix::from_element(1, 1, value)
}

fn one_mass(kappa: f64, mount: Mount, mean: f64) -> System {
    let loads = vec![load(1, 0, mean, 0.0)];
    System::new(one(0.0), one(kappa), one(1.0), vec![mount], loads).unwrap()
}

fn near(found: f64, wanted: f64, tolerance: f64, what: &str) {
    let gap = (found - wanted).abs();
    assert!(
        gap <= tolerance * (1.0 + wanted.abs()),
        "{what}: {found} is not {wanted}"
    );
}

/// q = 0.5 + 2 cos(tau) between flanks at -1 and 1.
fn through_both_flanks(subharmonic: usize) -> Measures {
    let mut system = one_mass(4.0, backlash(1.0), 0.5);
    system.set_subharmonic(subharmonic);
    let orbit = FourierOrbit {
        coefficients: vec![vec![0.5, 0.0, 2.0]],
        omega: 0.7,
        subharmonic,
    };
    Meter::new(1024).measure(&system, &Orbit::Fourier(orbit))[0]
}

#[test]
fn a_cosine_through_both_flanks() {
    for nu in [1, 3] {
        let contacts = through_both_flanks(nu).contacts;
        // In front contact while cos > 1/4, in back contact while cos < -3/4.
        near(contacts.front.share, 0.25_f64.acos() / PI, 1e-14, "front");
        near(contacts.back.share, 0.75_f64.acos() / PI, 1e-14, "back");
        let ratio = (0.25_f64.acos() + 0.75_f64.acos()) / PI;
        near(contacts.ratio(), ratio, 1e-14, "contact ratio");
        let per_period = 1.0 / nu as f64;
        assert_eq!(
            (contacts.front.impacts, contacts.back.impacts),
            (per_period, per_period)
        );
        assert_eq!(contacts.regime(), Regime::DoubleSided);
        let speed = |cos: f64| 0.7 * 2.0 * (1.0 - cos * cos).sqrt();
        near(contacts.speed_max, speed(0.25), 1e-13, "fastest impact");
        let mean = 0.5 * (speed(0.25) + speed(0.75));
        near(
            contacts.speed_mean().unwrap(),
            mean,
            1e-13,
            "mean impact speed",
        );
        let squares = speed(0.25).powi(2) + speed(0.75).powi(2);
        near(
            contacts.speed_square_sum,
            squares * per_period,
            1e-13,
            "squares",
        );
    }
    let measures = through_both_flanks(1);
    near(measures.force_max, 1.5, 1e-14, "largest force");
    near(measures.force_min, -0.5, 1e-14, "smallest force");
}

#[test]
fn regimes_without_and_with_one_flank() {
    let system = one_mass(1.0, backlash(1.0), 0.5);
    let of = |mean: f64, amplitude: f64| {
        let orbit = FourierOrbit {
            coefficients: vec![vec![mean, 0.0, amplitude]],
            omega: 1.0,
            subharmonic: 1,
        };
        Meter::new(256).measure(&system, &Orbit::Fourier(orbit))[0].contacts
    };
    let (pressed, free) = (of(2.0, 0.5), of(0.0, 0.5));
    assert_eq!(
        (pressed.regime(), pressed.front.share),
        (Regime::NoImpact, 1.0)
    );
    assert_eq!((free.regime(), free.ratio()), (Regime::NoImpact, 0.0));
    assert_eq!((pressed.speed_mean(), pressed.impacts()), (None, 0.0));
    let back = of(-1.0, 0.5);
    assert_eq!(
        (back.regime(), back.front.impacts, back.back.impacts),
        (Regime::SingleSided, 0.0, 1.0)
    );
    near(
        back.back.share,
        0.5,
        1e-14,
        "half the period on the back flank",
    );
}

/// A mass under a constant load g that bounces without loss on a stop of stiffness 4: flight of 2 v / g, contact of half an
/// oscillation and a bit around the static deflection g / 4.
#[test]
fn a_bouncing_mass() {
    let (kappa, g, v): (f64, f64, f64) = (4.0, 0.3, 0.8);
    let (w, deflection) = (kappa.sqrt(), g / kappa);
    let contact = 2.0 / w * (PI - (v / (w * deflection)).atan());
    let period = contact + 2.0 * v / g;
    let law = OneSided {
        gap: 0.0,
        side: Side::Positive,
        contact_damping: 0.0,
    };
    let mut system = one_mass(kappa, Mount::new(Box::new(law)), g);
    system.set_excitation_frequency(TAU / period);
    let mut orbit = SegmentOrbit::new(system.omega(), 1, 1);
    let mut state = [-v * v / (2.0 * g), 0.0];
    let mut integrator = choose(&system, IntegratorChoice::Exact).unwrap();
    let end = integrator.advance(&system, (0.0, TAU), &mut state, &mut orbit);
    assert_eq!(end, IntegrationEnd::Reached);
    near(state[0], -v * v / (2.0 * g), 1e-12, "the motion closes");

    let measures = Meter::new(64).measure(&system, &Orbit::Segments(orbit))[0];
    let contacts = measures.contacts;
    assert_eq!(
        (contacts.regime(), contacts.impacts()),
        (Regime::SingleSided, 1.0)
    );
    near(contacts.ratio(), contact / period, 1e-12, "contact ratio");
    near(contacts.speed_max, v, 1e-12, "impact speed");
    near(
        contacts.speed_mean().unwrap(),
        v,
        1e-12,
        "mean impact speed",
    );
    near(
        effective_mass(&system, 0).unwrap(),
        1.0 / kappa,
        1e-15,
        "mass",
    );
    // The force is the deflection: x = x_0 - x_0 cos(wt) + v/w sin(wt) = x_0 - a cos(wt + phase).
    let (a, phase) = (deflection.hypot(v / w), (v / w).atan2(deflection));
    near(measures.force_max, deflection + a, 1e-12, "peak force");
    near(measures.force_min, 0.0, 1e-15, "no force in flight");
    near(
        measures.force_mean,
        g / kappa,
        1e-12,
        "the mean force carries the load",
    );
    let integral = |t: f64| {
        let angle = w * t + phase;
        deflection.powi(2) * t - 2.0 * deflection * a * angle.sin() / w
            + a * a * (0.5 * t + 0.25 * (2.0 * angle).sin() / w)
    };
    let square = (integral(contact) - integral(0.0)) / period;
    near(
        measures.force_std,
        (square - (g / kappa).powi(2)).sqrt(),
        1e-11,
        "deviation of the force",
    );
}

/// Two gears on a dashpot, pressed together so hard that contact is never lost.
const PRESSED: &str = "
schema: 1
bodies:
  A: {inertia: 2.0e-3}
  B: {inertia: 1.0e-3}
connections:
  mesh: {gear: {A: 50 mm, B: 40 mm}, stiffness: 2.0e8, damping: 3000, element: {type: backlash, half_gap: 20 um}}
loads:
  A: {mean: 100, harmonics: [{order: 1, amplitude: 10}]}
  B: {mean: 80}
report: {units: si}
";

#[test]
fn a_gear_in_contact_meets_the_linear_response() {
    let report = run(
        PRESSED,
        "{type: frequency_response, from: 6 kHz, to: 5.9 kHz, harmonics: 3}",
    );
    let table = report.table("rattle").unwrap();
    let (k, c, drive, drag, i_a, i_b, r_a, r_b) =
        (2.0e8, 3000.0, 10.0, 80.0, 2e-3, 1e-3, 0.05, 0.04);
    let mass: f64 = 1.0 / (r_a * r_a / i_a + r_b * r_b / i_b);
    let peak = floats(table, "peak_acceleration.B");
    let index = floats(table, "rattle_index.B");
    for (row, hertz) in floats(table, "frequency_hz").into_iter().enumerate() {
        let w: f64 = TAU * hertz;
        let motion = r_a * drive / i_a / (k / mass - w * w).hypot(w * c / mass);
        let alpha = r_b * motion * k.hypot(w * c) / i_b;
        near(peak[row] / alpha, 1.0, 1e-8, "peak acceleration of B");
        near(index[row], i_b * alpha / drag, 1e-8, "rattle index of B");
    }
    // A carries the alternating load: its acceleration says nothing about its mesh.
    assert!(!names(table).contains(&"rattle_index.A"));
    assert_eq!(floats(table, "contact_loss.mesh")[0], 0.0);
    assert_eq!(floats(table, "regime.mesh")[0], 0.0);
    assert!(floats(table, "impact_velocity_max.mesh")[0].is_nan());
    assert_eq!(floats(table, "impact_energy.mesh")[0], 0.0);
}

/// The same pair with a tenth of the mean load, from permanent contact into rattle.
#[test]
fn units_energies_and_threshold_of_a_rattling_pair() {
    let light = PRESSED
        .replace("mean: 100,", "mean: 10,")
        .replace("{mean: 80}", "{mean: 8}");
    let analysis = "{type: frequency_response, from: 8 kHz, to: 3.2 kHz, harmonics: 15}";
    let report = run(&light, analysis);
    let table = report.table("rattle").unwrap();
    let unit = |name: &str| table.column(name).unwrap().unit.as_str();
    for (name, wanted) in [
        ("impact_velocity_max.mesh", "m/s"),
        ("impact_energy.mesh", "J"),
        ("force_peak.mesh", "N"),
        ("peak_acceleration.A", "rad/s^2"),
        ("contact_loss.mesh", ""),
    ] {
        assert_eq!(unit(name), wanted, "{name}");
    }
    let mass = 1.0 / (0.05_f64.powi(2) / 2e-3 + 0.04_f64.powi(2) / 1e-3);
    let of = |name: &str| floats(table, name);
    let (speed, energy) = (of("impact_velocity_max.mesh"), of("impact_energy_max.mesh"));
    let (loss, regime) = (of("contact_loss.mesh"), of("regime.mesh"));
    let (index, peak) = (of("rattle_index.B"), of("force_peak.mesh"));
    let (mean, std, factor) = (
        of("force_mean.mesh"),
        of("force_std.mesh"),
        of("force_peak_factor.mesh"),
    );
    assert!(regime.contains(&0.0) && regime.contains(&1.0), "{regime:?}");
    for row in 0..speed.len() {
        assert_eq!(loss[row] > 0.0, regime[row] > 0.0);
        near(
            factor[row],
            peak[row] / mean[row].hypot(std[row]),
            1e-14,
            "peak factor",
        );
        near(
            mean[row],
            10.0 / 0.05,
            1e-6,
            "the mean force carries the load",
        );
        if regime[row] > 0.0 {
            near(
                energy[row] / (0.5 * mass * speed[row].powi(2)),
                1.0,
                1e-12,
                "energy",
            );
            assert!(index[row] > 1.0, "contact is lost at index {}", index[row]);
        }
    }
    let main = report.table("").unwrap();
    assert_eq!(of("contact_ratio.mesh"), floats(main, "contact_ratio.mesh"));
    assert_eq!(of("impacts.mesh"), floats(main, "impacts.mesh"));

    let plain = light.replace("units: si", "units: nondimensional");
    let again = run(
        &plain,
        "{type: frequency_response, from: 8 kHz, to: 3.2 kHz, harmonics: 15}",
    );
    let dimensionless = again.table("rattle").unwrap();
    let w_c = again.summary["scales"]["omega_c"].as_f64().unwrap();
    let l = 20e-6;
    for (name, scale) in [
        ("impact_velocity_max.mesh", l * w_c),
        ("impact_energy.mesh", 2.0e8 * l * l),
        ("force_peak.mesh", 2.0e8 * l),
        ("peak_acceleration.B", w_c * w_c),
        ("rattle_index.B", 1.0),
    ] {
        for (a, b) in of(name).into_iter().zip(floats(dimensionless, name)) {
            assert!(
                a.is_nan() && b.is_nan() || (a / (b * scale) - 1.0).abs() < 1e-12 || a == b,
                "{name}"
            );
        }
    }
}

#[test]
fn a_loop_of_three_connections_has_a_mass_each() {
    // q_1, q_2 and their sum: W kappa has the mobilities B M^-1 B^T K / omega_c^2 on its diagonal.
    let w = DMatrix::from_row_slice(3, 2, &[1.0, 0.0, 0.0, 1.0, 1.0, 1.0]);
    let kappa = DMatrix::from_row_slice(2, 3, &[2.0, 1.0, 3.0, 1.0, 2.0, 3.0]);
    let mounts = (0..3).map(|_| backlash(1.0)).collect();
    let system = System::new(DMatrix::identity(2, 2), kappa, w, mounts, Vec::new()).unwrap();
    let masses: Vec<f64> = (0..3)
        .map(|e| effective_mass(&system, e).unwrap())
        .collect();
    assert_eq!(masses, [0.5, 0.5, 1.0 / 6.0]);
}

/// Wheels and masses accelerate in different units, meshes and shafts push in different ones: the axes name them all.
#[test]
fn axes_of_the_rattle_figure_name_every_unit() {
    let model = "schema: 1
bodies: {A: {inertia: 1.0e-3}, B: {inertia: 2.0e-3}, T: {inertia: 3 kg}}
connections:
  shaft: {shaft: [A, B], stiffness: 800}
  rack: {acts_on: {B: 30 mm, T: -1}, stiffness: 2.0e7, element: {type: backlash, half_gap: 20 um}}
damping: {modal_ratio: 0.05}
loads: {A: {mean: 3, harmonics: [{order: 1, amplitude: 1}]}, T: {mean: -100 N}}
report: {units: si}
";
    let report = run(
        model,
        "{type: frequency_response, from: 60 Hz, to: 62 Hz, harmonics: 5, stability: false}",
    );
    let rattle = report
        .further_figures
        .iter()
        .find(|f| f.name == "rattle")
        .unwrap();
    let labels: Vec<&str> = rattle
        .figure
        .panels
        .iter()
        .map(|p| p.y_label.as_str())
        .collect();
    assert!(labels.contains(&"peak force [N m, N]"), "{labels:?}");
    assert!(
        labels.contains(&"peak acceleration [rad/s^2, m/s^2]"),
        "{labels:?}"
    );
}
