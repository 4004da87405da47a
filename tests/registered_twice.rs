//! Laws that are registered twice: the program says which and does nothing. A binary of its own, for a registry belongs to a
//! whole program; it has no test harness, since it is the program as well.

use gearlash::element::{Element, Parameter, Response};
use gearlash::serde::{Deserialize, Serialize};
use gearlash::typetag;
use std::process::{Command, ExitCode};

/// Says that this process is the program and not the test.
const AS_PROGRAM: &str = "GEARLASH_TEST_AS_PROGRAM";

macro_rules! spring {
    ($name:ident, $tag:literal) => {
        #[derive(Debug, Clone, Serialize, Deserialize)]
        #[serde(crate = "gearlash::serde")]
        struct $name {}

        #[typetag::serde(name = $tag)]
        impl Element for $name {
            fn eval(&self, q: f64, _v: f64, _phase: f64) -> Response {
                Response {
                    f: 2.0 * q,
                    df_dq: 2.0,
                    df_dv: 0.0,
                }
            }

            fn visit_parameters(&mut self, _visit: &mut dyn FnMut(Parameter<'_>)) {}

            fn clone_box(&self) -> Box<dyn Element> {
                Box::new(self.clone())
            }
        }
    };
}

// A second law under the tag of a builtin one, without an entry in the table.
spring!(SecondLinear, "linear");

// A law with two entries.
spring!(Twin, "twin");
gearlash::register_element! {
    tag: "twin", doc: "f = 2 q", parameters: [], example: "{type: twin}",
}
gearlash::register_element! {
    tag: "twin", doc: "f = 3 q", parameters: [], example: "{type: twin}",
}

// An entry without a law.
gearlash::register_element! {
    tag: "ghost", doc: "f = 0", parameters: [], example: "{type: ghost}",
}

fn main() -> ExitCode {
    if std::env::var_os(AS_PROGRAM).is_some() {
        return gearlash::cli::main();
    }
    let own = std::env::current_exe().expect("the test is a file");
    for arguments in [&["elements"][..], &["check", "m.yaml"], &["run", "m.yaml"]] {
        let output = Command::new(&own)
            .args(arguments)
            .env(AS_PROGRAM, "1")
            .output();
        let output = output.expect("the test runs itself");
        let said = String::from_utf8_lossy(&output.stderr);
        assert_eq!(output.status.code(), Some(2), "{said}");
        for part in [
            "law `linear`: its example is not read",
            "non-unique tag",
            "law `twin` is registered more than once: two entries",
            "law `ghost`: its example is not read",
        ] {
            assert!(said.contains(part), "wanted {part:?} in:\n{said}");
        }
        assert!(output.stdout.is_empty(), "nothing is done");
        assert!(
            !said.contains("`backlash`"),
            "laws in order are not named:\n{said}"
        );
    }
    println!("laws registered twice are refused");
    ExitCode::SUCCESS
}
