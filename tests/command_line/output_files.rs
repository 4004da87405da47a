//! Files of a run, from synthetic reports: what is written, that it is whole, that pages and figures show everything.

use std::collections::HashSet;
use std::path::Path;

use gearlash::error::Error;
use gearlash::output::{
    FigureFormat, Input, RunOptions, html, manifest, svg, write_report, write_run,
};
use gearlash::report::{Curve, CurveStyle, Report, Values};
use serde_json::Value;

fn options() -> RunOptions {
    RunOptions {
        model: "idler </script><script>alert(1)</script> & \"pair\"".into(),
        figures: vec![FigureFormat::Svg],
        inputs: vec![Input::of("idler.yaml", b"schema: 1\n")],
        ..RunOptions::default()
    }
}

fn figure(report: &Report) -> String {
    svg::render(report.figure.as_ref().unwrap(), report).unwrap()
}

fn json(path: &Path) -> Value {
    serde_json::from_slice(&std::fs::read(path).unwrap()).unwrap()
}

#[test]
fn a_run_is_written_whole_and_listed_with_hashes() {
    let dir = tempfile::tempdir().unwrap();
    let out = dir.path().join("results").join("idler");
    let files = write_run(&out, &crate::synthetic::all(), &options()).unwrap();
    let found: HashSet<_> = std::fs::read_dir(&out)
        .unwrap()
        .map(|e| e.unwrap().path())
        .collect();
    assert_eq!(found, files.iter().cloned().collect());
    let manifest = json(&out.join("manifest.json"));
    assert_eq!(manifest["inputs"][0]["name"], "idler.yaml");
    let listed = manifest["files"].as_array().unwrap();
    assert_eq!(listed.len(), files.len() - 2); // all but itself and the times
    for entry in listed {
        let bytes = std::fs::read(out.join(entry["name"].as_str().unwrap())).unwrap();
        assert_eq!(entry["sha256"], manifest::sha256(&bytes));
        assert_eq!(entry["size"], bytes.len());
    }
    // A second run over the first one gives the same bytes.
    write_run(&out, &crate::synthetic::all(), &options()).unwrap();
    assert_eq!(json(&out.join("manifest.json")), manifest);
}

#[test]
fn figures_are_drawn_as_pixels_and_pages() {
    let dir = tempfile::tempdir().unwrap();
    let formats = [FigureFormat::Png, FigureFormat::Pdf];
    write_report(dir.path(), &crate::synthetic::bifurcation(), &formats).unwrap();
    let png = std::fs::read(dir.path().join("diagram.png")).unwrap();
    // Width in the header of a PNG: 178 mm, two columns of a journal, at 300 dots per inch.
    let width = u32::from_be_bytes(png[16..20].try_into().unwrap());
    assert!(
        (f64::from(width) - 178.0 / 25.4 * 300.0).abs() < 3.0,
        "{width}"
    );
    let pdf = std::fs::read(dir.path().join("diagram.pdf")).unwrap();
    assert!(pdf.starts_with(b"%PDF-"));
    assert!(!dir.path().join("diagram.svg").exists());
}

#[test]
fn numbers_in_a_table_read_back_the_same() {
    let dir = tempfile::tempdir().unwrap();
    let report = crate::synthetic::resonance();
    write_report(dir.path(), &report, &[]).unwrap();
    let mut reader = csv::Reader::from_path(dir.path().join("fig_11.csv")).unwrap();
    let main = report.table("").unwrap();
    let names: Vec<&str> = main.columns.iter().map(|c| c.name.as_str()).collect();
    assert_eq!(reader.headers().unwrap(), names);
    for (row, record) in reader.records().enumerate() {
        for (column, cell) in main.columns.iter().zip(record.unwrap().iter()) {
            match &column.values {
                Values::Float(v) if v[row].is_nan() => assert_eq!(cell, ""),
                Values::Float(v) => assert_eq!(cell.parse::<f64>().unwrap(), v[row]),
                Values::Integer(v) => assert_eq!(cell.parse::<i64>().unwrap(), v[row]),
                Values::Text(v) => assert_eq!(cell, v[row]),
            }
        }
    }
    let value = json(&dir.path().join("fig_11.json"));
    assert_eq!(value["columns"][2]["name"], "omega");
    assert_eq!(value["branches"][1]["end"]["reason"], "returned_to_start");
    assert_eq!(value["ended_early"], Value::Null);
}

