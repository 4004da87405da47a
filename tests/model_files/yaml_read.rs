//! Deserialising nodes: structs, enums, laws; messages with path, place and next move.

use gearlash::element::Element;
use gearlash::error::{Colour, Diagnostic, render};
use gearlash::yaml::{self, Node};
use indexmap::IndexMap;
use serde::Deserialize;

fn parse(text: &str) -> Node {
    yaml::parse(text, "m.yaml").unwrap_or_else(|e| panic!("{e}"))
}

/// Line, column, path and message with help.
fn shown(d: &Diagnostic) -> (usize, usize, String, String) {
    let at = d.location.as_ref().expect("a place");
    let help = d.help.as_deref().unwrap_or("");
    (
        at.line,
        at.column,
        d.path.clone(),
        format!("{}; {help}", d.message),
    )
}

#[derive(Debug, Deserialize, PartialEq)]
#[serde(deny_unknown_fields)]
struct Sample {
    points: u8,
    #[serde(default)]
    stability: Option<bool>,
    #[serde(default)]
    method: Option<Method>,
    #[serde(default)]
    pair: Option<(f64, f64)>,
    #[serde(default)]
    inner: IndexMap<String, Vec<Inner>>,
}

#[derive(Debug, Deserialize, PartialEq)]
#[serde(deny_unknown_fields)]
struct Inner {
    half_gap: f64,
}

#[derive(Debug, Deserialize, PartialEq)]
#[serde(rename_all = "snake_case")]
enum Method {
    Galerkin,
    Shooting,
    Value(f64),
    Box { count: u32 },
}

#[test]
fn structs_enums_options_and_maps() {
    let read = |text: &str| parse(text).read::<Sample>("s").unwrap();
    let sample =
        read("{points: 1e2, stability: true, pair: [1, '2'], inner: {b: [{half_gap: 1}], a: []}}");
    assert_eq!(
        (sample.points, sample.stability, sample.pair),
        (100, Some(true), Some((1.0, 2.0)))
    );
    assert_eq!(sample.inner.keys().collect::<Vec<_>>(), ["b", "a"]);
    assert_eq!(
        read("{points: 1, method: shooting}").method,
        Some(Method::Shooting)
    );
    assert_eq!(
        read("{points: 1, method: galerkin, stability: ~}").method,
        Some(Method::Galerkin)
    );
    assert_eq!(
        read("{points: 1, method: {value: 3}}").method,
        Some(Method::Value(3.0))
    );
    assert_eq!(
        read("{points: 1, method: {box: {count: 3}}}").method,
        Some(Method::Box { count: 3 })
    );
    assert_eq!(read("{points: 1, method: }").method, None);
}

#[test]
fn mistakes_of_values_have_path_place_and_next_move() {
    for (text, column, path, part) in [
        (
            "{points: 1, stabilty: true}",
            13,
            "s.stabilty",
            "unknown key `stabilty`; did you mean `stability`?",
        ),
        (
            "{points: 1, qqq: true}",
            13,
            "s.qqq",
            "known: points, stability",
        ),
        ("{stability: true}", 1, "s", "the key `points` is missing"),
        (
            "{points: 1.5}",
            10,
            "s.points",
            "found 1.5, wanted a whole number from 0 to 255",
        ),
        (
            "{points: 300}",
            10,
            "s.points",
            "found 300, wanted a whole number from 0 to 255",
        ),
        ("{points: 5 um}", 10, "s.points", "found the text `5 um`"),
        ("{points: -1}", 10, "s.points", "found -1"),
        ("{points: .inf}", 10, "s.points", "finite"),
        ("{points: ~}", 10, "s.points", "found nothing (null)"),
        ("{points: [1]}", 10, "s.points", "found a list"),
        (
            "{points: 1, stability: yes}",
            24,
            "s.stability",
            "wanted true or false; write `true`",
        ),
        (
            "{points: 1, stability: 'true'}",
            24,
            "s.stability",
            "without quotes",
        ),
        (
            "{points: 1, method: shoting}",
            21,
            "s.method",
            "did you mean `shooting`?",
        ),
        (
            "{points: 1, method: {valu: 1}}",
            22,
            "s.method.valu",
            "did you mean `value`?",
        ),
        (
            "{points: 1, method: {value: x}}",
            29,
            "s.method.value",
            "wanted a number",
        ),
        (
            "{points: 1, method: value}",
            21,
            "s.method",
            "wanted it as a key with a value",
        ),
        (
            "{points: 1, method: {a: 1, b: 2}}",
            21,
            "s.method",
            "found 2 entries",
        ),
        (
            "{points: 1, pair: [1, 2, 3]}",
            19,
            "s.pair",
            "found 3 entries",
        ),
        ("{points: 1, pair: [1]}", 19, "s.pair", "found 1 entry"),
        (
            "{points: 1, inner: {A: [{half_gap: 1}, {half_gap: 1e999}]}}",
            51,
            "s.inner.A.1.half_gap",
            "finite",
        ),
        (
            "{points: 1, inner: {A: [{halfgap: 1}]}}",
            26,
            "s.inner.A.0.halfgap",
            "`halfgap`",
        ),
        ("[1]", 1, "s", "found a list, wanted a map"),
    ] {
        let mistake = parse(text).read::<Sample>("s").unwrap_err();
        let (_, c, p, message) = shown(&mistake);
        assert_eq!((c, p.as_str()), (column, path), "{text}: {message}");
        assert!(message.contains(part), "{text}: {message}");
    }
}

#[test]
fn laws_keep_places_wherever_their_tag_stands() {
    let law = |text: &str| parse(text).read::<Box<dyn Element>>("e");
    let backlash = law("{half_gap: '4e-05', type: backlash}").unwrap();
    assert_eq!(backlash.breakpoints(), [-4e-5, 4e-5]);
    for (text, column, path, part) in [
        (
            "{half_gap: x, type: backlash}",
            12,
            "e.half_gap",
            "found the text `x`, wanted a number",
        ),
        (
            "{half_gab: 1, type: backlash}",
            2,
            "e.half_gab",
            "did you mean `half_gap`?",
        ),
        (
            "{half_gap: 1, type: backlsh}",
            21,
            "e.type",
            "did you mean `backlash`?",
        ),
        ("{half_gap: 1}", 1, "e", "the key `type` is missing"),
        ("{type: backlash}", 1, "e", "one of half_gap or gap"),
        (
            "{type: piecewise_linear, breakpoints: [1, b]}",
            43,
            "e.breakpoints.1",
            "wanted a number",
        ),
        ("backlash", 1, "e", "wanted a map with the key `type`"),
        (
            "{type: linear, stiffness: 1}",
            16,
            "e.stiffness",
            "unknown key",
        ),
    ] {
        let mistake = law(text).unwrap_err();
        let (_, c, p, message) = shown(&mistake);
        assert_eq!((c, p.as_str()), (column, path), "{text}: {message}");
        assert!(message.contains(part), "{text}: {message}");
    }
    law("{type: linear}").unwrap();
}

#[test]
fn unknown_keys_are_reported_in_one_go() {
    let node = parse("{bodie: 1, connections: 2, lods: 3}");
    let list = yaml::unknown_keys(
        node.as_map("").unwrap(),
        &["bodies", "connections", "loads"],
        "",
    );
    assert_eq!(list.len(), 2);
    let text = render(&list, Colour::Plain);
    assert!(
        text.contains("m.yaml:1:2") && text.contains("did you mean `bodies`?"),
        "{text}"
    );
    assert!(
        text.contains("m.yaml:1:28") && text.contains("did you mean `loads`?"),
        "{text}"
    );
}
