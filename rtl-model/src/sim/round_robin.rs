//! Fair choice among up to 64 requesters.

/// The first set bit of `mask` at or after position `start`, going round; `None` when the mask is empty.
#[inline]
pub fn next_set_bit(mask: u64, start: u32) -> Option<u32> {
    if mask == 0 {
        return None;
    }
    let ahead = mask & (u64::MAX << (start & 63));
    Some(if ahead != 0 { ahead.trailing_zeros() } else { mask.trailing_zeros() })
}

/// The first of `n` requesters that `wants`, from `start <= n` on, going round. No division: it is asked every cycle.
#[inline]
pub fn next_in_turn(n: usize, start: usize, mut wants: impl FnMut(usize) -> bool) -> Option<usize> {
    (start..n).chain(0..start).find(|&i| wants(i))
}

/// Calls `f` with every set bit's position, lowest first.
#[inline]
pub fn for_each_bit(mut mask: u64, mut f: impl FnMut(usize)) {
    while mask != 0 {
        f(mask.trailing_zeros() as usize);
        mask &= mask - 1;
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn next_set_bit_serves_every_requester_in_turn() {
        let mask = 0b1010_0010;
        let mut start = 0;
        let mut order = Vec::new();
        for _ in 0..6 {
            let bit = next_set_bit(mask, start).unwrap();
            order.push(bit);
            start = bit + 1;
        }
        assert_eq!(order, [1, 5, 7, 1, 5, 7]);
        assert_eq!(next_set_bit(0, 3), None);
        assert_eq!(next_set_bit(1 << 63, 64), Some(63));
    }

    #[test]
    fn next_in_turn_serves_every_requester_in_turn() {
        let wants = |i| [1, 5, 7].contains(&i);
        let mut start = 0;
        let order = [(); 6].map(|()| {
            let next = next_in_turn(8, start, wants).unwrap();
            start = next + 1;
            next
        });
        assert_eq!(order, [1, 5, 7, 1, 5, 7]);
        assert_eq!(next_in_turn(8, 8, |_| false), None);
    }
}
