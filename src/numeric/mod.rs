//! Numerical tools that know nothing of vibration.

pub mod assignment;
pub mod bernstein;
pub mod dense;
pub mod exponential;
pub mod fourier;
pub mod periodic;
pub mod roots;
pub mod trigonometric;
