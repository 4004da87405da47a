//! Text to nodes; the only file that names the YAML crate.
//!
//! The events of its parser are read twice: once to count, so that hostile input (nesting, alias bombs) is refused before
//! anything is built, then to build the tree.

mod glance;
mod measure;

use super::{Entry, Node, Value, join};
use crate::error::{Diagnostic, Error, Location, Source};
use indexmap::IndexMap;
use measure::measure;
use serde_yaml::granit_parser::{self as yaml, Event, Parser, ScalarStyle, Span};
use std::borrow::Cow;
use std::collections::{HashMap, HashSet};
use std::sync::Arc;

/// Largest text that is read, in bytes, with all files it extends.
pub const MAX_TEXT: usize = 16 << 20;
/// Deepest nesting of lists and maps.
pub(crate) const MAX_DEPTH: usize = 64;
/// Largest number of values, with aliases expanded.
pub(crate) const MAX_NODES: usize = 4_000_000;
/// Parts of what the parser says, and the next step.
const SYNTAX: [(&str, &str); 6] = [
    (
        "simple key expected",
        "a key is followed by `:` and a space, as in `stiffness: 2e8`",
    ),
    (
        "did not find expected key",
        "align the keys of a map in one column, deeper than the key above them",
    ),
    (
        "did not find expected ','",
        "a closing bracket or a comma is missing here or above",
    ),
    (
        "mapping values are not allowed",
        "quote a text that contains `: `; align the keys of a map in one column",
    ),
    ("tabs disallowed", "indent with spaces"),
    (
        "while scanning a quoted scalar",
        "a closing quote is missing",
    ),
];
/// Duplicate keys reported at once.
const MAX_MISTAKES: usize = 100;

/// The one document in a text.
///
/// # Errors
/// [`Error::Input`] for syntax errors, duplicate keys (all of them), no document or several, and exceeded limits.
pub fn parse(text: &str, name: &str) -> Result<Node, Error> {
    let source = Arc::new(Source {
        name: name.to_owned(),
        text: text.to_owned(),
    });
    compose(&source, 0, &mut 0).map_err(Error::Input)
}

/// The one document in a text from byte `start` on; adds the number of its values to `count`, limited to [`MAX_NODES`].
pub(super) fn compose(
    source: &Arc<Source>,
    start: usize,
    count: &mut usize,
) -> Result<Node, Vec<Diagnostic>> {
    let skipped = source.text[..start].chars().count();
    let place = SourceLocator { source, skipped };
    if source.text.len() > MAX_TEXT {
        return Err(vec![too_long(source, source.text.len() as u64)]);
    }
    let text = &source.text[start..];
    // The parser takes a byte order mark for the first column.
    let text = text.strip_prefix('\u{feff}').unwrap_or(text);
    if let Some(byte) = glance::too_many(text, MAX_NODES.saturating_sub(*count)) {
        return Err(vec![place.too_many(place.mark(&text[..byte]))]);
    }
    let counter = measure(text, &place, *count).map_err(|d| vec![d])?;
    *count += counter.total();
    let mut composer = Composer {
        parser: Parser::new_from_str_with_options(text, options()),
        place,
        aliased: counter.aliased,
        anchors: HashMap::new(),
        mistakes: Vec::new(),
    };
    let root = composer.document().map_err(|d| vec![d])?;
    if composer.mistakes.is_empty() {
        Ok(root)
    } else {
        Err(composer.mistakes)
    }
}

/// The error of a text longer than [`MAX_TEXT`].
pub(super) fn too_long(source: &Arc<Source>, bytes: u64) -> Diagnostic {
    let place = SourceLocator { source, skipped: 0 };
    let message = format!(
        "the text has {bytes} bytes; at most {} MiB are read, files it extends included",
        MAX_TEXT >> 20
    );
    place.mistake(yaml::Marker::new(0, 1, 0), message)
}

fn options() -> yaml::Options {
    let mut options = yaml::Options::default();
    options.set_emit_comments(false);
    options.emit_unresolved_aliases = true;
    // One level more than allowed, so that the message about depth is ours.
    options.flow_nesting_limit = MAX_DEPTH + 1;
    options.block_nesting_limit = MAX_DEPTH + 1;
    options
}

/// Turns positions of the parser into locations.
struct SourceLocator<'a> {
    source: &'a Arc<Source>,
    /// Characters of the first line before the parsed text.
    skipped: usize,
}

