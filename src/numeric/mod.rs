//! Numerical tools that know nothing of vibration.

pub mod assignment;
pub mod bernstein;
pub mod block;
pub mod broken_line;
pub mod complementary;
mod condensation;
pub mod corners;
pub mod dense;
pub mod eigenvalues;
pub mod exponential;
pub mod factors;
pub mod fourier;
pub mod fraction;
pub mod growth;
pub mod interpolation;
pub mod jacobian;
pub mod newtons;
pub mod nonzeros;
pub mod outline;
mod pairs;
pub mod pattern;
pub mod periodic;
pub mod quadrature;
pub mod roots;
pub mod symmetric;
pub mod taylor;
pub mod trigonometric;
