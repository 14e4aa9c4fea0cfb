//! Copies of a body: grid or pyramid by `repeat`. Copy (i, j, ..) is displaced by i step_0 + j step_1 + ..; in a
//! pyramid the last number l is the layer, and only copies with every other number below count - l exist.

use super::fields::Fields;
use serde_json::Value;

/// Most bodies that a scene may hold after repetition.
pub const MOST_BODIES: usize = 200_000;

/// One body to be made: its name, and by how much it is displaced \[m\].
#[derive(Clone, Debug, PartialEq)]
pub struct Copy {
    /// Name, with its numbers filled in.
    pub name: String,
    /// Displacement \[m\], as many numbers as the space has.
    pub displacement: Vec<f64>,
}

/// All copies of a body, in order of their running number.
///
/// # Errors
/// When `repeat` is not what it must be; `of` begins the message.
pub fn copies(name: &str, repeat: Option<Value>, dimension: usize, of: &str) -> Result<Vec<Copy>, String> {
    let Some(repeat) = repeat else {
        return Ok(vec![Copy { name: name.into(), displacement: vec![0.0; dimension] }]);
    };
    let mut fields = Fields::new(format!("{of}: repeat"), repeat)?;
    let count: Vec<usize> = fields.need("count")?;
    let step: Vec<Vec<f64>> = fields.need("step")?;
    let arrangement: String = fields.take("arrangement")?.unwrap_or_else(|| "grid".into());
    let pyramid = match arrangement.as_str() {
        "grid" => false,
        "pyramid" => true,
        other => return Err(fields.wrong("arrangement", format!("must be grid or pyramid, got '{other}'"))),
    };
    if step.len() != count.len() || step.iter().any(|s| s.len() != dimension) || count.is_empty() {
        return Err(fields.wrong("step", format!("needs {dimension} numbers for each of the counts")));
    }
    let all = count.iter().try_fold(1_usize, |n, &c| n.checked_mul(c)).unwrap_or(usize::MAX);
    if all == 0 || all > MOST_BODIES || (pyramid && count.len() < 2) {
        return Err(fields.wrong(
            "count",
            format!("makes {all} bodies; keep 1 to {MOST_BODIES}, and two counts for a pyramid"),
        ));
    }
    fields.finish()?;
    let mut found = Vec::new();
    for number in 0..all {
        let numbers = digits(number, &count);
        let (layer, others) = numbers.split_last().expect("there is a count");
        if pyramid && others.iter().zip(&count).any(|(n, c)| n + layer >= *c) {
            continue;
        }
        let displacement = (0..dimension).map(|k| along(&numbers, &step, k)).collect();
        found.push(Copy { name: named(name, &numbers, found.len()), displacement });
    }
    Ok(found)
}

/// A running number as a number for each count, the last running fastest.
fn digits(mut number: usize, count: &[usize]) -> Vec<usize> {
    let mut found = vec![0; count.len()];
    for (k, c) in count.iter().enumerate().rev() {
        found[k] = number % c;
        number /= c;
    }
    found
}

fn along(numbers: &[usize], step: &[Vec<f64>], axis: usize) -> f64 {
    numbers.iter().zip(step).fold(0.0, |sum, (&n, s)| sum + n as f64 * s[axis])
}

fn named(name: &str, numbers: &[usize], running: usize) -> String {
    let mut filled = name.replace("{n}", &running.to_string());
    for (letter, number) in ["{i}", "{j}", "{k}"].iter().zip(numbers) {
        filled = filled.replace(letter, &number.to_string());
    }
    if filled == name {
        let joined: Vec<String> = numbers.iter().map(usize::to_string).collect();
        filled = format!("{name}-{}", joined.join("-"));
    }
    filled
}
