//! Galerkin, shooting, exact flow and DOPRI5 against references, closed forms and each other.

#[path = "../support/common.rs"]
mod common;
#[path = "../support/dopri5_support.rs"]
mod dopri5_support;
#[path = "../support/texts.rs"]
mod texts;

mod analytic_linear;
mod base_order;
mod block_elimination;
mod branch_events;
mod branch_ledger;
mod branch_switching;
mod condensation;
mod continuation;
mod crosscheck_excitations;
mod crosscheck_integrators;
mod crosscheck_models;
mod crosscheck_series;
mod dopri5;
mod dopri5_memory;
mod dopri5_switches;
mod ensembles;
mod equal_parts;
mod evolving;
mod exact_energy;
mod exact_flow;
mod exact_grazing;
mod long_trains;
mod memory_ends;
mod memory_flow;
mod memory_impacts;
mod memory_series;
mod memory_stops;
mod quadrature_exact;
mod reproduction_figure_11;
mod reproduction_shooting;
mod residual_derivatives;
mod spur_pair;
mod stability_windows;
mod stiff_trains;
mod trains_si;
mod trains_topology;
