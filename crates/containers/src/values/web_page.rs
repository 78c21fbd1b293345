//! Texts in web pages, and the recipe in one: a `meta` element of its head.

use crate::recipe::KEY;

/// The characters that stand for themselves nowhere in a quoted attribute, and how they are written; `&`
/// first.
const ESCAPES: [(&str, &str); 4] = [("&", "&amp;"), ("<", "&lt;"), (">", "&gt;"), ("\"", "&quot;")];

/// Text as HTML and XML hold it, in an element or between double quotes. Control characters, of which XML
/// forbids most, become spaces.
///
/// # Example: nothing of a name is markup
/// ```
/// let shown = containers::escape_html("a<b> & \"c\" 'd'\u{7}");
/// assert_eq!(shown, "a&lt;b&gt; &amp; &quot;c&quot; &#39;d&#39; ");
/// ```
pub fn escape_html(text: &str) -> String {
    let mut escaped = String::with_capacity(text.len());
    for character in text.chars() {
        match character {
            '&' => escaped.push_str("&amp;"),
            '<' => escaped.push_str("&lt;"),
            '>' => escaped.push_str("&gt;"),
            '"' => escaped.push_str("&quot;"),
            '\'' => escaped.push_str("&#39;"),
            control if control.is_control() => escaped.push(' '),
            other => escaped.push(other),
        }
    }
    escaped
}

fn start() -> String {
    format!("<meta name=\"{KEY}\" content=\"")
}

/// Whether the bytes are a web page.
pub fn is_web_page(bytes: &[u8]) -> bool {
    bytes.get(..15).is_some_and(|start| start.eq_ignore_ascii_case(b"<!doctype html>"))
}

/// The element that holds a recipe, for a page's head.
///
/// # Example: the recipe comes back
/// ```
/// let recipe = r#"{"path":"a</head>&quot;b"}"#;
/// let page = format!("<!doctype html>\n<head>{}</head>", containers::recipe_element(recipe));
/// assert_eq!(containers::read_recipe(page.as_bytes()).unwrap(), recipe);
/// ```
pub fn recipe_element(recipe: &str) -> String {
    let escaped = ESCAPES.iter().fold(recipe.to_owned(), |text, (raw, safe)| text.replace(raw, safe));
    format!("{}{escaped}\"/>", start())
}

pub(crate) fn read_recipe(bytes: &[u8]) -> Option<String> {
    let page = std::str::from_utf8(bytes).ok()?;
    let (_, rest) = page.split_once(&start())?;
    let (escaped, _) = rest.split_once('"')?;
    Some(ESCAPES.iter().rev().fold(escaped.to_owned(), |text, (raw, safe)| text.replace(safe, raw)))
}
