//! A scene file as it is read: its text with the settings of the command line put in, its
//! outline, and the way back from both to what the user wrote.

use super::outline::{self, Kind, Node, Span, SyntaxError};
use crate::description::diagnostic::{Place, SourceText};
use std::ops::Range;
use std::path::PathBuf;
use std::sync::Arc;

/// A file, ready to be decoded.
#[derive(Debug)]
pub(super) struct Source {
    /// What the user wrote.
    pub(super) file: Arc<SourceText>,
    /// The folder in which names of files are looked for first.
    pub(super) dir: Option<PathBuf>,
    /// What is decoded: the file with settings put in.
    pub(super) text: String,
    /// The outline of `text`.
    pub(super) root: Node,
    /// Where each part of `text` comes from, in order and without gaps.
    pieces: Vec<Piece>,
}

/// A part of a text and its origin.
#[derive(Clone, Debug)]
pub(super) struct Piece {
    pub(super) text: String,
    pub(super) source: Arc<SourceText>,
    pub(super) origin: Range<usize>,
}

impl Source {
    pub(super) fn new(file: Arc<SourceText>, dir: Option<PathBuf>) -> Result<Self, SyntaxError> {
        let text = file.text.clone();
        let root = outline::parse(&text)?;
        let origin = 0..text.len();
        let pieces = vec![Piece { text: text.clone(), source: file.clone(), origin }];
        Ok(Self { file, dir, text, root, pieces })
    }

    /// The whole value.
    pub(super) fn cursor(&self) -> Cursor<'_> {
        Cursor { source: self, key: Span::default(), node: &self.root, path: String::new() }
    }

    /// The text without clock and settings of the render, which tell for themselves what they change.
    pub(super) fn without_settings(&self) -> String {
        let (mut rest, mut start) = (String::new(), 0);
        for entry in &self.root.entries {
            let key = entry.key.range();
            if matches!(&self.text[key.clone()], "clock" | "render") {
                rest.push_str(&self.text[start..key.start]);
                start = entry.value.span.range().end;
            }
        }
        rest + &self.text[start..]
    }

    /// Where the user wrote what stands at `span` of `text`.
    pub(super) fn place(&self, span: Range<usize>) -> Place {
        let start = self.origin(span.start, false);
        let end = self.origin(span.end, true);
        let end_at = if Arc::ptr_eq(&start.0, &end.0) { end.1.max(start.1) } else { start.2 };
        Place { source: start.0, span: start.1..end_at }
    }

    /// The origin of a byte: its text, its place there, and the end of its piece. The end of a
    /// span belongs to the piece before it.
    fn origin(&self, at: usize, is_end: bool) -> (Arc<SourceText>, usize, usize) {
        let mut start = 0;
        for piece in &self.pieces {
            let length = piece.text.len();
            let inside = at - start;
            if inside < length || (is_end && inside == length) {
                // Text of the same length is verbatim; glue such as `, ` stands for all of it.
                let verbatim = piece.origin.len() == length;
                let place = match (verbatim, is_end) {
                    (true, _) => piece.origin.start + inside,
                    (false, true) => piece.origin.end,
                    (false, false) => piece.origin.start,
                };
                return (piece.source.clone(), place, piece.origin.end);
            }
            start += length;
        }
        let end = self.file.text.len();
        (self.file.clone(), end, end)
    }

    /// Replaces a range of the text, and outlines it anew.
    pub(super) fn replace(
        &mut self,
        range: Range<usize>,
        with: Vec<Piece>,
    ) -> Result<(), SyntaxError> {
        let mut pieces = Vec::new();
        let mut with = Some(with);
        let mut start = 0;
        for piece in std::mem::take(&mut self.pieces) {
            let end = start + piece.text.len();
            let keep_before = range.start.clamp(start, end) - start;
            let keep_after = range.end.clamp(start, end) - start;
            if keep_before > 0 {
                pieces.push(piece.part(0..keep_before));
            }
            if range.start < end {
                pieces.extend(with.take().into_iter().flatten());
            }
            if keep_after < piece.text.len() && end > range.end {
                pieces.push(piece.part(keep_after..piece.text.len()));
            }
            start = end;
        }
        pieces.extend(with.take().into_iter().flatten());
        self.pieces = pieces;
        self.text = self.pieces.iter().map(|piece| piece.text.as_str()).collect();
        self.root = outline::parse(&self.text)?;
        Ok(())
    }
}

