//! Text from outside made harmless where it is put: in XML, in CSV, in `src`.

/// `text` for content and attributes of XML and HTML. Characters that XML 1.0 does not know are left out.
pub fn xml(text: &str) -> String {
    let mut out = String::with_capacity(text.len());
    for c in text.chars() {
        match c {
            '&' => out.push_str("&amp;"),
            '<' => out.push_str("&lt;"),
            '>' => out.push_str("&gt;"),
            '"' => out.push_str("&quot;"),
            '\'' => out.push_str("&#39;"),
            '\t' | '\n' | '\r' => out.push(c),
            c if c < ' ' || c == '\u{7f}' || c == '\u{fffe}' || c == '\u{ffff}' => {}
            c => out.push(c),
        }
    }
    out
}

/// One cell of CSV (RFC 4180): in quotation marks where it has to be.
pub fn cell(text: &str) -> String {
    if text.contains([',', '"', '\n', '\r']) {
        format!("\"{}\"", text.replace('"', "\"\""))
    } else {
        text.to_string()
    }
}

/// A picture that is in the page itself: `data:image/…;base64,…` and nothing that would be fetched or run.
pub fn picture(uri: &str) -> Option<&str> {
    let data = uri.strip_prefix("data:image/")?;
    let fine = |c: char| c.is_ascii_alphanumeric() || "+/=;,-.".contains(c);
    data.chars().all(fine).then_some(uri)
}

/// `text` in at most `length` characters, the last of them `…` if some are missing.
pub fn short(text: &str, length: usize) -> String {
    if text.chars().count() <= length {
        return text.to_string();
    }
    text.chars().take(length.saturating_sub(1)).chain(['…']).collect()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn nothing_gets_out_of_its_place() {
        assert_eq!(xml("a<b>&\"'\u{0}\u{1b}"), "a&lt;b&gt;&amp;&quot;&#39;");
        assert_eq!(cell("plain"), "plain");
        assert_eq!(cell("a,\"b\""), "\"a,\"\"b\"\"\"");
        assert_eq!(picture("data:image/png;base64,AAAA"), Some("data:image/png;base64,AAAA"));
        assert_eq!(picture("https://example.org/a.png"), None);
        assert_eq!(picture("data:image/png;base64,\"/><script>"), None);
        assert_eq!(picture("data:text/html,hello"), None);
        assert_eq!((short("abcdef", 4), short("äöü", 3)), ("abc…".into(), "äöü".into()));
    }
}
