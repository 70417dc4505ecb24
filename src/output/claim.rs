//! One job at a time in a folder.
//!
//! Two jobs in one folder would write over each other's pictures and records. A run therefore holds a lock on a file in
//! its output folder, and the file names the job. The lock is shared: runs of the same job, each with other frames, work
//! side by side. Who finds the lock free is alone, has it to itself while it names its job and prepares the folder,
//! and shares it from then on. The system takes the lock back when a process ends, however it ends, so that a dead one
//! keeps nobody out; the last one to leave removes the file.
//!
//! Between the lock for one and the shared one there is a moment without any, in which another job may come first: what
//! the file says under the shared lock is what holds, for only who is alone may write it.

use super::{Fingerprint, OutputError};
use std::fs::{self, File, OpenOptions, TryLockError};
use std::io::{self, Read, Seek, Write};
use std::path::{Path, PathBuf};

/// The file with the lock.
const LOCK_NAME: &str = ".kinora.lock";

/// What the file says when it has been removed from the folder: who opened it before has to open the new one.
const REMOVED: &str = "removed";

/// A share in an output folder, until it is dropped.
#[derive(Debug)]
pub(super) struct FolderClaim {
    /// `None` on a file system without locks, where nobody is kept out.
    file: Option<File>,
    path: PathBuf,
    job: String,
}

impl FolderClaim {
    /// Claims a folder for a job, which `by` names for people. If nobody else is at work there, `prepare` is called
    /// before anybody else comes in.
    ///
    /// # Errors
    /// When another job is at work in the folder, when the lock's file cannot be written, or when `prepare` fails.
    pub(super) fn new(
        folder: &Path,
        job: Fingerprint,
        by: &str,
        mut prepare: impl FnMut() -> Result<(), OutputError>,
    ) -> Result<Self, OutputError> {
        let mut claim = Self { file: None, path: folder.join(LOCK_NAME), job: job.to_string() };
        let failed = |source| OutputError::Write { path: folder.join(LOCK_NAME), source };
        loop {
            let mut file = open(&claim.path).map_err(failed)?;
            match file.try_lock() {
                Ok(()) if read(&mut file).map_err(failed)? == REMOVED => continue,
                Ok(()) => {
                    file.set_len(0).map_err(failed)?; // what a dead process has left
                    if let Err(error) = prepare() {
                        remove(&claim.path, &mut file);
                        return Err(error);
                    }
                    write(&mut file, &format!("{job}\n{by}")).map_err(failed)?;
                    file.unlock().map_err(failed)?;
                }
                Err(TryLockError::WouldBlock) => {}
                Err(TryLockError::Error(_)) => {
                    prepare()?;
                    return Ok(claim);
                }
            }
            file.lock_shared().map_err(failed)?;
            let holder = read(&mut file).map_err(failed)?;
            match holder.split_once('\n') {
                Some((of, _)) if of == claim.job => {
                    claim.file = Some(file);
                    return Ok(claim);
                }
                Some((_, by)) => {
                    return Err(OutputError::InUse {
                        folder: folder.to_owned(),
                        by: by.to_owned(),
                    });
                }
                None => {} // its last holder has removed it, or the next one has failed to prepare
            }
        }
    }

    /// Gives the share back. If nobody else is at work in the folder, `tidy` is called before anybody comes in.
    pub(super) fn leave(&mut self, tidy: impl FnOnce()) {
        let Some(mut file) = self.file.take() else { return tidy() };
        // A job that came in the moment between has tidied up by itself, or will.
        let alone = file.unlock().is_ok() && file.try_lock().is_ok();
        if alone && read(&mut file).is_ok_and(|holder| holder.starts_with(&self.job)) {
            tidy();
            remove(&self.path, &mut file);
        }
    }
}

/// Removes the file, as who has the lock to itself may. Where that fails, the file keeps nobody out.
fn remove(path: &Path, file: &mut File) {
    if write(file, REMOVED).is_ok() {
        let _ = fs::remove_file(path);
    }
}

fn open(path: &Path) -> io::Result<File> {
    OpenOptions::new().read(true).write(true).create(true).truncate(false).open(path)
}

