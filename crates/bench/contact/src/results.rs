//! Where results go: FOLDER/MACHINE/NAME.csv, one folder per processor.

use std::path::{Path, PathBuf};

/// The folder of this machine below the folder of results.
pub fn folder(results: &Path) -> PathBuf {
    let text = std::fs::read_to_string("/proc/cpuinfo").unwrap_or_default();
    let model = text.lines().find_map(|l| l.strip_prefix("model name")).and_then(|l| l.split_once(':'));
    let cores = std::thread::available_parallelism().map_or(1, usize::from);
    let label = format!("{} {cores} cores", model.map_or(std::env::consts::ARCH, |m| m.1.trim()));
    let plain = label.to_lowercase().replace("(r)", "").replace("(tm)", "");
    let words = plain.split(|c: char| !c.is_ascii_alphanumeric()).filter(|w| !w.is_empty());
    results.join(words.collect::<Vec<_>>().join("-"))
}

/// Writes lines under a heading.
///
/// # Errors
/// What the file system says.
pub fn save(results: Option<&Path>, name: &str, columns: &str, lines: &[String]) -> Result<(), String> {
    let Some(results) = results else { return Ok(()) };
    let folder = folder(results);
    let path = folder.join(name);
    let text = format!("{columns}\n{}\n", lines.join("\n"));
    std::fs::create_dir_all(&folder)
        .and_then(|()| std::fs::write(&path, text))
        .map_err(|e| format!("{}: {e}", path.display()))
}
