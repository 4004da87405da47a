//! Conventions: units, signs, names of columns, scales.
//!
//! # Units
//!
//! Models and results are in SI base units: m, kg, s, N, rad. Quantities with other units (`50 um`, `800 rpm`, `12 kN/mm`) are converted
//! when they are read. Angles have units: a bare angle is in rad. A bare frequency is rejected in SI models: use `Hz`, `rpm` or
//! `rad/s` ([`hertz`](crate::quantity::hertz), [`rpm`](crate::quantity::rpm)). `reduced` models are nondimensional throughout.
//!
//! # Deformations and forces
//!
//! A connection has one deformation, the sum of lever arm times motion of its bodies. It is positive when the drive flank is
//! loaded:
//!
//! ```text
//! gear {A: R_A, B: R_B}            R_A th_A + R_B th_B      m
//! internal_gear {A: R_A, B: R_B}   R_A th_A - R_B th_B      m
//! shaft [A, B]                     th_A - th_B              rad   (z_A - z_B, m, between sliding masses)
//! ground: A                        th_A                     rad   (z_A, m, for a sliding mass)
//! ```
//!
//! Its force is K f(deformation, rate, phase), positive where it opposes a positive deformation; for shafts it is a moment. The law f
//! is a displacement: force over the reference stiffness K. A transmission error e is subtracted: the law sees the deformation minus e.
//!
//! # Phase, frequency, period
//!
//! The excitation frequency is that of the reference shaft if the model has a `reference`, otherwise that of harmonic 1 of
//! the loads. A harmonic
//! of order k is amplitude cos(k phase + phase_0). The response of subharmonic index nu has nu times the period of the excitation.
//!
//! # Scales
//!
//! Solvers see nondimensional numbers ([`crate::system::System`]): deformations over the displacement scale l of their connection (its
//! own `length`, else that of `scaling`, else the first nonzero breakpoint of its law), frequencies over omega_c (the first natural
//! frequency in full contact unless `scaling` says otherwise). Along a varied parameter the scales stay those of the model as written.
//!
//! # Empty cells
//!
//! An unknown value is an empty cell (NaN in a column of numbers), never a guess.
