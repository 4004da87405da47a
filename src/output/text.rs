//! Widths of texts and lines that break well.

/// Width of a text in pixels, estimated for the widest of the requested fonts.
pub(super) fn text_width(text: &str, font: f64) -> f64 {
    let width = |c: char| match c {
        'i' | 'j' | 'l' | '.' | ',' | ':' | ';' | '\'' | '|' | '!' => 0.31,
        ' ' | 'f' | 't' | 'r' | '(' | ')' | '[' | ']' | '/' | '-' => 0.39,
        'm' | 'w' | 'M' | 'W' | '%' | '@' | '\u{d7}' => 0.9,
        c if c.is_uppercase() => 0.7,
        c if c.is_ascii_digit() => 0.64,
        c if (c as u32) > 0x2e80 => 1.0,
        _ => 0.6,
    };
    font * text.chars().map(width).sum::<f64>()
}

/// A text in as few lines as fit, of nearly equal length, so that no word is left alone in the last one.
pub(super) fn wrapped(text: &str, font: f64, room: f64) -> Vec<String> {
    let fewest = greedy(text, font, room);
    if fewest.len() < 2 {
        return fewest;
    }
    // The narrowest room with as few lines, by halving.
    let (mut low, mut high) = (0.3 * room, room);
    for _ in 0..12 {
        let middle = 0.5 * (low + high);
        match greedy(text, font, middle).len() <= fewest.len() {
            true => high = middle,
            false => low = middle,
        }
    }
    greedy(text, font, high)
}

fn greedy(text: &str, font: f64, room: f64) -> Vec<String> {
    let mut lines: Vec<String> = Vec::new();
    for word in text.split_whitespace() {
        match lines.last_mut() {
            Some(line) if text_width(line, font) + text_width(word, font) + 0.4 * font <= room => {
                line.push(' ');
                line.push_str(word);
            }
            _ => lines.extend(pieces(word, font, room)),
        }
    }
    lines
}

/// A word, cut where it is longer than a line.
fn pieces(word: &str, font: f64, room: f64) -> Vec<String> {
    let mut list = vec![String::new()];
    for c in word.chars() {
        let is_full = list
            .last()
            .is_some_and(|line| !line.is_empty() && text_width(line, font) + font > room);
        if is_full {
            list.push(String::new());
        }
        if let Some(line) = list.last_mut() {
            line.push(c);
        }
    }
    list
}

/// A text cut to the room there is.
pub(super) fn cut(text: &str, font: f64, room: f64) -> String {
    if text_width(text, font) <= room {
        return text.to_string();
    }
    let mut out = String::new();
    for c in text.chars() {
        if text_width(&out, font) + 1.6 * font > room {
            break;
        }
        out.push(c);
    }
    out + "\u{2026}"
}

/// A text whose beginning is left out where there is no room: of a path, the last parts say what it is.
pub(super) fn cut_front(text: &str, font: f64, room: f64) -> String {
    let mut rest = text;
    while text_width(rest, font) > room - font {
        match rest.char_indices().nth(1) {
            Some((next, _)) if text_width(text, font) > room => rest = &rest[next..],
            _ => break,
        }
    }
    match rest.len() == text.len() {
        true => text.to_string(),
        false => format!("\u{2026}{rest}"),
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn lines_have_nearly_equal_length() {
        let text = "Natural frequencies against the effective stiffness of both meshes together";
        let lines = wrapped(text, 10.0, 300.0);
        assert_eq!(lines.len(), 2, "{lines:?}");
        let widths: Vec<f64> = lines.iter().map(|l| text_width(l, 10.0)).collect();
        assert!(
            (widths[0] - widths[1]).abs() < 100.0 && widths[0] <= 300.0,
            "{widths:?}"
        );
        assert_eq!(lines.join(" "), text);
    }

    #[test]
    fn long_words_are_cut() {
        let lines = wrapped(&"x".repeat(100), 10.0, 100.0);
        assert!(lines.len() > 3 && lines.concat().len() == 100);
        assert!(cut(&"x".repeat(100), 10.0, 100.0).ends_with('…'));
        assert!(wrapped("", 10.0, 100.0).is_empty());
        let front = cut_front("connections.clutch.stages.0.hysteresis [N m]", 10.0, 150.0);
        assert!(
            front.starts_with('…') && front.ends_with("hysteresis [N m]"),
            "{front}"
        );
        assert_eq!(cut_front("time", 10.0, 100.0), "time");
    }
}
