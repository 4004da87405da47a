//! Formulas that are wrong, hostile or incomplete: what is said, and where in the text.

use gearlash::element::Expression;
use gearlash::model::read;
use gearlash::yaml;
use std::time::{Duration, Instant};

/// What is said of a law of one connection, one line a mistake.
fn said(element: &str) -> String {
    let text = format!(
        "bodies:
  A: {{inertia: 1e-3}}
connections:
  mesh:
    ground: A
    stiffness: 1e4
    element: {element}
"
    );
    let root = yaml::parse(&text, "m.yaml").unwrap();
    let list = read(&root).map(|_| Vec::new()).unwrap_or_else(|list| list);
    let lines: Vec<String> = list.iter().map(ToString::to_string).collect();
    lines.join("\n")
}

#[track_caller]
fn says(element: &str, wanted: &[&str]) {
    let found = said(element);
    for part in wanted {
        assert!(found.contains(part), "wanted {part:?} in:\n{found}");
    }
    assert_eq!(found.lines().count(), 1, "one mistake:\n{found}");
}

/// Message of a formula with the parameters k and half_gap, and characters before the place.
fn fault(force: &str) -> (String, usize) {
    let parameters = [("k", 1.0), ("half_gap", 2.0)];
    let fault = Expression::new(force, &parameters).expect_err(force);
    (fault.message, fault.place)
}

#[test]
fn mistakes_point_into_the_formula() {
    for (force, place, part) in [
        (
            "k*halfgap",
            2,
            "unknown name `halfgap`; did you mean `half_gap`?",
        ),
        ("k*sinn(q)", 2, "did you mean `sin`?"),
        ("ln(q)", 0, "the natural logarithm is `log`"),
        ("pow(q, 2)", 0, "a power is written `^`"),
        ("Q*k", 0, "did you mean `q`?"),
        ("k*(q - 1", 2, "this bracket is not closed"),
        ("sin(q", 3, "this bracket is not closed"),
        ("k*q)", 3, "this bracket closes nothing"),
        ("k*q + ", 6, "the formula ends here"),
        ("", 0, "the formula ends here"),
        ("k*/q", 2, "found `/`"),
        (
            "2q",
            1,
            "wanted an operator before `q`; a product is written `*`",
        ),
        ("k q", 2, "a product is written `*`"),
        ("2(q)", 1, "wanted an operator before `(`"),
        ("(q)(v)", 3, "wanted an operator before `(`"),
        ("k*q, 2", 3, "found `,`"),
        ("abs()", 4, "`abs` takes one argument; found 0"),
        ("abs(q, v)", 5, "`abs` takes one argument; found 2"),
        ("min(q)", 5, "`min` takes two arguments or more; found 1"),
        (
            "if(q > 0, 1)",
            11,
            "`if` takes three arguments, `if(condition, then, else)`; found 2",
        ),
        ("if(q > 0, 1, 2, 3)", 14, "found 4"),
        ("if(q, 1, 2)", 3, "`if` wants a condition such as `q > 0`"),
        ("if(q > 0 and v, 1, 2)", 13, "`and` wants a condition"),
        ("if(not q, 1, 2)", 7, "`not` wants a condition"),
        ("q > 0", 0, "found a condition, wanted a force"),
        ("if(0 < q < 1, 1, 2)", 9, "comparisons do not chain"),
        ("sin + 1", 4, "wanted `(` after the function `sin`"),
        ("q**2", 1, "a power is written `^`"),
        ("if(q > 0 && v > 0, 1, 2)", 9, "write `and`"),
        ("if(q > 0 || v > 0, 1, 2)", 9, "write `or`"),
        ("if(q = 0, 1, 2)", 5, "equality is written `==`"),
        ("k[0]", 1, "use round brackets"),
        ("|q|", 0, "write `abs(x)`"),
        ("q²", 1, "`²` has no meaning here"),
        ("5 % 2", 2, "`%` has no meaning here"),
        ("1e999*q", 0, "not finite"),
        (".*q", 0, "a number has digits"),
        ("1.2.3", 3, "wanted an operator before `.3`"),
    ] {
        let (message, at) = fault(force);
        assert!(message.contains(part), "{force}: {message}");
        assert_eq!(at, place, "{force}: {message}");
    }
    // Characters, not bytes.
    assert_eq!(fault("k·k·zz").1, 4);
}

#[test]
fn the_place_is_that_in_the_file() {
    says(
        "{type: expression, force: k*halfgap, parameters: {k: 1, half_gap: 2}}",
        &[
            "m.yaml:7:42: connections.mesh.element.force: unknown name `halfgap`; did you mean `half_gap`?",
        ],
    );
    says(
        "{type: expression, force: \"1e5*(q - 3\"}",
        &["m.yaml:7:45: connections.mesh.element.force: this bracket is not closed"],
    );
    says(
        "\n      type: expression\n      force: 2*kk",
        &["m.yaml:9:16: connections.mesh.element.force: unknown name `kk`"],
    );
    // A text over several lines: the place of the text, and the character in it.
    says(
        "\n      type: expression\n      force: >\n        2*q +\n        kk",
        &["m.yaml:10:9: ", "unknown name `kk`", "(character 7)"],
    );
}

