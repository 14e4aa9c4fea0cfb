//! Stories: one file per thing that went wrong and was mended, named after it.

#[path = "../harness/mod.rs"]
#[macro_use]
mod harness;
