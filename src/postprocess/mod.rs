//! Quantities derived from orbits.
