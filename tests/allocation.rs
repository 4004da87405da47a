//! Residual, Jacobian and Newton's iteration allocate nothing once they are warm.

#[path = "support/common.rs"]
mod common;

use gearlash::solve::family::FrequencyFamily;
use gearlash::solve::galerkin::{Galerkin, GalerkinOptions};
use gearlash::solve::integrate::{Dopri5, Dopri5Options, Integrator};
use gearlash::solve::newton::{Newton, NewtonOptions};
use gearlash::solve::residual::{Linearisation, Residual};
use nalgebra::{DMatrix, DVector};
use std::alloc::{GlobalAlloc, Layout, System as Heap};
use std::cell::Cell;

thread_local! {
    static COUNT: Cell<usize> = const { Cell::new(0) };
}

/// The system's allocator, counting what this thread asks for.
struct Counting;

// The crate itself forbids unsafe code; a test allocator cannot be had without it.
unsafe impl GlobalAlloc for Counting {
    unsafe fn alloc(&self, layout: Layout) -> *mut u8 {
        let _ = COUNT.try_with(|count| count.set(count.get() + 1));
        unsafe { Heap.alloc(layout) }
    }

    unsafe fn dealloc(&self, pointer: *mut u8, layout: Layout) {
        unsafe { Heap.dealloc(pointer, layout) }
    }
}

#[global_allocator]
static ALLOCATOR: Counting = Counting;

fn counted(work: impl FnOnce()) -> usize {
    let before = COUNT.with(Cell::get);
    work();
    COUNT.with(Cell::get) - before
}

#[test]
fn nothing_after_warm_up() {
    assert!(
        counted(|| drop(std::hint::black_box(vec![1.0; 3]))) > 0,
        "the allocator counts"
    );
    let system = common::system(&common::reference("fig11_case1")["system"]);
    for harmonics in [5, 40] {
        let size = GalerkinOptions {
            harmonics,
            samples: 1024,
        };
        let mut problem = Galerkin::new(FrequencyFamily::new(system.clone()), 0.9, size).unwrap();
        let guess = DVector::from_fn(problem.dim(), |k, _| (k as f64).cos() / (1.0 + k as f64));
        let mut work = Linearisation::of(&problem);
        problem.linearise(&guess, 0.9, &mut work).unwrap();
        let linearise = counted(|| problem.linearise(&guess, 0.8, &mut work).unwrap());
        assert_eq!(linearise, 0, "residual and Jacobian, {harmonics} harmonics");
        let mut newton = Newton::new(&problem.structure(), NewtonOptions::default());
        let mut u = guess.clone();
        newton.solve(&mut problem, &mut u, 0.8).unwrap();
        u.copy_from(&guess);
        let mut iterations = 0;
        let solve =
            counted(|| iterations = newton.solve(&mut problem, &mut u, 0.81).unwrap().iterations);
        assert!(iterations > 2);
        assert_eq!(solve, 0, "Newton's iteration, {harmonics} harmonics");
    }
}

#[test]
fn integration_allocates_by_the_call_not_by_the_step() {
    let mut system = common::system(&common::reference("fig11_case1")["system"]);
    system.set_excitation_frequency(0.9);
    let mut integrator = Dopri5::new(&system, Dopri5Options::default());
    let mut count = |turns: f64| {
        let (mut state, mut phi) = ([1.0, 0.5, 0.0, 0.2], DMatrix::identity(4, 4));
        let span = (0.0, turns * std::f64::consts::TAU);
        counted(|| {
            integrator.advance(&system, span, &mut state, &mut ());
            integrator.advance_with_variation(&system, span, &mut state, &mut phi, &mut ());
        })
    };
    count(1.0);
    assert_eq!(count(1.0), count(20.0));
}
