//! The cost tables in the book are what `examples/firmware/measure` printed when it wrote `figures.json` (`--json`), which CI holds
//! against a fresh measurement: row by row, and the table of goals with what was missed in bold.

use std::path::PathBuf;

use serde_json::Value;

fn read(path: &str) -> String {
    let path = PathBuf::from(env!("CARGO_MANIFEST_DIR")).join("..").join(path);
    std::fs::read_to_string(&path).unwrap_or_else(|e| panic!("{}: {e}", path.display()))
}

fn figures() -> Vec<Value> {
    let json: Value = serde_json::from_str(&read("examples/firmware/figures.json")).expect("JSON");
    json.as_array().expect("rows").clone()
}

fn text(row: &Value, key: &str) -> String {
    let value = row.get(key).unwrap_or_else(|| panic!("no {key} in {row}"));
    value.as_str().map_or_else(|| value.to_string(), str::to_owned)
}

fn mean(row: &Value, key: &str) -> String {
    format!("{:.1}", row[key].as_f64().expect("a number"))
}

#[test]
fn the_book_s_cost_table_is_the_measured_one() {
    let book = read("docs/firmware.md");
    let rows = figures();
    assert!(rows.len() >= 30, "{}", rows.len());
    for row in &rows {
        let cells = [
            text(row, "target"),
            text(row, "config"),
            mean(row, "tick_mean"),
            format!("{}-{}", text(row, "tick_usual_min"), text(row, "tick_usual_max")),
            text(row, "tick_max"),
            mean(row, "pi_tick"),
            text(row, "text_bytes"),
            text(row, "text_routines"),
            text(row, "ram_bytes"),
            text(row, "stack_bytes"),
            text(row, "panic_symbols"),
        ];
        let line = format!("| {} |", cells.join(" | "));
        assert!(book.contains(&line), "docs/firmware.md lacks this row of measure's table:\n{line}");
        let worst = row["tick_worst"].as_object().expect("stretches");
        let all = ["healthy", "disturbance", "drift", "gaps", "limits", "steps", "manual"]
            .map(|s| worst[s].to_string());
        let line = format!("| {} | {} | {} |", cells[0], cells[1], all.join(" | "));
        assert!(book.contains(&line), "docs/firmware.md lacks this row of the worst ticks:\n{line}");
    }
}

/// What was asked of a row: text, worst tick, mean tick, RAM.
type Goal = (&'static str, &'static str, [f64; 4]);

#[test]
fn the_book_s_goals_say_what_was_reached() {
    const GOALS: [Goal; 4] = [
        ("thumbv7em-none-eabihf", "smallest: pair f32, CUSUM, known baseline", [1950.0, 400.0, 22.0, 112.0]),
        ("thumbv7em-none-eabihf", "pair f32, CUSUM, curve, 16 blocks", [2600.0, 750.0, 24.0, 224.0]),
        (
            "thumbv7em-none-eabihf",
            "all f32, 3 channels, 4 detectors, 8 blocks",
            [6144.0, 2600.0, 75.0, 768.0],
        ),
        ("thumbv6m-none-eabi", "pair i32, CUSUM, curve, 8 blocks", [4096.0, 9000.0, 96.0, 232.0]),
    ];
    let (book, rows) = (read("docs/firmware.md"), figures());
    for (target, config, asked) in GOALS {
        let row =
            rows.iter().find(|r| r["target"] == target && r["config"] == config).expect("a measured row");
        let cell = |(key, asked): (&str, f64)| {
            let reached = row[key].as_f64().expect("a number");
            let shown = if key == "tick_mean" { format!("{reached:.1}") } else { format!("{reached}") };
            if reached > asked { format!("**{shown}**") } else { shown }
        };
        let keys = ["text_bytes", "tick_max", "tick_mean", "ram_bytes"];
        let reached: Vec<String> = keys.into_iter().zip(asked).map(cell).collect();
        let asked: Vec<String> = asked.iter().map(f64::to_string).collect();
        let line = format!("| {} | {} |", asked.join(", "), reached.join(", "));
        assert!(book.contains(&line), "docs/firmware.md lacks the goal:\n{line}");
    }
}
