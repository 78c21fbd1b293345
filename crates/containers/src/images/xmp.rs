//! Properties of XMP: simple values in RDF, as attributes or as elements, and lists of them.
//!
//! A reader of XML would refuse a packet that is cut or damaged anywhere. This one looks for the names alone,
//! and passes over comments.

/// A piece of XML.
#[derive(Clone, Copy)]
enum Piece<'a> {
    /// A tag without its angle brackets.
    Tag(&'a str),
    Text(&'a str),
}

/// The value of the property `name` of a namespace, by any prefix; that prefix is `usual` if none is
/// declared. The first one counts.
pub(crate) fn property(xmp: &str, namespace: &str, usual: &str, name: &str) -> Option<String> {
    properties(xmp, namespace, usual, name)?.into_iter().next()
}

/// The values of the property `name`, found as by [`property`]: all of a list (RDF's Seq, Bag or Alt).
pub(crate) fn properties(xmp: &str, namespace: &str, usual: &str, name: &str) -> Option<Vec<String>> {
    let pieces = pieces(xmp);
    let declared = pieces.iter().filter_map(|piece| match piece {
        Piece::Tag(tag) => Some(attributes(tag)),
        Piece::Text(_) => None,
    });
    let mut prefixes: Vec<&str> = declared
        .flatten()
        .filter(|(_, value)| *value == namespace)
        .filter_map(|(key, _)| key.strip_prefix("xmlns:"))
        .collect();
    if prefixes.is_empty() {
        prefixes.push(usual);
    }
    let is_it = |key: &str| {
        key.split_once(':').is_some_and(|(prefix, local)| local == name && prefixes.contains(&prefix))
    };
    let mut pieces = pieces.iter().peekable();
    while let Some(piece) = pieces.next() {
        let Piece::Tag(tag) = piece else { continue };
        if let Some((_, value)) = attributes(tag).find(|(key, _)| is_it(key)) {
            return Some(vec![unescaped(value)]);
        }
        let element = tag.split([' ', '\t', '\r', '\n', '/']).next().unwrap_or_default();
        if is_it(element) && !tag.ends_with('/') {
            let text = match pieces.peek() {
                Some(Piece::Text(text)) => text,
                _ => "",
            };
            let items = items(element, pieces.copied());
            return Some(if items.is_empty() { vec![unescaped(text)] } else { items });
        }
    }
    None
}

/// The items of the list that an element holds.
fn items<'a>(element: &str, pieces: impl Iterator<Item = Piece<'a>>) -> Vec<String> {
    let mut found = Vec::new();
    let mut in_item = false;
    for piece in pieces {
        match piece {
            Piece::Tag(tag) if tag.strip_prefix('/').map(str::trim_end) == Some(element) => break,
            Piece::Tag(tag) => in_item = tag.starts_with("rdf:li"),
            Piece::Text(text) if in_item => found.push(unescaped(text)),
            Piece::Text(_) => {}
        }
    }
    found
}

fn pieces(mut xml: &str) -> Vec<Piece<'_>> {
    let mut found = Vec::new();
    while let Some(start) = xml.find('<') {
        if start > 0 {
            found.push(Piece::Text(&xml[..start]));
        }
        xml = &xml[start + 1..];
        let is_comment = xml.starts_with("!--");
        let end = if is_comment { "-->" } else { ">" };
        // Quotes may hold the end of a tag.
        let mut quote = None;
        let closing = xml.char_indices().find(|&(at, c)| match (is_comment, quote) {
            (true, _) => xml[at..].starts_with(end),
            (false, Some(open)) => {
                quote = Some(open).filter(|&open| open != c);
                false
            }
            (false, None) => {
                quote = Some(c).filter(|c| ['"', '\''].contains(c));
                c == '>'
            }
        });
        let Some((closing, _)) = closing else { break };
        if !is_comment {
            found.push(Piece::Tag(&xml[..closing]));
        }
        xml = &xml[closing + end.len()..];
    }
    found
}

