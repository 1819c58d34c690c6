//! As much of Markdown as README and book use: fenced blocks, headings, links.

use std::fs;
use std::path::{Path, PathBuf};

/// The workspace's folder.
pub fn root() -> PathBuf {
    let here = Path::new(env!("CARGO_MANIFEST_DIR"));
    here.parent().unwrap_or(here).to_path_buf()
}

/// README and all pages of the book, sorted.
///
/// # Panics
/// The folder can't be read.
pub fn pages() -> Vec<PathBuf> {
    let mut found = vec![root().join("README.md")];
    let mut folders = vec![root().join("docs")];
    while let Some(folder) = folders.pop() {
        for entry in fs::read_dir(&folder).unwrap_or_else(|e| panic!("{}: {e}", folder.display())) {
            let path = entry.unwrap_or_else(|e| panic!("{}: {e}", folder.display())).path();
            if path.is_dir() {
                folders.push(path);
            } else if path.extension().is_some_and(|extension| extension == "md") {
                found.push(path);
            }
        }
    }
    found.sort();
    found
}

/// A fenced block.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct Block {
    /// What stands after the opening fence: `sh`, `rust`, `sh,ignore`; may be empty.
    pub language: String,
    /// The line of the opening fence, from 1.
    pub line: usize,
    /// The lines inside, without the fence's own indentation.
    pub text: String,
}

/// The fenced blocks of a page, in order.
///
/// # Panics
/// A fence is left open.
pub fn blocks(page: &str) -> Vec<Block> {
    let mut found = Vec::new();
    let mut lines = page.lines().enumerate();
    while let Some((at, line)) = lines.next() {
        let Some(language) = line.trim_start().strip_prefix("```") else { continue };
        let indent = line.len() - line.trim_start().len();
        let mut block = Block { language: language.trim().to_string(), line: at + 1, text: String::new() };
        loop {
            let Some((_, line)) = lines.next() else {
                panic!("the block in line {} is left open", block.line)
            };
            if line.trim() == "```" {
                break;
            }
            block.text += line.get(indent..).unwrap_or("");
            block.text.push('\n');
        }
        found.push(block);
    }
    found
}

/// The page with its fenced blocks blanked, so that nothing in them is taken for a heading or a link.
pub fn prose(page: &str) -> String {
    let mut inside = false;
    let mut kept = String::new();
    for line in page.lines() {
        let fence = line.trim_start().starts_with("```");
        inside ^= fence;
        if !fence && !inside {
            kept += line;
        }
        kept.push('\n');
    }
    kept
}

/// The anchors that a page's headings make: lower case, blanks as hyphens, other signs left out.
pub fn anchors(page: &str) -> Vec<String> {
    let prose = prose(page);
    let headings = prose.lines().filter(|line| line.starts_with('#'));
    headings
        .map(|heading| {
            let title = heading.trim_start_matches('#').trim().to_lowercase();
            let kept = title.chars().filter(|c| c.is_alphanumeric() || [' ', '-', '_'].contains(c));
            kept.map(|c| if c == ' ' { '-' } else { c }).collect()
        })
        .collect()
}

/// The targets of all links and pictures of a page.
pub fn links(page: &str) -> Vec<String> {
    let prose = prose(page);
    let ends = prose.split("](").skip(1);
    ends.filter_map(|rest| rest.split_once(')')).map(|(target, _)| target.to_string()).collect()
}

#[cfg(test)]
mod tests {
    use super::*;

    const PAGE: &str = "# A `b` C, d\n\n1. see [x](y.md#z)\n\n   ```sh\n   echo a\n     b\n   ```\n```text\n[no](link)\n```\n";

    #[test]
    fn blocks_lose_their_indentation() {
        let found = blocks(PAGE);
        assert_eq!((found[0].language.as_str(), found[0].line), ("sh", 5));
        assert_eq!(found[0].text, "echo a\n  b\n");
        assert_eq!(found[1].text, "[no](link)\n");
    }

    #[test]
    fn links_and_anchors_are_those_of_the_prose() {
        assert_eq!(links(PAGE), ["y.md#z"]);
        assert_eq!(anchors(PAGE), ["a-b-c-d"]);
    }
}
