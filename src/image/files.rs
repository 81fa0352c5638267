//! Output files: checked before the long work, staged as bytes, put in place all together at the end.
//!
//! ```text
//! paths --check_target--> (long work) --stage(path, bytes)*--> commit: write beside, flush, rename
//! ```
//! A file is replaced by one rename: whoever looks sees the old file or the new one, never half of one.

use std::io::Write;
use std::path::{Path, PathBuf};

use atomic_write_file::AtomicWriteFile;

/// An output that cannot be.
#[derive(Debug, thiserror::Error)]
pub enum OutputError {
    /// The extension names no format that can be written.
    #[error("{path}: cannot write {what}; pictures are .exr or .hdr (linear) or .png (sRGB)", path = path.display())]
    Extension {
        /// The file.
        path: PathBuf,
        /// What is wrong with its extension.
        what: String,
    },
    /// The place cannot take a file.
    #[error("{path}: {what}", path = path.display())]
    Target {
        /// The file.
        path: PathBuf,
        /// Why not.
        what: String,
    },
    /// One file was named for two outputs.
    #[error("{path}: named twice as an output, first as {first}", path = path.display(), first = first.display())]
    Duplicate {
        /// The file, as named the second time.
        path: PathBuf,
        /// As named the first time.
        first: PathBuf,
    },
    /// An output would replace an input.
    #[error("{path}: the output would replace the input {input}", path = path.display(), input = input.display())]
    IsInput {
        /// The file, as named as an output.
        path: PathBuf,
        /// As named as an input.
        input: PathBuf,
    },
    /// Writing failed.
    #[error("{path}: {source}", path = path.display())]
    Io {
        /// The file.
        path: PathBuf,
        /// Why.
        source: std::io::Error,
    },
    /// An encoder refused the picture.
    #[error("the picture cannot be encoded as {format}: {what}")]
    Encode {
        /// The format.
        format: &'static str,
        /// What the encoder said.
        what: String,
    },
}

/// Formats that pictures are written in.
#[derive(Clone, Copy, Debug, PartialEq, Eq, serde::Serialize)]
#[serde(rename_all = "lowercase")]
pub enum PictureFormat {
    /// Linear f32.
    Exr,
    /// Linear, 8 bit mantissas and a joint exponent.
    Hdr,
    /// 8 bit sRGB.
    Png,
}

impl PictureFormat {
    /// The format that a path's extension names, upper or lower case.
    ///
    /// # Errors
    /// [`OutputError::Extension`] for all others.
    pub fn of(path: &Path) -> Result<PictureFormat, OutputError> {
        if names_a_folder(path) {
            return Err(OutputError::Extension { path: path.to_owned(), what: "a folder".to_owned() });
        }
        let extension = path.extension().map(|e| e.to_string_lossy().to_ascii_lowercase());
        let what = match extension.as_deref() {
            Some("exr") => return Ok(PictureFormat::Exr),
            Some("hdr") => return Ok(PictureFormat::Hdr),
            Some("png") => return Ok(PictureFormat::Png),
            Some(other) => format!("'.{other}'"),
            None => "a picture without an extension".to_owned(),
        };
        Err(OutputError::Extension { path: path.to_owned(), what })
    }
}

/// A path that ends in a separator.
fn names_a_folder(path: &Path) -> bool {
    path.as_os_str().as_encoded_bytes().last().is_some_and(|b| std::path::is_separator(char::from(*b)))
}

/// Checks that a file can be written at `path`: its folder exists and takes files. Leaves nothing behind.
///
/// # Errors
/// [`OutputError::Target`] with the reason.
pub fn check_target(path: &Path) -> Result<(), OutputError> {
    let fault = |what: String| Err(OutputError::Target { path: path.to_owned(), what });
    if path.file_name().is_none() {
        return fault("not a file name".to_owned());
    }
    if path.is_dir() || names_a_folder(path) {
        return fault("is a folder, expected a file name".to_owned());
    }
    let folder = match path.parent() {
        Some(p) if !p.as_os_str().is_empty() => p,
        _ => Path::new("."),
    };
    if !folder.is_dir() {
        return fault(format!("the folder {} does not exist", folder.display()));
    }
    match AtomicWriteFile::open(path).and_then(AtomicWriteFile::discard) {
        Ok(()) => Ok(()),
        Err(e) => fault(format!("cannot write here: {e}")),
    }
}

