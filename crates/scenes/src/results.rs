//! Where results go: FOLDER/MACHINE/NAME, one folder per processor, and how their rows get there. Knows no task.

use std::path::{Path, PathBuf};

/// The folder of a machine below the folder of results; without a label, of this one: the processor's name and the
/// number of cores. Lower-case letters and digits, everything else as single hyphens.
pub fn folder(results: &Path, machine: Option<&str>) -> PathBuf {
    let plain = machine.map_or_else(processor, str::to_string).to_lowercase();
    let plain = plain.replace("(r)", "").replace("(tm)", "");
    let words = plain.split(|c: char| !c.is_ascii_alphanumeric()).filter(|w| !w.is_empty());
    results.join(words.collect::<Vec<_>>().join("-"))
}

fn processor() -> String {
    let text = std::fs::read_to_string("/proc/cpuinfo").unwrap_or_default();
    let model = text.lines().find_map(|l| l.strip_prefix("model name")).and_then(|l| l.split_once(':'));
    let cores = std::thread::available_parallelism().map_or(1, usize::from);
    format!("{} {cores} cores", model.map_or(std::env::consts::ARCH, |m| m.1.trim()))
}

/// Writes rows under the names of their columns into this machine's folder, when there is a folder of results.
///
/// # Errors
/// What the file system says.
pub fn save(results: Option<&Path>, name: &str, columns: &str, rows: &[String]) -> Result<(), String> {
    let Some(results) = results else { return Ok(()) };
    let folder = folder(results, None);
    let path = folder.join(name);
    let text = std::iter::once(columns).chain(rows.iter().map(String::as_str)).collect::<Vec<_>>();
    std::fs::create_dir_all(&folder)
        .and_then(|()| std::fs::write(&path, text.join("\n") + "\n"))
        .map_err(|e| format!("{}: {e}", path.display()))
}

/// The rows of a file that [`save`] wrote before, for rows of other runs to stay; none where it has other columns or
/// is not there.
pub fn rows(results: &Path, name: &str, columns: &str) -> Vec<String> {
    let text = std::fs::read_to_string(folder(results, None).join(name)).unwrap_or_default();
    let mut lines = text.lines().map(str::to_string);
    if lines.next().is_some_and(|first| first == columns) { lines.collect() } else { Vec::new() }
}
