//! What is wrong with a scene file, and where.
//!
//! A mistake is told with its place in the text, what was found, what was expected and, where one
//! is near, the name that was probably meant. All mistakes of one run are told together.

use annotate_snippets::{AnnotationKind, Group, Level, Renderer, Snippet};
use std::fmt;
use std::ops::Range;
use std::sync::Arc;

/// How bad it is.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash)]
pub enum Severity {
    /// The scene cannot be rendered.
    Error,
    /// The scene can be rendered, but probably not as meant.
    Warning,
}

/// A text to which diagnostics point: a file, or a setting from the command line.
#[derive(Debug, PartialEq, Eq)]
pub struct SourceText {
    /// The name of the file as the user knows it.
    pub name: String,
    /// All of its text.
    pub text: String,
}

/// A range of bytes in a text.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Place {
    /// The text.
    pub source: Arc<SourceText>,
    /// Bytes of [`SourceText::text`].
    pub span: Range<usize>,
}

impl Place {
    /// Line and column of the start, both from 1; the column counts characters.
    pub fn line_and_column(&self) -> (usize, usize) {
        let before = self.source.text.get(..self.span.start).unwrap_or(&self.source.text);
        let line_start = before.rfind('\n').map_or(0, |newline| newline + 1);
        let line = before.bytes().filter(|&byte| byte == b'\n').count() + 1;
        (line, before[line_start..].chars().count() + 1)
    }
}

/// One mistake.
#[derive(Clone, Debug, PartialEq)]
pub struct Diagnostic {
    /// How bad it is.
    pub severity: Severity,
    /// The kind of mistake, `scene::unknown-field` for instance; stable across versions.
    pub code: &'static str,
    /// What is wrong, in one line.
    pub message: String,
    /// Where; `None` when no text could be read.
    pub place: Option<Place>,
    /// The path of the value in the scene, such as `entities.ball.shape.Sphere.radius`.
    pub label: String,
    /// Other places which belong to it, each with its explanation.
    pub related: Vec<(Place, String)>,
    /// What to do about it.
    pub help: Option<String>,
}

/// The mistakes of a scene, in the order in which they were found.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Diagnostics(pub Vec<Diagnostic>);

/// So many are shown by [`Diagnostics::render`]; the rest is counted.
const SHOWN: usize = 50;

impl Diagnostics {
    /// Whether any of them is an error.
    pub fn has_errors(&self) -> bool {
        self.0.iter().any(|diagnostic| diagnostic.severity == Severity::Error)
    }

    /// Excerpts of the files with the mistakes marked; `styled` adds colours for a terminal.
    pub fn render(&self, styled: bool) -> String {
        let renderer = if styled { Renderer::styled() } else { Renderer::plain() };
        let mut text = String::new();
        for (index, diagnostic) in self.0.iter().take(SHOWN).enumerate() {
            if index > 0 {
                text.push('\n');
            }
            text.push_str(&renderer.render(&[diagnostic.group()]));
            text.push('\n');
        }
        if self.0.len() > SHOWN {
            let more = self.0.len() - SHOWN;
            text.push_str(&["\n… and ", &more.to_string(), " more\n"].concat());
        }
        text
    }
}

impl Diagnostic {
    fn group(&self) -> Group<'_> {
        let level = match self.severity {
            Severity::Error => Level::ERROR,
            Severity::Warning => Level::WARNING,
        };
        let mut group = Group::with_title(level.primary_title(self.message.as_str()).id(self.code));
        // Places in the same text share one excerpt.
        let mut related = self.related.iter().peekable();
        if let Some(place) = &self.place {
            let mut snippet = excerpt(place).annotation(
                AnnotationKind::Primary.span(clamped(place)).label(self.label.as_str()),
            );
            while let Some((other, label)) =
                related.next_if(|(other, _)| Arc::ptr_eq(&other.source, &place.source))
            {
                snippet = snippet
                    .annotation(AnnotationKind::Context.span(clamped(other)).label(label.as_str()));
            }
            group = group.element(snippet);
        }
        for (place, label) in related {
            let annotation = AnnotationKind::Context.span(clamped(place)).label(label.as_str());
            group = group.element(excerpt(place).annotation(annotation));
        }
        match &self.help {
            Some(help) => group.element(Level::HELP.message(help.as_str())),
            None => group,
        }
    }
}

fn excerpt(place: &Place) -> Snippet<'_, annotate_snippets::Annotation<'_>> {
    Snippet::source(place.source.text.as_str()).path(place.source.name.as_str())
}

/// The span, moved to whole characters inside the text; long ones end with their first line.
fn clamped(place: &Place) -> Range<usize> {
    let text = place.source.text.as_str();
    let floor = |mut at: usize| {
        at = at.min(text.len());
        while !text.is_char_boundary(at) {
            at -= 1;
        }
        at
    };
    let start = floor(place.span.start);
    let end = floor(place.span.end.max(start));
    let first_line = text[start..end].find('\n').map_or(end, |newline| start + newline);
    start..first_line
}

