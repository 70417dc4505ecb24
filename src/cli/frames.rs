//! Lists of frames as they are typed: `5`, `0-47`, `0-99:3`, `9,10,15-20`, `-12--1`.

use std::collections::HashSet;
use std::ops::Range;
use std::str::FromStr;

/// Frames in the order in which they are to be rendered, each once.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct FrameList(Vec<i32>);

/// The most frames of one run; beyond it a mistyped digit is likelier than a film of eleven hours.
const LIMIT: usize = 1_000_000;

/// Why a text is not a list of frames.
#[derive(Clone, Debug, PartialEq, Eq, thiserror::Error)]
pub enum FrameListError {
    #[error("`{0}` is not a frame; expected a number, a range 0-47, or a stepped range 0-99:3")]
    Item(String),
    #[error("the range `{0}` runs backwards; write the smaller frame first")]
    Backwards(String),
    #[error("the step of `{0}` must be at least 1")]
    Step(String),
    #[error("more than {LIMIT} frames in one run")]
    TooMany,
}

impl FrameList {
    /// All frames from the first to the last, both included.
    pub fn from_range(first: i32, last: i32) -> Result<Self, FrameListError> {
        format!("{first}-{last}").parse()
    }

    pub fn frames(&self) -> &[i32] {
        &self.0
    }
}

impl FromStr for FrameList {
    type Err = FrameListError;

    fn from_str(text: &str) -> Result<Self, Self::Err> {
        let (mut frames, mut seen) = (Vec::new(), HashSet::new());
        for item in text.split(',') {
            let (range, step) = parse_item(item.trim())?;
            // i64, for a range up to the last i32 ends beyond it.
            for frame in range.step_by(step) {
                let frame = frame as i32;
                if seen.insert(frame) {
                    frames.push(frame);
                }
                if frames.len() > LIMIT {
                    return Err(FrameListError::TooMany);
                }
            }
        }
        Ok(Self(frames))
    }
}

fn parse_item(item: &str) -> Result<(Range<i64>, usize), FrameListError> {
    let wrong = || FrameListError::Item(item.to_owned());
    let (range, step) = match item.split_once(':') {
        Some((range, step)) => (range, Some(step.trim().parse::<u32>().map_err(|_| wrong())?)),
        None => (item, None),
    };
    let number = |text: &str| text.trim().parse::<i32>().map_err(|_| wrong());
    // A minus sign in front belongs to the first number.
    let between = range.char_indices().skip(1).find(|&(_, letter)| letter == '-');
    let (first, last) = match between {
        Some((at, _)) => (number(&range[..at])?, number(&range[at + 1..])?),
        None if step.is_none() => (number(range)?, number(range)?),
        None => return Err(wrong()),
    };
    if first > last {
        return Err(FrameListError::Backwards(item.to_owned()));
    }
    if step == Some(0) {
        return Err(FrameListError::Step(item.to_owned()));
    }
    Ok((i64::from(first)..i64::from(last) + 1, step.unwrap_or(1) as usize))
}

#[cfg(test)]
mod tests {
    use super::*;

    fn frames(text: &str) -> Result<Vec<i32>, FrameListError> {
        text.parse::<FrameList>().map(|list| list.0)
    }

    #[test]
    fn numbers_ranges_steps_and_lists_are_understood() {
        assert_eq!(frames("5"), Ok(vec![5]));
        assert_eq!(frames("2-4"), Ok(vec![2, 3, 4]));
        assert_eq!(frames("7-7"), Ok(vec![7]));
        assert_eq!(frames("0-10:3"), Ok(vec![0, 3, 6, 9]));
        assert_eq!(frames("9, 10,1-3"), Ok(vec![9, 10, 1, 2, 3]));
        assert_eq!(frames("2147483646-2147483647"), Ok(vec![i32::MAX - 1, i32::MAX]));
    }

    #[test]
    fn a_minus_sign_belongs_to_the_number_behind_it() {
        assert_eq!(frames("-5"), Ok(vec![-5]));
        assert_eq!(frames("-2-1"), Ok(vec![-2, -1, 0, 1]));
        assert_eq!(frames("-5--3, -10--4:3"), Ok(vec![-5, -4, -3, -10, -7]));
        assert_eq!(frames("-2147483648"), Ok(vec![i32::MIN]));
        assert!(matches!(frames("-3--5"), Err(FrameListError::Backwards(_))));
    }

    #[test]
    fn a_frame_named_twice_is_rendered_once() {
        assert_eq!(frames("3,1-4,3"), Ok(vec![3, 1, 2, 4]));
    }

    #[test]
    fn mistakes_are_named() {
        for wrong in
            ["", ",", "a", "1-", "-", "--1", "1---2", "5:2", "1-2-3", "1.5", "1,", "2147483648"]
        {
            assert!(matches!(frames(wrong), Err(FrameListError::Item(_))), "{wrong}");
        }
        assert!(matches!(frames("9-3"), Err(FrameListError::Backwards(_))));
        assert!(matches!(frames("0-9:0"), Err(FrameListError::Step(_))));
        assert_eq!(frames("0-2147483647"), Err(FrameListError::TooMany));
    }
}
