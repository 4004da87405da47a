//! Studies in bad company: links in their folder, runs that cannot be paid, names that are formulas.

use crate::program::{Place, REDUCED};
use crate::study_support::{end, interrupt, journals, start, study, undisturbed, wait_for};

#[test]
fn a_journal_is_no_link() {
    let place = Place::with(&study(400));
    place.write("victim.txt", "keep this\n");
    let arguments = ["run", "m.yaml", "--jobs", "1", "--out", "out"];
    let mut child = start(&place, &arguments);
    wait_for(&place, "out", 2, &mut child);
    interrupt(&child);
    end(child);
    let journal = journals(&place, "out").pop().unwrap();
    let victim = place.path("victim.txt");
    for make in [
        |to: &std::path::Path, at: &std::path::Path| std::os::unix::fs::symlink(to, at).unwrap(),
        |to: &std::path::Path, at: &std::path::Path| std::fs::hard_link(to, at).unwrap(),
    ] {
        std::fs::remove_file(&journal).unwrap();
        make(&victim, &journal);
        place
            .run(&arguments)
            .ends_with(2)
            .says(&["is a link or no regular file"]);
        assert_eq!(place.read("victim.txt"), "keep this\n");
    }
    std::fs::remove_file(&journal).unwrap();
    let made = std::process::Command::new("mkfifo").arg(&journal).status();
    assert!(made.unwrap().success());
    place
        .run(&arguments)
        .ends_with(2)
        .says(&["is a link or no regular file"]);
}

#[test]
fn a_table_is_written_through_no_link() {
    let place = Place::with(&study(3));
    place.write("victim.txt", "keep this\n");
    std::fs::create_dir(place.path("undisturbed")).unwrap();
    for name in ["study.csv", ".gearlash-study.csv.part", "study.json"] {
        std::os::unix::fs::symlink(
            place.path("victim.txt"),
            place.path(&format!("undisturbed/{name}")),
        )
        .unwrap();
    }
    assert!(undisturbed(&place).lines().count() == 4);
    assert_eq!(place.read("victim.txt"), "keep this\n");
}

#[test]
fn a_run_that_cannot_be_paid_is_a_row() {
    let place = Place::with(&study(1));
    let text = study(1);
    let front = text.split("analyses:").next().unwrap();
    place.write(
        "m.yaml",
        &format!(
            "{front}analyses:\n  study:\n    type: parameter_study\n    grid: {{analysis.harmonics: [1, 2, 4096]}}\n    \
             analysis: {{type: frequency_response, from: 1.4, to: 1.2, max_points: 2}}\n    \
             collect: {{peak: {{column: rms.mesh, reduce: max}}}}\n"
        ),
    );
    let ended = place.run(&["run", "m.yaml", "--out", "out", "--memory-limit", "500MB"]);
    assert_eq!(ended.code, 1, "{}", ended.err);
    let rows = place.table("out/study.csv");
    let status: Vec<&str> = rows[1..].iter().map(|row| row[3].as_str()).collect();
    assert_eq!(status, ["complete", "complete", "refused"]);
    assert!(
        rows[3][4].contains("harmonics") && rows[3][4].contains("memory"),
        "{}",
        rows[3][4]
    );
}

#[test]
fn collected_quantities_have_names() {
    let front = REDUCED.split("analyses:").next().unwrap();
    for name in ["=HYPERLINK(1,2)", "@x", "line\\nbreak", "-1", "a b", ""] {
        let place = Place::with(&format!(
            "{front}analyses:\n  study:\n    type: parameter_study\n    grid: {{mesh.half_gap: [1, 2]}}\n    \
             analysis: {{type: frequency_response, from: 1.5, to: 1.4, harmonics: 3}}\n    \
             collect: {{\"{name}\": {{column: rms.mesh, reduce: max}}}}\n"
        ));
        place
            .run(&["run", "m.yaml"])
            .ends_with(2)
            .says(&["names start with a letter"]);
    }
}

#[test]
fn studies_have_an_end() {
    let front = REDUCED.split("analyses:").next().unwrap();
    let tail = "analysis: {type: modes, points: 3}, collect: {peak: {column: natural_frequency.1, reduce: max}}";
    for space in [
        "grid: {mesh.half_gap: {from: 1, to: 2, points: 9223372036854775807}}",
        "sample: {count: 9223372036854775807, seed: 1, parameters: {mesh.half_gap: {distribution: uniform, low: 1, high: 2}}}",
    ] {
        let place = Place::with(&format!(
            "{front}analyses:\n  study: {{type: parameter_study, {space}, {tail}}}\n"
        ));
        let ended = place.run(&["run", "m.yaml"]).ends_with(2);
        assert!(ended.err.contains("1000000000000"), "{}", ended.err);
    }
}
