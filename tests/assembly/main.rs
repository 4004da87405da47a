//! From trains to equations in relative coordinates.

#[path = "../support/assembly_support.rs"]
#[macro_use]
mod assembly_support;
#[path = "../support/common.rs"]
mod common;

mod assembly_absolute;
mod assembly_reference;
mod assembly_topology;
mod matrices;
mod start_and_statics;
mod statics_property;
