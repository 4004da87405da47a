//! Loading: scalars as written, places, merging, overrides.

use crate::places::shown;
use gearlash::error::{Diagnostic, Error};
use gearlash::yaml::{self, Node};
use indexmap::IndexMap;
use std::path::PathBuf;

fn parse(text: &str) -> Node {
    yaml::parse(text, "m.yaml").unwrap_or_else(|e| panic!("{e}"))
}

fn mistakes(result: Result<impl std::fmt::Debug, Error>) -> Vec<Diagnostic> {
    match result {
        Err(Error::Input(list)) => list,
        other => panic!("wanted mistakes in the input, found {other:?}"),
    }
}

struct Files(tempfile::TempDir);

impl Files {
    fn new(files: &[(&str, &str)]) -> Self {
        let dir = tempfile::tempdir().unwrap();
        for (name, text) in files {
            let path = dir.path().join(name);
            std::fs::create_dir_all(path.parent().unwrap()).unwrap();
            std::fs::write(path, text).unwrap();
        }
        Files(dir)
    }

    fn path(&self, name: &str) -> PathBuf {
        self.0.path().join(name)
    }

    fn load(&self, name: &str, overrides: &[&str]) -> Result<yaml::Document, Error> {
        let overrides: Vec<String> = overrides.iter().map(ToString::to_string).collect();
        yaml::load(&self.path(name), &overrides)
    }

    fn json(&self, name: &str, overrides: &[&str]) -> String {
        let document = self.load(name, overrides).unwrap_or_else(|e| panic!("{e}"));
        document.root.to_json().to_string()
    }
}

#[test]
fn words_stay_words_and_numbers_are_numbers_when_asked_for() {
    let node = parse("y: {no: on, N: yes}\nn: [1e5, 4e-05, .5, '4e-05', \"7\"]\nid: 007\n");
    let keys: Vec<_> = node.as_map("").unwrap().keys().cloned().collect();
    assert_eq!(keys, ["y", "n", "id"]);
    let words: IndexMap<String, String> = node.at("y").unwrap().read("y").unwrap();
    assert_eq!(words["no"], "on");
    assert_eq!(words["N"], "yes");
    let numbers: Vec<f64> = node.at("n").unwrap().read("n").unwrap();
    assert_eq!(numbers, [1e5, 4e-5, 0.5, 4e-5, 7.0]);
    assert_eq!(node.at("id").unwrap().as_text("id").unwrap(), "007");
    assert_eq!(
        node.at("n.3").unwrap().read::<String>("n.3").unwrap(),
        "4e-05"
    );
    assert_eq!(
        node.to_json().to_string(),
        r#"{"y":{"no":"on","N":"yes"},"n":[100000.0,0.00004,0.5,"4e-05","7"],"id":7}"#
    );
}

#[test]
fn places_count_lines_and_characters_from_one() {
    let node = parse("# µ\nü: {ab: [1, 'µ', c]}\n");
    let place = |path: &str| {
        let at = node.at(path).unwrap().location.clone().unwrap();
        (at.line, at.column)
    };
    assert_eq!(place("ü.ab.0"), (2, 10));
    assert_eq!(place("ü.ab.1"), (2, 13));
    assert_eq!(place("ü.ab.2"), (2, 18));
    let key = node.at("ü").unwrap().as_map("").unwrap()["ab"]
        .key_location
        .clone();
    assert_eq!(key.map(|at| (at.line, at.column)), Some((2, 5)));
    let marked = parse("\u{feff}a: 1\r\nb: 2\r\n");
    let at = marked.at("b").unwrap().location.clone().unwrap();
    assert_eq!((at.line, at.column), (2, 4));
}

