//! Numerical tools that know nothing of vibration.

pub mod periodic;
