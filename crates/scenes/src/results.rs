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

/// Writes rows under the names of their columns into this machine's folder, when there is a folder of results. The file
/// is there whole, before and after, whenever the program is stopped.
///
/// # Errors
/// What the file system says.
pub fn save(results: Option<&Path>, name: &str, columns: &str, rows: &[String]) -> Result<(), String> {
    let Some(results) = results else { return Ok(()) };
    let folder = folder(results, None);
    let path = folder.join(name);
    let beside = folder.join(format!(".{name}.{}", std::process::id()));
    let text = std::iter::once(columns).chain(rows.iter().map(String::as_str)).collect::<Vec<_>>();
    std::fs::create_dir_all(&folder)
        .and_then(|()| std::fs::write(&beside, text.join("\n") + "\n"))
        .and_then(|()| std::fs::rename(&beside, &path))
        .map_err(|e| format!("{}: {e}", path.display()))
}

/// Rows of a file with new ones in place of older ones of the same first `key` columns; where there are none such, new
/// ones follow the last row of the same first column.
pub fn merged(old: Vec<String>, new: Vec<String>, key: usize) -> Vec<String> {
    let first = |row: &str, n: usize| row.splitn(n + 1, ',').take(n).collect::<Vec<_>>().join(",");
    let mut rows = old;
    for new in new {
        if let Some(old) = rows.iter_mut().find(|old| first(old, key) == first(&new, key)) {
            *old = new;
            continue;
        }
        let place =
            rows.iter().rposition(|old| first(old, 1) == first(&new, 1)).map_or(rows.len(), |k| k + 1);
        rows.insert(place, new);
    }
    rows
}

/// The rows of a file that [`save`] wrote before, for rows of other runs to stay; none where it has other columns or
/// is not there.
pub fn rows(results: &Path, name: &str, columns: &str) -> Vec<String> {
    let text = std::fs::read_to_string(folder(results, None).join(name)).unwrap_or_default();
    let mut lines = text.lines().map(str::to_string);
    if lines.next().is_some_and(|first| first == columns) { lines.collect() } else { Vec::new() }
}

#[cfg(test)]
mod tests {
    use super::merged;

    fn rows(lines: &[&str]) -> Vec<String> {
        lines.iter().map(|line| line.to_string()).collect()
    }

    #[test]
    fn rows_of_other_runs_stay_and_new_ones_come_after_their_own_kind() {
        let old = rows(&["a,1,x", "a,2,x", "b,1,x"]);
        let found = merged(old, rows(&["a,2,y", "a,3,y", "c,1,y"]), 2);
        assert_eq!(found, rows(&["a,1,x", "a,2,y", "a,3,y", "b,1,x", "c,1,y"]));
    }
}
