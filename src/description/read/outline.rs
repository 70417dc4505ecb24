//! The outline of a RON text: which value stands where.
//!
//! `ron` turns text into types but forgets the places, and stops at the first mistake. The outline
//! keeps nothing but places: every value with its name, its entries and their spans. Pieces of the
//! text are then decoded alone, so that one mistake does not hide another, and a number which
//! turns out to be wrong long after decoding can still be pointed at. What a word *means* is
//! left to `ron`; the outline only knows brackets, commas, colons, strings and comments.

use std::ops::Range;

/// Greatest depth of nested brackets. Deeper than any scene, and safe for recursion.
pub(super) const MAX_DEPTH: usize = 64;

/// Greatest length of a name in bytes: every path of a value in it repeats the name.
pub(super) const MAX_NAME: usize = 1024;

/// Bytes of a text; half the size of a `Range<usize>`, for there is one per number.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Hash)]
pub(super) struct Span {
    pub(super) start: u32,
    pub(super) end: u32,
}

impl Span {
    pub(super) fn new(start: usize, end: usize) -> Self {
        Self { start: start as u32, end: end as u32 }
    }

    pub(super) fn range(self) -> Range<usize> {
        self.start as usize..self.end as usize
    }

    pub(super) fn is_empty(self) -> bool {
        self.start >= self.end
    }
}

/// What a value looks like.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum Kind {
    /// A number, an identifier, a character.
    Word,
    /// A string.
    Text,
    /// `(…)`, with or without a name before it: a struct, a tuple, a variant.
    Tuple,
    /// `[…]`.
    List,
    /// `{…}`.
    Map,
}

/// A value and where it stands.
#[derive(Clone, Debug)]
pub(super) struct Node {
    pub(super) kind: Kind,
    /// All of it, name and brackets included.
    pub(super) span: Span,
    /// The name before a `(`; empty if there is none.
    pub(super) name: Span,
    pub(super) entries: Vec<Entry>,
}

/// A value inside brackets.
#[derive(Clone, Debug)]
pub(super) struct Entry {
    /// The field's name, or the key of a map; empty if there is none.
    pub(super) key: Span,
    pub(super) value: Node,
}

/// A mistake in brackets, commas, strings or comments.
#[derive(Clone, Debug, PartialEq)]
pub(super) struct SyntaxError {
    pub(super) message: String,
    pub(super) span: Range<usize>,
    /// The bracket which it is about.
    pub(super) opened: Option<Range<usize>>,
}

/// Reads the outline of a text which holds one value.
pub(super) fn parse(text: &str) -> Result<Node, SyntaxError> {
    let mut parser = Parser { text, at: 0 };
    let node = parser.value(0)?;
    parser.skip_blank()?;
    if parser.at < text.len() {
        return Err(parser.here("expected nothing more after the end of the value"));
    }
    Ok(node)
}

/// The string which a key stands for: quotes and escapes resolved.
pub(super) fn unquoted(text: &str) -> String {
    if text.starts_with(['"', 'r']) && text.contains('"') {
        ron::from_str(text).unwrap_or_else(|_| text.trim_matches('"').to_owned())
    } else {
        text.to_owned()
    }
}

fn check_name(name: Span) -> Result<(), SyntaxError> {
    let length = name.range().len();
    if length <= MAX_NAME {
        return Ok(());
    }
    let message = format!("a name has at most {MAX_NAME} bytes, but this one has {length}");
    Err(SyntaxError { message, span: name.range(), opened: None })
}

struct Parser<'a> {
    text: &'a str,
    at: usize,
}

