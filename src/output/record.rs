//! A record that grows by an entry at a time, in time and memory that do not grow with it.
//!
//! It is one JSON object, whole after every entry: a new one goes between the last one and the end of the file, in place,
//! at one stroke. A reader that comes in the midst of the stroke, a process killed there, or a machine that loses its
//! power then may find the last entry torn; whoever writes the record anew keeps all before it.

use super::atomic::{folder_of, replace_atomically};
use super::{JobFingerprint, OutputError};
use serde::Serialize;
use serde::de::{DeserializeSeed, Deserializer, Error, IgnoredAny, MapAccess, SeqAccess, Visitor};
use serde_json::Value;
use std::collections::BTreeMap;
use std::fmt;
use std::fs::{File, OpenOptions};
use std::io::{self, BufReader, BufWriter, Read, Seek, SeekFrom, Write};
use std::ops::Range;
use std::path::PathBuf;

/// Where in a file the entry of each frame stands.
pub(super) type Places = BTreeMap<i32, Range<u64>>;

/// A record on disk.
#[derive(Debug)]
pub(super) struct Record {
    path: PathBuf,
    /// What stands at the top, as JSON.
    run: String,
    job: JobFingerprint,
}

/// What stands before the first entry and after the last.
const HEAD: &str = ",\n  \"frames\": [";
const TAIL: &str = "\n  ]\n}\n";

impl Record {
    /// The record at `path` with `run` at its top, of a job which says which of its entries hold.
    pub(super) fn new(
        path: PathBuf,
        run: &impl Serialize,
        job: &JobFingerprint,
    ) -> Result<Self, OutputError> {
        let run = serde_json::to_string_pretty(run);
        let run = run.map_err(|source| OutputError::Json { source })?;
        Ok(Self { path, run, job: job.clone() })
    }

    /// Writes the record anew, with those of its entries that hold: of each frame the last one, in order. They are in
    /// memory one at a time.
    pub(super) fn renew(&self) -> Result<Places, OutputError> {
        let (mut kept, found) = self.entries_that_hold().map_err(|source| self.failed(source))?;
        let run = self.run.strip_suffix("\n}").expect("an object over several lines");
        let mut places = Places::new();
        replace_atomically(&self.path, |file| {
            let mut file = BufWriter::new(file);
            write!(file, "{run}{HEAD}")?;
            let mut end = (run.len() + HEAD.len()) as u64;
            let mut text = Vec::new();
            for (frame, place) in found {
                let before = before_entry(places.is_empty());
                text.resize((place.end - place.start) as usize, 0);
                kept.seek(SeekFrom::Start(place.start))?;
                kept.read_exact(&mut text)?;
                file.write_all(before.as_bytes())?;
                file.write_all(&text)?;
                let start = end + before.len() as u64;
                end = start + text.len() as u64;
                places.insert(frame, start..end);
            }
            file.write_all(TAIL.as_bytes())?;
            file.flush()
        })?;
        Ok(places)
    }

    /// The entries that hold, one after another in a file without a name.
    fn entries_that_hold(&self) -> io::Result<(File, Places)> {
        let mut kept = BufWriter::new(tempfile::tempfile_in(folder_of(&self.path))?);
        let (mut places, mut end) = (Places::new(), 0);
        let mut keep = |entry: Value| {
            let Some(frame) = self.holds(&entry) else { return Ok(()) };
            let text = entry.to_string();
            kept.write_all(text.as_bytes())?;
            let start = end;
            end += text.len() as u64;
            places.insert(frame, start..end);
            Ok(())
        };
        if let Ok(file) = File::open(&self.path) {
            for_each_entry(BufReader::new(file), &mut keep)?;
        }
        Ok((kept.into_inner()?, places))
    }

    /// The frame of an entry that tells of the picture which this job would make.
    fn holds(&self, entry: &Value) -> Option<i32> {
        let frame = i32::try_from(entry.get("frame")?.as_i64()?).ok()?;
        let fingerprint = entry.get("fingerprint")?.as_str()?;
        (fingerprint == self.job.of_frame(frame).to_string()).then_some(frame)
    }

    /// Puts an entry behind the last one, in place. Answers with false, and has done nothing, where the file does not end
    /// as a record does.
    pub(super) fn append(&self, entry: &[u8]) -> Result<bool, OutputError> {
        let opened = OpenOptions::new().read(true).write(true).open(&self.path);
        if opened.as_ref().is_err_and(|error| error.kind() == io::ErrorKind::NotFound) {
            return Ok(false);
        }
        opened.and_then(|mut file| append(&mut file, entry)).map_err(|source| self.failed(source))
    }

