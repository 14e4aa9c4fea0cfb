//! Requests of a page as JSON, and their answers: `{"op": "load", ..}` and so on. Answers are tables; an error is a
//! sentence, and whatever ran before goes on.

use crate::run::{Live, Run};
use crate::scene::{self, About, AnyWorld, mesh};
use carom::{World2, World3};
use serde::Deserialize;
use serde_json::{Map, Value, json};

/// What a page may ask.
#[derive(Deserialize)]
#[serde(tag = "op", rename_all = "snake_case", deny_unknown_fields)]
enum Request {
    /// The scenes that are known by name.
    Scenes,
    /// Another scene: by name, by its text with the triangles of its mesh files, or from a snapshot; settings replace
    /// its own. A snapshot has the coefficients that all bodies were given; `own` are those that they had before.
    Load {
        name: Option<String>,
        text: Option<String>,
        snapshot: Option<String>,
        #[serde(default)]
        settings: Map<String, Value>,
        #[serde(default)]
        meshes: mesh::Files,
        own: Option<Vec<(f64, f64)>>,
    },
    /// Other settings, from the next step on.
    Set { settings: Map<String, Value> },
    /// Coefficients of all bodies; null is the scene's own.
    Coefficients { friction: Option<f64>, restitution: Option<f64> },
    /// Takes hold of a body at a place.
    Hold { body: usize, place: Vec<f64> },
    /// Pulls it there.
    Pull { place: Vec<f64> },
    /// Lets go.
    Release,
    /// The state as a text.
    Snapshot,
    /// One number for the bits of the motion.
    Fingerprint,
}

/// What a page drives: at most one run.
#[derive(Default)]
pub struct Page {
    run: Option<Box<dyn Run>>,
}

impl Page {
    /// Answers a request.
    ///
    /// # Errors
    /// A sentence for the reader of the page; nothing has changed then.
    pub fn answer(&mut self, request: &str) -> Result<Value, String> {
        let request: Request = serde_json::from_str(request).map_err(|e| format!("request: {e}"))?;
        match request {
            Request::Scenes => return Ok(scenes()),
            Request::Load { name, text, snapshot, settings, meshes, own } => {
                let mut run = loaded((name, text, snapshot), settings, &meshes)?;
                if let Some(own) = own {
                    run.know_own(own)?;
                }
                let about = run.about();
                self.run = Some(run);
                return Ok(about);
            }
            _ => {}
        }
        let run = self.run.as_mut().ok_or("no scene is loaded")?;
        match request {
            Request::Set { settings } => {
                run.set(settings)?;
                let about = run.about();
                return Ok(json!({
                    "settings": about["settings"], "solver": about["solver"], "impact": about["impact"],
                }));
            }
            Request::Coefficients { friction, restitution } => run.set_coefficients(friction, restitution)?,
            Request::Hold { body, place } => return Ok(json!(run.hold(body, &place))),
            Request::Pull { place } => run.pull(&place),
            Request::Release => run.release(),
            Request::Snapshot => return Ok(json!(run.snapshot())),
            Request::Fingerprint => return Ok(json!(format!("{:016x}", run.fingerprint()))),
            Request::Scenes | Request::Load { .. } => unreachable!("answered above"),
        }
        Ok(Value::Null)
    }
    /// Takes steps and writes the frame after them; only the frame when `count` is 0.
    ///
    /// # Errors
    /// When no scene is loaded, or a step was refused: the frame is then that of the state before it.
    pub fn steps(&mut self, count: u32, out: &mut Vec<f64>) -> Result<(), String> {
        let run = self.run.as_mut().ok_or("no scene is loaded")?;
        if count > 0 {
            return run.steps(count, out);
        }
        run.frame(out);
        Ok(())
    }
}

fn scenes() -> Value {
    let told = |s: &carom_scenes::SceneInfo| json!({ "name": s.name, "space": s.space, "description": s.description, "duration": s.duration });
    carom_scenes::catalogue().iter().map(told).collect()
}

fn loaded(
    from: (Option<String>, Option<String>, Option<String>),
    settings: Map<String, Value>,
    meshes: &mesh::Files,
) -> Result<Box<dyn Run>, String> {
    let (world, about) = match from {
        (Some(name), None, None) => named(&name)?,
        (None, Some(text), None) => return Ok(boxed(scene::read(&text, &settings, meshes)?)),
        (None, None, Some(snapshot)) => (restored(&snapshot)?, About::default()),
        _ => return Err("load: give name, text or snapshot".into()),
    };
    let mut run = boxed((world, about));
    if !settings.is_empty() {
        run.set(settings)?;
    }
    Ok(run)
}

fn boxed((world, about): (AnyWorld, About)) -> Box<dyn Run> {
    match world {
        AnyWorld::Planar(world) => Box::new(Live::new(*world, about)),
        AnyWorld::Spatial(world) => Box::new(Live::new(*world, about)),
    }
}

/// A scene of the catalogue.
fn named(name: &str) -> Result<(AnyWorld, About), String> {
    let info = carom_scenes::catalogue().iter().find(|s| s.name == name);
    let info = info.ok_or_else(|| format!("no scene is called '{name}'"))?;
    let about = About { name: name.into(), description: info.description.into(), duration: info.duration };
    let world = if let Some(world) = carom_scenes::planar(name) {
        AnyWorld::Planar(Box::new(world.map_err(|e| e.to_string())?))
    } else {
        let world = carom_scenes::spatial(name).ok_or_else(|| format!("no scene is called '{name}'"))?;
        AnyWorld::Spatial(Box::new(world.map_err(|e| e.to_string())?))
    };
    Ok((world, about))
}

/// The world of a snapshot, whose space it names itself.
fn restored(text: &str) -> Result<AnyWorld, String> {
    #[derive(Deserialize)]
    struct Head {
        space: String,
    }
    let head: Head = serde_json::from_str(text).map_err(|e| format!("snapshot: {e}"))?;
    let (world, fields) = if head.space == "planar" {
        let (world, fields) = World2::from_snapshot(text).map_err(|e| e.to_string())?;
        (AnyWorld::Planar(Box::new(world)), fields)
    } else {
        let (world, fields) = World3::from_snapshot(text).map_err(|e| e.to_string())?;
        (AnyWorld::Spatial(Box::new(world)), fields)
    };
    match fields.first() {
        Some(name) => Err(format!("snapshot: force field '{name}' is code, which a page does not have")),
        None => Ok(world),
    }
}
