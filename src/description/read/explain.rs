//! What was expected where a value has the wrong form.
//!
//! `ron` says that it found no parenthesis or no identifier; whoever writes scenes asks what to write instead. The types know:
//! other values are put into the place of the wrong one and read, and what that says tells whether a struct, a choice,
//! a vector or a number is wanted, and how its fields are called.

use super::outline::{Kind, Node, Span};
use super::source::Cursor;
use ron::error::SpannedError;

/// Reads a value again with another in the place of one of its parts.
pub(super) struct Probe<'p, 'a> {
    /// The value that is read.
    pub(super) cursor: &'p Cursor<'a>,
    /// What stands around its text when it is read.
    pub(super) around: (&'p str, &'p str),
    /// What reading a text says, with the byte at which it stopped.
    pub(super) read: &'p dyn Fn(&str) -> Result<(), (usize, SpannedError)>,
}

/// What reading says to another value.
enum Answer {
    Fits,
    /// It is a struct or a variant with these fields.
    Fields(&'static [&'static str]),
    /// It is one of these.
    Variants(&'static [&'static str]),
    No,
}

/// What was expected, and what to write instead.
#[derive(Debug, PartialEq)]
pub(super) struct Expected {
    pub(super) what: String,
    pub(super) help: Option<String>,
}

impl Probe<'_, '_> {
    /// What was expected in the place of a part of the value.
    pub(super) fn expected(&self, value: &Cursor) -> Option<Expected> {
        if let Some(parent) = self.parent(value)
            && let Some(expected) = self.fields(&parent, value)
        {
            return Some(expected);
        }
        self.fields(value, value)
            .or_else(|| self.variants(value))
            .or_else(|| self.numbers(value))
            .or_else(|| self.plain(value))
    }