#[test]
fn a_figure_shows_every_part_and_is_deterministic() {
    let mut report = crate::synthetic::resonance();
    assert!(
        !figure(&report).contains("backbone"),
        "drawn where it is requested"
    );
    report.plot.backbone = Some(true);
    let text = figure(&report);
    assert_eq!(text, figure(&report));
    for part in [
        "mesh 1",
        "backbone, mode 1",
        "stable",
        "unstable",
        "stability unknown",
        "fold",
        "Neimark-Sacker",
        "period doubling",
        "grazing",
        "branch point",
        "r.m.s. displacement",
        "effective stiffness",
        "viewBox",
    ] {
        assert!(text.contains(part), "{part}");
    }
    assert!(!text.contains("NaN") && !text.contains("inf"));
    // Two curves a panel dashed where unstable, and the sample in the legend.
    assert_eq!(text.matches("stroke-dasharray").count(), 5);
}

#[test]
fn reports_without_points_or_panels_still_have_figures() {
    let mut report = crate::synthetic::resonance();
    for column in report.tables.iter_mut().flat_map(|t| &mut t.columns) {
        match &mut column.values {
            Values::Float(v) => v.clear(),
            Values::Integer(v) => v.clear(),
            Values::Text(v) => v.clear(),
        }
    }
    assert!(figure(&report).contains("no points"));
    report.figure.as_mut().unwrap().panels.clear();
    assert!(figure(&report).starts_with("<svg"));
}

#[test]
fn text_of_the_user_cannot_break_a_figure() {
    let mut report = crate::synthetic::bifurcation();
    let figure = report.figure.as_mut().unwrap();
    figure.title = "a < b & \"c\" costs $5 or $6".into();
    figure.panels[0].y_label = "</text><script>".into();
    figure.panels[0].curves[0].label = "<x>".repeat(100);
    let text = self::figure(&report);
    assert!(text.contains("a &lt; b &amp; &quot;c&quot; costs $5 or $6"));
    assert!(!text.contains("<script>"));
}

fn page(reports: &[Report], options: &RunOptions) -> String {
    let mut bytes = Vec::new();
    let page = html::render(reports, options).unwrap();
    page.write(&mut bytes).unwrap();
    String::from_utf8(bytes).unwrap()
}

#[test]
fn the_page_holds_everything_and_user_text_is_escaped() {
    let mut reports = crate::synthetic::all();
    reports[0].figure.as_mut().unwrap().panels[0].x_label = "</script><!--".into();
    let page = page(&reports, &options());
    // One data element a figure, the plotting script, our seven scripts.
    let figures = reports.iter().filter(|r| r.figure.is_some()).count();
    assert_eq!(page.matches("</script").count(), figures + 8);
    assert!(!page.contains("<script>alert"));
    for part in [
        "<title>idler &lt;/script&gt;",
        "href=\"#a-fig_11\"",
        "Figure 11 &lt;i&gt;of&lt;/i&gt; the paper",
        "Softening resonance &amp; jump",
        "zeta = 0.05 (not legible)",
        "pulls at 3 points",
        "interrupted after 400 of 500 values",
        "returned to start",
        "turned back at 0.87",
        "Neimark-Sacker",
        "fig_11.events.csv",
        "src=\"data:image/svg+xml,",
        &manifest::sha256(b"schema: 1\n"),
    ] {
        assert!(page.contains(part), "{part}");
    }
    for start in ["src=\"http", "href=\"http", "MathJax-2", "@import"] {
        let ours = page.rmatch_indices("<script>").nth(6).unwrap().0;
        assert!(!page[ours..].contains(start), "{start}");
    }
}

#[test]
fn a_page_without_figures_carries_no_script() {
    let report = Report {
        name: "bare".into(),
        ..Report::default()
    };
    let page = page(&[report], &RunOptions::default());
    assert!(page.len() < 10_000 && !page.contains("<script"));
}

