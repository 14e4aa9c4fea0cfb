//! Laws: what every run keeps, stated as sentences and checked in the plane and in space. Cases C1 to C35 and
//! items 1 to 47 are those of the project's checklist; each tolerance stands beside its assertion with its reason.

mod accuracy;
mod alone;
mod bodies;
mod cavities;
mod constraints;
mod determinism;
mod directions;
mod event_log;
mod events;
mod failures;
mod friction;
mod gradients;
mod groups;
mod heaps;
mod impact_laws;
mod impacts;
mod joints;
mod ledger;
mod materials;
mod rigid_lanes;
mod robustness;
mod rolling;
mod rotation;
mod simbenchmark;
mod sleep;
mod slices;
mod snapshots;
mod soft_step;
mod statics;
mod systems;
mod threads;