    /// Puts spaces in the place of a frame's entry that is not the last one, and of the comma behind it. Where something
    /// else stands there, since somebody has changed the file, the entry stays until the record is written anew.
    pub(super) fn blank(&self, frame: i32, place: Range<u64>) -> Result<(), OutputError> {
        let blank = |mut file: File| {
            let mut text = Vec::new();
            file.seek(SeekFrom::Start(place.start))?;
            (&file).take(place.end - place.start + 1).read_to_end(&mut text)?;
            let entry =
                text.strip_suffix(b",").and_then(|entry| serde_json::from_slice(entry).ok());
            if entry.and_then(|entry: Value| self.holds(&entry)) == Some(frame) {
                text.fill(b' ');
                file.seek(SeekFrom::Start(place.start))?;
                file.write_all(&text)?;
            }
            Ok(())
        };
        let opened = OpenOptions::new().read(true).write(true).open(&self.path);
        opened.and_then(blank).map_err(|source| self.failed(source))
    }

    fn failed(&self, source: io::Error) -> OutputError {
        OutputError::Write { path: self.path.clone(), source }
    }
}

fn append(file: &mut File, entry: &[u8]) -> io::Result<bool> {
    let _ = file.lock(); // against other runs of this job; without locks they take their chance
    let end = file.seek(SeekFrom::End(0))?;
    let Some(last) = end.checked_sub(TAIL.len() as u64 + 1) else { return Ok(false) };
    let mut found = [0; TAIL.len() + 1];
    file.seek(SeekFrom::Start(last))?;
    file.read_exact(&mut found)?;
    if found[1..] != *TAIL.as_bytes() {
        return Ok(false);
    }
    let space = before_entry(found[0] == b'[');
    file.seek(SeekFrom::Start(last + 1))?;
    let text = [space.as_bytes(), entry, TAIL.as_bytes()].concat();
    let written = file.write_all(&text).and_then(|()| file.sync_data());
    if written.is_err() {
        // There was room for the old end, so there is now.
        file.set_len(last + 1)?;
        file.seek(SeekFrom::End(0))?;
        file.write_all(TAIL.as_bytes())?;
    }
    written.map(|()| true)
}

/// What stands between an entry and the one before it, or the beginning of the list.
fn before_entry(is_first: bool) -> &'static str {
    if is_first { "\n    " } else { ",\n    " }
}

pub(super) fn to_json(value: &impl Serialize) -> Result<Vec<u8>, OutputError> {
    serde_json::to_vec(value).map_err(|source| OutputError::Json { source })
}

/// Hands the entries of a record to `keep` one by one, up to its end or to where it breaks off.
fn for_each_entry(
    record: impl Read,
    keep: &mut dyn FnMut(Value) -> io::Result<()>,
) -> io::Result<()> {
    let mut failed = None;
    let mut keep = |entry| keep(entry).map_err(|error| failed = Some(error)).is_ok();
    // What breaks off is no failure of this run.
    let _ = serde_json::Deserializer::from_reader(record).deserialize_map(Entries(&mut keep));
    failed.map_or(Ok(()), Err)
}

/// Visits the object at the top of a record, and then the list of frames in it; false ends it.
struct Entries<'a>(&'a mut dyn FnMut(Value) -> bool);

impl<'de> Visitor<'de> for Entries<'_> {
    type Value = ();

    fn expecting(&self, f: &mut fmt::Formatter) -> fmt::Result {
        f.write_str("the record of a run")
    }

    fn visit_map<A: MapAccess<'de>>(self, mut map: A) -> Result<(), A::Error> {
        while let Some(key) = map.next_key::<String>()? {
            if key == "frames" {
                map.next_value_seed(Entries(&mut *self.0))?;
            } else {
                map.next_value::<IgnoredAny>()?;
            }
        }
        Ok(())
    }

    fn visit_seq<A: SeqAccess<'de>>(self, mut entries: A) -> Result<(), A::Error> {
        while let Some(entry) = entries.next_element()? {
            if !(self.0)(entry) {
                return Err(A::Error::custom("not kept"));
            }
        }
        Ok(())
    }
}

