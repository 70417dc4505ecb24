//! What decides the pixels of a frame, in 128 bits.
//!
//! A frame on disk may be kept when everything that decides its pixels is the same as now: the bytes of
//! all scene files, what the command line changed in them, the settings, the clock, the camera and the
//! version of the software. Exposure and tone curve are left out: they belong to the PNG, which is
//! developed from the EXR and says itself how. XXH3-128 over a canonical text of these; there is no adversary, so no
//! cryptography.

use super::SOFTWARE;
use crate::description::SceneDescription;
use serde::{Deserialize, Deserializer, Serialize, Serializer, de};
use std::fmt;
use std::str::FromStr;
use xxhash_rust::xxh3::xxh3_128;

/// The fingerprint of one frame, written as 32 hexadecimal digits.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash)]
pub struct Fingerprint(pub u128);

/// The fingerprint of a whole run: everything but the number of the frame.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct JobFingerprint(String);

impl JobFingerprint {
    /// Describes a scene as it is going to be rendered, with every setting applied.
    ///
    /// The range of frames does not count: frame 7 is the same in every range, unless a mesh is divided for all
    /// views of the sequence.
    pub fn new(scene: &SceneDescription) -> Self {
        let facts = serde_json::json!({
            "software": SOFTWARE,
            "content": format!("{:032x}", scene.content_hash),
            "render": scene.render.without_development(),
            "fps": scene.clock.fps,
            "shutter": scene.clock.shutter,
            "camera": scene.camera,
            "views": scene.displacements.values().any(|d| d.adaptive).then_some(scene.clock.frames),
        });
        Self(facts.to_string())
    }

    /// The fingerprint of one frame of the run.
    pub fn of_frame(&self, frame: i32) -> Fingerprint {
        Fingerprint(xxh3_128(format!("{} frame {frame}", self.0).as_bytes()))
    }
}

impl fmt::Display for Fingerprint {
    fn fmt(&self, f: &mut fmt::Formatter) -> fmt::Result {
        write!(f, "{:032x}", self.0)
    }
}

impl FromStr for Fingerprint {
    type Err = std::num::ParseIntError;
    fn from_str(text: &str) -> Result<Self, Self::Err> {
        u128::from_str_radix(text, 16).map(Self)
    }
}

impl Serialize for Fingerprint {
    fn serialize<S: Serializer>(&self, serializer: S) -> Result<S::Ok, S::Error> {
        serializer.collect_str(self)
    }
}

impl<'de> Deserialize<'de> for Fingerprint {
    fn deserialize<D: Deserializer<'de>>(deserializer: D) -> Result<Self, D::Error> {
        let text = String::deserialize(deserializer)?;
        text.parse().map_err(de::Error::custom)
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::description::{Displacement, Relief, ToneMap};

    fn of(change: impl FnOnce(&mut SceneDescription)) -> Fingerprint {
        let mut scene = SceneDescription { camera: "eye".into(), ..Default::default() };
        change(&mut scene);
        JobFingerprint::new(&scene).of_frame(3)
    }

    #[test]
    fn everything_that_decides_the_pixels_changes_the_fingerprint() {
        let plain = of(|_| ());
        let changed = [
            of(|s| s.content_hash = 1),
            of(|s| s.render.samples += 1),
            of(|s| s.render.seed = 1),
            of(|s| s.render.exr_bits = 16),
            of(|s| s.clock.fps = 25.0),
            of(|s| s.clock.shutter = (0.0, 0.25)),
            of(|s| s.camera = "other".into()),
        ];
        for (i, fingerprint) in changed.iter().enumerate() {
            assert_ne!(*fingerprint, plain, "change {i}");
            assert!(!changed[..i].contains(fingerprint), "change {i}");
        }
    }

    #[test]
    fn what_belongs_to_the_png_alone_does_not_count() {
        assert_eq!(of(|s| s.render.tonemap = ToneMap::Agx), of(|_| ()));
        assert_eq!(of(|s| s.render.exposure = -1.5), of(|_| ()));
    }

    #[test]
    fn the_range_of_frames_does_not_count_but_the_frame_does() {
        assert_eq!(of(|s| s.clock.frames = (2, 9)), of(|_| ()));
        let with = |frames| {
            of(|s| {
                let (texture, says) = (String::new(), Relief::Height);
                let diced =
                    Displacement { texture, says, strength: 1.0, middle: 0.0, adaptive: true };
                s.displacements.insert("hill".to_owned(), diced);
                s.clock.frames = frames;
            })
        };
        assert_ne!(with((2, 9)), with((0, 9)), "what is diced for all views");
        let job = JobFingerprint::new(&SceneDescription::default());
        assert_ne!(job.of_frame(1), job.of_frame(2));
    }

    #[test]
    fn text_and_fingerprint_are_inverse() {
        let fingerprint = Fingerprint(0x00ab);
        assert_eq!(fingerprint.to_string().len(), 32);
        assert_eq!(fingerprint.to_string().parse(), Ok(fingerprint));
        assert!("xyz".parse::<Fingerprint>().is_err());
    }
}
