//! Quantities derived from orbits: functions of the system and an orbit.

pub mod connection;
pub mod contacts;
pub mod describing_function;
pub mod effective_stiffness;
pub mod floquet_estimate;
pub mod measures;
mod segment_measures;
