//! Several trajectories of one system side by side.

/// How a trajectory stands after a step.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Status {
    /// On its way.
    Flying,
    /// At the end of its period.
    Arrived,
    /// Something rare has happened: the integrator has to take the period from its begin.
    Lost,
}

/// Places for trajectories that are advanced together, each over one period of the excitation from phase 0.
///
/// A trajectory has the states that the integrator gives it, to the bit, whatever the other places hold.
pub trait Flight: Send {
    /// Number of places.
    fn places(&self) -> usize;

    /// Puts a state [q; v] at phase 0 into a place; `false` where the integrator has to take the period.
    fn start(&mut self, place: usize, state: &[f64]) -> bool;

    /// A step of every trajectory, and how each stands then. Places without one say anything.
    fn step(&mut self, status: &mut [Status]);

    /// State of the trajectory in a place.
    fn state(&self, place: usize, out: &mut [f64]);
}
