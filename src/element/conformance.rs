//! The contract of a law as an executable check.
