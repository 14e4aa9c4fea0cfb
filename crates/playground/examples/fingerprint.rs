//! What a native build makes of the scenes of the playground: reads requests as lines of JSON, each
//! `{"load": {..}, "steps": n}`, and writes the fingerprint of the motion after the steps, or the sentence of an error.
//! `player/tests/playground.test.mjs` compares it with the page's.

use carom_playground::page::Page;
use serde_json::{Value, json};

fn answer(line: &str) -> Result<String, String> {
    let asked: Value = serde_json::from_str(line).map_err(|e| e.to_string())?;
    let mut page = Page::default();
    let mut request = json!({ "op": "load" });
    if let (Some(request), Some(load)) = (request.as_object_mut(), asked["load"].as_object()) {
        request.extend(load.clone());
    }
    page.answer(&request.to_string())?;
    page.steps(asked["steps"].as_u64().unwrap_or(0) as u32, &mut Vec::new())?;
    let told = page.answer(r#"{"op": "fingerprint"}"#)?;
    Ok(told.as_str().unwrap_or_default().into())
}

fn main() {
    for line in std::io::stdin().lines().map_while(Result::ok) {
        println!("{}", answer(&line).unwrap_or_else(|error| format!("refused: {error}")));
    }
}
