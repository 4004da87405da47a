//! Takes the plotting script of the report page out of the crate that carries it: the program holds it once and as it is written.

use std::path::Path;

fn main() {
    println!("cargo::rerun-if-changed=build.rs");
    // Two script elements; the second one typesets formulas, which no page has.
    let both = plotly::Plot::offline_js_sources();
    let (_, rest) = both.split_once('>').expect("a script element");
    let (script, _) = rest.split_once("</script>").expect("its end");
    // Control characters in its strings are written as escapes: a page holds none as they are.
    let is_raw = |c: &char| c.is_control() && !matches!(c, '\n' | '\t' | '\r');
    let escaped = |c: char| match is_raw(&c) {
        true => format!("\\x{:02x}", c as u32),
        false => c.to_string(),
    };
    let script: String = script.chars().map(escaped).collect();
    let folder = std::env::var_os("OUT_DIR").expect("set by cargo");
    std::fs::write(Path::new(&folder).join("plotting.js"), script).expect("a writable OUT_DIR");
}
