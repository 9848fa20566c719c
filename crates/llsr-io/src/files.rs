//! Reading files whole with a limit, and writing them all or not at all.

use std::fs::{self, File, OpenOptions};
use std::io::{BufWriter, Cursor, Read as _, Seek, Write};
use std::path::{Component, Path, PathBuf};

use crate::error::Error;

/// Largest scene file or buffer (bytes).
pub(crate) const LARGEST_FILE: u64 = 4 << 30;

/// Reads a file of at most `limit` bytes.
pub(crate) fn read(path: &Path, limit: u64) -> Result<Vec<u8>, Error> {
    let metadata = fs::metadata(path).map_err(|e| Error::read(path, e))?;
    // Pipes and devices may never end.
    if !metadata.is_file() {
        return Err(Error::NotAFile {
            path: path.to_owned(),
        });
    }
    let too_large = |size: u64| Error::TooLarge {
        path: path.to_owned(),
        element: "the file".to_owned(),
        needed: size >> 20,
        limit: limit >> 20,
    };
    if metadata.len() > limit {
        return Err(too_large(metadata.len()));
    }
    let mut bytes = Vec::new();
    let file = File::open(path).map_err(|e| Error::read(path, e))?;
    file.take(limit + 1)
        .read_to_end(&mut bytes)
        .map_err(|e| Error::read(path, e))?;
    // It may have grown since.
    if bytes.len() as u64 > limit {
        return Err(too_large(bytes.len() as u64));
    }
    Ok(bytes)
}

/// Reads a text file of at most `limit` bytes; bytes that are no UTF-8 become replacement characters.
///
/// # Errors
/// If it cannot be read, is no file or is larger; the error names it.
pub fn read_text(path: &Path, limit: u64) -> Result<String, Error> {
    let bytes = read(path, limit)?;
    Ok(String::from_utf8_lossy(&bytes).into_owned())
}

/// The file that `name` means, written in a file in `directory`; `None` if that is not below `directory`.
pub(crate) fn beside(directory: &Path, name: &str) -> Option<PathBuf> {
    let name = name.replace('\\', "/");
    // A drive letter or scheme is no relative path either.
    if name.is_empty() || name.contains(':') || name.contains('\0') {
        return None;
    }
    let relative = Path::new(&name);
    let mut depth = 0i32;
    for component in relative.components() {
        match component {
            Component::Normal(_) => depth += 1,
            Component::CurDir => {}
            Component::ParentDir => depth -= 1,
            Component::RootDir | Component::Prefix(_) => return None,
        }
        if depth < 0 {
            return None;
        }
    }
    Some(directory.join(relative))
}

/// The directory that holds `path`.
pub(crate) fn directory_of(path: &Path) -> &Path {
    match path.parent() {
        Some(parent) if !parent.as_os_str().is_empty() => parent,
        _ => Path::new("."),
    }
}

/// What pictures and scenes are written to.
pub(crate) trait Sink: Write + Seek {}

impl<T: Write + Seek> Sink for T {}

/// Writes a file so that `path` holds either all of it or what it held before: the bytes go to a new file in the
/// same directory, which takes the name at the end.
///
/// A link keeps pointing where it does, to the new file. What is no file (a pipe, `/dev/stdout`) is not replaced but gets
/// all bytes at once.
pub(crate) fn write_atomically(
    path: &Path,
    write: impl FnOnce(&mut dyn Sink) -> std::io::Result<()>,
) -> Result<(), Error> {
    let fail = |e| Error::write(path, e);
    let target = fs::canonicalize(path).unwrap_or_else(|_| path.to_owned());
    if fs::metadata(&target).is_ok_and(|metadata| !metadata.is_file()) {
        let mut bytes = Cursor::new(Vec::new());
        write(&mut bytes).map_err(fail)?;
        let mut file = OpenOptions::new().write(true).open(&target).map_err(fail)?;
        return file.write_all(bytes.get_ref()).map_err(fail);
    }
    let mut builder = tempfile::Builder::new();
    builder.prefix(".llsr-").suffix(".part");
    // Private by default; a picture is meant to be shared as any new file would be.
    #[cfg(unix)]
    {
        use std::os::unix::fs::PermissionsExt as _;
        builder.permissions(fs::Permissions::from_mode(0o666));
    }
    let file = builder.tempfile_in(directory_of(&target)).map_err(fail)?;
    let mut buffered = BufWriter::new(file);
    write(&mut buffered).map_err(fail)?;
    let file = buffered.into_inner().map_err(|e| fail(e.into_error()))?;
    file.persist(&target).map_err(|e| fail(e.error))?;
    Ok(())
}

/// Can [`write_file`] write this file, as far as can be told beforehand? What is there stays as it is.
///
/// A file that is made and removed again beside it is the proof; the disk may still fill up later. Of pipes and devices nothing is
/// asked: opening them could wait, or be seen at the other end.
///
/// # Errors
/// If it cannot be written; the error names it.
pub fn check_writable(path: &Path) -> Result<(), Error> {
    let target = fs::canonicalize(path).unwrap_or_else(|_| path.to_owned());
    match fs::metadata(&target) {
        Ok(metadata) if metadata.is_dir() => Err(Error::write(path, std::io::ErrorKind::IsADirectory.into())),
        Ok(metadata) if !metadata.is_file() => Ok(()),
        _ => try_directory(directory_of(&target)).map_err(|e| Error::write(path, e)),
    }
}

