//! Files of a run, from synthetic reports.
#[path = "output_files/synthetic.rs"]
mod synthetic;

use gearlash::output::{FigureFormat, RunOptions, svg, write_run};

#[test]
fn figure_has_every_part() {
    let report = synthetic::resonance();
    let text = svg::render(report.figure.as_ref().unwrap(), &report).unwrap();
    assert!(text.contains("stroke-dasharray"));
    assert_eq!(
        text,
        svg::render(report.figure.as_ref().unwrap(), &report).unwrap()
    );
}

#[test]
fn run_is_written() {
    let dir = match std::env::var("GEARLASH_TEST_OUT") {
        Ok(d) => std::path::PathBuf::from(d),
        Err(_) => tempfile::tempdir().unwrap().keep(),
    };
    let options = RunOptions {
        model: "reverse-idler </script> & <b>pair</b>".into(),
        figures: vec![FigureFormat::Svg],
        inputs: vec![("idler.yaml".into(), b"schema: 1".to_vec())],
        ..RunOptions::default()
    };
    write_run(&dir, &synthetic::all(), &options).unwrap();
}
