//! Hostile and broken input is refused with a message, soon, and never with a panic.

use gearlash::error::{Colour, Error, render};
use gearlash::yaml;
use std::time::{Duration, Instant};

/// Longer than any refusal takes on the busiest machine: measured well below a second alone.
const PATIENCE: Duration = Duration::from_secs(60);

fn refused(what: &str, text: &str, part: &str) {
    let start = Instant::now();
    match yaml::parse(text, "hostile.yaml") {
        Err(Error::Input(list)) => {
            let shown = render(&list, Colour::Plain);
            assert!(
                shown.contains(part),
                "{what}: {}",
                &shown[..shown.len().min(500)]
            );
            assert!(shown.len() < 100_000, "{what}: {} bytes", shown.len());
        }
        Err(other) => panic!("{what}: {other}"),
        Ok(_) => panic!("{what}: accepted"),
    }
    let seconds = start.elapsed();
    println!("{what}: {seconds:?}");
    assert!(seconds < PATIENCE, "{what}: {seconds:?}");
}

#[test]
fn nesting_is_refused() {
    refused("[", &"[".repeat(20_000), "nested deeper than 64");
    refused("{", &"{a: ".repeat(20_000), "nested deeper than 64");
    refused("- ", &"- ".repeat(20_000), "nested deeper than 64");
    refused("? ", &"? ".repeat(20_000), "nested deeper than 64");
    let indented: String = (0..2000)
        .map(|i| format!("{}a:\n", " ".repeat(i)))
        .collect();
    refused("indented", &indented, "nested deeper than 64");
    let depth = |n: usize| format!("{}1{}", "[".repeat(n), "]".repeat(n));
    assert!(yaml::parse(&depth(64), "deep.yaml").is_ok());
    refused("65", &depth(65), "nested deeper than 64");
    // Aliases deepen as well.
    let half = format!(
        "a: &a {}\nb: {}*a{}",
        depth(40),
        "[".repeat(40),
        "]".repeat(40)
    );
    refused("alias depth", &half, "nested deeper than 64");
}

#[test]
fn alias_bombs_are_refused() {
    let mut bomb = String::from("a0: &a0 [x, x, x, x, x, x, x, x, x]\n");
    for level in 1..30 {
        let aliases = vec![format!("*a{}", level - 1); 9].join(", ");
        bomb.push_str(&format!("a{level}: &a{level} [{aliases}]\n"));
    }
    refused("billion laughs", &bomb, "aliases repeat");
    let mut merge = String::from("a0: &a0 {k: 1, l: 2}\n");
    for level in 1..60 {
        let below = level - 1;
        merge.push_str(&format!(
            "a{level}: &a{level} {{p: *a{below}, q: *a{below}}}\n"
        ));
    }
    refused("doubling maps", &merge, "aliases repeat");
}

#[test]
fn large_texts_are_refused_or_read_in_time() {
    let size = yaml::MAX_TEXT;
    refused("too long", &" ".repeat(size + 1), "16 MiB");
    refused(
        "many nodes",
        &format!("[{}]", "0,".repeat(size / 2 - 4)),
        "more than 4000000 values",
    );
    refused("comment", &"#".repeat(size), "empty");
    refused("brackets", &"[".repeat(size), "nested deeper");
    refused(
        "unclosed quote",
        &format!("a: \"{}", "x".repeat(size - 8)),
        "not valid YAML",
    );
    refused("anchors", &"&a ".repeat(size / 3), "not valid YAML");
    refused("tags", &"!a ".repeat(size / 3), "not valid YAML");
    refused("documents", &"---\n".repeat(size / 4), "second document");
    refused(
        "long key",
        &format!("{}: 1\nb: [", "k".repeat(size - 20)),
        "not valid YAML",
    );
    refused(
        "directives",
        &"%YAML 1.2\n".repeat(size / 10),
        "not valid YAML",
    );
    refused("duplicates", &"a: 1\n".repeat(1_000_000), "given twice");
    let long = format!("a: {}", "word ".repeat(size / 5 - 2));
    assert!(yaml::parse(&long, "long.yaml").is_ok());
}

#[test]
fn large_files_are_refused_before_they_are_read() {
    let dir = tempfile::tempdir().unwrap();
    let path = dir.path().join("large.yaml");
    // A sparse file: a terabyte that takes no room.
    std::fs::File::create(&path)
        .unwrap()
        .set_len(1 << 40)
        .unwrap();
    let start = Instant::now();
    let error = yaml::load(&path, &[]).unwrap_err();
    assert!(error.to_string().contains("16 MiB"), "{error}");
    assert!(start.elapsed() < PATIENCE);
    std::fs::write(&path, b"a: 1\nb: \xc3\xa4\xff\n").unwrap();
    let error = yaml::load(&path, &[]).unwrap_err().to_string();
    assert!(
        error.contains("large.yaml:2:5: the file is not UTF-8"),
        "{error}"
    );
}

#[cfg(unix)]
#[test]
fn devices_are_read_up_to_the_limit() {
    let error = yaml::load(std::path::Path::new("/dev/zero"), &[]).unwrap_err();
    assert!(error.to_string().contains("16 MiB"), "{error}");
    let error = yaml::load(std::path::Path::new("/"), &[]).unwrap_err();
    assert!(matches!(error, Error::File { .. }), "{error}");
}