/// Can files be written into this folder, which may be made first with all that it lies in? Nothing is made by asking.
///
/// # Errors
/// If not; the error names the folder.
pub fn check_folder(path: &Path) -> Result<(), Error> {
    let fail = |e| Error::write(path, e);
    // The part of the way that is there.
    let there = path.ancestors().find_map(|part| {
        let part = if part.as_os_str().is_empty() {
            Path::new(".")
        } else {
            part
        };
        fs::metadata(part).ok().map(|metadata| (part, metadata))
    });
    match there {
        Some((part, metadata)) if metadata.is_dir() => try_directory(part).map_err(fail),
        _ => Err(fail(std::io::ErrorKind::NotADirectory.into())),
    }
}

fn try_directory(directory: &Path) -> std::io::Result<()> {
    let mut builder = tempfile::Builder::new();
    builder.prefix(".llsr-").suffix(".part");
    builder.tempfile_in(directory).map(drop)
}

/// Writes `bytes` to `path`: afterwards the file holds either all of them or what it held before.
///
/// # Errors
/// If the file cannot be written; the error names it.
pub fn write_file(path: &Path, bytes: &[u8]) -> Result<(), Error> {
    write_atomically(path, |out| out.write_all(bytes))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn only_names_below_the_directory_are_followed() {
        let directory = Path::new("scenes");
        let inside = |name| beside(directory, name).is_some();
        assert!(inside("a.png"), "a neighbour");
        assert!(inside("textures\\wood 1.png"), "a folder, written the other way");
        assert!(inside("a/../b.png"), "up, but not out");
        for name in [
            "../a.png",
            "a/../../b.png",
            "/etc/passwd",
            "C:\\a.png",
            "file:///a",
            "",
            "a\0b",
        ] {
            assert!(!inside(name), "{name:?} is outside");
        }
    }

    #[test]
    fn a_failed_write_leaves_the_old_file_and_nothing_else() {
        let directory = tempfile::tempdir().expect("a temporary directory");
        let path = directory.path().join("a.bin");
        write_atomically(&path, |w| w.write_all(b"old")).expect("a first write");
        let result = write_atomically(&path, |w| {
            w.write_all(b"half")?;
            Err(std::io::Error::other("the disk is full"))
        });
        assert!(result.is_err(), "the failure is reported");
        assert_eq!(
            fs::read(&path).expect("still there"),
            b"old",
            "the old contents stand"
        );
        assert_eq!(
            fs::read_dir(directory.path()).expect("a directory").count(),
            1,
            "no part file stays"
        );
    }

    #[test]
    fn what_cannot_be_written_is_known_beforehand_and_nothing_is_touched() {
        let directory = tempfile::tempdir().expect("a temporary directory");
        let place = |name: &str| directory.path().join(name);
        write_file(&place("file"), b"old").expect("a file");
        fs::create_dir(place("folder")).expect("a folder");
        let count = || fs::read_dir(directory.path()).expect("a directory").count();
        for (name, file, folder) in [
            ("file", true, false),
            ("new", true, true),
            ("folder", false, true),
            ("folder/new", true, true),
            ("nowhere/new", false, true),
            ("nowhere/at/all", false, true),
            ("file/new", false, false),
        ] {
            assert_eq!(check_writable(&place(name)).is_ok(), file, "{name} as a file");
            assert_eq!(check_folder(&place(name)).is_ok(), folder, "{name} as a folder");
            assert_eq!(count(), 2, "nothing is left of asking for {name}");
        }
        // It says what happens.
        assert_eq!(fs::read(place("file")).expect("there"), b"old");
        assert!(
            write_file(&place("nowhere/new"), b"x").is_err()
                && fs::create_dir_all(place("file/new")).is_err()
        );
        assert!(check_folder(Path::new("new")).is_ok(), "in the working directory");
        let error = check_writable(&place("folder"))
            .expect_err("a folder")
            .to_string();
        assert!(error.contains("folder") && error.contains("directory"), "{error}");
    }

    #[cfg(unix)]
    #[test]
    fn links_are_followed_and_pipes_stay_pipes() {
        use std::os::unix::fs::FileTypeExt as _;

        let directory = tempfile::tempdir().expect("a temporary directory");
        let place = |name: &str| directory.path().join(name);
        write_file(&place("target"), b"old").expect("a file");
        std::os::unix::fs::symlink("target", place("link")).expect("a link");
        write_file(&place("link"), b"new").expect("a file");
        assert!(
            fs::symlink_metadata(place("link")).expect("there").is_symlink(),
            "still a link"
        );
        assert_eq!(
            fs::read(place("target")).expect("there"),
            b"new",
            "to the new contents"
        );

        let pipe = place("pipe");
        let made = std::process::Command::new("mkfifo")
            .arg(&pipe)
            .status()
            .expect("a standard tool");
        assert!(made.success(), "a pipe");
        let reader = std::thread::spawn({
            let pipe = pipe.clone();
            move || fs::read(pipe).expect("the pipe's contents")
        });
        check_writable(&pipe).expect("nothing is asked of it");
        write_file(&pipe, b"through").expect("a written pipe");
        assert_eq!(reader.join().expect("a reader"), b"through", "all of it");
        assert!(
            fs::metadata(&pipe).expect("there").file_type().is_fifo(),
            "still a pipe"
        );
        assert!(
            matches!(read(&pipe, 10), Err(Error::NotAFile { .. })),
            "which is not waited for"
        );
        assert!(
            write_file(directory.path(), b"x").is_err(),
            "a folder is no target"
        );
    }
}