/// Checks every path as [`check_target`] does, and that no file is named twice, by whatever path.
///
/// # Errors
/// The first path that cannot be.
pub fn check_targets<'a>(paths: impl IntoIterator<Item = &'a Path>) -> Result<(), OutputError> {
    let mut seen: Vec<(PathBuf, &Path)> = Vec::new();
    for path in paths {
        check_target(path)?;
        let file = identity(path);
        if let Some((_, first)) = seen.iter().find(|(other, _)| *other == file) {
            return Err(OutputError::Duplicate { path: path.to_owned(), first: first.to_path_buf() });
        }
        seen.push((file, path));
    }
    Ok(())
}

/// Checks that no output is one of the inputs, by whatever path.
///
/// # Errors
/// The first output that is.
pub fn check_not_inputs(outputs: &[&Path], inputs: &[&Path]) -> Result<(), OutputError> {
    let inputs: Vec<(PathBuf, &Path)> = inputs.iter().map(|path| (identity(path), *path)).collect();
    for path in outputs {
        let file = identity(path);
        if let Some((_, input)) = inputs.iter().find(|(other, _)| *other == file) {
            return Err(OutputError::IsInput { path: path.to_path_buf(), input: input.to_path_buf() });
        }
    }
    Ok(())
}

/// The same for all paths to one file, links followed; also for a file that does not exist yet.
fn identity(path: &Path) -> PathBuf {
    if let Ok(file) = path.canonicalize() {
        return file;
    }
    let folder = match path.parent() {
        Some(p) if !p.as_os_str().is_empty() => p,
        _ => Path::new("."),
    };
    match (folder.canonicalize(), path.file_name()) {
        (Ok(folder), Some(name)) => folder.join(name),
        _ => path.to_owned(),
    }
}

/// Files to be written together: nothing shows before [`OutputFiles::commit`].
#[derive(Debug, Default)]
pub struct OutputFiles {
    staged: Vec<(PathBuf, Vec<u8>)>,
}

impl OutputFiles {
    /// Nothing staged.
    pub fn new() -> OutputFiles {
        OutputFiles::default()
    }

    /// Adds a file.
    pub fn stage(&mut self, path: &Path, bytes: Vec<u8>) {
        self.staged.push((path.to_owned(), bytes));
    }

    /// Writes all files beside their places, then renames each into place.
    ///
    /// # Errors
    /// When a file could not be written: then no place was touched, unless a rename itself failed.
    pub fn commit(self) -> Result<(), OutputError> {
        self.commit_with(|| Ok(()))
    }

