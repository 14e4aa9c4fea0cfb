//! What is known of a step after it: energies, momenta, the ledger, the report.

pub mod accounts;
pub mod energy;
pub mod event_log;
pub mod explain;
pub mod groups;
pub mod ledger;
pub mod push;
pub mod report;
pub mod step_times;
