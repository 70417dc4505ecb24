//! Files that exist whole or not at all.

use super::OutputError;
use std::io::Write;
use std::path::Path;
use tempfile::{Builder, NamedTempFile};

/// Writes a file so that a crash, a full disk or an interrupt never leaves half of it: into a temporary
/// file in the same folder, flushed to the disk, then renamed over the target in one step.
///
/// # Errors
/// When the folder or the disk refuses; the target is then what it was before.
pub fn write_atomically(path: &Path, bytes: &[u8]) -> Result<(), OutputError> {
    let failed = |source| OutputError::Write { path: path.to_owned(), source };
    let mut file = temporary_beside(path).map_err(failed)?;
    // On the plain file: tempfile's own `Write` adds the temporary name to every message.
    file.as_file_mut().write_all(bytes).map_err(failed)?;
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

/// A file that vanishes when it is dropped, with the permissions of an ordinary new file (tempfile's own
/// default would let nobody else read the pictures).
fn temporary_beside(path: &Path) -> std::io::Result<NamedTempFile> {
    let mut builder = Builder::new();
    builder.prefix(".kinora-").suffix(".tmp");
    #[cfg(unix)]
    {
        use std::os::unix::fs::PermissionsExt;
        builder.permissions(std::fs::Permissions::from_mode(0o666)); // reduced by the umask
    }
    let folder = path.parent().filter(|parent| !parent.as_os_str().is_empty());
    builder.tempfile_in(folder.unwrap_or(Path::new(".")))
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
