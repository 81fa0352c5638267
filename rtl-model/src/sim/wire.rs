//! A register between two blocks whose reader always takes: set in cycle n, seen in cycle n + 1 only.

/// The register.
#[derive(Clone, Copy, Debug, Default)]
pub struct Wire<T> {
    seen: Option<T>,
    staged: Option<T>,
}

impl<T: Copy> Wire<T> {
    /// An empty register.
    pub fn new() -> Self {
        Wire { seen: None, staged: None }
    }

    /// Sets what the reader sees in the next cycle. At most once a cycle.
    #[inline]
    pub fn set(&mut self, value: T) {
        debug_assert!(self.staged.is_none(), "a wire is driven twice in a cycle");
        self.staged = Some(value);
    }

    /// What was set in the last cycle.
    #[inline]
    pub fn get(&self) -> Option<T> {
        self.seen
    }

    /// True when nothing is on the way.
    pub fn is_empty(&self) -> bool {
        self.seen.is_none() && self.staged.is_none()
    }

    /// The clock edge.
    #[inline]
    pub fn commit(&mut self) {
        // Most wires are quiet in most cycles: no copy then.
        if self.seen.is_some() | self.staged.is_some() {
            self.seen = self.staged.take();
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn wire_value_is_seen_in_the_next_cycle_only() {
        let mut wire = Wire::new();
        wire.set(3);
        assert_eq!(wire.get(), None);
        wire.commit();
        assert_eq!(wire.get(), Some(3));
        wire.commit();
        assert_eq!(wire.get(), None);
    }
}
