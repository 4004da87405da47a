//! Model files: what is read, what is refused, the schema; the map of the code.

#[path = "../support/program.rs"]
mod program;

mod architecture;
mod circles;
mod input_fuzz;
mod kinematics;
mod load_tables;
mod loader_fuzz;
mod manual;
mod model_mistakes;
mod model_read;
mod model_value;
mod models_load;
mod places;
mod run_fuzz;
mod schema;
mod supply_chain;
mod yaml_hostile;
mod yaml_loader;
mod yaml_read;
