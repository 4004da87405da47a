//! Documents that are plainly too large, seen without the parser, which takes a microsecond for a value.

/// The place, in bytes, where a text plainly has more than `limit` values; `None` when a look does not show that.
///
/// Counts lines `- value`, `key: value` and entries of flow collections as long as every character is one whose meaning needs
/// no parser; the first quote, comment, anchor or doubtful indentation ends the count. Never counts too many in a valid document.
pub(super) fn too_many(text: &str, limit: usize) -> Option<usize> {
    let mut glance = Glance {
        bytes: text.as_bytes(),
        at: 0,
        values: 0,
        limit,
    };
    let mut parent = PreviousLine::Opens;
    while glance.at < glance.bytes.len() {
        parent = glance.line(parent)?;
        if glance.values > limit {
            return Some(glance.at);
        }
    }
    None
}

/// The line before: whether deeper lines can belong to it.
#[derive(Clone, Copy)]
enum PreviousLine {
    /// `key:` alone.
    Opens,
    /// A value has ended: deeper lines would go on with it.
    Ends(usize),
}

struct Glance<'t> {
    bytes: &'t [u8],
    at: usize,
    values: usize,
    limit: usize,
}

impl Glance<'_> {
    fn run(&mut self, is_part: impl Fn(u8) -> bool) -> usize {
        let rest = &self.bytes[self.at..];
        let length = rest.iter().take_while(|b| is_part(**b)).count();
        self.at += length;
        length
    }

    fn next(&self) -> Option<u8> {
        self.bytes.get(self.at).copied()
    }

    /// Counts a line; `None` when its meaning is not plain.
    fn line(&mut self, before: PreviousLine) -> Option<PreviousLine> {
        let indent = self.run(|b| b == b' ');
        let fits = match before {
            PreviousLine::Opens => true,
            PreviousLine::Ends(other) => indent <= other,
        };
        if !fits {
            return None;
        }
        if self.bytes[self.at..].starts_with(b"- ") {
            self.at += 2;
        } else {
            if self.run(is_word) == 0 || self.next() != Some(b':') {
                return None;
            }
            self.at += 1;
            if self.end_of_line() {
                return Some(PreviousLine::Opens);
            }
            if self.bytes[self.at - 1] != b' ' {
                return None;
            }
        }
        match self.next()? {
            b'[' | b'{' => self.flow()?,
            // A nested list, not a negative number.
            b'-' if !self.bytes.get(self.at + 1).is_some_and(u8::is_ascii_digit) => return None,
            b'?' | b':' => return None,
            _ => {
                if self.run(is_word) == 0 {
                    return None;
                }
                self.values += 1;
            }
        }
        (self.values > self.limit || self.end_of_line()).then_some(PreviousLine::Ends(indent))
    }

    /// Counts the entries of a flow collection up to its end, or up to the limit.
    fn flow(&mut self) -> Option<()> {
        let mut depth = 0;
        loop {
            match self.next()? {
                b'[' | b'{' => depth += 1,
                b']' | b'}' => depth -= 1,
                b',' => self.values += 1,
                b' ' | b'\n' | b':' => {}
                byte if is_word(byte) => {}
                _ => return None,
            }
            self.at += 1;
            if depth == 0 || self.values > self.limit {
                return Some(());
            }
        }
    }

    /// Skips the end of a line; false if something else follows.
    fn end_of_line(&mut self) -> bool {
        self.run(|b| b == b' ');
        match self.next() {
            None => true,
            Some(b'\n') => {
                self.at += 1;
                true
            }
            Some(_) => false,
        }
    }
}

/// Characters of words and numbers that mean nothing else anywhere in YAML.
fn is_word(byte: u8) -> bool {
    byte.is_ascii_alphanumeric() || matches!(byte, b'_' | b'.' | b'+' | b'-')
}

#[cfg(test)]
mod tests {
    use super::too_many;

    #[test]
    fn counts_what_is_plain_and_nothing_else() {
        for text in [
            "a: [1, 2, 3, 4, 5]\n",
            "- 1\n- 2\n- 3\n- 4\n",
            "a: 1\nb:\n  c: 2\n  d: -3\n  e: 4\n",
            "list:\n- 1\n- [2, {a: 3}, 4]\n",
        ] {
            assert!(too_many(text, 2).is_some(), "{text}");
            assert!(too_many(text, 9).is_none(), "{text}");
        }
        for text in [
            "a: \"[1, 2, 3, 4, 5]\"\n",
            "a: one\n  - two\n  - three\n  - four\n",
            "a: one [1, 2, 3, 4]\n",
            "a: |\n  - 1\n  - 2\n  - 3\n  - 4\n",
            "# [1, 2, 3, 4]\n",
            "a: [1 # , 2, 3, 4, 5\n]\n",
            "",
        ] {
            assert!(too_many(text, 2).is_none(), "{text}");
        }
    }
}
