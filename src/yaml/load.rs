//! Files: reading within limits, `extends`, `--set`.

use super::edit::apply_from;
use super::parse::{MAX_TEXT, compose, too_long};
use super::{Node, Value};
use crate::error::{Diagnostic, Error, Location, Source};
use std::io::Read;
use std::path::{Path, PathBuf};
use std::sync::Arc;

/// Files that may extend one another in a row.
const MAX_CHAIN: usize = 32;

/// A document with everything it was made from.
#[derive(Debug, Clone)]
pub struct Document {
    /// The merged tree, a map, without `extends`.
    pub root: Node,
    /// The file, the files it extends, nearest first, then the overrides in their order.
    pub sources: Vec<Arc<Source>>,
}

impl Document {
    /// The texts of all sources in order, each with a final zero byte: what a hash of the input is taken of.
    pub fn bytes(&self) -> Vec<u8> {
        let mut bytes = Vec::new();
        for source in &self.sources {
            bytes.extend_from_slice(source.text.as_bytes());
            bytes.push(0);
        }
        bytes
    }
}

/// Reads a file, lays it upon the files it extends, and applies overrides `PATH=VALUE`.
///
/// # Errors
/// [`Error::File`] when the file or one it extends cannot be read; [`Error::Input`] for everything wrong inside. Mistakes in
/// several overrides are reported together.
pub fn load(path: &Path, overrides: &[String]) -> Result<Document, Error> {
    let mut reader = Reader::default();
    let mut root = reader.tree(path)?;
    let mut sources = reader.sources;
    let mut mistakes = Vec::new();
    for assignment in overrides {
        let source = Arc::new(Source {
            name: "--set".to_owned(),
            text: assignment.clone(),
        });
        if let Err(mistake) = apply_from(&mut root, &source) {
            mistakes.push(mistake);
        }
        sources.push(source);
    }
    if mistakes.is_empty() {
        Ok(Document { root, sources })
    } else {
        Err(Error::Input(mistakes))
    }
}

/// State over a chain of files.
#[derive(Default)]
struct Reader {
    sources: Vec<Arc<Source>>,
    /// Canonical paths of the files so far, to find cycles.
    chain: Vec<PathBuf>,
    bytes: usize,
    nodes: usize,
}

impl Reader {
    /// The merged tree of a file and its bases, nearest file on top.
    fn tree(&mut self, path: &Path) -> Result<Node, Error> {
        let mut layers = Vec::new();
        let mut next = Some(path.to_owned());
        while let Some(path) = next {
            let source = self.text(&path)?;
            let layer = compose(&source, 0, &mut self.nodes);
            let mut layer = match layers.is_empty() {
                true => layer.map_err(Error::Input)?,
                false => base_model(layer, &path).map_err(|d| Error::Input(vec![d]))?,
            };
            next = self
                .base(&mut layer, &path)
                .map_err(|d| Error::Input(vec![d]))?;
            layers.push(layer);
        }
        let mut root = layers.pop().unwrap_or_else(|| Node::scalar(""));
        while let Some(layer) = layers.pop() {
            root.overlay(layer);
        }
        Ok(root)
    }

    fn text(&mut self, path: &Path) -> Result<Arc<Source>, Error> {
        let failed = |source| Error::File {
            action: "read",
            path: path.to_owned(),
            source,
        };
        let name = path.display().to_string();
        let refuse = |bytes| {
            let text = String::new();
            let source = Arc::new(Source {
                name: name.clone(),
                text,
            });
            Error::Input(vec![too_long(&source, bytes)])
        };
        self.chain.push(path.canonicalize().map_err(failed)?);
        let file = std::fs::File::open(path).map_err(failed)?;
        let room = (MAX_TEXT - self.bytes) as u64;
        let length = file.metadata().map_err(failed)?.len();
        if length > room {
            return Err(refuse(self.bytes as u64 + length));
        }
        // Pipes and devices have no length: read at most one byte too many.
        let mut bytes = Vec::new();
        file.take(room + 1)
            .read_to_end(&mut bytes)
            .map_err(failed)?;
        self.bytes += bytes.len();
        if self.bytes > MAX_TEXT {
            return Err(refuse(self.bytes as u64));
        }
        let is_base = self.chain.len() > 1;
        let text = String::from_utf8(bytes).map_err(|e| {
            let shown = if is_base { &[] } else { e.as_bytes() };
            Error::Input(vec![not_utf8(&name, shown, e.utf8_error())])
        })?;
        let source = Arc::new(Source { name, text });
        self.sources.push(Arc::clone(&source));
        Ok(source)
    }

