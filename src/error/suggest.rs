//! "Did you mean": the nearest known name.

/// The candidate that a misspelt name most likely means; `None` when none is near.
///
/// A name that differs in case alone is nearest; else the smallest number of single-letter slips (missing, extra, wrong,
/// swapped letters), at most one in three letters; else a candidate that shares most letters in order (Jaro-Winkler).
pub fn nearest<'a, S: AsRef<str> + ?Sized + 'a>(
    name: &str,
    candidates: impl IntoIterator<Item = &'a S>,
) -> Option<&'a str> {
    /// Below this similarity, suggestions seen in practice were noise.
    const SIMILAR: f64 = 0.85;
    /// Longer names are not typing errors, and comparing costs the product of the lengths.
    const LONGEST: usize = 100;
    let length = name.chars().count();
    if length == 0 || length > LONGEST {
        return None;
    }
    let mut best: Option<(usize, f64, &str)> = None;
    for candidate in candidates {
        let candidate = candidate.as_ref();
        if candidate == name || candidate.len() > 4 * LONGEST {
            continue;
        }
        let slips = if candidate.to_lowercase() == name.to_lowercase() {
            0
        } else {
            strsim::damerau_levenshtein(name, candidate)
        };
        let similarity = strsim::jaro_winkler(name, candidate);
        let allowed = (length.max(candidate.chars().count()) / 3).max(1);
        let few = slips <= allowed && slips < length;
        if !few && (similarity < SIMILAR || length < 4) {
            continue;
        }
        if best.is_none_or(|(s, j, _)| (slips, -similarity) < (s, -j)) {
            best = Some((slips, similarity, candidate));
        }
    }
    best.map(|(_, _, candidate)| candidate)
}

/// Help for an unknown name: ``did you mean `half_gap`?``, or the list of the known names.
pub fn did_you_mean<'a, S: AsRef<str> + ?Sized + 'a>(
    name: &str,
    candidates: impl IntoIterator<Item = &'a S>,
) -> String {
    /// More names than this are cut off, or the message hides itself.
    const LISTED: usize = 60;
    let known: Vec<&str> = candidates.into_iter().map(AsRef::as_ref).collect();
    if let Some(candidate) = nearest(name, known.iter().copied()) {
        return format!("did you mean `{candidate}`?");
    }
    match known.len() {
        0 => "nothing is known here".to_owned(),
        1 => format!("the only known name is `{}`", known[0]),
        n if n > LISTED => format!(
            "known: {}, and {} more",
            known[..LISTED].join(", "),
            n - LISTED
        ),
        _ => format!("known: {}", known.join(", ")),
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    const KEYS: [&str; 5] = ["half_gap", "gap", "impact_damping", "stiffness", "kN"];

    #[test]
    fn near_names_are_found_and_far_ones_listed() {
        assert_eq!(nearest("halfgap", KEYS), Some("half_gap"));
        assert_eq!(nearest("stifness", KEYS), Some("stiffness"));
        assert_eq!(nearest("impact_dampnig", KEYS), Some("impact_damping"));
        assert_eq!(nearest("GAP", KEYS), Some("gap"));
        assert_eq!(nearest("KN", KEYS), Some("kN"));
        assert_eq!(nearest("colour", KEYS), None);
        assert_eq!(nearest("", KEYS), None);
        assert!(did_you_mean("colour", KEYS).starts_with("known: half_gap, gap"));
        assert_eq!(did_you_mean("gep", KEYS), "did you mean `gap`?");
        assert_eq!(did_you_mean("x", [] as [&str; 0]), "nothing is known here");
    }
}
