//! The scenes: what each promises, and known answers.

mod catalogue;
mod contact_problems;
mod crowds;
mod known_answers;
