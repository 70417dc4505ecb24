//! Numbers for people.

use std::time::Duration;

/// `950`, `12.3 k`, `4.56 M`, `1.20 G`: three digits and a decimal prefix.
pub fn count(value: f64) -> String {
    scaled(value, &["", " k", " M", " G", " T", " P"], 1000.0)
}

/// `512 B`, `1.50 MB`: bytes in decimal units.
pub fn bytes(value: u64) -> String {
    scaled(value as f64, &[" B", " kB", " MB", " GB", " TB", " PB"], 1000.0)
}

fn scaled(value: f64, units: &[&str], base: f64) -> String {
    // The thresholds round up: 999.6 would print as 1000.
    let exponent = (0..units.len() - 1).find(|&i| value / base.powi(i as i32) < 999.5);
    let exponent = exponent.unwrap_or(units.len() - 1);
    let digits = value / base.powi(exponent as i32);
    let decimals = match digits {
        _ if exponent == 0 && value.fract() == 0.0 => 0,
        d if d < 9.995 => 2,
        d if d < 99.95 => 1,
        _ => 0,
    };
    format!("{digits:.decimals$}{}", units[exponent])
}

/// `0.42 s`, `12.3 s`, `4 min 05 s`, `2 h 07 min`.
pub fn duration(duration: Duration) -> String {
    let seconds = duration.as_secs_f64();
    match seconds {
        s if s < 9.995 => format!("{s:.2} s"),
        s if s < 59.95 => format!("{s:.1} s"),
        s if s < 3599.5 => {
            let whole = s.round() as u64;
            format!("{} min {:02} s", whole / 60, whole % 60)
        }
        s => {
            let minutes = (s / 60.0).round() as u64;
            format!("{} h {:02} min", minutes / 60, minutes % 60)
        }
    }
}

/// A text of one line as a terminal may show it.
///
/// Names can hold what moves its cursor, changes its colours or turns the order of letters. Such characters are shown by
/// their pictures (U+2400 and following) or by U+FFFD, as in diagnostics.
pub fn harmless(text: &str) -> String {
    let shown = |letter: char| match letter {
        '\0'..='\x1f' => char::from_u32(0x2400 + u32::from(letter)).unwrap_or('\u{fffd}'),
        '\x7f' => '\u{2421}',
        '\u{80}'..='\u{9f}'
        | '\u{200b}'..='\u{200f}'
        | '\u{2028}'..='\u{202e}'
        | '\u{2060}'..='\u{206f}'
        | '\u{feff}' => '\u{fffd}',
        other => other,
    };
    text.chars().map(shown).collect()
}

/// [`harmless`] of a text of several lines.
pub fn harmless_lines(text: &str) -> String {
    text.split('\n').map(harmless).collect::<Vec<_>>().join("\n")
}

/// `1 frame`, `2 frames`.
pub fn plural(number: usize, noun: &str) -> String {
    if number == 1 { format!("1 {noun}") } else { format!("{number} {noun}s") }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn counts_have_three_digits_and_a_prefix() {
        let cases = [
            (0.0, "0"),
            (999.0, "999"),
            (1000.0, "1.00 k"),
            (12_345.0, "12.3 k"),
            (999_600.0, "1.00 M"),
            (4.5e9, "4.50 G"),
            (2.5, "2.50"),
        ];
        for (value, text) in cases {
            assert_eq!(count(value), text);
        }
        assert_eq!(bytes(1_500_000), "1.50 MB");
        assert_eq!(bytes(12), "12 B");
    }

    #[test]
    fn what_a_terminal_would_obey_is_shown_and_not_done() {
        let hostile = "ball\u{1b}[2J\r\n\u{9b}31m\u{202e}x";
        assert_eq!(harmless(hostile), "ball␛[2J␍␊\u{fffd}31m\u{fffd}x");
        assert_eq!(harmless_lines("a\u{7}\nö камера 木"), "a␇\nö камера 木");
    }

    #[test]
    fn durations_suit_their_length() {
        let text = |seconds| duration(Duration::from_secs_f64(seconds));
        assert_eq!(text(0.416), "0.42 s");
        assert_eq!(text(59.96), "1 min 00 s");
        assert_eq!(text(245.0), "4 min 05 s");
        assert_eq!(text(3599.9), "1 h 00 min");
        assert_eq!(text(7630.0), "2 h 07 min");
    }
}
