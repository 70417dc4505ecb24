//! Settings from the command line: `entities.ball.velocity.linear=(2, 0, 0)`.
//!
//! A setting is put into the text of the scene before it is decoded, in place of the value there
//! or as a new field, so that every check applies to it as to the file. What is wrong with it
//! is shown in its own text.

use super::decode::Report;
use super::outline::{self, Kind, Node};
use super::source::{Piece, Source};
use crate::description::diagnostic::{Place, SourceText};
use std::ops::Range;
use std::sync::Arc;

/// The parts of a scene which are maps from names.
pub(super) const MAPS: [&str; 5] = ["textures", "materials", "profiles", "meshes", "entities"];
/// All fields of a scene.
pub(super) const FIELDS: [&str; 9] = [
    "include",
    "clock",
    "render",
    "camera",
    "textures",
    "materials",
    "profiles",
    "meshes",
    "entities",
];

/// How far a path leads into the text.
struct Reached {
    /// The value which was reached.
    node: Range<usize>,
    /// How many steps of the path led there.
    steps: usize,
    /// Where a field can be put in, and whether a comma must come before it.
    insert: Option<(usize, bool)>,
    /// The names at the place where the path ended.
    names: Vec<String>,
}

/// Puts one setting into the text of the file to which it belongs; the last source is the root.
pub(super) fn apply(sources: &mut [Source], path: &str, value: &str, report: &mut Report) {
    let text = format!("{path}={value}");
    let file = Arc::new(SourceText { name: "--set".to_owned(), text });
    let steps: Vec<&str> = path.split('.').collect();
    let whole = Place { source: file.clone(), span: 0..path.len() };
    let shift = path.len() + 1;
    // Comments around the value stay out: they could swallow what follows.
    let span = match outline::parse(value) {
        Ok(node) => node.span.start as usize + shift..node.span.end as usize + shift,
        Err(error) => {
            let span = error.span.start + shift..error.span.end + shift;
            let place = Place { source: file, span };
            report.error("scene::syntax", place, path, error.message);
            return;
        }
    };
    if steps[0] == "include" || !FIELDS.contains(&steps[0]) {
        let message = format!("there is no setting `{path}`");
        let fields = FIELDS.iter().copied().filter(|&field| field != "include");
        report.error("scene::unknown-setting", whole, path, message).help =
            report.hints.suggestion(steps[0], fields, "it may begin with");
        return;
    }
    // The file whose text leads furthest; the root file has the last word.
    let reached = sources.iter().map(|source| reach(&source.text, &source.root, &steps));
    let Some((index, reached)) =
        reached.enumerate().max_by_key(|(index, reached)| (reached.steps, *index))
    else {
        return;
    };
    let rest = &steps[reached.steps..];
    let known = !MAPS.contains(&steps[0]) || reached.steps >= 2;
    let edit = match (rest, reached.insert) {
        ([], _) => Some((reached.node.clone(), vec![verbatim(&file, span)])),
        (_, Some((at, comma))) if known => {
            Some((at..at, inserted(&file, &steps, reached.steps, comma, span)))
        }
        _ => None,
    };
    let Some((range, pieces)) = edit else {
        let parent = steps[..reached.steps].join(".");
        let missing = if known { rest[0].to_owned() } else { steps[1..].join(".") };
        let message = if reached.steps == 0 {
            format!("the scene has no `{}` to set", steps[0])
        } else {
            format!("there is no `{missing}` in `{parent}`")
        };
        let guess = rest.first().copied().unwrap_or_default();
        report.error("scene::unknown-setting", whole, path, message).help =
            report.hints.suggestion(guess, reached.names.iter().map(String::as_str), "there is");
        return;
    };
    if let Err(error) = sources[index].replace(range, pieces) {
        report.error("scene::syntax", whole, path, error.message);
    }
}

/// Follows a path into an outline.
fn reach(text: &str, root: &Node, steps: &[&str]) -> Reached {
    let mut node = root;
    let mut done = 0;
    loop {
        // `Some(…)` and a variant around one value stand for what is inside.
        let name = &text[node.name.range()];
        let single = node.kind == Kind::Tuple
            && !name.is_empty()
            && node.entries.len() == 1
            && node.entries[0].key.is_empty();
        let named = done > 0 && !name.is_empty() && steps.get(done) == Some(&name);
        if named && done < steps.len() {
            done += 1;
            if single {
                node = &node.entries[0].value;
            }
            continue;
        }
        if single && name == "Some" {
            node = &node.entries[0].value;
            continue;
        }
        let key = |at: usize| outline::unquoted(&text[node.entries[at].key.range()]);
        let names: Vec<String> =
            (0..node.entries.len()).map(key).filter(|name| !name.is_empty()).collect();
        // Names of a map may hold dots themselves: the longest one that fits is meant.
        let found = (1..=steps.len() - done).rev().find_map(|count| {
            let wanted = steps[done..done + count].join(".");
            let entry = node.entries.iter().enumerate().find_map(|(index, entry)| {
                let fits = if entry.key.is_empty() {
                    wanted == index.to_string()
                } else {
                    wanted == key(index)
                };
                fits.then_some(entry)
            });
            entry.map(|entry| (count, entry))
        });
        if let Some((count, entry)) = found {
            done += count;
            node = &entry.value;
            continue;
        }
        let is_struct =
            node.kind == Kind::Tuple && node.entries.iter().all(|entry| !entry.key.is_empty());
        let insert = is_struct.then(|| match node.entries.last() {
            Some(last) => (last.value.span.end as usize, true),
            None => (node.span.end as usize - 1, false),
        });
        return Reached { node: node.span.range(), steps: done, insert, names };
    }
}

/// A part of the setting's own text.
fn verbatim(file: &Arc<SourceText>, range: Range<usize>) -> Piece {
    Piece { text: file.text[range.clone()].to_owned(), source: file.clone(), origin: range }
}

/// The pieces `, a: (b: value)` for the steps from `done` on.
fn inserted(
    file: &Arc<SourceText>,
    steps: &[&str],
    done: usize,
    comma: bool,
    value: Range<usize>,
) -> Vec<Piece> {
    let equals: usize = steps.iter().map(|step| step.len() + 1).sum::<usize>() - 1;
    let glue =
        |text: &str| Piece { text: text.to_owned(), source: file.clone(), origin: 0..equals };
    let mut pieces = Vec::new();
    let mut start: usize = steps[..done].iter().map(|step| step.len() + 1).sum();
    if comma {
        pieces.push(glue(", "));
    }
    for (index, step) in steps[done..].iter().enumerate() {
        if index > 0 {
            pieces.push(glue("("));
        }
        pieces.push(verbatim(file, start..start + step.len()));
        pieces.push(glue(": "));
        start += step.len() + 1;
    }
    pieces.push(verbatim(file, value));
    pieces.push(glue(&")".repeat(steps.len() - done - 1)));
    pieces.retain(|piece| !piece.text.is_empty());
    pieces
}
