//! The analyses of model files through the library.

#[path = "../support/common.rs"]
mod common;
#[path = "../support/drive_support.rs"]
mod drive_support;
#[path = "../support/response_support.rs"]
mod response_support;
#[path = "../support/time_domain_support.rs"]
mod time_domain_support;

mod accuracy;
mod attractor_cases;
mod attractor_labels;
mod basins;
mod bifurcation_curves;
mod branches_all;
mod costs;
mod crosscheck_methods;
mod curve_corners;
mod curve_ends;
mod curve_jumps;
mod curve_meetings;
mod effective_frequencies;
mod events_of_both_methods;
mod examples;
mod first_contact;
mod floquet_estimate;
mod from_rust;
mod honest_ends;
mod interrupted_maps;
mod links;
mod motions;
mod named_parameters;
mod narrow_windows;
mod parameter_response;
mod parameter_response_mistakes;
mod random_starts;
mod rattle_metrics;
mod regime_maps;
mod reproduction_rook_singh;
mod response_integration;
mod run_ups;
mod saved_points;
mod scaling_invariance;
mod sliders;
mod speeds;
mod stability;
mod tables;
mod time_domain;
mod time_domain_mistakes;
mod time_domain_sweeps;
mod tori;
mod transients;
