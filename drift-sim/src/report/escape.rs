//! The one place where text becomes part of a page.

/// Text as it may stand between tags and in quoted attributes. Control characters, which HTML forbids, become spaces.
pub(crate) fn text(text: &str) -> String {
    let mut out = String::with_capacity(text.len());
    for c in text.chars() {
        match c {
            '&' => out.push_str("&amp;"),
            '<' => out.push_str("&lt;"),
            '>' => out.push_str("&gt;"),
            '"' => out.push_str("&quot;"),
            '\'' => out.push_str("&#39;"),
            '\n' => out.push('\n'),
            c if c.is_control() => out.push(' '),
            c => out.push(c),
        }
    }
    out
}

/// JSON as it may stand in a script element: `</script>` and `<!--` can't occur, nor what ends a line of JavaScript. These
/// characters are found in JSON's strings alone, where an escape means the same.
pub(super) fn json(json: &str) -> String {
    let mut out = String::with_capacity(json.len());
    for c in json.chars() {
        match c {
            '<' => out.push_str("\\u003c"),
            '>' => out.push_str("\\u003e"),
            '&' => out.push_str("\\u0026"),
            '\u{2028}' => out.push_str("\\u2028"),
            '\u{2029}' => out.push_str("\\u2029"),
            c => out.push(c),
        }
    }
    out
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn markup_in_text_stays_text() {
        assert_eq!(
            text("<b onclick='x'>\"a\" & \u{7}b\n"),
            "&lt;b onclick=&#39;x&#39;&gt;&quot;a&quot; &amp;  b\n"
        );
    }

    #[test]
    fn json_in_a_script_reads_back_and_cant_end_it() {
        let names = ["</script><script>alert(1)</script>", "<!-- & \u{2028}\u{2029}"];
        let embedded = json(&serde_json::to_string(&names).unwrap());
        assert!(!embedded.contains(['<', '>', '&', '\u{2028}', '\u{2029}']), "{embedded}");
        assert_eq!(serde_json::from_str::<Vec<String>>(&embedded).unwrap(), names);
    }
}