impl SourceLocator<'_> {
    fn location(&self, mark: yaml::Marker) -> Location {
        let skipped = if mark.line() <= 1 { self.skipped } else { 0 };
        Location {
            source: Arc::clone(self.source),
            line: mark.line().max(1),
            column: mark.col() + 1 + skipped,
        }
    }

    fn mistake(&self, mark: yaml::Marker, message: impl Into<String>) -> Diagnostic {
        Diagnostic {
            location: Some(self.location(mark)),
            path: String::new(),
            message: message.into(),
            help: None,
        }
    }

    fn syntax(&self, error: &yaml::ScanError) -> Diagnostic {
        match error.kind() {
            yaml::ErrorKind::RecursionLimitExceeded => self.too_deep(*error.marker()),
            kind => {
                let said = kind.to_string();
                let help = SYNTAX.iter().find(|(part, _)| said.contains(part));
                let mut mistake = self.mistake(*error.marker(), format!("not valid YAML: {said}"));
                mistake.help = help.map(|(_, help)| (*help).to_owned());
                mistake
            }
        }
    }

    /// The position behind a piece of the parsed text.
    fn mark(&self, before: &str) -> yaml::Marker {
        let line = before.rfind('\n').map_or(0, |at| at + 1);
        let lines = before.bytes().filter(|b| *b == b'\n').count();
        yaml::Marker::new(before.len(), lines + 1, before[line..].chars().count())
    }

    fn too_many(&self, mark: yaml::Marker) -> Diagnostic {
        self.mistake(
            mark,
            format!("more than {MAX_NODES} values, with aliases expanded"),
        )
    }

    fn too_deep(&self, mark: yaml::Marker) -> Diagnostic {
        self.mistake(
            mark,
            format!("lists and maps are nested deeper than {MAX_DEPTH} levels"),
        )
    }
}

/// Builds the tree; recursion is bounded by [`MAX_DEPTH`], which [`measure`] has checked.
struct Composer<'a, 't> {
    parser: Parser<'t, yaml::StrInput<'t>>,
    place: SourceLocator<'a>,
    /// Anchors that aliases refer to; copies of all others would cost memory for nothing.
    aliased: HashSet<usize>,
    anchors: HashMap<usize, Node>,
    mistakes: Vec<Diagnostic>,
}

