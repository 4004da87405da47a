//! What a formula consists of: its tree, its words, and how strongly operators hold.

/// Functions and operators of one argument.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(super) enum Unary {
    Negative,
    Not,
    Abs,
    Sign,
    Sqrt,
    Exp,
    Log,
    Sin,
    Cos,
    Tan,
    Atan,
    Sinh,
    Cosh,
    Tanh,
}

/// Functions and operators of two arguments.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(super) enum Binary {
    Add,
    Subtract,
    Multiply,
    Divide,
    Power,
    Min,
    Max,
    Less,
    LessEqual,
    Greater,
    GreaterEqual,
    Equal,
    NotEqual,
    And,
    Or,
}

/// Variables of a law.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(super) enum Variable {
    Displacement,
    Velocity,
    Phase,
}

/// One instruction.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(super) enum Instruction {
    Number(f64),
    Variable(Variable),
    Parameter(usize),
    Unary(Unary),
    Binary(Binary),
    /// x^n for a whole n.
    Power(i32),
    /// Takes a condition and goes on at that instruction unless it holds.
    SkipUnless(usize),
    /// Goes on at that instruction.
    Skip(usize),
}

/// A node of the tree; arguments precede it in the list.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(super) enum FormulaNode {
    Number(f64),
    Variable(Variable),
    Parameter(usize),
    Unary(Unary, usize),
    Binary(Binary, usize, usize),
    If(usize, usize, usize),
}

/// A formula, read.
#[derive(Debug, Clone, Default)]
pub(super) struct Formula {
    /// The tree, arguments first: the last node is the value.
    pub(super) nodes: Vec<FormulaNode>,
    /// Bytes of the text before the sign or name of each node.
    pub(super) places: Vec<usize>,
    /// The same as instructions.
    pub(super) code: Vec<Instruction>,
    /// Intermediate values that the instructions need at once.
    pub(super) stack: usize,
}

pub(super) const FUNCTIONS: [(&str, Unary); 12] = [
    ("abs", Unary::Abs),
    ("sign", Unary::Sign),
    ("sqrt", Unary::Sqrt),
    ("exp", Unary::Exp),
    ("log", Unary::Log),
    ("sin", Unary::Sin),
    ("cos", Unary::Cos),
    ("tan", Unary::Tan),
    ("atan", Unary::Atan),
    ("sinh", Unary::Sinh),
    ("cosh", Unary::Cosh),
    ("tanh", Unary::Tanh),
];
pub(super) const VARIABLES: [(&str, Variable); 3] = [
    ("q", Variable::Displacement),
    ("v", Variable::Velocity),
    ("phase", Variable::Phase),
];
/// What else has a meaning.
pub(super) const WORDS: [&str; 7] = ["pi", "min", "max", "if", "and", "or", "not"];

/// Whether a name means something of its own and cannot be that of a parameter.
pub(super) fn is_reserved(name: &str) -> bool {
    WORDS.contains(&name)
        || FUNCTIONS.iter().any(|(known, _)| *known == name)
        || VARIABLES.iter().any(|(known, _)| *known == name)
}

/// How strongly an operator holds its arguments: that on its left, and that on its right.
pub(super) fn strength(word: &str) -> Option<(u8, u8, Binary)> {
    let (left, right, operator) = match word {
        "or" => (1, 2, Binary::Or),
        "and" => (3, 4, Binary::And),
        "<" => (COMPARISON, 8, Binary::Less),
        "<=" => (COMPARISON, 8, Binary::LessEqual),
        ">" => (COMPARISON, 8, Binary::Greater),
        ">=" => (COMPARISON, 8, Binary::GreaterEqual),
        "==" => (COMPARISON, 8, Binary::Equal),
        "!=" => (COMPARISON, 8, Binary::NotEqual),
        "+" => (9, 10, Binary::Add),
        "-" => (9, 10, Binary::Subtract),
        "*" | "·" | "×" => (11, 12, Binary::Multiply),
        "/" => (11, 12, Binary::Divide),
        // From the right: 2^3^2 is 2^9. A sign in front holds less: -q^2 is -(q^2), and 2^-1 is 1/2.
        "^" => (15, SIGN, Binary::Power),
        _ => return None,
    };
    Some((left, right, operator))
}

/// What `not` holds.
pub(super) const NOT: u8 = 5;
/// How comparisons hold; they do not chain.
pub(super) const COMPARISON: u8 = 7;
/// What a sign in front holds.
pub(super) const SIGN: u8 = 13;

impl Binary {
    /// Whether it gives a condition from numbers.
    pub(super) fn is_comparison(self) -> bool {
        use Binary::{Equal, Greater, GreaterEqual, Less, LessEqual, NotEqual};
        matches!(
            self,
            Less | LessEqual | Greater | GreaterEqual | Equal | NotEqual
        )
    }
}

impl FormulaNode {
    /// Whether it may have a kink or a jump of its own.
    pub(super) fn is_switch(&self) -> bool {
        match self {
            FormulaNode::Unary(operator, _) => matches!(operator, Unary::Abs | Unary::Sign),
            FormulaNode::Binary(operator, ..) => {
                matches!(operator, Binary::Min | Binary::Max) || operator.is_comparison()
            }
            _ => false,
        }
    }
}