/// Small fast generator (splitmix64), so that the sequence is fixed for ever.
struct Random(u64);

impl Random {
    fn below(&mut self, n: usize) -> usize {
        self.0 = self.0.wrapping_add(0x9e37_79b9_7f4a_7c15);
        let mut z = self.0;
        z = (z ^ (z >> 30)).wrapping_mul(0xbf58_476d_1ce4_e5b9);
        z = (z ^ (z >> 27)).wrapping_mul(0x94d0_49bb_1331_11eb);
        ((z ^ (z >> 31)) % n as u64) as usize
    }
}

const SEED_TEXT: &str = "\
# µ comment
schema: 1
name: &n \"reverse \\u00e9 idler\"
bodies: {A: {inertia: 1.0e-3 kg m^2}, B: &b {inertia: 5 g mm^2}, C: {<<: *b}}
connections:
  mesh_1:
    gear: {A: 50 mm, B: 50 mm}
    element: {type: backlash, half_gap: 50 um, impact_damping: 0}
loads:
  A: {mean: 100 N m, harmonics: [{order: 1, amplitude: 150 N m, phase: 30 deg}]}
text: |
  block
  text
list:
- 1
- 'two'
- *n
";

const SNIPPETS: [&str; 24] = [
    "[", "]", "{", "}", ": ", "- ", "? ", "&a ", "*a", "<<: ", "\n", "\t", "'", "\"", "|", ">",
    "#", "%", "---\n", "!", "\0", "\u{85}", "\u{2028}", "ü",
];

fn mutated(random: &mut Random) -> String {
    let mut chars: Vec<char> = SEED_TEXT.chars().collect();
    for _ in 0..1 + random.below(6) {
        let at = random.below(chars.len() + 1);
        match random.below(4) {
            0 => {
                let end = (at + 1 + random.below(8)).min(chars.len());
                chars.drain(at..end);
            }
            1 => {
                let piece = SNIPPETS[random.below(SNIPPETS.len())].chars();
                chars.splice(at..at, piece);
            }
            2 => {
                let end = (at + random.below(40)).min(chars.len());
                let copy = chars[at..end].to_vec();
                let to = random.below(chars.len() + 1);
                chars.splice(to..to, copy);
            }
            _ if at < chars.len() => {
                chars[at] = char::from(random.below(128) as u8);
            }
            _ => chars.truncate(at / 2 + 1),
        }
        if chars.is_empty() {
            chars.push('a');
        }
    }
    chars.into_iter().collect()
}

#[test]
fn mutated_texts_do_not_panic() {
    let mut random = Random(19_950_101);
    let (mut good, mut bad) = (0, 0);
    for round in 0..20_000 {
        let text = mutated(&mut random);
        match yaml::parse(&text, "fuzz.yaml") {
            Ok(mut node) => {
                good += 1;
                let _ = node.to_json();
                let _ = yaml::apply_override(&mut node, &text);
                let _ = yaml::apply_override(&mut node, &format!("list.0={text}"));
                for (key, entry) in node.as_map("").cloned().unwrap_or_default() {
                    let _ = entry.node.read::<Box<dyn gearlash::element::Element>>(&key);
                    let _ = entry.node.read::<Vec<f64>>(&key);
                    let _ = gearlash::quantity::Quantity::from_node(&entry.node, &key);
                }
                if let Some(element) = node.at("connections.mesh_1.element") {
                    let _ = element.read::<Box<dyn gearlash::element::Element>>("e");
                }
            }
            Err(Error::Input(list)) => {
                bad += 1;
                assert!(!list.is_empty());
                if round % 10 == 0 {
                    assert!(!render(&list, Colour::Plain).is_empty());
                }
            }
            Err(other) => panic!("{other}"),
        }
    }
    println!("{good} accepted, {bad} refused");
    assert!(good > 1000 && bad > 1000);
}

#[test]
fn mutated_quantities_do_not_panic() {
    let seeds = [
        "50 um",
        "1e4 N m/rad",
        "12 lbf in",
        "5 g mm^2",
        "-1.5e-3 N/(m s)",
        "1/m^2",
        "30 °",
        "2 µm·N^-2",
    ];
    let pieces = [
        "^", "/", "(", ")", "*", ".", "e", "-", "9", "µ", " ", "\u{301}", "_", "m", "²", "0x",
    ];
    let mut random = Random(7);
    for _ in 0..20_000 {
        let mut chars: Vec<char> = seeds[random.below(seeds.len())].chars().collect();
        for _ in 0..1 + random.below(5) {
            let at = random.below(chars.len() + 1);
            if random.below(3) == 0 && at < chars.len() {
                chars.remove(at);
            } else {
                chars.splice(at..at, pieces[random.below(pieces.len())].chars());
            }
        }
        let text: String = chars.into_iter().collect();
        if let Ok(quantity) = gearlash::quantity::Quantity::parse(&text) {
            assert!(quantity.value.is_finite(), "{text}");
        }
    }
}