    /// Takes `extends` out of a layer; the path of the file it names.
    fn base(&self, layer: &mut Node, path: &Path) -> Result<Option<PathBuf>, Diagnostic> {
        layer.as_map("")?;
        let Value::Map(map) = &mut layer.value else {
            return Ok(None);
        };
        let Some(entry) = map.shift_remove("extends") else {
            return Ok(None);
        };
        let name = entry.node.as_text("extends")?;
        let base = path.parent().unwrap_or(Path::new("")).join(name);
        let mistake = |message| Diagnostic::at(&entry.node, "extends", message);
        let known = base.canonicalize().map_err(|e| {
            mistake(format!("cannot read {}: {e}", base.display()))
                .with_help("the path is relative to this file")
        })?;
        // A pipe would keep the reader waiting, a device has no end.
        if !known.is_file() {
            let message = format!("{} is no regular file", base.display());
            return Err(mistake(message));
        }
        if let Some(first) = self.chain.iter().position(|p| *p == known) {
            let mut names: Vec<&str> = self.sources[first..].iter().map(|s| &*s.name).collect();
            names.push(names[0]);
            return Err(mistake(format!(
                "circular `extends`: {}",
                names.join(" -> ")
            )));
        }
        if self.chain.len() >= MAX_CHAIN {
            return Err(mistake(format!(
                "more than {MAX_CHAIN} files extend each other in a row"
            )));
        }
        Ok(Some(base))
    }
}

/// Keys of which a model file has one at least, unless it holds nothing but anchors (`x-..`).
const KEYS: [&str; 14] = [
    "schema",
    "extends",
    "name",
    "bodies",
    "matrices",
    "reference",
    "balance",
    "connections",
    "damping",
    "loads",
    "scaling",
    "report",
    "reduced",
    "analyses",
];

/// The tree of a file that another one extends. `extends` may name any file that the user can read: what is not a model is not
/// shown, neither its lines nor their content.
fn base_model(layer: Result<Node, Vec<Diagnostic>>, path: &Path) -> Result<Node, Diagnostic> {
    let (message, location) = match layer {
        Ok(node) => {
            let is_known = |key: &String| KEYS.contains(&key.as_str()) || key.starts_with("x-");
            match &node.value {
                Value::Map(map) if map.keys().any(is_known) => return Ok(node),
                Value::Map(_) => ("none of its keys is one of a model".into(), None),
                _ => ("it is not a map".to_string(), None),
            }
        }
        Err(list) => {
            let first = list.into_iter().next();
            let place = first.as_ref().and_then(|mistake| mistake.location.clone());
            let message =
                first.map_or_else(String::new, |mistake| without_quotations(&mistake.message));
            (message, place)
        }
    };
    let location = location.map(|at| Location {
        source: Arc::new(Source {
            name: at.source.name.clone(),
            text: String::new(),
        }),
        ..at
    });
    Err(Diagnostic {
        location,
        path: "extends".into(),
        message: format!("{} cannot be read as a model: {message}", path.display()),
        help: None,
    })
}

/// A message without what it quotes.
fn without_quotations(message: &str) -> String {
    let parts = message.split('`').enumerate();
    parts
        .map(|(k, part)| if k % 2 == 0 { part } else { ".." })
        .collect()
}

fn not_utf8(name: &str, bytes: &[u8], error: std::str::Utf8Error) -> Diagnostic {
    let valid = bytes.get(..error.valid_up_to()).unwrap_or_default();
    let valid = String::from_utf8_lossy(valid);
    let line_start = valid.rfind('\n').map_or(0, |at| at + 1);
    let location = Location {
        line: valid.matches('\n').count() + 1,
        column: valid[line_start..].chars().count() + 1,
        source: Arc::new(Source {
            name: name.to_owned(),
            text: String::from_utf8_lossy(bytes).into_owned(),
        }),
    };
    Diagnostic {
        location: Some(location),
        path: String::new(),
        message: "the file is not UTF-8 text".to_owned(),
        help: Some("save it as UTF-8".to_owned()),
    }
}
