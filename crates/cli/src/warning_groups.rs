//! Warnings of many items, in a few lines: those of a stage that differ only in numbers and names share one.

use std::cmp::Reverse;
use std::collections::{BTreeMap, BTreeSet};

use engine::ItemName;

use crate::lists::more;

/// This many groups are shown; the warnings of the others are counted.
const MAX_GROUPS: usize = 10;

/// The warnings that have not been shown yet.
#[derive(Default)]
pub(crate) struct WarningGroups(BTreeMap<(String, String), Group>);

/// The warnings of a stage's items with the same pattern.
struct Group {
    items: BTreeSet<ItemName>,
    /// The warnings, of which an item may have several.
    count: usize,
    /// The least of the items and of its texts, so that the order of the warnings does not count.
    example: (ItemName, String),
}

impl WarningGroups {
    pub(crate) fn add(&mut self, item: &ItemName, message: &str) {
        let warning = (item.clone(), message.to_owned());
        let group = self.0.entry((item.stage.clone(), pattern(item, message))).or_insert_with(|| Group {
            items: BTreeSet::new(),
            count: 0,
            example: warning.clone(),
        });
        group.items.insert(item.clone());
        group.count += 1;
        group.example = std::mem::replace(&mut group.example, warning.clone()).min(warning);
    }

    /// A line for each of the largest groups, and one that counts the rest. Nothing is left to be shown.
    pub(crate) fn take_lines(&mut self) -> Vec<String> {
        let mut groups = std::mem::take(&mut self.0).into_values().collect::<Vec<_>>();
        groups.sort_by_key(|group| Reverse(group.count));
        let rest = groups.iter().skip(MAX_GROUPS).map(|group| group.count).sum();
        let mut lines = groups.iter().take(MAX_GROUPS).map(Group::line).collect::<Vec<_>>();
        lines.extend(more(rest, "more warning").map(|more| format!("{more}; --verbose shows all")));
        lines
    }
}

impl Group {
    /// `reflection: 197 items: the text of one; for example [sky, gold]`
    fn line(&self) -> String {
        let (item, message) = &self.example;
        match (self.items.len(), self.count) {
            (1, 1) => format!("{item}: {message}"),
            (1, count) => format!("{item}: {message} ({count} warnings like this)"),
            (items, _) => {
                let message = message.trim_end_matches('.');
                format!("{}: {items} items: {message}; for example [{}]", item.stage, item.key)
            }
        }
    }
}

/// A warning without what differs between items: their names, what stands in quotes, and numbers.
fn pattern(item: &ItemName, message: &str) -> String {
    let mut names = item.key.iter().map(|(_, stem)| stem).collect::<Vec<_>>();
    names.sort_by_key(|name| Reverse(name.len()));
    let text = names.iter().fold(message.to_owned(), |text, name| without_name(&text, name));
    let mut pattern = String::new();
    let mut rest = text.as_str();
    while let Some(first) = rest.chars().next() {
        let length = match first {
            '"' => rest[1..].find('"').map_or(1, |end| end + 2),
            _ => number_length(rest).unwrap_or(0),
        };
        let (taken, mark) = if length > 0 { (length, '#') } else { (first.len_utf8(), first) };
        pattern.push(mark);
        rest = &rest[taken..];
    }
    pattern
}

/// A text in which a name is left out where it stands as a whole word.
fn without_name(text: &str, name: &str) -> String {
    let is_inside = |c: Option<char>| c.is_some_and(|c| c.is_alphanumeric() || c == '_');
    let mut out = String::new();
    let mut from = 0;
    for (at, _) in text.match_indices(name).filter(|_| !name.is_empty()) {
        let end = at + name.len();
        if at >= from && !is_inside(text[..at].chars().next_back()) && !is_inside(text[end..].chars().next())
        {
            out += &text[from..at];
            out.push('#');
            from = end;
        }
    }
    out + &text[from..]
}

/// The length of the number at the start of a text: digits, a fraction and an exponent.
fn number_length(text: &str) -> Option<usize> {
    let bytes = text.as_bytes();
    let digits = |from: usize| bytes[from..].iter().take_while(|byte| byte.is_ascii_digit()).count();
    let sign = usize::from(bytes.first() == Some(&b'-'));
    let mut end = sign + digits(sign);
    if end == sign {
        return None;
    }
    if bytes.get(end) == Some(&b'.') && digits(end + 1) > 0 {
        end += 1 + digits(end + 1);
    }
    if matches!(bytes.get(end), Some(b'e' | b'E')) {
        let sign = usize::from(matches!(bytes.get(end + 1), Some(b'-' | b'+')));
        if bytes.len() > end + 1 + sign && digits(end + 1 + sign) > 0 {
            end += 1 + sign + digits(end + 1 + sign);
        }
    }
    Some(end)
}

#[cfg(test)]
mod tests {
    use engine::ItemKey;

    use super::*;

    fn item(stage: &str, stems: &[&str]) -> ItemName {
        let key = stems.iter().enumerate().map(|(at, stem)| (format!("stage {at}"), (*stem).to_owned()));
        ItemName { stage: stage.into(), key: ItemKey::from_iter(key) }
    }

    #[test]
    fn warnings_that_differ_in_numbers_and_names_are_one_line() {
        let mut groups = WarningGroups::default();
        for number in (0..197).rev() {
            let name = format!("studio_{number}");
            let text =
                format!("a cut at degree {number} leaves {number}.5e-3 % of env/{name}.hdr (\"{name}\")");
            groups.add(&item("reflection", &[&name, "m2"]), &text);
        }
        groups.add(&item("reflection", &["studio_1", "m2"]), "something else");
        groups.add(&item("map", &["studio_1"]), "something else");
        let expected = [
            "reflection: 197 items: a cut at degree 0 leaves 0.5e-3 % of env/studio_0.hdr (\"studio_0\"); for \
             example [studio_0, m2]",
            "map [studio_1]: something else",
            "reflection [studio_1, m2]: something else",
        ];
        assert_eq!(groups.take_lines(), expected);
        assert!(groups.take_lines().is_empty());
    }

    #[test]
    fn the_largest_groups_are_shown_and_the_others_counted() {
        let mut groups = WarningGroups::default();
        for kind in 'a'..='m' {
            groups.add(&item("map", &["sky"]), &format!("warning {kind}"));
        }
        groups.add(&item("map", &["studio"]), "warning m");
        let lines = groups.take_lines();
        assert_eq!(lines.len(), 11, "{lines:?}");
        assert_eq!(lines[0], "map: 2 items: warning m; for example [sky]");
        assert_eq!(lines[10], "... and 3 more warnings; --verbose shows all");
    }

    #[test]
    fn only_whole_names_are_left_out() {
        let check = |stem: &str, text: &str, expected: &str| {
            assert_eq!(pattern(&item("map", &[stem]), text), expected, "{text}");
        };
        check("a", "a map of a.exr has a gap", "# map of #.exr has # gap");
        check("sky", "skyline, sky, sky_2, -3.5 and 1e9.", "skyline, #, sky_#, # and #.");
        check("sky", "an open \"quote 7", "an open #quote #");
        check("", "é 8-bit 1.", "é #-bit #.");
    }

    #[test]
    fn several_warnings_of_one_item_are_counted() {
        let mut groups = WarningGroups::default();
        groups.add(&item("rig", &["sky"]), "light 2 is weak");
        groups.add(&item("rig", &["sky"]), "light 1 is weak");
        assert_eq!(groups.take_lines(), ["rig [sky]: light 1 is weak (2 warnings like this)"]);
    }
}