#[test]
fn parameters_are_checked_too() {
    let law =
        |parameters: &str| format!("{{type: expression, force: q, parameters: {parameters}}}");
    says(
        &law("{q: 1}"),
        &["connections.mesh.element.parameters.q: this name is reserved in formulas"],
    );
    says(&law("{sin: 1}"), &["parameters.sin: this name is reserved"]);
    says(
        &law("{a-b: 1}"),
        &["parameters.a-b: names start with a letter"],
    );
    says(
        &law("{a: x}"),
        &["parameters.a: `x` is neither a number nor"],
    );
    says(&law("{a: .inf}"), &["parameters.a", "finite"]);
    says(
        &law("[1]"),
        &["element.parameters: found a list, wanted a map"],
    );
    says("{type: expression}", &["law `expression` wants `force`"]);
    says(
        "{type: expression, force: [q]}",
        &["found a list, wanted text"],
    );
    says(
        "{type: expression, force: max(q, 0)}",
        &[
            "has no parameter `0)`",
            "a text with commas needs quotes within { }",
        ],
    );
    says(
        "{type: expression, force: 1/q}",
        &["at rest (q = 0, v = 0, phase = 0): must be finite"],
    );
    says("{type: expression, force: sqrt(q)}", &["must be finite"]);
    // Quantities of any dimension, in SI.
    let fine = law("{a: 5 um, b: 2e4 N m/rad, c: 3 N s/m, d: 300 rpm}")
        .replace("force: q", "force: a + b + c + d*0 + q");
    assert_eq!(said(&fine), "");
}

#[test]
fn hostile_formulas_are_refused_at_once() {
    let deep = |n: usize| format!("{}q{}", "(".repeat(n), ")".repeat(n));
    let start = Instant::now();
    for (force, part) in [
        (deep(100_000), "the formula has 200001 bytes, at most 10000"),
        (
            "q+".repeat(500_000) + "q",
            "the formula has 1000001 bytes, at most 10000",
        ),
        (deep(4000), "nested deeper than 100"),
        ("-".repeat(9000) + "q", "nested deeper than 100"),
        ("2^".repeat(4000) + "q", "more than 64 intermediate values"),
        ("sin(".repeat(2000), "nested deeper than 100"),
        ("if(q>0,".repeat(1000), "nested deeper than 100"),
        ("(".repeat(9999), "nested deeper than 100"),
        ("q+(".repeat(90), "nested deeper than 100"),
        ("q ".repeat(4999), "wanted an operator"),
        ("\u{0}".repeat(10), "has no meaning here"),
        ("𝔮".repeat(100), "has no meaning here"),
        ("q".repeat(9999), "unknown name"),
    ] {
        let (message, _) = fault(&force);
        assert!(
            message.contains(part),
            "{}: {message}",
            &force[..10.min(force.len())]
        );
    }
    // Long but harmless: 5000 terms, and many switches.
    let sum = "q+".repeat(4999) + "q";
    assert_eq!(Expression::new(&sum, &[]).unwrap().eval_at(1.0), 5000.0);
    let kinks: Vec<String> = (0..100).map(|k| format!("abs(q-{k})")).collect();
    let law = Expression::new(&kinks.join("+"), &[]).unwrap();
    assert_eq!(gearlash::element::Element::breakpoints(&law).len(), 100);
    // One switch too many.
    let (message, _) = fault(&format!("{}+abs(v)", kinks.join("+")));
    assert!(message.contains("more than 100 of abs"), "{message}");
    assert!(
        start.elapsed() < Duration::from_secs(2),
        "{:?}",
        start.elapsed()
    );
}

trait At {
    fn eval_at(&self, q: f64) -> f64;
}

impl At for Expression {
    fn eval_at(&self, q: f64) -> f64 {
        gearlash::element::Element::eval(self, q, 0.0, 0.0).f
    }
}

/// Random strings over the words of formulas: an answer or a mistake, never a panic.
#[test]
fn a_hundred_thousand_random_formulas() {
    const WORDS: [&str; 34] = [
        "q", "v", "phase", "k", "pi", "1", ".5", "2e3", "+", "-", "*", "/", "^", "(", ")", ",",
        "<", ">=", "==", "and", "or", "not", "if(", "min(", "max(", "abs(", "sign(", "sin(",
        "log(", "sqrt(", " ", "²", ")", "q",
    ];
    let mut state = 1_u64;
    let mut random = |n: usize| {
        // xorshift64: any sequence will do, the same on every machine
        state ^= state << 13;
        state ^= state >> 7;
        state ^= state << 17;
        (state % n as u64) as usize
    };
    let mut read = 0;
    for _ in 0..100_000 {
        let length = 1 + random(12);
        let text: String = (0..length).map(|_| WORDS[random(WORDS.len())]).collect();
        match Expression::new(&text, &[("k", 2.0)]) {
            Ok(law) => {
                read += 1;
                law.eval_at(0.3);
            }
            Err(fault) => assert!(fault.place <= text.chars().count(), "{text}: {fault}"),
        }
    }
    assert!(read > 500, "{read} of them are formulas");
}