#[test]
fn what_cannot_be_written_is_named() {
    let dir = tempfile::tempdir().unwrap();
    let file = dir.path().join("taken");
    std::fs::write(&file, "").unwrap();
    let error = write_run(&file.join("sub"), &[], &options()).unwrap_err();
    assert!(matches!(error, Error::File { .. }), "{error}");

    // A folder has the name of the table: the error names the table, and no temporary file is left.
    std::fs::create_dir(dir.path().join("fig_11.csv")).unwrap();
    let error = write_report(dir.path(), &crate::synthetic::resonance(), &[]).unwrap_err();
    assert!(error.to_string().contains("fig_11.csv"), "{error}");
    let names = std::fs::read_dir(dir.path()).unwrap();
    let parts = names.filter(|e| {
        e.as_ref()
            .unwrap()
            .file_name()
            .to_string_lossy()
            .contains(".part")
    });
    assert_eq!(parts.count(), 0);
}

#[test]
fn names_that_are_no_file_names_are_refused() {
    let dir = tempfile::tempdir().unwrap();
    for name in ["", "../up", "manifest", "a/b", ".hidden"] {
        let report = Report {
            name: name.into(),
            ..Report::default()
        };
        let error = write_report(dir.path(), &report, &[]).unwrap_err();
        assert!(matches!(error, Error::File { .. }), "{name}");
    }
}

#[test]
fn a_figure_that_wants_a_missing_column_says_so() {
    let mut report = crate::synthetic::resonance();
    report.figure.as_mut().unwrap().panels[1].curves[0].y = "rms.mesh_9".into();
    let error = svg::render(report.figure.as_ref().unwrap(), &report).unwrap_err();
    assert!(error.to_string().contains("rms.mesh_9"), "{error}");
}

/// A sweep is drawn once a panel, each panel in the colour of its connection.
#[test]
fn what_several_panels_show_stands_once_in_the_legend() {
    let mut report = crate::synthetic::resonance();
    let panels = &mut report.figure.as_mut().unwrap().panels;
    for (panel, connection) in panels.iter_mut().zip(["mesh_1", "mesh_2"]) {
        let of_connection = |c: &Curve| c.y.ends_with(connection);
        panel.curves.retain(of_connection);
        panel.curves.truncate(1);
        panel.curves[0].label = "down".into();
        panel.curves[0].style = CurveStyle::Dots;
    }
    let text = figure(&report);
    assert_eq!(text.matches(">down<").count(), 1, "{text}");
}

/// The file holds every row, the picture and the page what they can show.
#[test]
fn long_records_make_small_pictures() {
    use gearlash::report::{Column, Figure, Panel, Table};
    let rows = 200_000;
    let column = |name: &str, unit: &str, value: &dyn Fn(f64) -> f64| Column {
        name: name.into(),
        unit: unit.into(),
        values: Values::Float((0..rows).map(|k| value(f64::from(k) * 1e-4)).collect()),
    };
    let curve = |y: &str| Curve {
        table: String::new(),
        x: "t".into(),
        y: y.into(),
        label: y.into(),
        style: CurveStyle::Line,
        only: None,
    };
    let report = Report {
        name: "long".into(),
        tables: vec![Table {
            name: String::new(),
            columns: vec![
                column("t", "s", &|t| t),
                column("q.mesh", "m", &|t| (300.0 * t).sin() * (0.1 * t).cos()),
            ],
        }],
        figure: Some(Figure {
            title: String::new(),
            panels: vec![Panel {
                x_label: "time t [s]".into(),
                y_label: "deformation q [m]".into(),
                curves: vec![curve("q.mesh")],
                ..Panel::default()
            }],
        }),
        ..Report::default()
    };
    let picture = figure(&report);
    assert!(picture.len() < 200_000, "{}", picture.len());
    let dir = tempfile::tempdir().unwrap();
    write_run(dir.path(), &[report], &options()).unwrap();
    let page = std::fs::metadata(dir.path().join("report.html")).unwrap();
    assert!(page.len() < 3_000_000, "{}", page.len());
    let table = std::fs::read_to_string(dir.path().join("long.csv")).unwrap();
    assert_eq!(table.lines().count(), 200_001);
}