fn attributes(tag: &str) -> impl Iterator<Item = (&str, &str)> {
    let mut rest = tag;
    std::iter::from_fn(move || {
        let (before, after) = rest.split_once('=')?;
        let key = before.trim_end().rsplit([' ', '\t', '\r', '\n']).next().unwrap_or_default();
        let value = after.trim_start();
        let quote = value.chars().next().filter(|quote| ['"', '\''].contains(quote))?;
        let (value, after) = value[1..].split_once(quote)?;
        rest = after;
        Some((key, value))
    })
}

fn unescaped(text: &str) -> String {
    [("&lt;", "<"), ("&gt;", ">"), ("&quot;", "\""), ("&apos;", "'"), ("&amp;", "&")]
        .iter()
        .fold(text.trim().to_owned(), |text, (entity, character)| text.replace(entity, character))
}

#[cfg(test)]
mod tests {
    use super::*;

    const NAMESPACE: &str = "http://ns.google.com/photos/1.0/panorama/";

    fn found(xmp: &str) -> Option<String> {
        property(xmp, NAMESPACE, "GPano", "FullPanoWidthPixels")
    }

    #[test]
    fn attributes_and_elements_are_found_by_their_namespace() {
        let with = |inside: &str| {
            format!("<?xpacket begin='\u{feff}'?><rdf:RDF><rdf:Description {inside}</rdf:RDF>")
        };
        let declared = format!("xmlns:p = '{NAMESPACE}'");
        for inside in [
            format!("{declared} p:FullPanoWidthPixels=\"64\"/>"),
            format!("a='x > y = z' p:FullPanoWidthPixels = '64'\n\t{declared} b=\"\"/>"),
            format!("{declared}><p:FullPanoWidthPixels> 64\n</p:FullPanoWidthPixels></rdf:Description>"),
            format!("{declared}><p:FullPanoWidthPixels rdf:x=\"1\">64</p:FullPanoWidthPixels>"),
            format!(
                "{declared}><!-- p:FullPanoWidthPixels=\"1\" <a b=\"> --> <c p:FullPanoWidthPixels=\"64\"/>"
            ),
            "GPano:FullPanoWidthPixels=\"64\"/>".into(),
        ] {
            assert_eq!(found(&with(&inside)).as_deref(), Some("64"), "{inside}");
        }
        for inside in [
            format!("{declared} p:FullPanoWidth=\"64\"/>"),
            format!("{declared} GPano:FullPanoWidthPixels=\"64\"/>"),
            format!("{declared} FullPanoWidthPixels=\"64\"/>"),
        ] {
            assert_eq!(found(&with(&inside)), None, "{inside}");
        }
        assert_eq!(
            found(&with("GPano:FullPanoWidthPixels=\"&quot;a&amp;lt;\"/>")).as_deref(),
            Some("\"a&lt;")
        );
    }

    #[test]
    fn a_list_has_all_its_values() {
        let xmp = "<a p:FullPanoWidthPixels2='0' xmlns:p='http://ns.google.com/photos/1.0/panorama/'>
            <p:FullPanoWidthPixels> <rdf:Seq> <rdf:li> 1.5</rdf:li>\n<rdf:li xml:lang='x'>2</rdf:li>
            </rdf:Seq> </p:FullPanoWidthPixels><p:Other><rdf:li>3</rdf:li></p:Other></a>";
        let values = properties(xmp, NAMESPACE, "GPano", "FullPanoWidthPixels").unwrap();
        assert_eq!(values, ["1.5", "2"]);
        assert_eq!(property(xmp, NAMESPACE, "GPano", "Other").as_deref(), Some("3"));
        assert_eq!(properties(xmp, NAMESPACE, "GPano", "Absent"), None);
    }

    #[test]
    fn a_cut_packet_gives_what_is_whole() {
        let xmp = "<a GPano:FullPanoWidthPixels=\"64\"><GPano:ProjectionType>x</GPano:ProjectionType></a>";
        for cut in 0..=xmp.len() {
            let value = found(&xmp[..cut]);
            assert_eq!(value.is_some(), cut > xmp.find('>').unwrap(), "{cut}");
        }
        for text in ["<", "<>", "<=", "<a =>", "<a b=>", "<!--", "<a b=\"", "é<é é='é'>", "<a b='c\"d'e=>"]
        {
            assert_eq!(found(text), None);
        }
    }
}