fn read(file: &mut File) -> io::Result<String> {
    let mut bytes = Vec::new();
    file.rewind()?;
    file.read_to_end(&mut bytes)?;
    Ok(String::from_utf8_lossy(&bytes).into_owned())
}

fn write(file: &mut File, text: &str) -> io::Result<()> {
    file.set_len(0)?;
    file.rewind()?;
    file.write_all(text.as_bytes())
}

#[cfg(test)]
mod tests {
    use super::*;
    use std::cell::Cell;

    const A: Fingerprint = Fingerprint(1);
    const B: Fingerprint = Fingerprint(2);

    fn claim(folder: &Path, job: Fingerprint) -> Result<FolderClaim, OutputError> {
        FolderClaim::new(folder, job, &format!("job {job}"), || Ok(()))
    }

    /// Whether the lock's file is there.
    fn locked(folder: &Path) -> bool {
        folder.join(LOCK_NAME).exists()
    }

    #[test]
    fn a_folder_takes_one_job_at_a_time_and_any_number_of_its_runs() {
        let folder = tempfile::tempdir().expect("temporary folder");
        let mut first = claim(folder.path(), A).expect("nobody is there");
        let mut second = claim(folder.path(), A).expect("the same job");
        for _ in 0..2 {
            let error = claim(folder.path(), B).expect_err("another job").to_string();
            assert!(error.contains(&format!("job {A}")) && error.contains("--out"), "{error}");
        }
        let tidied = Cell::new(0);
        first.leave(|| tidied.set(1));
        assert_eq!(tidied.get(), 0, "the second is still at work");
        claim(folder.path(), B).expect_err("the second is still at work");
        second.leave(|| tidied.set(2));
        assert_eq!(tidied.get(), 2);
        assert!(!locked(folder.path()));
        claim(folder.path(), B).expect("nobody is there any more").leave(|| ());
    }

    #[test]
    fn the_first_alone_prepares_and_what_a_dead_process_left_keeps_nobody_out() {
        let folder = tempfile::tempdir().expect("temporary folder");
        fs::write(folder.path().join(LOCK_NAME), format!("{B}\nprocess 1")).expect("writable");
        let prepared = Cell::new(0);
        let enter = |job| {
            let count = || {
                prepared.set(prepared.get() + 1);
                Ok(())
            };
            FolderClaim::new(folder.path(), job, "me", count)
        };
        let mut first = enter(A).expect("the other is dead");
        let mut second = enter(A).expect("the same job");
        assert_eq!(prepared.get(), 1);
        first.leave(|| ());
        second.leave(|| ());
    }

    #[test]
    fn a_preparation_that_fails_leaves_the_folder_free() {
        let folder = tempfile::tempdir().expect("temporary folder");
        let fail = || {
            Err(OutputError::NotWritable { folder: "x".into(), source: io::Error::other("full") })
        };
        FolderClaim::new(folder.path(), A, "me", fail).expect_err("as it was told");
        assert!(!locked(folder.path()));
        claim(folder.path(), B).expect("nobody is there").leave(|| ());
    }

    /// Runs of two jobs come and go by threads; a lock belongs to the opened file, as if they were processes.
    #[test]
    fn however_they_come_and_go_two_jobs_are_never_in_at_once() {
        use std::sync::atomic::{AtomicI64, Ordering::SeqCst};
        let folder = tempfile::tempdir().expect("temporary folder");
        // Runs of A count up, runs of B down; entered is how often anybody was in.
        let (inside, entered) = (AtomicI64::new(0), AtomicI64::new(0));
        let run = |job: Fingerprint, step: i64| {
            for _ in 0..200 {
                let Ok(mut claim) = claim(folder.path(), job) else { continue };
                let before = inside.fetch_add(step, SeqCst);
                assert!(before * step >= 0, "the other job is in");
                std::thread::yield_now();
                inside.fetch_sub(step, SeqCst);
                entered.fetch_add(1, SeqCst);
                claim.leave(|| ());
            }
        };
        std::thread::scope(|threads| {
            for (job, step) in [(A, 1), (B, -1), (A, 1), (B, -1)] {
                threads.spawn(move || run(job, step));
            }
        });
        assert!(entered.load(SeqCst) > 200, "{entered:?}");
        claim(folder.path(), A).expect("all have left").leave(|| ());
        assert!(!locked(folder.path()));
    }
}