#[test]
fn anchors_merge_keys_and_tags() {
    let node = parse(
        "x-g: &g {type: backlash, half_gap: 1}\nx-h: &h {half_gap: 2, side: b}\n\
         a: {impact: 0, <<: *g, half_gap: 3}\nb: {<<: [*g, *h]}\nc: [*g, !!str 5, !!float '5']\n",
    );
    let json = |path: &str| node.at(path).unwrap().to_json().to_string();
    assert_eq!(json("a"), r#"{"impact":0,"type":"backlash","half_gap":3}"#);
    assert_eq!(json("b"), r#"{"type":"backlash","half_gap":1,"side":"b"}"#);
    assert_eq!(json("c"), r#"[{"type":"backlash","half_gap":1},"5",5]"#);
}

#[test]
fn mistakes_in_the_text_have_places() {
    for (text, line, column, part) in [
        ("a: [1, 2\nb: 3\n", 2, 2, "not valid YAML"),
        (
            "a: {b: 1, b: 2}\n",
            1,
            11,
            "`b` is given twice; first at line 1, column 5",
        ),
        ("", 1, 1, "empty"),
        ("# nothing\n", 1, 1, "empty"),
        ("a: 1\n---\nb: 2\n", 2, 1, "second document"),
        ("a: *b\n", 1, 4, "no anchor `&b`"),
        ("a: &a [*a]\n", 1, 8, "contains the alias"),
        ("a: !foo 1\n", 1, 9, "`!foo`"),
        ("a: !!set {b}\n", 1, 10, "has no meaning"),
        ("? [a]\n: 1\n", 1, 3, "found a list as a key"),
        ("a: {<<: 5}\n", 1, 9, "after `<<`"),
        ("a: {<<: {}, <<: {}}\n", 1, 13, "given twice"),
    ] {
        let list = mistakes(yaml::parse(text, "m.yaml"));
        let (l, c, _, message) = shown(&list[0]);
        assert_eq!((l, c), (line, column), "{text}: {message}");
        assert!(message.contains(part), "{text}: {message}");
    }
    let list = mistakes(yaml::parse("a:\n  b: [{c: 1, c: 2}]\na: 3\n", "m.yaml"));
    let paths: Vec<_> = list.iter().map(|d| d.path.as_str()).collect();
    assert_eq!(paths, ["a.b.0.c", "a"]);
}

#[test]
fn extends_merges_in_base_order() {
    let files = Files::new(&[
        (
            "base/root.yaml",
            "schema: 1\nbodies: {A: 1, B: 2, C: 3}\nlist: [1, 2]\nold: 1\n",
        ),
        (
            "base/mid.yaml",
            "extends: root.yaml\nbodies: {B: 20, D: 4}\nold: null\n",
        ),
        (
            "top.yaml",
            "name: t\nextends: base/mid.yaml\nlist: [9]\nbodies: {A: ~, C: {m: 1}}\nabsent: null\n",
        ),
    ]);
    assert_eq!(
        files.json("top.yaml", &[]),
        r#"{"schema":1,"bodies":{"B":20,"C":{"m":1},"D":4},"list":[9],"name":"t","absent":null}"#
    );
    let document = files.load("top.yaml", &["name=u"]).unwrap();
    assert_eq!(document.sources.len(), 4);
    assert!(document.sources[1].name.ends_with("mid.yaml"));
    assert_eq!(document.sources[3].name, "--set");
    let place = document
        .root
        .at("bodies.B")
        .unwrap()
        .location
        .clone()
        .unwrap();
    assert!(place.source.name.ends_with("mid.yaml"));
    assert_eq!(
        document.bytes(),
        files.load("top.yaml", &["name=u"]).unwrap().bytes()
    );
}

#[test]
fn extends_refuses_circles_and_missing_files() {
    let files = Files::new(&[
        ("a.yaml", "extends: b.yaml\n"),
        ("b.yaml", "x: 1\nextends: ./a.yaml\n"),
        ("c.yaml", "extends: none.yaml\n"),
        ("d.yaml", "extends: [a.yaml]\n"),
        ("e.yaml", "- 1\n"),
        ("f.yaml", "extends: f.yaml\n"),
    ]);
    let first = |name| shown(&mistakes(files.load(name, &[]))[0]);
    let (line, column, path, message) = first("a.yaml");
    assert_eq!((line, column, path.as_str()), (2, 10, "extends"));
    assert!(message.contains("a.yaml -> "), "{message}");
    assert!(message.contains("b.yaml -> "), "{message}");
    assert!(first("c.yaml").3.contains("cannot read"));
    assert!(first("d.yaml").3.contains("found a list, wanted text"));
    assert!(first("e.yaml").3.contains("found a list, wanted a map"));
    assert!(first("f.yaml").3.contains("circular"));
    assert!(matches!(
        files.load("none.yaml", &[]),
        Err(Error::File { .. })
    ));
}

const MODEL: &str = "\
connections:
  mesh_2: {element: {type: backlash, half_gap: 5 um}}
loads:
  A: {harmonics: [{order: 1, amplitude: 1}]}
damping:
";

#[test]
fn overrides_set_values_at_paths() {
    let files = Files::new(&[("m.yaml", MODEL)]);
    assert_eq!(
        files.json(
            "m.yaml",
            &[
                "connections.mesh_2.element.half_gap=7 um",
                "loads.A.harmonics.0.amplitude=2e3",
                "loads.A.mean = 5",
                "connections.mesh_2.element.impact_damping=0.5",
                "damping.modal_ratio=0.05",
                "scaling={frequency: first_mode}",
                "connections.mesh_2.element.type=null",
            ]
        ),
        r#"{"connections":{"mesh_2":{"element":{"half_gap":"7 um","impact_damping":0.5}}},"loads":{"A":{"harmonics":[{"order":1,"amplitude":2000.0}],"mean":5}},"damping":{"modal_ratio":0.05},"scaling":{"frequency":"first_mode"}}"#
    );
    let document = files.load("m.yaml", &["loads.A=µ: {b: ä}"]).unwrap();
    let at = document
        .root
        .at("loads.A.µ.b")
        .unwrap()
        .location
        .clone()
        .unwrap();
    assert_eq!(
        (at.source.name.as_str(), at.line, at.column),
        ("--set", 1, 16)
    );
}

#[test]
fn wrong_overrides_are_reported_together() {
    let files = Files::new(&[("m.yaml", MODEL)]);
    let overrides = [
        ("conections.mesh_2.x=1", 1, "did you mean `connections`?"),
        ("connections.mesh_3.x=1", 13, "did you mean `mesh_2`?"),
        (
            "loads.A.harmonics.1.order=1",
            19,
            "not an index from 0 to 0",
        ),
        ("loads.A.harmonics.x=1", 19, "list of 1"),
        (
            "loads.A.harmonics.0.order.x=1",
            27,
            "`loads.A.harmonics.0.order` is 1",
        ),
        ("loads.A", 1, "PATH=VALUE"),
        ("loads.A=", 9, "no value"),
        ("loads.A=[1", 9, "not valid YAML"),
        ("loads.=1", 7, "empty step"),
        ("=1", 1, "empty step"),
    ];
    let texts: Vec<_> = overrides.iter().map(|(text, ..)| *text).collect();
    let list = mistakes(files.load("m.yaml", &texts));
    assert_eq!(list.len(), overrides.len());
    for (found, (text, column, part)) in list.iter().zip(overrides) {
        let (line, c, _, message) = shown(found);
        assert_eq!((line, c), (1, column), "{text}: {message}");
        assert!(message.contains(part), "{text}: {message}");
    }
}

#[test]
fn set_of_an_analysis() {
    let mut node = parse(MODEL);
    node.set("loads.A.mean", Node::number(5e-6)).unwrap();
    assert_eq!(
        node.at("loads.A.mean").unwrap().read::<f64>("").unwrap(),
        5e-6
    );
    let value = parse("v: 3").at("v").unwrap().clone();
    let mistake = node.set("loads.B.mean", value).unwrap_err();
    assert_eq!(shown(&mistake).0, 1);
    assert_eq!(mistake.path, "loads.B.mean");
    let json = serde_json::json!({"a": [1, 2.5, "3", null, true]});
    assert_eq!(Node::from_json(&json).to_json(), json);
}
