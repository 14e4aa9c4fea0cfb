//! The solvers against closed forms, laws and each other.

#[macro_use]
mod common;

mod alone;
mod complementarity;
mod contact;
mod file_and_check;
mod first_order;
mod friction;
mod fuzz;
mod ladder;
mod laws;
mod lemke;
mod linear;
mod matrix;
mod matrix_form;
mod one_collision;
mod pgs;
mod residual;
mod resistance;
mod shared;
mod slip_target;
mod speed;
mod statics;
mod systems;
