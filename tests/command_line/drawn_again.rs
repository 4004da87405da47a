//! Figures drawn again, runs compared, tables exported, trains drawn: what needs no run.

use crate::program::{Place, TRAIN};

fn place() -> Place {
    let place = Place::with(TRAIN);
    place
        .run(&["run", "m.yaml", "--out", "o", "--quiet"])
        .ends_with(0);
    place
}

#[test]
fn a_folder_is_drawn_again_as_the_run_drew_it() {
    let place = place();
    let names = [
        "response.svg",
        "response.rattle.svg",
        "report.html",
        "manifest.json",
    ];
    let before = names.map(|name| place.read(&format!("o/{name}")));
    place.run(&["plot", "o"]).ends_with(0);
    let after = names.map(|name| place.read(&format!("o/{name}")));
    for (name, (a, b)) in names.iter().zip(before.iter().zip(&after)) {
        assert!(a == b, "{name} differs");
    }
}

#[test]
fn figures_show_what_is_asked_for() {
    let place = place();
    assert!(
        place
            .read("o/response.svg")
            .contains("excitation frequency [Hz]")
    );
    place
        .run(&[
            "plot",
            "o",
            "--plot",
            "x_unit=rpm",
            "--plot",
            "y=impacts,force_max",
            "--plot",
            "size=one_column",
        ])
        .ends_with(0);
    let text = place.read("o/response.svg");
    for part in [
        "excitation frequency [rpm]",
        "impacts per period",
        "largest force [",
        "width=\"321\"",
    ] {
        assert!(text.contains(part), "{part}");
    }
    assert!(!text.contains("r.m.s. deformation"));
    // 8 to 9 kHz.
    assert!(
        text.contains(">500000<") || text.contains(">5.0<"),
        "{text}"
    );
    place
        .run(&["plot", "o", "--plot", "y_scale=log"])
        .ends_with(0);
    place
        .run(&["plot", "o", "--plot", "backbone=true"])
        .ends_with(0);
    assert!(place.read("o/response.svg").contains("backbone, mode 1"));
}

#[test]
fn what_cannot_be_drawn_is_refused_and_nothing_changes() {
    let place = place();
    let before = place.read("o/response.svg");
    for (change, says) in [
        ("y=rms.mash", "did you mean `rms.mesh`?"),
        ("x_unit=kg", "is no unit of"),
        ("connections=mash", "did you mean `mesh`?"),
        ("colour=red", "colour"),
        ("y_scale=logarithmic", "log"),
    ] {
        place
            .run(&["plot", "o", "--plot", change])
            .ends_with(2)
            .says(&[says]);
    }
    place.run(&["plot", "o", "--only", "respons"]).ends_with(2);
    place.run(&["plot", "nowhere"]).ends_with(2);
    assert_eq!(place.read("o/response.svg"), before);
}

#[test]
fn the_key_of_the_model_file_is_checked_before_anything_runs() {
    let with = |plot: &str| {
        TRAIN.replace(
            "marks: [8.5 kHz]}",
            &format!("marks: [8.5 kHz], plot: {plot}}}"),
        )
    };
    for (plot, says) in [
        ("{y: [rms.mash]}", "did you mean `rms.mesh`?"),
        ("{events: [bend]}", "plot.events.0"),
        ("{methods: [newton]}", "plot.methods.0"),
        ("{x_range: [1, 1]}", "two different finite numbers"),
        ("{width: 3}", "width"),
    ] {
        let place = Place::with(&with(plot));
        place
            .run(&["run", "m.yaml", "--out", "o"])
            .ends_with(2)
            .says(&[says]);
        assert!(!place.path("o").exists());
    }
    let place = Place::with(&with(
        "{y: [contact_ratio], x_unit: rpm, x_range: [480000, 540000], events: []}",
    ));
    place
        .run(&["run", "m.yaml", "--out", "o", "--quiet"])
        .ends_with(0);
    let text = place.read("o/response.svg");
    assert!(text.contains("contact ratio") && text.contains("[rpm]"));
}

#[test]
fn two_runs_are_compared() {
    let place = place();
    place
        .run(&[
            "run",
            "m.yaml",
            "--out",
            "p",
            "--quiet",
            "--set",
            "loads.A.harmonics.0.amplitude=30",
        ])
        .ends_with(0);
    let ended = place.run(&["compare", "o", "p", "--out", "c"]).ends_with(0);
    assert!(
        ended.out.contains("loads.A.harmonics.0.amplitude"),
        "{}",
        ended.out
    );
    let column = |folder: &str| {
        let values = place.column(&format!("{folder}/response.csv"), "rms.mesh");
        values.into_iter().fold(0.0, f64::max)
    };
    let change = 100.0 * (column("p") / column("o") - 1.0);
    assert!(
        ended.out.contains(&format!("{change:+.2} %")),
        "{change} {}",
        ended.out
    );
    let page = place.read("c/report.html");
    assert!(page.contains("What differs") && page.contains("loads.A.harmonics.0.amplitude"));
    let figure = place.read("c/response.svg");
    assert!(
        figure.contains(">o<") && figure.contains(">p<"),
        "both runs in the legend"
    );
    // Equal runs differ in nothing.
    let ended = place.run(&["compare", "o", "o", "--out", "d"]).ends_with(0);
    assert!(ended.out.contains("The models are equal."), "{}", ended.out);
}

/// The values of a column as bytes stand in the file of another format.
#[test]
fn exported_tables_hold_the_numbers() {
    let place = place();
    let values = place.column("o/response.csv", "rms.mesh");
    let bytes = |of: fn(f64) -> [u8; 8]| values.iter().flat_map(|x| of(*x)).collect::<Vec<u8>>();
    for (format, ending, wanted) in [
        ("npz", "npz", bytes(f64::to_le_bytes)),
        ("mat", "mat", bytes(f64::to_le_bytes)),
        ("netcdf", "nc", bytes(f64::to_be_bytes)),
    ] {
        place
            .run(&["export", "o", "--format", format, "--out", "e"])
            .ends_with(0);
        let found = std::fs::read(place.path(&format!("e/response.{ending}"))).unwrap();
        assert!(found.windows(wanted.len()).any(|w| w == wanted), "{format}");
    }
    place.run(&["export", "o", "--format", "xls"]).ends_with(2);
    place
        .run(&[
            "export",
            "o",
            "--format",
            "npz",
            "--safe-names",
            "--out",
            "s",
        ])
        .ends_with(0);
    let safe = std::fs::read(place.path("s/response.npz")).unwrap();
    assert!(safe.windows(12).any(|w| w == b"rms_mesh.npy"));
}

#[test]
fn a_train_is_drawn() {
    let place = place();
    place.run(&["check", "m.yaml", "--figure"]).ends_with(0);
    let text = place.read("m.svg");
    for part in [">A<", ">B<", ">mesh<", "half gap 50 um", "100 mm"] {
        assert!(text.contains(part), "{part}");
    }
    place
        .run(&["check", "m.yaml", "--figure=train.pdf"])
        .ends_with(0);
    assert!(place.path("train.pdf").exists());
    place
        .run(&["check", "m.yaml", "--figure=train.txt"])
        .ends_with(2);
}
