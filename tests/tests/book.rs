//! The book says what the code says: every kind of physics with its parameters, no broken link, every block run or
//! marked.

use std::fs;
use std::path::Path;

use drift_sim::physics::{KINDS, Kind, UnitNames};
use drift_tests::markdown::{anchors, blocks, links, pages, root};

/// Blocks that can't run, by page. Each needs a reason in the text around it.
const IGNORED_AT_MOST: usize = 7;

fn read(path: &Path) -> String {
    fs::read_to_string(path).unwrap_or_else(|e| panic!("{}: {e}", path.display()))
}

/// Words alone, so that line breaks don't matter.
fn words(text: &str) -> String {
    text.split_whitespace().collect::<Vec<_>>().join(" ")
}

fn physics_page(place: &str) -> String {
    read(&root().join(format!("docs/physics/{place}.md")))
}

/// The table that a kind's section must hold.
fn table(kind: &Kind) -> String {
    let units = UnitNames::default();
    let rows = kind
        .parameters
        .iter()
        .map(|p| format!("| `{}` | {} | {} |", p.name, units.unit_in_words(p.unit), p.range.says()));
    std::iter::once("| parameter | unit | must be |\n|---|---|---|".to_string())
        .chain(rows)
        .collect::<Vec<_>>()
        .join("\n")
}

/// What a section lacks of what the code says of its kind.
fn faults(kind: &Kind, section: &str) -> Vec<String> {
    let text = words(section);
    let mut faults = Vec::new();
    let mut must = |holds: bool, what: String| {
        if !holds {
            faults.push(format!("{}: {what}", kind.name));
        }
    };
    must(section.contains(&table(kind)), format!("the table must be\n{}", table(kind)));
    let rows = section.lines().filter(|line| line.starts_with("| `")).count();
    must(rows == kind.parameters.len(), format!("{rows} parameters in the table"));
    must(section.contains(&format!("](../pictures/{}.svg)", kind.name)), "its picture is missing".into());
    must(text.contains(&words(kind.excitation)), format!("shows with: {}", kind.excitation));
    must(text.contains(&words(kind.experiment)), format!("experiment: {}", kind.experiment));
    for tie in kind.ties {
        must(text.contains(&format!("[{tie}](")), format!("its look-alike {tie} is not linked"));
    }
    faults
}

#[test]
fn every_kind_has_its_section_with_the_code_s_own_parameters() {
    let mut wrong = Vec::new();
    for kind in KINDS {
        let page = physics_page(kind.place.name());
        match page.split("\n## ").find(|section| section.lines().next() == Some(kind.name)) {
            Some(section) => wrong.extend(faults(kind, section)),
            None => {
                wrong.push(format!("docs/physics/{}.md has no section '## {}'", kind.place.name(), kind.name))
            }
        }
    }
    assert!(wrong.is_empty(), "{}", wrong.join("\n"));
}

#[test]
fn the_chapters_name_no_kind_that_the_code_does_not_have() {
    for place in ["plant", "actuator", "loop", "sensor", "disturbance", "controller"] {
        let page = physics_page(place);
        let sections: Vec<&str> = page.lines().filter_map(|line| line.strip_prefix("## ")).collect();
        let kinds: Vec<&str> = KINDS.iter().filter(|k| k.place.name() == place).map(|k| k.name).collect();
        assert_eq!(sections, kinds, "docs/physics/{place}.md");
    }
    let overview = read(&root().join("docs/physics.md"));
    for kind in KINDS {
        let place = kind.place.name();
        let row = format!("| {place} | [{}](physics/{place}.md#{}) |", kind.name, kind.name);
        assert!(overview.contains(&row), "docs/physics.md lacks: {row}");
    }
}

#[test]
fn a_section_that_differs_from_the_code_is_found() {
    let kind = Kind::named("stribeck_friction").unwrap();
    let page = physics_page("plant");
    let section = page.split("\n## ").find(|s| s.starts_with("stribeck_friction\n")).unwrap();
    assert!(faults(kind, section).is_empty());
    for (from, to) in [
        ("| drive unit |", "| u unit |"),
        ("| `breakaway` |", "| `break` |"),
        ("[coulomb_friction](", "[a]("),
        ("> 0", ">= 0"),
    ] {
        assert!(!faults(kind, &section.replacen(from, to, 1)).is_empty(), "{from}");
    }
}

#[test]
fn no_link_is_broken() {
    let mut broken = Vec::new();
    for page in pages() {
        let text = read(&page);
        for target in links(&text).iter().filter(|t| !t.starts_with("http")) {
            let (file, anchor) = target.split_once('#').unwrap_or((target, ""));
            let to = if file.is_empty() { page.clone() } else { page.parent().unwrap().join(file) };
            let found = to.exists() && (anchor.is_empty() || anchors(&read(&to)).iter().any(|a| a == anchor));
            if !found {
                broken.push(format!("{}: {target}", page.display()));
            }
        }
    }
    assert!(broken.is_empty(), "{}", broken.join("\n"));
}

#[test]
fn the_summary_lists_every_page_and_every_picture_is_shown() {
    let docs = root().join("docs");
    let summary = links(&read(&docs.join("SUMMARY.md")));
    let shown: Vec<String> = pages().iter().flat_map(|page| links(&read(page))).collect();
    for page in pages().iter().filter_map(|page| page.strip_prefix(&docs).ok()) {
        let name = page.display().to_string();
        assert!(name == "SUMMARY.md" || summary.contains(&name), "{name} is not in SUMMARY.md");
    }
    for picture in fs::read_dir(docs.join("pictures")).unwrap() {
        let picture = picture.unwrap();
        let name = picture.file_name().into_string().unwrap();
        assert!(shown.iter().any(|link| link.ends_with(&format!("pictures/{name}"))), "{name} is in no page");
        assert!(picture.metadata().unwrap().len() < 30_000, "{name} is large");
    }
}

#[test]
fn every_block_says_what_it_is_and_few_are_not_run() {
    let doc_tests = read(&root().join("tests/src/lib.rs"));
    let mut ignored = Vec::new();
    for page in pages() {
        let name = page.strip_prefix(root()).unwrap().display().to_string();
        for block in blocks(&read(&page)) {
            let at = format!("{name}:{}", block.line);
            match block.language.as_str() {
                "sh" | "toml" | "c" | "text" => {}
                "rust" => {
                    assert!(doc_tests.contains(&format!("../../{name}")), "{at}: not in tests/src/lib.rs")
                }
                // Run by the package's own tests, drift-sim/python/tests/test_package.py.
                "python" => assert_eq!(name, "docs/python.md", "{at}: Python that no test runs"),
                language if language.ends_with(",ignore") => ignored.push(at),
                language => {
                    panic!("{at}: '{language}'; sh, rust, toml, c, python, text, or one of them with ,ignore")
                }
            }
        }
    }
    assert!(ignored.len() <= IGNORED_AT_MOST, "{ignored:?}");
}