impl<'de> DeserializeSeed<'de> for Entries<'_> {
    type Value = ();

    fn deserialize<D: Deserializer<'de>>(self, frames: D) -> Result<(), D::Error> {
        frames.deserialize_any(self)
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::description::SceneDescription;
    use serde_json::json;
    use std::fs;
    use std::path::Path;

    fn record(folder: &Path) -> (Record, impl Fn(i32) -> Value) {
        let job = JobFingerprint::new(&SceneDescription::default());
        let run = json!({ "threads": 2, "objects": { "1": "ball" } });
        let record = Record::new(folder.join("r.json"), &run, &job).expect("is JSON");
        (
            record,
            move |frame| json!({ "frame": frame, "fingerprint": job.of_frame(frame), "x": [0.1, "}\n]"] }),
        )
    }

    fn read(record: &Record) -> (Vec<u8>, Value) {
        let bytes = fs::read(&record.path).expect("was written");
        let value = serde_json::from_slice(&bytes).expect("is JSON");
        (bytes, value)
    }

    #[test]
    fn an_entry_leaves_all_before_it_untouched() {
        let folder = tempfile::tempdir().expect("temporary folder");
        let (record, entry) = record(folder.path());
        record.renew().expect("writable");
        let (mut before, mut entries) = (read(&record).0, Vec::new());
        for frame in 0..20 {
            entries.push(entry(frame));
            assert!(record.append(&to_json(&entry(frame)).expect("is JSON")).expect("writable"));
            let (bytes, value) = read(&record);
            let length = before.len() - TAIL.len();
            assert!(bytes[..length] == before[..length]);
            assert_eq!(
                value,
                json!({ "threads": 2, "objects": { "1": "ball" }, "frames": entries })
            );
            before = bytes;
        }
        record.renew().expect("writable");
        assert!(read(&record).0 == before, "what is in order stays as it is");
    }

    #[test]
    fn places_are_those_of_the_entries_and_a_blank_takes_one_out() {
        let folder = tempfile::tempdir().expect("temporary folder");
        let (record, entry) = record(folder.path());
        record.renew().expect("writable");
        for frame in [5, -1, 9] {
            record.append(&to_json(&entry(frame)).expect("is JSON")).expect("writable");
        }
        let places = record.renew().expect("writable");
        let bytes = read(&record).0;
        for frame in [-1, 5, 9] {
            let place = places[&frame].start as usize..places[&frame].end as usize;
            assert_eq!(serde_json::from_slice::<Value>(&bytes[place]).expect("JSON"), entry(frame));
        }
        record.blank(-1, places[&-1].clone()).expect("writable");
        record.blank(5, places[&5].clone()).expect("writable");
        for elsewhere in [places[&-1].clone(), 3..40, 1 << 40..(1 << 40) + 5] {
            record.blank(5, elsewhere).expect("nothing is written");
        }
        assert_eq!(read(&record).1["frames"], json!([entry(9)]));
        assert_eq!(read(&record).0.len(), bytes.len());
    }

    /// Of an earlier version, or rewritten by another program.
    #[test]
    fn entries_over_several_lines_are_read() {
        let folder = tempfile::tempdir().expect("temporary folder");
        let (record, entry) = record(folder.path());
        let stranger = json!({ "frame": 3, "fingerprint": "0" });
        let old = json!({ "frames": [entry(8), stranger, 5, entry(1), entry(8)], "more": [1] });
        fs::write(&record.path, serde_json::to_string_pretty(&old).expect("JSON"))
            .expect("writable");
        assert!(!record.append(b"{}").expect("readable"), "its end is another");
        assert_eq!(record.renew().expect("writable").len(), 2);
        assert_eq!(read(&record).1["frames"], json!([entry(1), entry(8)]));
        fs::remove_file(&record.path).expect("was written");
        assert!(!record.append(b"{}").expect("not there"));
    }

    /// Wherever a kill or a loss of power cuts the file.
    #[test]
    fn a_record_cut_at_any_byte_keeps_its_whole_entries() {
        let folder = tempfile::tempdir().expect("temporary folder");
        let (record, entry) = record(folder.path());
        record.renew().expect("writable");
        for frame in 0..3 {
            record.append(&to_json(&entry(frame)).expect("is JSON")).expect("writable");
        }
        let places = record.renew().expect("writable");
        let whole = read(&record).0;
        for length in 0..whole.len() {
            fs::write(&record.path, &whole[..length]).expect("writable");
            let (_, found) = record.entries_that_hold().expect("writable");
            let expected = places.values().filter(|place| place.end as usize <= length).count();
            assert_eq!(found.len(), expected, "cut at {length}");
        }
    }
}
