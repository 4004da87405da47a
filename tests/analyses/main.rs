//! The analyses of model files through the library.

#[path = "../support/common.rs"]
mod common;
#[path = "../support/time_domain_support.rs"]
mod time_domain_support;

mod attractor_labels;
mod effective_frequencies;
mod floquet_estimate;
mod rattle_metrics;
mod response_integration;
mod time_domain;
mod time_domain_mistakes;
mod time_domain_sweeps;