impl<'t> Composer<'_, 't> {
    fn document(&mut self) -> Result<Node, Diagnostic> {
        loop {
            let (event, span) = self.next()?;
            match event {
                Event::StreamStart | Event::DocumentStart(..) => {}
                event => return self.node(event, span),
            }
        }
    }

    fn next(&mut self) -> Result<(Event<'t>, Span), Diagnostic> {
        match self.parser.next_event() {
            Some(Ok(pair)) => Ok(pair),
            Some(Err(error)) => Err(self.place.syntax(&error)),
            None => Err(self
                .place
                .mistake(yaml::Marker::new(0, 1, 0), "the document ends too early")),
        }
    }

    fn node(&mut self, event: Event<'t>, span: Span) -> Result<Node, Diagnostic> {
        let (value, anchor) = match event {
            Event::Scalar(text, style, anchor, tag) => {
                let plain = self.plain(tag.as_deref(), style == ScalarStyle::Plain, span)?;
                let text = text.into_owned();
                (Value::Scalar { text, plain }, anchor)
            }
            Event::SequenceStart(_, anchor, tag) => {
                self.check_tag(tag, "seq", span)?;
                (Value::List(self.list()?), anchor)
            }
            Event::MappingStart(_, anchor, tag) => {
                self.check_tag(tag, "map", span)?;
                (Value::Map(self.map()?), anchor)
            }
            Event::Alias(anchor) => {
                let unknown = "the anchor of this alias contains the alias";
                return match self.anchors.get(&anchor) {
                    Some(node) => Ok(node.clone()),
                    None => Err(self.place.mistake(span.start, unknown)),
                };
            }
            Event::UnresolvedAlias(name) => {
                let message = format!("no anchor `&{name}` is defined above this alias");
                return Err(self.place.mistake(span.start, message));
            }
            _ => return Err(self.place.mistake(span.start, "wanted a value here")),
        };
        let location = Some(self.place.location(span.start));
        let node = Node { value, location };
        if self.aliased.contains(&anchor) {
            self.anchors.insert(anchor, node.clone());
        }
        Ok(node)
    }

    /// Whether a scalar counts as unquoted: core tags decide, other tags are refused.
    fn plain(&self, tag: Option<&yaml::Tag>, plain: bool, span: Span) -> Result<bool, Diagnostic> {
        match tag.map(|tag| (tag, tag.core_suffix())) {
            None => Ok(plain),
            Some((_, Some("str"))) => Ok(false),
            Some((_, Some("int" | "float" | "bool" | "null"))) => Ok(true),
            Some((tag, _)) if tag.original() == "!" => Ok(false),
            Some((tag, _)) => Err(self.unknown_tag(tag, span)),
        }
    }

    fn check_tag(
        &self,
        tag: Option<Cow<'_, yaml::Tag>>,
        wanted: &str,
        span: Span,
    ) -> Result<(), Diagnostic> {
        match tag {
            Some(tag) if tag.core_suffix() != Some(wanted) => Err(self.unknown_tag(&tag, span)),
            _ => Ok(()),
        }
    }

    fn unknown_tag(&self, tag: &yaml::Tag, span: Span) -> Diagnostic {
        let message = format!("the tag `{}` has no meaning here", tag.original());
        self.place.mistake(span.start, message)
    }

    fn list(&mut self) -> Result<Vec<Node>, Diagnostic> {
        let mut list = Vec::new();
        loop {
            match self.next()? {
                (Event::SequenceEnd, _) => return Ok(list),
                (event, span) => {
                    let before = self.mistakes.len();
                    list.push(self.node(event, span)?);
                    self.prefix(before, &(list.len() - 1).to_string());
                }
            }
        }
    }

    fn map(&mut self) -> Result<IndexMap<String, Entry>, Diagnostic> {
        let mut map: IndexMap<String, Entry> = IndexMap::new();
        let mut merge: Option<(usize, Entry)> = None;
        loop {
            let (event, span) = self.next()?;
            if event == Event::MappingEnd {
                break;
            }
            let at = span.start;
            let key = self.node(event, span)?;
            let (event, span) = self.next()?;
            let before = self.mistakes.len();
            let entry = Entry {
                key_location: Some(self.place.location(at)),
                node: self.node(event, span)?,
            };
            if let Value::Scalar { text, .. } = &key.value {
                self.prefix(before, text);
            }
            match key.value {
                Value::Scalar { text, plain: true } if text == "<<" => {
                    if let Some((_, first)) = &merge {
                        self.duplicate("<<", &entry, first.key_location.as_ref());
                    } else {
                        merge = Some((map.len(), entry));
                    }
                }
                Value::Scalar { text, .. } => match map.get(&text) {
                    Some(first) => self.duplicate(&text, &entry, first.key_location.as_ref()),
                    None => drop(map.insert(text, entry)),
                },
                _ => {
                    let message = format!("found {} as a key, wanted text", key.describe());
                    return Err(self.place.mistake(at, message));
                }
            }
        }
        match merge {
            Some((index, entry)) => merged(map, index, entry.node),
            None => Ok(map),
        }
    }

    /// Puts a step in front of the paths of the errors found since `before`.
    fn prefix(&mut self, before: usize, step: &str) {
        for mistake in &mut self.mistakes[before..] {
            mistake.path = join(step, &mistake.path);
        }
    }

    fn duplicate(&mut self, key: &str, entry: &Entry, first: Option<&Location>) {
        if self.mistakes.len() >= MAX_MISTAKES {
            return;
        }
        let first = first.map_or_else(String::new, |at| {
            format!("; first at line {}, column {}", at.line, at.column)
        });
        let key = super::read::cropped(key);
        let message = format!("the key `{key}` is given twice{first}");
        self.mistakes.push(Diagnostic::at_key(entry, &key, message));
    }
}

/// A map with the entries of its merge key `<<` in the place where that stood; own entries win, then earlier maps.
fn merged(
    map: IndexMap<String, Entry>,
    index: usize,
    bases: Node,
) -> Result<IndexMap<String, Entry>, Diagnostic> {
    let refused = |node: &Node| {
        let message = format!("found {} after `<<`, wanted a map", node.describe());
        Diagnostic::at(node, "", message).with_help("such as `<<: *anchor` or `<<: [*a, *b]`")
    };
    let bases = match bases.value {
        Value::List(list) => list,
        _ => vec![bases],
    };
    let mut inherited: IndexMap<String, Entry> = IndexMap::new();
    for base in bases {
        let Value::Map(entries) = base.value else {
            return Err(refused(&base));
        };
        for (key, entry) in entries {
            if !map.contains_key(&key) {
                inherited.entry(key).or_insert(entry);
            }
        }
    }
    let mut own = map.into_iter();
    let mut all: IndexMap<String, Entry> = own.by_ref().take(index).collect();
    all.extend(inherited);
    all.extend(own);
    Ok(all)
}
