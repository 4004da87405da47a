//! Integration in time.

mod dopri5;

pub use dopri5::{Dopri5, Dopri5Options, IntegrationEnd};
