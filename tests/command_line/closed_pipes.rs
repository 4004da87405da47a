//! Readers that go before the program ends: results are complete, nothing is said, nothing panics.

use crate::program::{Place, REDUCED};
use std::process::{Command, Stdio};

/// Runs the program with pipes that nobody reads; status and what is left of standard error.
fn unread(place: &Place, arguments: &[&str], closed: &[&str]) -> (Option<i32>, String) {
    let mut command = Command::new(assert_cmd::cargo::cargo_bin("gearlash"));
    command.current_dir(place.folder.path()).args(arguments);
    command.stdout(Stdio::piped()).stderr(Stdio::piped());
    let mut child = command.spawn().unwrap();
    if closed.contains(&"stdout") {
        drop(child.stdout.take());
    }
    if closed.contains(&"stderr") {
        drop(child.stderr.take());
    }
    let output = child.wait_with_output().unwrap();
    let said = String::from_utf8_lossy(&output.stderr).into_owned();
    (output.status.code(), said)
}

#[test]
fn a_run_nobody_listens_to_writes_everything() {
    // A slip that is warned of: there is something to say on standard error.
    let text = REDUCED.replace("half_gap: 1.0", "half_gap: 1.0, impact_damping: 2");
    let place = Place::with(&text);
    place.run(&["run", "m.yaml", "--out", "heard"]).ends_with(0);
    for (k, closed) in [&["stdout"][..], &["stderr"], &["stdout", "stderr"]]
        .iter()
        .enumerate()
    {
        let out = format!("unheard_{k}");
        let (status, said) = unread(&place, &["run", "m.yaml", "--out", &out], closed);
        assert_eq!(status, Some(0), "{closed:?}: {said}");
        assert!(!said.contains("panicked"), "{said}");
        assert_eq!(place.names(&out), place.names("heard"));
    }
}

#[test]
fn mistakes_nobody_reads_keep_their_status() {
    let place = Place::with(&REDUCED.replace("modal_ratio", "modal_ration"));
    let both = ["stdout", "stderr"];
    for arguments in [
        &["run", "m.yaml"][..],
        &["check", "m.yaml"],
        &["run", "absent.yaml"],
        &["run", "m.yaml", "--nonsense"],
    ] {
        let (status, _) = unread(&place, arguments, &both);
        assert_eq!(status, Some(2), "{arguments:?}");
    }
    let place = Place::with(REDUCED);
    for arguments in [
        &["check", "m.yaml"][..],
        &["elements"],
        &["schema"],
        &["--help"],
    ] {
        let (status, _) = unread(&place, arguments, &both);
        assert_eq!(status, Some(0), "{arguments:?}");
    }
}
