//! What the judge says of ours beside the best peer, column by column.

use crate::rows::{COLUMNS, QUALITY, Row};

/// Lines of the columns in which some peer did better than ours on the same scene and choice, and how many they are.
pub fn verdict(rows: &[Row]) -> String {
    let lines: Vec<String> =
        rows.iter().filter(|row| row.is_ours()).flat_map(|ours| worse(ours, rows)).collect();
    if lines.is_empty() {
        return "the judge finds no column in which a peer did better".into();
    }
    format!("columns of the judge in which a peer did better, {}:\n{}", lines.len(), lines.join("\n"))
}

/// A line for each column of a row of ours that the best peer's is better in. What makes no sense for one is not compared.
fn worse(ours: &Row, rows: &[Row]) -> Vec<String> {
    let names = COLUMNS.split(',').skip(QUALITY);
    let peers: Vec<&Row> =
        rows.iter().filter(|row| !row.is_ours() && row.course() == ours.course()).collect();
    let mut lines = Vec::new();
    for (k, (name, value)) in names.zip(ours.quality).enumerate() {
        let best = peers.iter().filter(|peer| !peer.quality[k].is_nan());
        let Some(best) = best.min_by(|a, b| a.quality[k].total_cmp(&b.quality[k])) else { continue };
        if value > best.quality[k] {
            let (scene, peer, least) = (ours.course(), &best.engine, best.quality[k]);
            lines.push(format!("{scene:<40} {}: {name} {value:.2e}, {peer} {least:.2e}", ours.solver));
        }
    }
    lines
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::rows::tests::row;

    #[test]
    fn a_column_in_which_a_peer_is_better_is_told() {
        let (mut ours, mut one, mut other) = (row("carom", 1.0), row("box2d", 1.0), row("rapier", 1.0));
        let mut elsewhere = row("box2d", 2.0);
        elsewhere.threads = 2;
        ours.quality = [1.0, 2.0, 3.0, f64::NAN, 5.0, 6.0, 7.0];
        one.quality = [2.0, 2.0, 2.5, 1.0, f64::NAN, 6.5, 9.0];
        other.quality = [3.0, 2.5, 2.0, 1.0, f64::NAN, 6.5, 6.9];
        elsewhere.quality = [0.0; 7];
        let told = verdict(&[ours.clone(), one.clone(), other.clone(), elsewhere]);
        let lines: Vec<&str> = told.lines().collect();
        assert_eq!(lines.len(), 3, "{told}");
        assert!(lines[0].contains(", 2:"));
        assert!(lines[1].contains("drift_max 3.00e0, rapier 2.00e0"), "{told}");
        assert!(lines[2].contains("energy_gain 7.00e0, rapier 6.90e0"), "{told}");
        ours.quality = [1.0; 7];
        (one.quality, other.quality) = ([1.0; 7], [2.0; 7]);
        assert!(verdict(&[ours, one, other]).contains("no column"));
    }
}