impl fmt::Display for Diagnostic {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        if let Some(place) = &self.place {
            let (line, column) = place.line_and_column();
            write!(f, "{}:{line}:{column}: ", place.source.name)?;
        }
        f.write_str(&self.message)
    }
}

impl fmt::Display for Diagnostics {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        for (index, diagnostic) in self.0.iter().enumerate() {
            if index > 0 {
                f.write_str("\n")?;
            }
            diagnostic.fmt(f)?;
        }
        Ok(())
    }
}

impl std::error::Error for Diagnostic {}
impl std::error::Error for Diagnostics {}

/// Finds the names which were probably meant, as long as that takes no time worth naming.
///
/// A distance takes as many steps as the product of the lengths, and each wrong name is held against all right ones:
/// thousands of long names would take minutes. When all steps are spent, mistakes are told without a hint.
#[derive(Clone, Debug)]
pub(super) struct Hints {
    steps_left: usize,
}

impl Default for Hints {
    /// Sixty wrong names of 13 letters among two thousand right ones; a fifth of a second.
    fn default() -> Self {
        Self { steps_left: 20_000_000 }
    }
}

impl Hints {
    /// The candidate which was probably meant by `found`, if one is near.
    ///
    /// Near means a Damerau–Levenshtein distance (letters added, left out, changed or swapped; case
    /// ignored) of at most a third of the longer word's length.
    pub(super) fn nearest<'a>(
        &mut self,
        found: &str,
        candidates: impl IntoIterator<Item = &'a str>,
    ) -> Option<&'a str> {
        let lower = found.to_lowercase();
        let length = lower.chars().count();
        let mut best: Option<(usize, &str)> = None;
        for candidate in candidates {
            let other = candidate.chars().count();
            let allowed = length.max(other).div_ceil(3);
            // Every letter that one has more is a difference.
            let steps = if length.abs_diff(other) > allowed { 1 } else { 1 + length * other };
            let Some(left) = self.steps_left.checked_sub(steps) else {
                self.steps_left = 0;
                return None;
            };
            self.steps_left = left;
            if steps == 1 {
                continue;
            }
            let distance = strsim::damerau_levenshtein(&lower, &candidate.to_lowercase());
            if distance <= allowed && best.is_none_or(|(least, _)| distance < least) {
                best = Some((distance, candidate));
            }
        }
        best.map(|(_, candidate)| candidate)
    }

    /// "did you mean …?", else the list of what there is, else nothing.
    pub(super) fn suggestion<'a>(
        &mut self,
        found: &str,
        candidates: impl IntoIterator<Item = &'a str> + Clone,
        what: &str,
    ) -> Option<String> {
        if let Some(name) = self.nearest(found, candidates.clone()) {
            return Some(format!("did you mean `{name}`?"));
        }
        if self.steps_left == 0 {
            return None;
        }
        let mut names: Vec<String> =
            candidates.into_iter().take(21).map(|name| format!("`{name}`")).collect();
        if names.len() > 20 {
            "…".clone_into(&mut names[20]);
        }
        (!names.is_empty()).then(|| format!("{what}: {}", names.join(", ")))
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_nearest_name_is_found_and_far_ones_are_not() {
        let names = ["radius", "height", "capped"];
        let nearest = |found| Hints::default().nearest(found, names);
        assert_eq!(nearest("raduis"), Some("radius"));
        assert_eq!(nearest("Height"), Some("height"));
        assert_eq!(nearest("albedo"), None);
        assert_eq!(nearest(&"radius".repeat(100_000)), None);
    }

    /// Two thousand wrong names among two thousand right ones: the first are told what was meant, then the steps are spent.
    #[test]
    fn hints_end_before_they_take_long() {
        let names: Vec<String> = (0..2000).map(|k| format!("material{k:04}")).collect();
        let mut hints = Hints::default();
        let mut told = 0;
        for name in &names {
            let hint = hints.suggestion(
                &format!("{name}x"),
                names.iter().map(String::as_str),
                "materials",
            );
            told += usize::from(hint == Some(format!("did you mean `{name}`?")));
        }
        assert!((50..200).contains(&told), "{told}");
        assert_eq!(hints.suggestion("sky", ["sky"], "lights"), None, "all steps are spent");
    }

    #[test]
    fn columns_count_characters_and_not_bytes() {
        let source = Arc::new(SourceText { name: "a".into(), text: "ä\nöü x".into() });
        let span = source.text.find('x').expect("it is there");
        assert_eq!(Place { source, span: span..span + 1 }.line_and_column(), (2, 4));
    }
}