    /// Where an entry without a name stands in parentheses: those.
    fn parent(&self, value: &Cursor) -> Option<Cursor<'_>> {
        let mut at = self.cursor.clone();
        loop {
            let inside = at.entries().find(|entry| holds(entry.node.span, value.node.span))?;
            if inside.node.span == value.node.span {
                return (inside.key.is_empty() && at.node.kind == Kind::Tuple).then_some(at);
            }
            at = inside;
        }
    }

    fn attempt(&self, value: &Cursor, with: &str) -> Answer {
        let mut text = self.around.0.to_owned();
        let source = &self.cursor.source.text;
        let end = put(source, self.cursor.node, value.node.span, with, &mut text);
        text.push_str(self.around.1);
        match (self.read)(&text) {
            Ok(()) => Answer::Fits,
            Err((at, error)) => match error.code {
                ron::Error::NoSuchStructField { expected, found, .. } if found == NOTHING => {
                    Answer::Fields(expected)
                }
                ron::Error::NoSuchEnumVariant { expected, found, .. } if found == NOTHING => {
                    Answer::Variants(expected)
                }
                ron::Error::MissingStructField { .. } => Answer::Fits,
                _ if at >= end => Answer::Fits,
                _ => Answer::No,
            },
        }
    }

    fn fits(&self, value: &Cursor, with: &str) -> bool {
        matches!(self.attempt(value, with), Answer::Fits)
    }

    /// Where fields with names are wanted; `found` is `value` itself or an entry of it without a name.
    fn fields(&self, value: &Cursor, found: &Cursor) -> Option<Expected> {
        let is_name = value.node.kind == Kind::Word
            && value.text().starts_with(|c: char| c.is_alphabetic() || c == '_');
        let name = if is_name { value.text() } else { value.name() };
        let Answer::Fields(fields) = self.attempt(value, &format!("{name}({NOTHING}: 0)")) else {
            return None;
        };
        if fields.is_empty() {
            let what = if is_name { "parentheses `()` after the name" } else { "nothing inside" };
            let help = Some(format!("write `{name}()`"));
            return Some(Expected { what: what.to_owned(), help });
        }
        let listed: Vec<String> =
            fields.iter().take(3).map(|field| format!("{field}: …")).collect();
        let more = if fields.len() > 3 { ", …" } else { "" };
        let form = format!("{name}({}{more})", listed.join(", "));
        let values: Vec<&str> = match value.node.kind {
            Kind::Word if is_name => Vec::new(),
            Kind::Tuple => value.entries().map(|entry| whole(&entry)).collect(),
            _ => vec![value.text()],
        };
        let help =
            self.with_names(value, name, fields, &values).map(|text| format!("write `{text}`"));
        let is_entry = value.node.span != found.node.span;
        let what = if is_entry {
            format!("a field by its name, as in `{form}`")
        } else {
            format!("`{form}`")
        };
        Some(Expected { what, help })
    }

    /// The values with names of fields, if they fit some: in order, or all as one vector.
    fn with_names(
        &self,
        value: &Cursor,
        name: &str,
        fields: &[&str],
        values: &[&str],
    ) -> Option<String> {
        let named =
            |text: &&str| text.split_once(':').is_some_and(|(key, _)| fields.contains(&key.trim()));
        let (first, list) = (fields[0], values.join(", "));
        let mut tries = vec![];
        if let [number, fraction, rest @ ..] = values
            && let Some((key, whole)) = number.split_once(':').filter(|_| named(number))
            && fraction.bytes().all(|b| b.is_ascii_digit())
        {
            // A comma in a number, as some languages write it.
            let number = format!("{key}: {}.{fraction}", whole.trim());
            let all: Vec<&str> =
                [number.as_str()].into_iter().chain(rest.iter().copied()).collect();
            tries.push(format!("{name}({})", all.join(", ")));
        }
        if values.is_empty() {
            tries.push(format!("{name}()"));
        } else if !values.iter().any(named) {
            let pairs = fields.iter().zip(values).map(|(field, value)| format!("{field}: {value}"));
            let pairs = pairs.collect::<Vec<_>>().join(", ");
            if values.len() <= fields.len() {
                tries.push(format!("{name}({pairs})"));
            }
            tries.push(format!("{name}({first}: ({list}))"));
        }
        tries.into_iter().find(|text| text.len() <= LONGEST && self.fits(value, text))
    }

    /// Where one of several names is wanted.
    fn variants(&self, value: &Cursor) -> Option<Expected> {
        let Answer::Variants(variants) = self.attempt(value, NOTHING) else { return None };
        let listed: Vec<String> =
            variants.iter().take(12).map(|name| format!("`{name}`")).collect();
        let more = if variants.len() > 12 { ", …" } else { "" };
        let what = format!("one of {}{more}", listed.join(", "));
        let unquoted = super::outline::unquoted(value.text());
        let same = variants.iter().find(|name| name.eq_ignore_ascii_case(&unquoted));
        let inside = |name: &&str| format!("{name}({})", value.text());
        let help = match same {
            Some(same) if self.fits(value, same) => Some(format!("write `{same}`, without quotes")),
            Some(same) => Some(format!("write `{same}(…)`, without quotes")),
            None if value.text().len() > LONGEST => None,
            None => {
                let mut tries = variants.iter().map(inside);
                tries.find(|text| self.fits(value, text)).map(|text| format!("write `{text}`"))
            }
        };
        Some(Expected { what, help })
    }

    /// Where a vector is wanted.
    fn numbers(&self, value: &Cursor) -> Option<Expected> {
        let (what, count) = if self.fits(value, "(0.5, 0.5, 0.5)") {
            ("three numbers `(x, y, z)`", 3)
        } else if self.fits(value, "(1, 1)") {
            ("two numbers `(a, b)`", 2)
        } else {
            return None;
        };
        let text = value.text();
        let example = match (value.node.kind, count) {
            (Kind::Word, 3) if text.parse::<f64>().is_ok() => format!("(0, {text}, 0)"),
            (Kind::Word, _) if text.parse::<f64>().is_ok() => format!("({text}, {text})"),
            (Kind::List, count) if value.node.entries.len() == count => {
                format!("({})", text.trim_matches(['[', ']']))
            }
            _ => String::new(),
        };
        let fits = !example.is_empty() && example.len() <= LONGEST && self.fits(value, &example);
        let help = fits.then(|| format!("write all of them, as in `{example}`"));
        Some(Expected { what: what.to_owned(), help })
    }

    /// Where a number, a text, a list or a map is wanted.
    fn plain(&self, value: &Cursor) -> Option<Expected> {
        let kinds = [
            ("0.5", "a number"),
            ("1", "a whole number"),
            ("\"x\"", "a string in double quotes"),
            ("true", "`true` or `false`"),
            ("[]", "a list `[…]`"),
            ("{}", "a map `{…}`"),
        ];
        let (_, what) = kinds.into_iter().find(|(text, _)| self.fits(value, text))?;
        let text = value.text();
        let corrected = match value.node.kind {
            Kind::Text => super::outline::unquoted(text),
            Kind::Word => format!("\"{text}\""),
            _ => String::new(),
        };
        let fits =
            !corrected.is_empty() && corrected.len() <= LONGEST && self.fits(value, &corrected);
        let help = fits.then(|| format!("write `{corrected}`"));
        Some(Expected { what: what.to_owned(), help })
    }
}

/// A name which no field and no variant has.
const NOTHING: &str = "no_such_name_";

/// Longer values are not written out in a hint.
const LONGEST: usize = 80;

fn holds(outer: Span, inner: Span) -> bool {
    outer.start <= inner.start && inner.end <= outer.end
}

/// The text of an entry with its key.
fn whole<'a>(entry: &Cursor<'a>) -> &'a str {
    let start = if entry.key.is_empty() { entry.node.span.start } else { entry.key.start };
    &entry.source.text[start as usize..entry.node.span.end as usize]
}

/// Writes a value with another one in the place of the part `target`; of structs and maps on the way only the field on the
/// way, for others may be wrong as well. Returns where the other value ends.
fn put(source: &str, node: &Node, target: Span, with: &str, text: &mut String) -> usize {
    let entry = node.entries.iter().find(|entry| holds(entry.value.span, target));
    let Some(entry) = entry.filter(|_| node.span != target) else {
        text.push_str(with);
        return text.len();
    };
    let (open, close) = match node.kind {
        Kind::List => ("[", "]"),
        Kind::Map => ("{", "}"),
        _ => ("(", ")"),
    };
    text.push_str(&source[node.name.range()]);
    text.push_str(open);
    let mut end = 0;
    for other in &node.entries {
        if std::ptr::eq(other, entry) {
            if !other.key.is_empty() {
                text.push_str(&source[other.key.range()]);
                text.push_str(": ");
            }
            end = put(source, &other.value, target, with, text);
        } else if entry.key.is_empty() {
            text.push_str(&source[other.value.span.range()]);
        } else {
            continue;
        }
        text.push_str(", ");
    }
    text.push_str(close);
    end
}
