//! Engines that live in Python, in a process of their own: it gets the scene as JSON, takes steps when told, and says by its
//! own clocks what they took. Knows no engine by name; `race/peers.py` does.

use crate::engine::{Engine, Spent};
use crate::scene::{Arena, DT, FRICTION, Kind, Scene};
use carom::{Column, Pose, Rotation};
use serde_json::{Value, json};
use std::io::{BufRead, BufReader, Write};
use std::path::Path;
use std::process::{Child, ChildStdin, ChildStdout, Command, Stdio};

/// A world in another process.
struct Foreign {
    name: String,
    child: Child,
    words: ChildStdin,
    answers: BufReader<ChildStdout>,
}

/// A scene in an engine of the script, which `python` runs.
///
/// # Errors
/// What the process says when the engine is not there or lacks something of the scene.
pub fn build<S: Arena>(scene: &Scene<S>, name: &str, python: &Path) -> Result<Box<dyn Engine<S>>, String> {
    let script = Path::new(env!("CARGO_MANIFEST_DIR")).join("peers.py");
    let mut child = Command::new(python)
        .arg(script)
        .arg(name)
        .stdin(Stdio::piped())
        .stdout(Stdio::piped())
        .spawn()
        .map_err(|e| format!("{name}: {}: {e}", python.display()))?;
    let words = child.stdin.take().ok_or("no way to the process")?;
    let answers = BufReader::new(child.stdout.take().ok_or("no way from the process")?);
    let mut made = Foreign { name: name.into(), child, words, answers };
    made.ask(&as_json(scene).to_string())?;
    Ok(Box::new(made))
}

/// Whether an engine of the script can be had.
pub fn is_there(name: &str, python: &Path) -> bool {
    let import = Command::new(python).args(["-c", &format!("import {name}")]).stderr(Stdio::null()).status();
    import.is_ok_and(|status| status.success())
}

fn as_json<S: Arena>(scene: &Scene<S>) -> Value {
    let body = |b: &crate::scene::Body<S>| {
        let parts: Vec<Value> = S::parts(&b.shape)
            .into_iter()
            .map(|(place, shape)| {
                let (at, turn) = (place.position.as_slice(), place.rotation.as_slice());
                json!({ "position": at, "rotation": turn, "shape": shape })
            })
            .collect();
        json!({
            "kind": match b.kind { Kind::Dynamic => "dynamic", Kind::Fixed => "fixed", Kind::Kinematic => "kinematic" },
            "position": b.pose.position.as_slice(),
            "rotation": b.pose.rotation.as_slice(),
            "velocity": b.velocity.as_slice(),
            "spin": b.spin.as_slice(),
            "density": b.density,
            "parts": parts,
        })
    };
    json!({
        "dt": DT,
        "gravity": Scene::<S>::gravity().as_slice(),
        "friction": FRICTION,
        "bodies": scene.bodies.iter().map(body).collect::<Vec<_>>(),
    })
}

impl Foreign {
    /// Says a line and hears one: JSON, an object with `error` when something went wrong.
    fn ask(&mut self, word: &str) -> Result<Value, String> {
        let trouble = |e: &dyn std::fmt::Display| format!("{}: {e}", self.name);
        writeln!(self.words, "{word}").and_then(|()| self.words.flush()).map_err(|e| trouble(&e))?;
        let mut line = String::new();
        self.answers.read_line(&mut line).map_err(|e| trouble(&e))?;
        let answer: Value = serde_json::from_str(&line).map_err(|_| trouble(&"its process ended"))?;
        match answer.get("error") {
            Some(error) => Err(trouble(error)),
            None => Ok(answer),
        }
    }
}

fn numbers(value: &Value) -> Option<Vec<f64>> {
    value.as_array()?.iter().map(Value::as_f64).collect()
}

impl<S: Arena> Engine<S> for Foreign {
    fn step(&mut self) -> Result<Spent, String> {
        let told = self.ask("step")?;
        let told = numbers(&told).filter(|t| t.len() == 2).ok_or("no times in the answer")?;
        Ok(Spent { wall: told[0], cpu: told[1] })
    }
    fn poses(&mut self) -> Result<Vec<Pose<S>>, String> {
        let told = self.ask("poses")?;
        let pose = |value: &Value| {
            let all = numbers(value)?;
            let (at, turn) = all.split_at_checked(S::DIM)?;
            Some(Pose::new(S::Vector::from_slice(at)?, S::Rotation::from_slice(turn)?))
        };
        let poses: Option<Vec<Pose<S>>> = told.as_array().and_then(|all| all.iter().map(pose).collect());
        poses.ok_or_else(|| format!("{}: no poses in the answer", self.name))
    }
    fn contacts(&mut self) -> Option<usize> {
        self.ask("contacts").ok()?.as_u64().map(|count| count as usize)
    }
}

impl Drop for Foreign {
    fn drop(&mut self) {
        // the process ends by itself at the word; it is ended when it does not hear
        if writeln!(self.words, "end").is_err() {
            let _ = self.child.kill();
        }
        let _ = self.child.wait();
    }
}
