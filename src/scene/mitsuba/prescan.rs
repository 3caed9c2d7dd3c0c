//! Checks the size of an XML text before a tree is built from it.
//!
//! The XML library is iterative and safe, but some of its checks take quadratic time (attributes of
//! one element, namespaces), and a tree can be many times larger than its text. This scan is linear,
//! reads exactly the tags the library would read up to the first fault, and refuses texts beyond the
//! limits. Faults themselves are left to the library, whose messages are better.

use std::ops::Range;

use crate::scene::limits;

/// A limit that is exceeded, and the place.
#[derive(Debug, PartialEq, Eq)]
pub(crate) struct Excess {
    /// The message, without a full stop.
    pub(crate) message: String,
    /// The place, in bytes.
    pub(crate) at: Range<usize>,
}

/// Refuses texts with document types, namespaces, or more nesting, elements or attributes than
/// [`limits`] allows.
pub(crate) fn check(text: &str) -> Result<(), Excess> {
    let bytes = text.as_bytes();
    let (mut i, mut depth, mut elements) = (0, 0_usize, 0_usize);
    while let Some(open) = find(bytes, i, b'<') {
        let rest = &bytes[open..];
        i = if rest.starts_with(b"<!--") {
            after(text, open + 4, "-->")
        } else if rest.starts_with(b"<![CDATA[") {
            after(text, open, "]]>")
        } else if rest.starts_with(b"<?") {
            after(text, open, "?>")
        } else if rest.starts_with(b"<!") {
            return Err(Excess { message: "a document type has no use here".into(), at: open..open + 2 });
        } else if rest.starts_with(b"</") {
            depth = depth.saturating_sub(1);
            after(text, open, ">")
        } else {
            elements += 1;
            let end = tag(bytes, open)?;
            if bytes[..end].ends_with(b">") && !bytes[..end].ends_with(b"/>") {
                depth += 1;
            }
            end
        };
        let at = open..open + 1;
        if depth > limits::NESTING {
            let message = format!("elements are nested deeper than {}", limits::NESTING);
            return Err(Excess { message, at });
        }
        if elements > limits::ELEMENTS {
            return Err(Excess { message: format!("there are more than {} elements", limits::ELEMENTS), at });
        }
    }
    Ok(())
}

/// The end of the tag that opens at `open`. Markup inside quotes does not count.
fn tag(bytes: &[u8], open: usize) -> Result<usize, Excess> {
    let (mut i, mut attributes) = (open + 1, 0);
    while i < bytes.len() {
        match bytes[i] {
            b'>' => return Ok(i + 1),
            quote @ (b'"' | b'\'') => {
                attributes += 1;
                if attributes > limits::ATTRIBUTES {
                    let message = format!("an element has more than {} attributes", limits::ATTRIBUTES);
                    return Err(Excess { message, at: open..open + 1 });
                }
                match find(bytes, i + 1, quote) {
                    Some(end) => i = end,
                    None => return Ok(bytes.len()),
                }
            }
            b'x' if bytes[i..].starts_with(b"xmlns") => {
                return Err(Excess { message: "namespaces have no use here".into(), at: i..i + 5 });
            }
            _ => {}
        }
        i += 1;
    }
    Ok(bytes.len())
}

fn find(bytes: &[u8], from: usize, needle: u8) -> Option<usize> {
    bytes.get(from..)?.iter().position(|b| *b == needle).map(|p| from + p)
}

fn after(text: &str, from: usize, end: &str) -> usize {
    text.get(from..).and_then(|t| t.find(end)).map_or(text.len(), |p| from + p + end.len())
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn ordinary_text_passes() {
        let text = "<?xml version='1.0'?><!-- it's > <a> --><scene version=\"3.0.0\"><a b='>'/><![CDATA[<x]]></scene>";
        assert_eq!(check(text), Ok(()));
        assert_eq!(check(""), Ok(()));
        assert_eq!(check("<"), Ok(()));
        assert_eq!(check("<!--"), Ok(()));
    }

    #[test]
    fn excess_is_found() {
        let deep = "<a>".repeat(limits::NESTING + 1);
        assert_eq!(check(&deep).map_err(|e| e.at.start), Err(3 * limits::NESTING));
        assert_eq!(check(&"<a>".repeat(limits::NESTING)), Ok(()));
        assert!(check(&"<a/>".repeat(limits::ELEMENTS + 1)).is_err());
        assert!(check(&format!("<a {}/>", "b='>' ".repeat(limits::ATTRIBUTES + 1))).is_err());
        assert!(check("<a xmlns:b='c'/>").is_err());
        assert!(check("<!DOCTYPE a [<!ENTITY b 'c'>]><a/>").is_err());
    }
}
