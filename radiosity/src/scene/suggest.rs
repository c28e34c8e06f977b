//! What a misspelt word was probably meant to be.

/// The candidate nearest to `word`, where one is near enough to be worth naming: a slip in one letter, or in
/// a third of a longer word. Upper and lower case are the same letter here. `None` where several are as near.
pub(super) fn nearest<'c>(word: &str, candidates: impl IntoIterator<Item = &'c str>) -> Option<&'c str> {
    /// Longer words are nobody's slip, and would cost time.
    const LONGEST: usize = 64;
    let letters = |text: &str| -> Vec<char> { text.chars().flat_map(char::to_uppercase).collect() };
    if word.len() > LONGEST {
        return None;
    }
    let word = letters(word);
    let mut best: Option<(usize, &str, bool)> = None;
    for candidate in candidates.into_iter().filter(|candidate| candidate.len() <= LONGEST) {
        let slips = slips(&word, &letters(candidate));
        best = match best {
            Some((least, other, alone)) if slips >= least => Some((least, other, alone && slips > least)),
            _ => Some((slips, candidate, true)),
        };
    }
    let (slips, candidate, alone) = best?;
    (alone && slips <= (candidate.len() / 3).max(1)).then_some(candidate)
}

/// Letters added, left out, changed, or exchanged with their neighbour: the optimal string alignment distance.
fn slips(a: &[char], b: &[char]) -> usize {
    let mut rows: Vec<Vec<usize>> = vec![(0..=b.len()).collect()];
    for i in 1..=a.len() {
        let mut row = vec![i];
        for j in 1..=b.len() {
            let changed = rows[i - 1][j - 1] + usize::from(a[i - 1] != b[j - 1]);
            let mut least = changed.min(rows[i - 1][j] + 1).min(row[j - 1] + 1);
            if i > 1 && j > 1 && a[i - 1] == b[j - 2] && a[i - 2] == b[j - 1] {
                least = least.min(rows[i - 2][j - 2] + 1);
            }
            row.push(least);
        }
        rows.push(row);
    }
    rows[a.len()][b.len()]
}

#[cfg(test)]
mod tests {
    use super::nearest;

    #[test]
    fn one_slip_is_forgiven_and_two_are_not() {
        let keywords = ["QD", "PG", "TI"];
        assert_eq!(nearest("qd", keywords), Some("QD"));
        assert_eq!(nearest("DQ", keywords), Some("QD"));
        assert_eq!(nearest("QDR", keywords), Some("QD"));
        assert_eq!(nearest("XY", keywords), None);
        assert_eq!(nearest("XD", ["QD", "CD"]), None, "either would be a guess");
        assert_eq!(nearest("", keywords), None);
        assert_eq!(nearest("kitchn.scn", ["bath.scn", "kitchen.scn"]), Some("kitchen.scn"));
        assert_eq!(nearest(&"Q".repeat(1000), keywords), None);
    }
}
