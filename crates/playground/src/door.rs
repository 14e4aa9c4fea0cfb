//! The functions that WebAssembly exports: numbers in, numbers out, and two stretches of memory: one that the page
//! writes requests into, one that it reads answers from. No pointer is followed here; the page's side is
//! `player/playground/engine.ts`.
//!
//! `no_mangle` counts as unsafe because two symbols of one name would clash; these stand in one file and begin with
//! `carom_` ([ADR 6](../../../docs/adr/0006-where-unsafe-lives.md)).
#![allow(unsafe_code, reason = "exported names; there is no unsafe block")]

use crate::page::Page;
use std::cell::RefCell;

/// Page, request, answer as text, answer as numbers.
#[derive(Default)]
struct Desk {
    page: Page,
    request: Vec<u8>,
    answer: Vec<u8>,
    frame: Vec<f64>,
}

thread_local! {
    static DESK: RefCell<Desk> = RefCell::default();
}

impl Desk {
    /// Keeps an answer or an error; 0 or 1.
    fn keep(&mut self, told: Result<String, String>) -> i32 {
        let (code, text) = match told {
            Ok(text) => (0, text),
            Err(text) => (1, text),
        };
        self.answer = text.into_bytes();
        code
    }
}

fn at_desk<R>(act: impl FnOnce(&mut Desk) -> R) -> R {
    DESK.with(|desk| act(&mut desk.borrow_mut()))
}

/// Makes room for a request of `length` bytes of UTF-8; returns where to write it.
#[unsafe(no_mangle)]
pub extern "C" fn carom_request(length: usize) -> usize {
    at_desk(|desk| {
        desk.request.clear();
        desk.request.resize(length, 0);
        desk.request.as_mut_ptr() as usize
    })
}

/// Answers the request: 0 with JSON as the answer, 1 with a sentence.
#[unsafe(no_mangle)]
pub extern "C" fn carom_answer() -> i32 {
    at_desk(|desk| {
        let text = String::from_utf8_lossy(&desk.request).into_owned();
        let told = desk.page.answer(&text).map(|value| value.to_string());
        desk.keep(told)
    })
}

/// Takes `count` steps and makes the frame: 0, or 1 with a sentence as the answer.
#[unsafe(no_mangle)]
pub extern "C" fn carom_steps(count: u32) -> i32 {
    at_desk(|desk| {
        let told = desk.page.steps(count, &mut desk.frame).map(|()| String::new());
        desk.keep(told)
    })
}

/// Where the answer begins.
#[unsafe(no_mangle)]
pub extern "C" fn carom_answer_at() -> usize {
    at_desk(|desk| desk.answer.as_ptr() as usize)
}

/// Length of the answer \[bytes\].
#[unsafe(no_mangle)]
pub extern "C" fn carom_answer_length() -> usize {
    at_desk(|desk| desk.answer.len())
}

/// Where the frame begins.
#[unsafe(no_mangle)]
pub extern "C" fn carom_frame_at() -> usize {
    at_desk(|desk| desk.frame.as_ptr() as usize)
}

/// Numbers of the frame.
#[unsafe(no_mangle)]
pub extern "C" fn carom_frame_length() -> usize {
    at_desk(|desk| desk.frame.len())
}
