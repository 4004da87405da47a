//! The size of a document, counted before anything is built.

use super::yaml::{Event, Marker, Parser};
use super::{MAX_DEPTH, MAX_NODES, SourceLocator, options};
use crate::error::Diagnostic;
use std::collections::{HashMap, HashSet};

/// Values that aliases may repeat, whatever the number of values written.
const FREE_REPEATS: usize = 100_000;
/// Beyond that, repeated values for each value written: legitimate files stay below 1, bombs grow exponentially.
const REPEATS_PER_NODE: usize = 10;
/// Size of a subtree with its aliases expanded.
#[derive(Clone, Copy, Default)]
struct Weight {
    nodes: usize,
    height: usize,
}

/// A list or map that is not closed yet.
struct Open {
    anchor: usize,
    weight: Weight,
}

/// Counts the values of the only document and checks all limits, building nothing.
pub(super) fn measure(
    text: &str,
    place: &SourceLocator<'_>,
    before: usize,
) -> Result<Counter, Diagnostic> {
    let mut counter = Counter::default();
    let mut documents = 0;
    for event in Parser::new_from_str_with_options(text, options()) {
        let (event, span) = event.map_err(|e| place.syntax(&e))?;
        if let Event::DocumentStart(..) = event {
            documents += 1;
            if documents > 1 {
                return Err(place
                    .mistake(span.start, "a second document starts here; wanted one")
                    .with_help("keep one model per file; use `extends` to combine files"));
            }
        }
        if !counter.count(&event) {
            return Err(place.mistake(span.start, "the anchor of this alias contains the alias"));
        }
        if counter.depth > MAX_DEPTH {
            return Err(place.too_deep(span.start));
        }
        if before + counter.total() > MAX_NODES {
            return Err(place.too_many(span.start));
        }
        if counter.repeated > FREE_REPEATS.max(REPEATS_PER_NODE * counter.written) {
            let message = format!("aliases repeat {} values by here", counter.repeated);
            return Err(place
                .mistake(span.start, message)
                .with_help("aliases of aliases multiply; write the values out"));
        }
    }
    if counter.total() == 0 || documents == 0 {
        let message = "the document is empty; wanted a map";
        return Err(place.mistake(Marker::new(0, 1, 0), message));
    }
    Ok(counter)
}

/// Running totals of [`measure`].
#[derive(Default)]
pub(super) struct Counter {
    open: Vec<Open>,
    anchored: HashMap<usize, Weight>,
    /// Anchors that aliases refer to.
    pub aliased: HashSet<usize>,
    written: usize,
    repeated: usize,
    /// Depth that the last event reached.
    depth: usize,
}

impl Counter {
    /// Values so far.
    pub fn total(&self) -> usize {
        self.written + self.repeated
    }

    /// Takes in an event; false for an alias inside its own anchor.
    fn count(&mut self, event: &Event<'_>) -> bool {
        match event {
            Event::Scalar(_, _, anchor, _) => {
                self.written += 1;
                self.close(
                    *anchor,
                    Weight {
                        nodes: 1,
                        height: 0,
                    },
                );
            }
            Event::SequenceStart(_, anchor, _) | Event::MappingStart(_, anchor, _) => {
                self.written += 1;
                let weight = Weight {
                    nodes: 1,
                    height: 0,
                };
                let anchor = *anchor;
                self.open.push(Open { anchor, weight });
                self.depth = self.open.len();
            }
            Event::SequenceEnd | Event::MappingEnd => {
                if let Some(Open { anchor, mut weight }) = self.open.pop() {
                    weight.height += 1;
                    self.close(anchor, weight);
                }
            }
            Event::Alias(anchor) => {
                let Some(weight) = self.anchored.get(anchor).copied() else {
                    return false;
                };
                self.aliased.insert(*anchor);
                self.repeated = self.repeated.saturating_add(weight.nodes);
                self.close(0, weight);
            }
            _ => {}
        }
        true
    }

    fn close(&mut self, anchor: usize, weight: Weight) {
        if anchor != 0 {
            self.anchored.insert(anchor, weight);
        }
        self.depth = self.open.len() + weight.height;
        if let Some(parent) = self.open.last_mut() {
            parent.weight.nodes = parent.weight.nodes.saturating_add(weight.nodes);
            parent.weight.height = parent.weight.height.max(weight.height);
        }
    }
}
