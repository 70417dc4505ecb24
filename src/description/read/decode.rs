//! Decoding a piece of a scene file by `ron`, and telling what went wrong.
//!
//! `ron` stops at the first mistake. A struct which cannot be decoded is therefore decoded once
//! more field by field, each alone in parentheses, so that all wrong fields are told.

use super::explain::Probe;
use super::outline::Kind;
use super::source::Cursor;
use super::words;
use crate::description::diagnostic::{Diagnostic, Diagnostics, Hints, Place, Severity};
use ron::error::SpannedError;
use ron::extensions::Extensions;
use serde::de::DeserializeOwned;
use std::collections::HashMap;
use std::ops::Range;
use std::sync::Arc;

/// The mistakes found so far: one for each place, the first one told.
#[derive(Debug, Default)]
pub(super) struct Report {
    pub(super) found: Diagnostics,
    /// Where each place stands in `found`: by the address of its text, and its bytes.
    known: HashMap<(usize, Range<usize>), usize>,
    /// For what was probably meant.
    pub(super) hints: Hints,
}

impl Report {
    /// Adds an error at a place, unless there is one already at the same place.
    pub(super) fn error(
        &mut self,
        code: &'static str,
        place: Place,
        label: &str,
        message: impl Into<String>,
    ) -> &mut Diagnostic {
        // Every text outlives the report, so that an address stays that of one text.
        let key = (Arc::as_ptr(&place.source).addr(), place.span.clone());
        let diagnostic = Diagnostic {
            severity: Severity::Error,
            code,
            message: clipped(message.into()),
            place: Some(place),
            label: label.to_owned(),
            related: Vec::new(),
            help: None,
        };
        let index = *self.known.entry(key).or_insert_with(|| {
            self.found.0.push(diagnostic);
            self.found.0.len() - 1
        });
        &mut self.found.0[index]
    }

    /// Adds an error about a value.
    pub(super) fn at(
        &mut self,
        code: &'static str,
        cursor: &Cursor,
        message: impl Into<String>,
    ) -> &mut Diagnostic {
        self.error(code, cursor.place(), &cursor.path, message)
    }
}

/// A message with no more of a name than a reader can take in.
fn clipped(mut message: String) -> String {
    const MOST: usize = 1000;
    if let Some((end, _)) = message.char_indices().nth(MOST) {
        message.truncate(end);
        message.push('…');
    }
    message
}

fn options() -> ron::Options {
    ron::Options::default()
        .with_default_extension(Extensions::IMPLICIT_SOME)
        .with_recursion_limit(super::outline::MAX_DEPTH)
}

/// Decodes a value; mistakes go to the report.
pub(super) fn decode<T: DeserializeOwned>(cursor: &Cursor, report: &mut Report) -> Option<T> {
    let error = match options().from_str::<T>(cursor.text()) {
        Ok(value) => return Some(value),
        Err(error) => error,
    };
    let probe = Probe { cursor, around: ("", ""), read: &read_again::<T> };
    let fields: Vec<_> = cursor.entries().filter(|entry| !entry.key.is_empty()).collect();
    let mut told = false;
    if cursor.node.kind == Kind::Tuple && fields.len() > 1 {
        for field in &fields {
            if let Err(error) = decode_field::<T>(cursor.name(), field) {
                told |= tell(&error, &probe, report);
            }
        }
    }
    if !told {
        tell(&Misread::new(error, cursor.text(), cursor.node.span.start as usize), &probe, report);
    }
    None
}

/// Decodes a struct all of whose fields have defaults from fields in several places, each of
/// which may be wrong.
pub(super) fn decode_fields<T: DeserializeOwned>(
    fields: &[Cursor],
    report: &mut Report,
) -> Option<T> {
    let mut text = String::from("(");
    for field in fields {
        match decode_field::<T>("", field) {
            Ok(()) => {
                text.push_str(entry_text(field));
                text.push(',');
            }
            Err(error) => {
                let key = &field.source.text[field.key.range()];
                let around = (format!("({key}: "), ")");
                let around = (around.0.as_str(), around.1);
                let probe = Probe { cursor: field, around, read: &read_again::<T> };
                tell(&error, &probe, report);
            }
        }
    }
    text.push(')');
    options().from_str(&text).ok()
}

/// Reads a text for what that says; where it stopped is a byte of the text.
fn read_again<T: DeserializeOwned>(text: &str) -> Result<(), (usize, SpannedError)> {
    options()
        .from_str::<T>(text)
        .map(drop)
        .map_err(|error| (byte_of(text, error.span.start.line, error.span.start.col), error))
}

fn entry_text<'a>(field: &Cursor<'a>) -> &'a str {
    &field.source.text[field.key.start as usize..field.node.span.end as usize]
}

/// Decodes the struct or variant `name` from one of its fields; that others are missing is fine.
fn decode_field<T: DeserializeOwned>(name: &str, field: &Cursor) -> Result<(), Misread> {
    let text = format!("{name}({})", entry_text(field));
    match options().from_str::<T>(&text) {
        Ok(_) => Ok(()),
        Err(error) if matches!(error.code, ron::Error::MissingStructField { .. }) => Ok(()),
        Err(error) => {
            // In the text decoded, `name(` stands before the field.
            let misread = Misread::new(error, &text, 0);
            let shift = |at: usize| field.key.start as usize + at.saturating_sub(name.len() + 1);
            Err(Misread { at: shift(misread.at.start)..shift(misread.at.end), ..misread })
        }
    }
}

