//! The packages of the C interface by their formats' rules: which keys there have to be, which words are allowed, that versions and
//! paths agree. What is built of them is built by `.ci/packages`.

use std::path::PathBuf;

fn package(file: &str) -> String {
    let path = PathBuf::from(env!("CARGO_MANIFEST_DIR")).join("../drift-core/c").join(file);
    std::fs::read_to_string(&path).unwrap_or_else(|e| panic!("{}: {e}", path.display()))
}

/// `key: value` and `key=value` files, top level only.
fn pairs(text: &str, separator: char) -> Vec<(String, String)> {
    let top = |line: &&str| !line.starts_with([' ', '#', '-']) && !line.trim().is_empty();
    let pair = |line: &str| {
        let (key, value) =
            line.split_once(separator).unwrap_or_else(|| panic!("no '{separator}' in: {line}"));
        (key.to_owned(), value.trim().trim_matches('"').to_owned())
    };
    text.lines().filter(top).map(pair).collect()
}

fn value<'a>(pairs: &'a [(String, String)], key: &str) -> &'a str {
    let found: Vec<_> = pairs.iter().filter(|(k, _)| k == key).collect();
    assert_eq!(found.len(), 1, "{key} has to be there once");
    &found[0].1
}

fn only(pairs: &[(String, String)], allowed: &[&str]) {
    for (key, _) in pairs {
        assert!(allowed.contains(&key.as_str()), "{key} is not of the format: {allowed:?}");
    }
}

/// Of the header, which the crate holds against its own at compile time.
fn version() -> String {
    let header = package("include/drift.h");
    let number = |name: &str| {
        let line = header.lines().find_map(|l| l.strip_prefix(&format!("#define DRIFT_VERSION_{name} ")));
        line.unwrap_or_else(|| panic!("no {name}")).to_owned()
    };
    [number("MAJOR"), number("MINOR"), number("PATCH")].join(".")
}

#[test]
fn the_arduino_library_follows_its_specification() {
    let pairs = pairs(&package("arduino/library.properties"), '=');
    only(
        &pairs,
        &[
            "name",
            "version",
            "author",
            "maintainer",
            "sentence",
            "paragraph",
            "category",
            "url",
            "architectures",
            "depends",
            "dot_a_linkage",
            "includes",
            "precompiled",
            "ldflags",
        ],
    );
    for required in ["author", "maintainer", "sentence", "paragraph", "url", "architectures"] {
        assert!(!value(&pairs, required).is_empty(), "{required}");
    }
    let name = value(&pairs, "name");
    assert!(
        name.starts_with(|c: char| c.is_ascii_alphanumeric()) && !name.to_lowercase().starts_with("arduino")
    );
    assert_eq!(value(&pairs, "version"), version());
    let categories = [
        "Display",
        "Communication",
        "Signal Input/Output",
        "Sensors",
        "Device Control",
        "Timing",
        "Data Storage",
        "Data Processing",
        "Other",
    ];
    assert!(categories.contains(&value(&pairs, "category")));
    assert!(["true", "full"].contains(&value(&pairs, "precompiled")));
    assert_eq!(value(&pairs, "ldflags"), "-ldrift", "of libdrift.a");
    assert_eq!(value(&pairs, "includes"), "drift.h");
}

#[test]
fn the_platformio_library_follows_its_specification() {
    let json: serde_json::Value = serde_json::from_str(&package("arduino/library.json")).expect("JSON");
    let object = json.as_object().expect("an object");
    let allowed = [
        "name",
        "version",
        "description",
        "keywords",
        "homepage",
        "repository",
        "authors",
        "license",
        "frameworks",
        "platforms",
        "headers",
        "examples",
        "dependencies",
        "export",
        "scripts",
        "build",
    ];
    for key in object.keys() {
        assert!(allowed.contains(&key.as_str()), "{key}");
    }
    assert_eq!(json["version"], version().as_str());
    let name = json["name"].as_str().expect("a name");
    assert!(name.len() <= 100 && !name.contains(['/', ':']));
    let build = json["build"].as_object().expect("build");
    let allowed = [
        "flags",
        "unflags",
        "includeDir",
        "srcDir",
        "srcFilter",
        "extraScript",
        "libArchive",
        "libLDFMode",
        "libCompatMode",
        "builder",
    ];
    for key in build.keys() {
        assert!(allowed.contains(&key.as_str()), "build.{key}");
    }
    let script = build["extraScript"].as_str().expect("a script");
    assert!(package(&format!("arduino/{script}")).contains("LIBS=[\"drift\"]"));
}

#[test]
fn the_zephyr_module_names_files_that_are_there() {
    let text = package("zephyr/module.yml");
    only(&pairs(&text, ':'), &["name", "build", "package-managers", "security", "blobs", "tests"]);
    let nested = |key: &str| {
        let value = text.lines().find_map(|line| line.strip_prefix(&format!("  {key}: ")));
        value.unwrap_or_else(|| panic!("build.{key}")).to_owned()
    };
    assert!(package(&format!("{}/CMakeLists.txt", nested("cmake"))).contains("zephyr_"));
    assert!(package(&nested("kconfig")).contains("config DRIFT\n"));
}

#[test]
fn the_esp_idf_component_lists_the_chips_that_it_builds_for() {
    let text = package("esp-idf/drift/idf_component.yml");
    let pairs = pairs(&text, ':');
    let allowed = [
        "version",
        "description",
        "url",
        "repository",
        "documentation",
        "issues",
        "license",
        "tags",
        "targets",
        "dependencies",
        "files",
        "maintainers",
        "discussion",
        "examples",
    ];
    only(&pairs, &allowed);
    assert_eq!(value(&pairs, "version"), version());
    let chips: Vec<&str> =
        value(&pairs, "targets").trim_matches(['[', ']']).split(',').map(str::trim).collect();
    let cmake = package("esp-idf/drift/CMakeLists.txt");
    for chip in &chips {
        let short = chip.strip_prefix("esp32").expect("an ESP32");
        let named =
            cmake.contains(&format!("\"{chip}\"")) || cmake.split(['(', '|', ')']).any(|w| w == short);
        assert!(named, "{chip} has no Rust target in the component's CMakeLists.txt");
    }
    assert!(text.contains("  idf: \""), "it depends on ESP-IDF");
}

/// A triple that Rust does not have would only be noticed on the board that needs it.
#[test]
fn every_target_that_a_package_names_is_one_of_rust_s() {
    let output =
        std::process::Command::new("rustc").args(["--print", "target-list"]).output().expect("rustc");
    let known = String::from_utf8(output.stdout).expect("text");
    let mut seen = 0;
    for file in ["zephyr/Kconfig", "esp-idf/drift/CMakeLists.txt", "cmake/arduino.cmake"] {
        for word in package(file).split(['"', ':', ' ', '\n']) {
            if word.contains("-none-e") {
                seen += 1;
                assert!(known.lines().any(|target| target == word), "{file}: {word}");
            }
        }
    }
    assert!(seen > 20, "{seen}");
}
