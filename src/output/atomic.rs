//! Files that exist whole or not at all.

use super::OutputError;
use std::fs::{self, DirEntry, File};
use std::io::{self, Write};
use std::path::Path;
use tempfile::{Builder, NamedTempFile};

/// Writes a file so that a crash, a full disk or an interrupt never leaves half of it: into a temporary
/// file in the same folder, flushed to the disk, then renamed over the target in one step.
///
/// # Errors
/// When the folder or the disk refuses; the target is then what it was before.
pub fn write_atomically(path: &Path, bytes: &[u8]) -> Result<(), OutputError> {
    replace_atomically(path, |file| file.write_all(bytes))
}

/// As [`write_atomically`], for what is written piece by piece.
pub(super) fn replace_atomically(
    path: &Path,
    write: impl FnOnce(&mut File) -> io::Result<()>,
) -> Result<(), OutputError> {
    let failed = |source| OutputError::Write { path: path.to_owned(), source };
    let mut file = temporary_beside(path).map_err(failed)?;
    // On the plain file: tempfile's own `Write` adds the temporary name to every message.
    write(file.as_file_mut()).map_err(failed)?;
    file.as_file().sync_all().map_err(failed)?;
    file.persist(path).map_err(|error| failed(error.error))?;
    Ok(())
}

/// Makes sure that `folder` exists and takes files.
///
/// # Errors
/// When it can be neither found nor made, or when a trial file in it fails.
pub fn check_writable(folder: &Path) -> Result<(), OutputError> {
    std::fs::create_dir_all(folder)
        .map_err(|source| OutputError::Folder { folder: folder.to_owned(), source })?;
    temporary_beside(&folder.join("trial"))
        .and_then(|mut file| file.write_all(b"trial"))
        .map_err(|source| OutputError::NotWritable { folder: folder.to_owned(), source })
}

/// Removes the temporary files which writers that were killed have left in `folder`; the lock that a living writer has
/// on its file tells them apart.
pub(super) fn remove_abandoned(folder: &Path) {
    let abandoned = |entry: &DirEntry| {
        let name = entry.file_name();
        let ours = name.to_str().is_some_and(|n| n.starts_with(PREFIX) && n.ends_with(SUFFIX));
        // Nothing but a plain file is opened: a pipe would wait for its other end.
        ours && entry.file_type().is_ok_and(|kind| kind.is_file())
    };
    for entry in fs::read_dir(folder_of(&folder.join(PREFIX)))
        .into_iter()
        .flatten()
        .flatten()
        .filter(abandoned)
    {
        let Ok(file) = File::open(entry.path()) else { continue };
        if file.try_lock().is_ok() {
            let _ = fs::remove_file(entry.path()); // another has done it, or nobody may
        }
    }
}

/// The folder of a file, by a name that can be opened.
pub(super) fn folder_of(path: &Path) -> &Path {
    path.parent().filter(|parent| !parent.as_os_str().is_empty()).unwrap_or(Path::new("."))
}

/// What the names of temporary files begin and end with.
const PREFIX: &str = ".kinora-";
const SUFFIX: &str = ".tmp";

/// A file that vanishes when it is dropped, with the permissions of an ordinary new file (tempfile's own
/// default would let nobody else read the pictures), and locked until then.
fn temporary_beside(path: &Path) -> std::io::Result<NamedTempFile> {
    let mut builder = Builder::new();
    builder.prefix(PREFIX).suffix(SUFFIX);
    #[cfg(unix)]
    {
        use std::os::unix::fs::PermissionsExt;
        builder.permissions(std::fs::Permissions::from_mode(0o666)); // reduced by the umask
    }
    loop {
        let file = builder.tempfile_in(folder_of(path))?;
        // Where a file system has no locks, nothing is ever taken for abandoned. Where it has them, another process may
        // have taken the file for that before it was locked.
        if file.as_file().lock().is_err() || file.path().exists() {
            return Ok(file);
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_file_is_replaced_and_nothing_else_remains() {
        let folder = tempfile::tempdir().expect("temporary folder");
        let path = folder.path().join("a.bin");
        write_atomically(&path, b"first").expect("writable");
        write_atomically(&path, b"second").expect("writable");
        assert_eq!(std::fs::read(&path).expect("just written"), b"second");
        assert_eq!(std::fs::read_dir(folder.path()).expect("exists").count(), 1);
    }

    #[test]
    fn a_write_that_fails_leaves_nothing_behind() {
        let folder = tempfile::tempdir().expect("temporary folder");
        let target = folder.path().join("taken");
        std::fs::create_dir(&target).expect("new folder");
        std::fs::write(target.join("x"), b"").expect("new file");
        // A folder in the place of the file lets everything succeed but the last step.
        assert!(matches!(write_atomically(&target, b"data"), Err(OutputError::Write { .. })));
        assert_eq!(std::fs::read_dir(folder.path()).expect("exists").count(), 1);
    }

    /// A lock belongs to the opened file, so that this process is as good as another one.
    #[test]
    fn files_of_the_dead_are_removed_and_those_of_the_living_are_not() {
        let folder = tempfile::tempdir().expect("temporary folder");
        let at = |name: &str| folder.path().join(name);
        let living = temporary_beside(&at("a.exr")).expect("writable");
        for name in [".kinora-x1Y2z3.tmp", ".kinora-kept", "kinora-kept.tmp", "a.exr"] {
            fs::write(at(name), b"half").expect("writable");
        }
        fs::create_dir(at(".kinora-folder.tmp")).expect("writable");
        remove_abandoned(folder.path());
        assert!(!at(".kinora-x1Y2z3.tmp").exists());
        for name in [".kinora-kept", "kinora-kept.tmp", "a.exr", ".kinora-folder.tmp"] {
            assert!(at(name).exists(), "{name}");
        }
        assert!(living.path().exists());
        living.persist(at("b.exr")).expect("still there");
    }

    #[test]
    fn a_folder_below_a_file_is_refused_with_its_path() {
        let folder = tempfile::tempdir().expect("temporary folder");
        let file = folder.path().join("file");
        std::fs::write(&file, b"").expect("new file");
        let error = check_writable(&file.join("out")).expect_err("not a folder");
        assert!(error.to_string().contains("--out"), "{error}");
        check_writable(&folder.path().join("new/deep")).expect("can be made");
    }
}
