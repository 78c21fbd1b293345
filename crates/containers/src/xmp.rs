//! Simple properties of XMP (ISO 16684-1): `p:name="value"`, `<p:name>value</p:name>`, and lists of those in
//! RDF's Seq, Bag or Alt.

/// What stands for a prefix: `xmlns:p="namespace"`.
const DECLARATION: &str = "xmlns:";

/// An XMP packet.
#[derive(Clone, Copy)]
pub(crate) struct Xmp<'a>(pub(crate) &'a str);

impl<'a> Xmp<'a> {
    /// The values of a property of a namespace: one, or those of a list. `None` if the packet has no such
    /// property.
    pub(crate) fn values(self, namespace: &str, name: &str) -> Option<Vec<&'a str>> {
        self.prefixes(namespace).find_map(|prefix| {
            let name = format!("{prefix}:{name}");
            self.attribute(&name).map(|value| vec![value]).or_else(|| self.element(&name))
        })
    }

    /// The value of a property that has one value.
    pub(crate) fn value(self, namespace: &str, name: &str) -> Option<&'a str> {
        self.values(namespace, name)?.first().copied()
    }

    /// Whether the packet declares a namespace.
    pub(crate) fn has_namespace(self, namespace: &str) -> bool {
        self.prefixes(namespace).next().is_some()
    }

    fn prefixes<'b>(self, namespace: &'b str) -> impl Iterator<Item = &'a str> + use<'a, 'b> {
        self.0.match_indices(DECLARATION).filter_map(move |(at, _)| {
            let (prefix, rest) = self.0[at + DECLARATION.len()..].split_once('=')?;
            (quoted(rest)? == namespace).then(|| prefix.trim_end())
        })
    }

    fn attribute(self, name: &str) -> Option<&'a str> {
        self.0.match_indices(name).find_map(|(at, _)| {
            let is_whole = self.0[..at].ends_with(|before: char| before.is_ascii_whitespace());
            let value = self.0[at + name.len()..].trim_start().strip_prefix('=').filter(|_| is_whole)?;
            quoted(value)
        })
    }

    fn element(self, name: &str) -> Option<Vec<&'a str>> {
        let content = self.0.match_indices(name).find_map(|(at, _)| {
            let rest = &self.0[at + name.len()..];
            let is_whole = self.0[..at].ends_with('<') && !rest.starts_with(is_of_name);
            content(rest, name).filter(|_| is_whole)
        })?;
        let items: Vec<&str> = content
            .match_indices("<rdf:li")
            .filter_map(|(at, start)| Some(self::content(&content[at + start.len()..], "rdf:li")?.trim()))
            .collect();
        Some(if items.is_empty() { vec![content.trim()] } else { items })
    }
}

/// What lies between the rest of an element's start and its end.
fn content<'a>(start: &'a str, name: &str) -> Option<&'a str> {
    let (attributes, rest) = start.split_once('>')?;
    if attributes.ends_with('/') {
        return Some("");
    }
    rest.split_once(&format!("</{name}")).map(|(content, _)| content)
}

/// The text within the quotes with which `text` begins.
fn quoted(text: &str) -> Option<&str> {
    let text = text.trim_start();
    let quote = text.chars().next().filter(|first| ['"', '\''].contains(first))?;
    text[1..].split_once(quote).map(|(value, _)| value.trim())
}

fn is_of_name(character: char) -> bool {
    character.is_alphanumeric() || ['_', '-', '.', ':'].contains(&character)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn properties_are_attributes_elements_or_lists_of_any_prefix() {
        let xmp = Xmp(r#"<x:xmpmeta xmlns:x="adobe:ns:meta/">
            <rdf:Description xmlns:g = 'urn:gain/' xmlns:h="urn:other/" h:Max="9" g:MaxOfAll="8"
                             xg:Max="7" g:Min = ' -1 '>
              <g:Maximum>6</g:Maximum>
              <g:Max> <rdf:Seq> <rdf:li> 1.5</rdf:li> <rdf:li xml:lang="x">2</rdf:li>
              <rdf:li>3</rdf:li></rdf:Seq></g:Max>
              <g:Flag>True</g:Flag><g:Empty/>
            </rdf:Description></x:xmpmeta>"#);
        assert_eq!(xmp.values("urn:gain/", "Max"), Some(vec!["1.5", "2", "3"]));
        assert_eq!(xmp.value("urn:gain/", "Min"), Some("-1"));
        assert_eq!(xmp.value("urn:gain/", "Flag"), Some("True"));
        assert_eq!(xmp.value("urn:gain/", "Empty"), Some(""));
        assert_eq!(xmp.value("urn:other/", "Max"), Some("9"));
        assert_eq!(xmp.value("urn:gain/", "Absent"), None);
        assert_eq!(xmp.value("urn:absent/", "Max"), None);
        assert!(xmp.has_namespace("urn:other/") && !xmp.has_namespace("urn:absent/"));
    }

    #[test]
    fn a_packet_that_ends_anywhere_says_nothing_more() {
        let whole = r#"<a xmlns:g="urn:g/" g:A="1" ><g:B>2</g:B><g:C><rdf:li>3</rdf:li></g:C></a>"#;
        for length in 0..whole.len() {
            let xmp = Xmp(&whole[..length]);
            for (name, value) in [("A", "1"), ("B", "2"), ("C", "3")] {
                assert!(xmp.value("urn:g/", name).is_none_or(|found| found == value), "{length}");
            }
        }
    }
}