    /// As [`OutputFiles::commit`], with a write of the caller's between: it runs when all staged files are written
    /// and none is in place, and when it fails none will be.
    ///
    /// # Errors
    /// As [`OutputFiles::commit`], or what `write` returns.
    pub fn commit_with<E: From<OutputError>>(self, write: impl FnOnce() -> Result<(), E>) -> Result<(), E> {
        let mut written = Vec::with_capacity(self.staged.len());
        for (path, bytes) in &self.staged {
            let io = |source| OutputError::Io { path: path.clone(), source };
            let mut file = AtomicWriteFile::open(path).map_err(io)?;
            file.write_all(bytes).map_err(io)?;
            written.push((path, file));
        }
        write()?;
        for (path, file) in written {
            file.commit().map_err(|source| OutputError::Io { path: path.clone(), source })?;
        }
        Ok(())
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn names(dir: &Path) -> Vec<String> {
        let mut names: Vec<String> = std::fs::read_dir(dir)
            .unwrap()
            .map(|e| e.unwrap().file_name().to_string_lossy().into_owned())
            .collect();
        names.sort();
        names
    }

    #[test]
    fn format_of_known_extensions_is_found_in_any_case_and_others_are_refused() {
        assert_eq!(PictureFormat::of(Path::new("a/b.exr")).unwrap(), PictureFormat::Exr);
        assert_eq!(PictureFormat::of(Path::new("b.PNG")).unwrap(), PictureFormat::Png);
        assert_eq!(PictureFormat::of(Path::new("c.Hdr")).unwrap(), PictureFormat::Hdr);
        for bad in ["a.jpg", "a", "a.exr/"] {
            let e = PictureFormat::of(Path::new(bad)).expect_err(bad).to_string();
            assert!(e.contains(".exr or .hdr (linear) or .png (sRGB)"), "{e}");
        }
    }

    #[test]
    fn check_of_a_good_target_leaves_nothing_behind_and_keeps_the_old_file() {
        let dir = tempfile::tempdir().unwrap();
        check_target(&dir.path().join("new.png")).unwrap();
        assert!(names(dir.path()).is_empty());
        let old = dir.path().join("old.png");
        std::fs::write(&old, "old").unwrap();
        check_target(&old).unwrap();
        assert_eq!(std::fs::read(&old).unwrap(), b"old");
    }

    #[test]
    fn check_of_a_missing_folder_a_folder_and_a_double_name_says_so() {
        let dir = tempfile::tempdir().unwrap();
        let missing = dir.path().join("none/a.png");
        assert!(check_target(&missing).unwrap_err().to_string().contains("does not exist"));
        assert!(check_target(dir.path()).unwrap_err().to_string().contains("is a folder"));
        let a = dir.path().join("a.png");
        assert!(matches!(check_targets([a.as_path(), a.as_path()]), Err(OutputError::Duplicate { .. })));
        let slash = format!("{}/", a.display());
        assert!(check_target(Path::new(&slash)).unwrap_err().to_string().contains("is a folder"));
    }

    #[test]
    fn one_file_by_two_paths_is_refused_as_two_outputs_and_as_input_and_output() {
        let dir = tempfile::tempdir().unwrap();
        let (a, same, other) =
            (dir.path().join("a.png"), dir.path().join("./a.png"), dir.path().join("b.png"));
        std::fs::create_dir(dir.path().join("in")).unwrap();
        let around = dir.path().join("in/../a.png");
        for exists in [false, true] {
            if exists {
                std::fs::write(&a, "old").unwrap();
            }
            check_targets([a.as_path(), other.as_path()]).unwrap();
            check_not_inputs(&[&a], &[&other]).unwrap();
            for twin in [&same, &around] {
                let twice = check_targets([a.as_path(), twin.as_path()]);
                assert!(matches!(twice, Err(OutputError::Duplicate { .. })), "{twin:?} {exists}");
                let input = check_not_inputs(&[twin], &[&other, &a]);
                assert!(matches!(input, Err(OutputError::IsInput { .. })), "{twin:?} {exists}");
            }
        }
    }

    #[test]
    fn commit_with_one_bad_place_touches_no_other_place() {
        let dir = tempfile::tempdir().unwrap();
        let good = dir.path().join("good.png");
        std::fs::write(&good, "old").unwrap();
        let mut files = OutputFiles::new();
        files.stage(&good, b"new".to_vec());
        files.stage(&dir.path().join("none/bad.png"), b"new".to_vec());
        assert!(files.commit().is_err());
        assert_eq!(std::fs::read(&good).unwrap(), b"old");
        assert_eq!(names(dir.path()), ["good.png"]);
    }

    #[test]
    fn commit_with_a_failing_write_puts_nothing_in_place() {
        let dir = tempfile::tempdir().unwrap();
        let mut files = OutputFiles::new();
        files.stage(&dir.path().join("a"), b"1".to_vec());
        let no = || Err(OutputError::Encode { format: "PNG", what: "no".to_owned() });
        assert!(files.commit_with(no).is_err());
        assert!(names(dir.path()).is_empty());
    }

    #[test]
    fn commit_of_two_files_puts_both_in_place_without_leftovers() {
        let dir = tempfile::tempdir().unwrap();
        let mut files = OutputFiles::new();
        files.stage(&dir.path().join("a"), b"1".to_vec());
        files.stage(&dir.path().join("b"), b"2".to_vec());
        files.commit().unwrap();
        assert_eq!(names(dir.path()), ["a", "b"]);
        assert_eq!(std::fs::read(dir.path().join("b")).unwrap(), b"2");
    }
}