impl<'a> Parser<'a> {
    fn rest(&self) -> &'a str {
        &self.text[self.at..]
    }

    fn peek(&self) -> Option<char> {
        self.rest().chars().next()
    }

    fn here(&self, message: impl Into<String>) -> SyntaxError {
        let length = self.peek().map_or(0, char::len_utf8);
        SyntaxError { message: message.into(), span: self.at..self.at + length, opened: None }
    }

    /// Skips white space and comments, which nest.
    fn skip_blank(&mut self) -> Result<(), SyntaxError> {
        loop {
            let rest = self.rest();
            let trimmed = rest.trim_start_matches(|c: char| c.is_whitespace() || c == '\u{feff}');
            self.at += rest.len() - trimmed.len();
            if trimmed.starts_with("//") {
                self.at += trimmed.find('\n').unwrap_or(trimmed.len());
            } else if trimmed.starts_with("/*") {
                self.skip_block_comment()?;
            } else {
                return Ok(());
            }
        }
    }

    fn skip_block_comment(&mut self) -> Result<(), SyntaxError> {
        let start = self.at;
        let mut depth = 0_usize;
        loop {
            let rest = self.rest();
            if rest.starts_with("/*") {
                depth += 1;
                self.at += 2;
            } else if rest.starts_with("*/") {
                depth -= 1;
                self.at += 2;
                if depth == 0 {
                    return Ok(());
                }
            } else if let Some(c) = rest.chars().next() {
                self.at += c.len_utf8();
            } else {
                let message = "this comment is never closed".to_owned();
                return Err(SyntaxError { message, span: start..start + 2, opened: None });
            }
        }
    }

    fn value(&mut self, depth: usize) -> Result<Node, SyntaxError> {
        self.skip_blank()?;
        let start = self.at;
        match self.peek() {
            None => Err(self.here("expected a value, found the end of the text")),
            Some('"') => self.string(start, 0),
            Some('\'') => self.character(),
            Some('(' | '[' | '{') => self.group(start, Span::default(), depth),
            Some(_) => self.word(depth),
        }
    }

    fn node(&self, kind: Kind, start: usize) -> Node {
        let span = Span::new(start, self.at);
        Node { kind, span, name: Span::default(), entries: Vec::new() }
    }

    /// A string from its first quote; a raw one ends with a quote and as many `#`.
    fn string(&mut self, start: usize, hashes: usize) -> Result<Node, SyntaxError> {
        let raw = self.at > start;
        self.at += 1;
        let end = format!("\"{}", "#".repeat(hashes));
        loop {
            let rest = self.rest();
            if rest.starts_with(&end) {
                self.at += end.len();
                return Ok(self.node(Kind::Text, start));
            }
            match rest.chars().next() {
                Some('\\') if !raw => {
                    self.at += 1;
                    self.at += self.peek().map_or(0, char::len_utf8);
                }
                Some(c) => self.at += c.len_utf8(),
                None => {
                    let message = "this string is never closed".to_owned();
                    return Err(SyntaxError { message, span: start..start + 1, opened: None });
                }
            }
        }
    }

    fn character(&mut self) -> Result<Node, SyntaxError> {
        let start = self.at;
        self.at += 1;
        let escaped = self.peek() == Some('\\');
        for _ in 0..=usize::from(escaped) {
            self.at += self.peek().map_or(0, char::len_utf8);
        }
        if self.peek() != Some('\'') {
            self.at = start;
            return Err(self.here("expected a value; strings stand in double quotes `\"`"));
        }
        self.at += 1;
        Ok(self.node(Kind::Word, start))
    }

    fn word(&mut self, depth: usize) -> Result<Node, SyntaxError> {
        let start = self.at;
        let is_part = |c: char| c.is_alphanumeric() || "_+-.".contains(c);
        let rest = self.rest();
        let length = rest.find(|c| !is_part(c)).unwrap_or(rest.len());
        self.at += length;
        let after = self.rest();
        if matches!(&self.text[start..self.at], "r" | "b" | "br") {
            let hashes = after.len() - after.trim_start_matches('#').len();
            if after[hashes..].starts_with('"') {
                self.at += hashes;
                return self.string(start, hashes);
            }
        }
        if length == 0 {
            let message = match self.peek() {
                Some(closing @ (')' | ']' | '}')) => {
                    format!("expected a value, found `{closing}`")
                }
                Some('#') => "expected a value, found `#`: all extensions of RON that \
                    scenes need are on already"
                    .to_owned(),
                Some(other) => format!("expected a value, found `{other}`"),
                None => "expected a value, found the end of the text".to_owned(),
            };
            return Err(self.here(message));
        }
        let word = self.node(Kind::Word, start);
        let is_name = self.text[start..].starts_with(|c: char| c.is_alphabetic() || c == '_');
        let end = self.at;
        self.skip_blank()?;
        if is_name && self.peek() == Some('(') {
            check_name(word.span)?;
            return self.group(start, word.span, depth);
        }
        self.at = end;
        Ok(word)
    }

    /// Brackets and what is in them; `start` is where the name before them begins.
    fn group(&mut self, start: usize, name: Span, depth: usize) -> Result<Node, SyntaxError> {
        let opened = self.at..self.at + 1;
        if depth >= MAX_DEPTH {
            let message = format!("brackets are nested deeper than {MAX_DEPTH} levels");
            return Err(SyntaxError { message, span: opened, opened: None });
        }
        let (kind, close) = match self.peek() {
            Some('(') => (Kind::Tuple, ')'),
            Some('[') => (Kind::List, ']'),
            _ => (Kind::Map, '}'),
        };
        self.at += 1;
        let mut entries = Vec::new();
        loop {
            self.skip_blank()?;
            match self.peek() {
                Some(c) if c == close => break,
                None => return Err(self.unclosed(opened, close)),
                Some(c @ (')' | ']' | '}')) => {
                    let message = format!("expected `{close}`, found `{c}`");
                    return Err(SyntaxError { opened: Some(opened), ..self.here(message) });
                }
                Some(_) => entries.push(self.entry(kind, &opened, close, depth)?),
            }
            self.skip_blank()?;
            match self.peek() {
                Some(',') => self.at += 1,
                Some(')' | ']' | '}') => {}
                None => return Err(self.unclosed(opened, close)),
                Some(c) => {
                    return Err(self.here(format!("expected `,` or `{close}`, found `{c}`")));
                }
            }
        }
        self.at += 1;
        entries.shrink_to_fit();
        Ok(Node { name, entries, ..self.node(kind, start) })
    }

    fn entry(
        &mut self,
        kind: Kind,
        opened: &Range<usize>,
        close: char,
        depth: usize,
    ) -> Result<Entry, SyntaxError> {
        let value = self.value(depth + 1)?;
        if kind == Kind::List || (kind == Kind::Tuple && value.kind != Kind::Word) {
            return Ok(Entry { key: Span::default(), value });
        }
        let end = self.at;
        self.skip_blank()?;
        if self.peek() == Some(':') {
            self.at += 1;
            self.skip_blank()?;
            if self.peek().is_none() {
                return Err(self.unclosed(opened.clone(), close));
            }
            check_name(value.span)?;
            return Ok(Entry { key: value.span, value: self.value(depth + 1)? });
        }
        if kind == Kind::Map {
            return Err(match self.peek() {
                None => self.unclosed(opened.clone(), close),
                Some(c) => self.here(format!("expected `:` after the key, found `{c}`")),
            });
        }
        self.at = end;
        Ok(Entry { key: Span::default(), value })
    }

    fn unclosed(&self, opened: Range<usize>, close: char) -> SyntaxError {
        let open = &self.text[opened.clone()];
        let message = format!("this `{open}` is never closed by a `{close}`");
        SyntaxError { message, span: opened, opened: None }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn outline(text: &str) -> String {
        fn show(node: &Node, text: &str, out: &mut String) {
            out.push_str(&text[node.name.range()]);
            if node.entries.is_empty() && matches!(node.kind, Kind::Word | Kind::Text) {
                out.push_str(&text[node.span.range()]);
                return;
            }
            out.push('<');
            for entry in &node.entries {
                out.push_str(&text[entry.key.range()]);
                out.push('=');
                show(&entry.value, text, out);
                out.push(' ');
            }
            out.push('>');
        }
        let node = parse(text).expect("it is valid");
        let mut out = String::new();
        show(&node, text, &mut out);
        out
    }

    #[test]
    fn brackets_names_keys_strings_and_comments_are_told_apart() {
        let text = r##"Scene( // a "comment" (
            a: 1.5e-3, /* nested /* ( */ */ b: [1, -2,], "c": x,
            m: {"k\"(": Sphere(radius: 1), r#"q")"#: ()}, t: (Some(1), 'c', '\''), ext: "ü",)"##;
        // A key in quotes inside parentheses is not a field name.
        assert!(parse(text).is_err());
        assert_eq!(
            outline(&text.replace("\"c\": x,", "")),
            r##"Scene<a=1.5e-3 b=<=1 =-2 > m=<"k\"("=Sphere<radius=1 > r#"q")"#=<> > t=<=Some<=1 > ='c' ='\'' > ext="ü" >"##
        );
    }

    #[test]
    fn unbalanced_brackets_point_at_where_they_opened() {
        let error = parse("(a: [1, 2)").expect_err("the list is not closed");
        assert_eq!((error.span, error.opened), (9..10, Some(4..5)));
        let error = parse("(a: (b: 1").expect_err("it ends early");
        assert_eq!(
            (error.message.as_str(), error.span),
            ("this `(` is never closed by a `)`", 4..5)
        );
    }

    #[test]
    fn names_end_somewhere() {
        let long = "x".repeat(MAX_NAME);
        assert!(parse(&format!("({long}: {long}(1))")).is_ok());
        for text in [format!("(x{long}: 1)"), format!("x{long}(1)"), format!("{{\"{long}\": 1}}")] {
            let error = parse(&text).expect_err("the name is too long");
            assert!(error.message.contains("at most 1024 bytes"), "{}", error.message);
        }
    }

    #[test]
    fn deep_nesting_is_an_error_and_not_an_overflow() {
        let deep = "(".repeat(1_000_000);
        assert!(parse(&deep).expect_err("too deep").message.contains("deeper than 64"));
        let fits = format!("{}{}", "[".repeat(MAX_DEPTH), "]".repeat(MAX_DEPTH));
        assert!(parse(&fits).is_ok());
    }
}
