//! A pipeline of fixed latency that moves as a whole: a token issued in cycle n is at its end in cycle n + depth.
//!
//! ```text
//! issue --> [ depth registers ] --> head          stalls together when the head cannot leave
//! ```

/// The pipeline; one token per stage at most.
#[derive(Clone, Debug)]
pub struct Pipe<T> {
    stages: Box<[Option<T>]>,
    head: usize,
    occupied: u32,
}

impl<T: Copy> Pipe<T> {
    /// An empty pipeline of `depth >= 1` stages.
    ///
    /// # Panics
    /// When `depth` is 0.
    pub fn new(depth: u32) -> Self {
        assert!(depth >= 1, "a pipeline needs a stage");
        Pipe { stages: vec![None; depth as usize].into_boxed_slice(), head: 0, occupied: 0 }
    }

    /// The token that has passed every stage.
    #[inline]
    pub fn head(&self) -> Option<&T> {
        self.stages[self.head].as_ref()
    }

    /// Moves every token on by one stage: the head leaves (the caller has taken it), `input` enters.
    #[inline]
    pub fn step(&mut self, input: Option<T>) {
        self.occupied =
            self.occupied + u32::from(input.is_some()) - u32::from(self.stages[self.head].is_some());
        self.stages[self.head] = input;
        self.head += 1;
        if self.head == self.stages.len() {
            self.head = 0;
        }
    }

    /// True when no stage holds a token.
    #[inline]
    pub fn is_empty(&self) -> bool {
        self.occupied == 0
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn pipe_token_is_not_out_at_depth_minus_one_and_out_at_depth() {
        for depth in 1..30 {
            let mut pipe = Pipe::new(depth);
            pipe.step(Some(1)); // cycle 0
            for _ in 1..depth {
                assert!(pipe.head().is_none(), "out before cycle {depth}");
                pipe.step(None);
            }
            assert_eq!(pipe.head(), Some(&1), "not out in cycle {depth}");
            pipe.step(None);
            assert!(pipe.is_empty());
        }
    }

    #[test]
    fn pipe_fed_every_cycle_delivers_every_cycle_in_order() {
        let mut pipe = Pipe::new(5);
        let mut out = Vec::new();
        for now in 0..50 {
            out.extend(pipe.head().copied());
            pipe.step((now < 40).then_some(now));
        }
        assert_eq!(out, (0..40).collect::<Vec<_>>());
    }
}
