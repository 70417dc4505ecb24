//! One table on the terminal, and the same numbers by name in a file.

use serde_json::{Map, Value};
use std::path::Path;

/// A line above the rows of a section.
pub fn section(title: &str) {
    println!("\n{title}");
}

/// All numbers so far.
#[derive(Default)]
pub struct Report(Map<String, Value>);

impl Report {
    /// A row of the table: numbers under `prefix`, each with its own name and unit.
    pub fn row(&mut self, prefix: &str, values: &[(&str, f64, &str)]) {
        print!("  {prefix:34}");
        for &(name, value, unit) in values {
            // Names share a prefix in the file.
            let full = if name.is_empty() { prefix.to_owned() } else { format!("{prefix}.{name}") };
            let digits = if value.abs() < 0.1 { 5 } else { 3 };
            print!("  {name} {value:.digits$}{}{unit}", if unit.is_empty() { "" } else { " " });
            self.0.insert(full, Value::from(value));
        }
        println!();
    }

    /// Writes all numbers as one JSON object.
    pub fn write(&self, path: &Path) -> std::io::Result<()> {
        std::fs::write(path, serde_json::to_string_pretty(&self.0)? + "\n")
    }
}