impl Piece {
    fn part(&self, range: Range<usize>) -> Self {
        let origin = if self.origin.len() == self.text.len() {
            self.origin.start + range.start..self.origin.start + range.end
        } else {
            self.origin.clone()
        };
        Self { text: self.text[range].to_owned(), source: self.source.clone(), origin }
    }
}

/// A value of a scene file: where it stands and what it is called.
#[derive(Clone, Debug)]
pub(super) struct Cursor<'a> {
    pub(super) source: &'a Source,
    /// The field's name or the key of the map, as written; empty for an element of a list.
    pub(super) key: Span,
    pub(super) node: &'a Node,
    /// The names on the way from the root, joined by dots.
    pub(super) path: String,
}

impl<'a> Cursor<'a> {
    /// The value's text.
    pub(super) fn text(&self) -> &'a str {
        &self.source.text[self.node.span.range()]
    }

    /// The name before the parenthesis; empty if there is none.
    pub(super) fn name(&self) -> &'a str {
        &self.source.text[self.node.name.range()]
    }

    /// The key without quotes.
    pub(super) fn key(&self) -> String {
        outline::unquoted(&self.source.text[self.key.range()])
    }

    /// Where the value stands.
    pub(super) fn place(&self) -> Place {
        self.source.place(self.node.span.range())
    }

    /// Where the key stands, or the value if it has none.
    pub(super) fn key_place(&self) -> Place {
        let span = if self.key.is_empty() { self.node.span } else { self.key };
        self.source.place(span.range())
    }

    /// The entries in order. The name of a variant becomes part of the path.
    pub(super) fn entries(&self) -> impl Iterator<Item = Cursor<'a>> + use<'a> {
        let this = self.clone();
        (0..self.node.entries.len()).filter_map(move |index| this.index(index))
    }

    /// The entry at this index.
    pub(super) fn index(&self, index: usize) -> Option<Cursor<'a>> {
        let entry = self.node.entries.get(index)?;
        let mut entry = Cursor {
            source: self.source,
            key: entry.key,
            node: &entry.value,
            path: self.path.clone(),
        };
        let mut step = |name: &str| {
            if !entry.path.is_empty() && !name.is_empty() {
                entry.path.push('.');
            }
            // Paths are shown; a name may hold what a terminal would obey.
            let shown = |letter: char| if letter.is_control() { '\u{fffd}' } else { letter };
            entry.path.extend(name.chars().map(shown));
        };
        if !self.path.is_empty() && self.name() != "Some" {
            step(self.name());
        }
        if !entry.key.is_empty() {
            step(&outline::unquoted(&self.source.text[entry.key.range()]));
        } else if self.node.entries.len() > 1 || self.node.kind == Kind::List {
            step(&index.to_string());
        }
        Some(entry)
    }

    /// The entry of this name, looked for through `Some(…)`.
    pub(super) fn field(&self, name: &str) -> Option<Cursor<'a>> {
        if self.name() == "Some" {
            return self.entries().next()?.field(name);
        }
        self.entries().find(|entry| entry.key() == name)
    }

    /// The entry of this name, or this value itself where the field is left out.
    pub(super) fn at(&self, name: &str) -> Cursor<'a> {
        self.field(name).unwrap_or_else(|| self.clone())
    }

    /// The entry at this index, or this value itself where it is not a tuple.
    pub(super) fn nth(&self, index: usize) -> Cursor<'a> {
        self.index(index).unwrap_or_else(|| self.clone())
    }

    /// The deepest value whose entry contains the byte `at` of the text.
    pub(super) fn deepest(&self, at: usize) -> Cursor<'a> {
        let inside = self.entries().find(|entry| {
            let start = if entry.key.is_empty() { entry.node.span.start } else { entry.key.start };
            (start as usize..(entry.node.span.end as usize).max(start as usize + 1)).contains(&at)
        });
        match inside {
            Some(entry) if entry.key.range().contains(&at) => entry,
            Some(entry) => entry.deepest(at),
            None => self.clone(),
        }
    }
}
