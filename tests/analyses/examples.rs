//! The examples run.

#[path = "../../examples/branch_switching.rs"]
mod branch_switching;
#[path = "../../examples/own_law.rs"]
mod own_law;
#[path = "../../examples/response.rs"]
mod response;
#[path = "../../examples/study.rs"]
mod study;
#[path = "../../examples/time_history.rs"]
mod time_history;

#[test]
fn examples_run() {
    response::main().unwrap();
    own_law::main().unwrap();
    study::main().unwrap();
    time_history::main().unwrap();
    branch_switching::main().unwrap();
}
