//! What the laws of a system remember.

use super::{Mount, System};

impl System {
    /// Numbers that all laws remember together.
    pub fn memory_count(&self) -> usize {
        self.memory_count
    }

    /// Numbers of a state [q; v; z].
    pub fn state_size(&self) -> usize {
        2 * self.dof() + self.memory_count
    }

    /// Places of what a law remembers, among the numbers of all.
    pub fn memory_of(&self, connection: usize) -> std::ops::Range<usize> {
        let count = |m: &Mount| m.element.memory_count();
        let begin = self.mounts[..connection].iter().map(count).sum();
        begin..begin + count(&self.mounts[connection])
    }

    /// The system with laws without memory: each on first loading.
    pub fn at_first_loading(&self) -> System {
        let mut copy = self.clone();
        for mount in &mut copy.mounts {
            if let Some(law) = mount.element.first_loading() {
                mount.element = law;
            }
        }
        copy.index();
        copy
    }

    /// Memories of all laws after their first loading up to a state of rest.
    pub fn memory_at_rest(&self, q: &[f64]) -> Vec<f64> {
        let mut memory = vec![0.0; self.memory_count];
        let mut begin = 0;
        for (k, mount) in self.mounts.iter().enumerate() {
            let end = begin + mount.element.memory_count();
            let x: f64 = self.element_map_row(k).iter().map(|(j, w)| w * q[*j]).sum();
            let x = x - mount.transmission_error.as_ref().map_or(0.0, |e| e.mean());
            match mount.element.evolving() {
                Some(law) => memory[begin] = law.loaded(x),
                None => mount.element.project(x, &mut memory[begin..end]),
            }
            begin = end;
        }
        memory
    }
}
