//! Parameter studies: journals, shards, tables.

#[path = "../support/program.rs"]
mod program;
#[path = "../support/study_support.rs"]
mod study_support;
#[path = "../support/time_domain_support.rs"]
mod time_domain_support;

mod panics;
mod parameter_study;
#[cfg(unix)]
mod study_hostile;
#[cfg(unix)]
mod study_journal;
mod study_mistakes;
#[cfg(feature = "parquet")]
mod study_parquet;
mod study_shards;
