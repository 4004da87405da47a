//! Diagnostics as text, with the line of the source and a caret under the place.

use super::{Diagnostic, Location};
use annotate_snippets::{AnnotationKind, Level, Origin, Renderer, Snippet};

/// Whether the text carries colour codes of a terminal.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Colour {
    /// Text alone: files, pipes, tests.
    Plain,
    /// ANSI codes.
    Ansi,
}

/// Mistakes shown; whoever has more reads the first and corrects them.
const SHOWN: usize = 100;
/// Characters shown of a line.
const WINDOW: usize = 120;

/// All diagnostics by source, line and column, each with its line of text, a caret under the place, and the next step.
///
/// Long lines are cropped around the place. Equal input gives equal output.
pub fn render(list: &[Diagnostic], colour: Colour) -> String {
    let mut sorted: Vec<&Diagnostic> = list.iter().collect();
    sorted.sort_by_key(|diagnostic| {
        let place = diagnostic.location.as_ref();
        place.map(|at| (at.source.name.as_str(), at.line, at.column))
    });
    let renderer = match colour {
        Colour::Plain => Renderer::plain(),
        Colour::Ansi => Renderer::styled(),
    };
    let shown = sorted.iter().take(SHOWN);
    let mut blocks: Vec<String> = shown.map(|d| block(d, &renderer)).collect();
    if let Some(more) = sorted.len().checked_sub(SHOWN).filter(|more| *more > 0) {
        blocks.push(format!("and {more} more mistakes"));
    }
    blocks.join("\n\n")
}

fn block(diagnostic: &Diagnostic, renderer: &Renderer) -> String {
    let title = if diagnostic.path.is_empty() {
        printable(&diagnostic.message)
    } else {
        printable(&format!("{}: {}", diagnostic.path, diagnostic.message))
    };
    let report = Level::ERROR
        .primary_title(title)
        .elements(None::<Origin<'_>>);
    let help = diagnostic.help.as_ref();
    let help = help.map(|help| Level::HELP.message(printable(help)));
    let Some(at) = &diagnostic.location else {
        return renderer.render(&[report.elements(help)]);
    };
    let name = printable(&at.source.name);
    let Some((line, caret)) = window(at) else {
        let origin = Origin::path(name).line(at.line).char_column(at.column);
        return renderer.render(&[report.element(origin).elements(help)]);
    };
    let shown = line[..caret.start].chars().count() + 1;
    let snippet = Snippet::source(line)
        .line_start(at.line)
        .path(&*name)
        .annotation(AnnotationKind::Primary.span(caret));
    let text = renderer.render(&[report.element(snippet).elements(help)]);
    // The renderer counts columns in what it is shown, which is part of a long line.
    text.replacen(
        &format!("{name}:{}:{shown}\n", at.line),
        &format!("{name}:{}:{}\n", at.line, at.column),
        1,
    )
}

/// The line of a place, cropped around it, and the bytes to mark; `None` when the text has no such line.
fn window(at: &Location) -> Option<(String, std::ops::Range<usize>)> {
    let line = at.source.text.split('\n').nth(at.line.checked_sub(1)?)?;
    let line = line.strip_suffix('\r').unwrap_or(line);
    let line = line.strip_prefix('\u{feff}').unwrap_or(line);
    let column = at.column.saturating_sub(1);
    // Half a window before the place: the key that belongs to a value stays visible.
    let start = if line.chars().nth(WINDOW).is_some() {
        column.saturating_sub(WINDOW / 2)
    } else {
        0
    };
    let mut text = String::from(if start > 0 { "…" } else { "" });
    let mut caret = None;
    let mut shown = line.chars().skip(start);
    for (index, c) in (start..).zip(shown.by_ref().take(WINDOW)) {
        if index == column {
            caret = Some(text.len()..text.len() + c.len_utf8());
        }
        text.push(c);
    }
    let caret = caret.unwrap_or(text.len()..text.len());
    if shown.next().is_some() {
        text.push('…');
    }
    Some((text, caret))
}

/// Control characters, which could move the cursor of a terminal, as spaces.
fn printable(text: &str) -> String {
    text.chars()
        .map(|c| if c.is_control() && c != '\n' { ' ' } else { c })
        .collect()
}

#[cfg(test)]
mod tests {
    use super::super::Source;
    use super::*;
    use std::sync::Arc;

    fn at(text: &str, line: usize, column: usize) -> Diagnostic {
        Diagnostic {
            location: Some(Location {
                source: Arc::new(Source {
                    name: "m.yaml".into(),
                    text: text.into(),
                }),
                line,
                column,
            }),
            path: "bodies.A".into(),
            message: "unknown key `inerta`".into(),
            help: Some("did you mean `inertia`?".into()),
        }
    }

    #[test]
    fn shows_place_line_caret_and_help() {
        let text = render(&[at("bodies:\n  A: {inerta: 1}\n", 2, 7)], Colour::Plain);
        println!("{text}");
        assert!(text.contains("bodies.A: unknown key `inerta`"), "{text}");
        assert!(text.contains("--> m.yaml:2:7"), "{text}");
        assert!(text.contains("2 |   A: {inerta: 1}\n  |       ^"), "{text}");
        assert!(text.contains("did you mean `inertia`?"), "{text}");
        assert!(!text.contains('\u{1b}'));
        assert!(render(&[at("a", 1, 1)], Colour::Ansi).contains('\u{1b}'));
    }

    #[test]
    fn orders_by_place_and_survives_strange_places() {
        let text = "a: 1\nb: 2\n";
        let list = [
            at(text, 2, 1),
            at(text, 1, 4),
            at(text, 9, 9),
            at(text, 1, 99),
        ];
        let first = render(&list, Colour::Plain);
        let position = |needle| {
            first
                .find(needle)
                .unwrap_or_else(|| panic!("{needle}: {first}"))
        };
        assert!(position("m.yaml:1:4") < position("m.yaml:1:99"));
        assert!(position("m.yaml:1:99") < position("m.yaml:2:1"));
        assert!(position("m.yaml:2:1") < position("m.yaml:9:9"));
        assert_eq!(first, render(&list, Colour::Plain));
        render(
            &[at("", 0, 0), at("\r\n\u{1b}[31mx\u{202e}", 2, 3)],
            Colour::Plain,
        );
    }

    #[test]
    fn crops_long_lines_around_the_place() {
        let line = format!("{}X{}", "µ".repeat(100_000), "y".repeat(100_000));
        let text = render(&[at(&line, 1, 100_001)], Colour::Plain);
        assert!(text.len() < 2000, "{}", text.len());
        assert!(text.contains("m.yaml:1:100001"), "{text}");
        let source = text.lines().find(|l| l.contains('X')).unwrap();
        let caret = text.lines().find(|l| l.contains('^')).unwrap();
        let column = |line: &str, c| line.chars().position(|x| x == c);
        assert_eq!(column(source, 'X'), column(caret, '^'), "{text}");
    }
}