/// An error of `ron` with its bytes in the text of the source.
struct Misread {
    code: ron::Error,
    at: Range<usize>,
}

impl Misread {
    fn new(error: SpannedError, text: &str, offset: usize) -> Self {
        let start = byte_of(text, error.span.start.line, error.span.start.col);
        let end = byte_of(text, error.span.end.line, error.span.end.col);
        Self { code: error.code, at: offset + start..offset + end.max(start) }
    }
}

/// The byte at a line and column, both from 1; columns count characters.
fn byte_of(text: &str, line: usize, column: usize) -> usize {
    let before: usize = text.split_inclusive('\n').take(line.saturating_sub(1)).map(str::len).sum();
    let rest = &text[before..];
    let inside = rest.char_indices().nth(column.saturating_sub(1)).map_or(rest.len(), |(at, _)| at);
    before + inside
}

/// The value which an error is about: where reading stopped if a value begins there, else the one
/// that was read last.
fn culprit<'a>(misread: &Misread, cursor: &Cursor<'a>) -> Cursor<'a> {
    let next = cursor.deepest(misread.at.end);
    if next.node.span.start as usize == misread.at.end {
        return next;
    }
    cursor.deepest(misread.at.start)
}

/// Puts an error of `ron` into words. Returns true, for it has been told.
fn tell(misread: &Misread, probe: &Probe, report: &mut Report) -> bool {
    use ron::Error as E;
    let cursor = probe.cursor;
    let last = cursor.deepest(misread.at.start);
    let value = culprit(misread, cursor);
    match &misread.code {
        E::NoSuchStructField { expected, found, outer } if !last.key.is_empty() => {
            let inside = last.path.rsplit('.').nth(1);
            let message = match inside.or(outer.as_deref()) {
                Some(inside) if !inside.is_empty() => format!("`{inside}` has no field `{found}`"),
                _ => format!("there is no field `{found}` here"),
            };
            let help = words::hint(found, expected)
                .or_else(|| report.hints.suggestion(found, expected.iter().copied(), "fields"));
            report.error("scene::unknown-field", last.key_place(), &last.path, message).help = help;
        }
        E::NoSuchEnumVariant { expected, found, .. } => {
            let span = if value.node.name.is_empty() { value.node.span } else { value.node.name };
            let message = format!("there is no `{found}` to choose here");
            let place = value.source.place(span.range());
            let help = words::hint(found, expected)
                .or_else(|| report.hints.suggestion(found, expected.iter().copied(), "possible"));
            report.error("scene::unknown-variant", place, &value.path, message).help = help;
        }
        E::MissingStructField { field, outer } => {
            let whole = enclosing(cursor, misread.at.end);
            let message = match outer.as_deref() {
                Some(outer) if !outer.is_empty() => format!("`{outer}` needs a field `{field}`"),
                _ => format!("the field `{field}` is missing"),
            };
            report.at("scene::missing-field", &whole, message);
        }
        E::DuplicateStructField { field, .. } => {
            let message = format!("the field `{field}` is given twice");
            report.error("scene::duplicate", last.key_place(), &last.path, message);
        }
        E::IntegerOutOfBounds => {
            let message = format!("{} is out of the range of this integer", shown(&value));
            report.at("scene::out-of-range", &value, message);
        }
        code => wrong_type(code, &value, probe, report),
    }
    true
}

/// Tells what was expected in the place of a value.
fn wrong_type(code: &ron::Error, value: &Cursor, probe: &Probe, report: &mut Report) {
    use ron::Error as E;
    let expected = probe.expected(value);
    let message = match (&expected, code) {
        // What a type of ours says itself is more to the point than what fits.
        (_, E::ExpectedDifferentLength { expected, found }) if !expected.contains("sequence") => {
            format!("expected {expected}, found {found} values")
        }
        (_, E::InvalidValueForType { expected, found }) => {
            format!("expected {expected}, found {found}")
        }
        (Some(expected), _) => format!("expected {}, found {}", expected.what, shown(value)),
        (None, E::ExpectedComma | E::ExpectedStructLikeEnd | E::TrailingCharacters) => {
            format!("expected nothing more after this, found {}", shown(value))
        }
        (None, other) => format!("{other}, found {}", shown(value)),
    };
    report.at("scene::wrong-type", value, message).help =
        expected.and_then(|expected| expected.help);
}

/// The innermost value with parentheses around the byte `at`, or ending there.
fn enclosing<'a>(cursor: &Cursor<'a>, at: usize) -> Cursor<'a> {
    let inside = cursor.entries().find(|entry| {
        let span = entry.node.span.range();
        entry.node.kind == Kind::Tuple && span.start <= at && at <= span.end
    });
    inside.map_or_else(|| cursor.clone(), |entry| enclosing(&entry, at))
}

/// The value's text in backquotes, shortened.
fn shown(cursor: &Cursor) -> String {
    let text = cursor.text();
    let line = text.lines().next().unwrap_or_default();
    let short: String = line.chars().take(24).collect();
    if short.len() < text.len() { format!("`{short}…`") } else { format!("`{short}`") }
}
