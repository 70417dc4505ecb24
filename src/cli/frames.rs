//! Lists of frames as they are typed: `5`, `0-47`, `0-99:3`, `9,10,15-20`.

use std::collections::HashSet;
use std::ops::Range;
use std::str::FromStr;

/// Frames in the order in which they are to be rendered, each once.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct FrameList(Vec<u32>);

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
    pub fn from_range(first: u32, last: u32) -> Result<Self, FrameListError> {
        format!("{first}-{last}").parse()
    }

    pub fn frames(&self) -> &[u32] {
        &self.0
    }
}

impl FromStr for FrameList {
    type Err = FrameListError;

    fn from_str(text: &str) -> Result<Self, Self::Err> {
        let (mut frames, mut seen) = (Vec::new(), HashSet::new());
        for item in text.split(',') {
            let (range, step) = parse_item(item.trim())?;
            // u64, for a range up to the last u32 ends beyond it.
            for frame in range.step_by(step) {
                let frame = frame as u32;
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

fn parse_item(item: &str) -> Result<(Range<u64>, usize), FrameListError> {
    let wrong = || FrameListError::Item(item.to_owned());
    let number = |text: &str| text.trim().parse::<u32>().map_err(|_| wrong());
    let (range, step) = match item.split_once(':') {
        Some((range, step)) => (range, number(step)?),
        None => (item, 1),
    };
    let (first, last) = match range.split_once('-') {
        Some((first, last)) => (number(first)?, number(last)?),
        None if step == 1 && !item.contains(':') => (number(range)?, number(range)?),
        None => return Err(wrong()),
    };
    if first > last {
        return Err(FrameListError::Backwards(item.to_owned()));
    }
    if step == 0 {
        return Err(FrameListError::Step(item.to_owned()));
    }
    Ok((u64::from(first)..u64::from(last) + 1, step as usize))
}

#[cfg(test)]
mod tests {
    use super::*;

    fn frames(text: &str) -> Result<Vec<u32>, FrameListError> {
        text.parse::<FrameList>().map(|list| list.0)
    }

    #[test]
    fn numbers_ranges_steps_and_lists_are_understood() {
        assert_eq!(frames("5"), Ok(vec![5]));
        assert_eq!(frames("2-4"), Ok(vec![2, 3, 4]));
        assert_eq!(frames("7-7"), Ok(vec![7]));
        assert_eq!(frames("0-10:3"), Ok(vec![0, 3, 6, 9]));
        assert_eq!(frames("9, 10,1-3"), Ok(vec![9, 10, 1, 2, 3]));
        assert_eq!(frames("4294967294-4294967295"), Ok(vec![u32::MAX - 1, u32::MAX]));
    }

    #[test]
    fn a_frame_named_twice_is_rendered_once() {
        assert_eq!(frames("3,1-4,3"), Ok(vec![3, 1, 2, 4]));
    }

    #[test]
    fn mistakes_are_named() {
        for wrong in ["", ",", "a", "1-", "-1", "1--2", "5:2", "1-2-3", "1.5", "1,", "4294967296"] {
            assert!(matches!(frames(wrong), Err(FrameListError::Item(_))), "{wrong}");
        }
        assert!(matches!(frames("9-3"), Err(FrameListError::Backwards(_))));
        assert!(matches!(frames("0-9:0"), Err(FrameListError::Step(_))));
        assert_eq!(frames("0-4294967295"), Err(FrameListError::TooMany));
    }
}
