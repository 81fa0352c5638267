//! Large tables on large pages: what is read here and there all over a table waits for its address first.
//!
//! ```text
//! table, read at random --madvise--> Linux moves it onto pages of 2 MiB
//! ```
//! With 4 KiB pages every access to a table of tens of MiB walks the page tables, twice over on a virtual machine: 8 % of
//! pass 1 with 358 k elements, more beyond. Systems but Linux, and kernels without such pages, leave all as it is.

/// Smaller tables are left where they are (bytes).
const LEAST_BYTES: usize = 4 << 20;
/// Advice counts in whole pages of this size (bytes).
#[cfg(target_os = "linux")]
const PAGE_BYTES: usize = 4096;
/// Of linux/mman.h; `libc` has it for glibc alone.
#[cfg(target_os = "linux")]
const MADV_COLLAPSE: libc::c_int = 25;

/// Asks for large pages under a table that is filled and that stays where it is. Only speed depends on the answer.
pub(crate) fn move_table<T>(table: &[T]) {
    if size_of_val(table) >= LEAST_BYTES {
        // A kernel that has no such pages, or none left, leaves the table as fast as it was.
        let _ = advise(table);
    }
}

#[cfg(target_os = "linux")]
#[expect(unsafe_code, reason = "memory advice has no safe interface for memory that a Vec owns")]
fn advise<T>(table: &[T]) -> std::io::Result<()> {
    let range = table.as_ptr_range();
    let first = (range.start as usize).next_multiple_of(PAGE_BYTES);
    let end = range.end as usize / PAGE_BYTES * PAGE_BYTES;
    // Collapsing (Linux 6.1) moves what is there at once; older kernels do it in time.
    let mut answer = 0;
    for advice in [libc::MADV_HUGEPAGE, MADV_COLLAPSE] {
        // SAFETY: both kinds of advice change which physical pages stand under an address, never what is read there, what
        // may be done there or whose it is; so other threads may read and write meanwhile. The range is whole pages inside
        // of a slice that this borrow keeps alive; on a system with larger pages the call refuses what is not aligned.
        unsafe {
            answer = libc::madvise(first as *mut libc::c_void, end.saturating_sub(first), advice);
        }
    }
    if answer == 0 { Ok(()) } else { Err(std::io::Error::last_os_error()) }
}

#[cfg(not(target_os = "linux"))]
fn advise<T>(_: &[T]) -> std::io::Result<()> {
    Err(std::io::ErrorKind::Unsupported.into())
}

#[cfg(test)]
mod tests {
    use std::sync::atomic::{AtomicU64, Ordering};

    use super::*;

    /// Bytes on large pages under the mapping that holds `address`, as the kernel tells.
    #[cfg(target_os = "linux")]
    fn huge_bytes(address: usize) -> u64 {
        let maps = std::fs::read_to_string("/proc/self/smaps").unwrap_or_default();
        let mut inside = false;
        let mut bytes = 0;
        for line in maps.lines() {
            let range = line.split_whitespace().next().and_then(|word| word.split_once('-'));
            let hex = |s: &str| usize::from_str_radix(s, 16).ok();
            if let Some((start, end)) = range.and_then(|(start, end)| Some((hex(start)?, hex(end)?))) {
                inside = (start..end).contains(&address);
            } else if let Some(rest) = line.strip_prefix("AnonHugePages:").filter(|_| inside) {
                bytes = 1024 * rest.trim().trim_end_matches(" kB").parse::<u64>().unwrap_or(0);
            }
        }
        bytes
    }

    #[test]
    #[cfg(target_os = "linux")]
    fn a_moved_table_reads_the_same_and_lies_on_large_pages() {
        let table: Vec<u64> = (0..4 << 20).map(|i: u64| i.wrapping_mul(0x9e37_79b9_7f4a_7c15)).collect();
        move_table(&table);
        for (i, x) in table.iter().enumerate() {
            assert_eq!(*x, (i as u64).wrapping_mul(0x9e37_79b9_7f4a_7c15));
        }
        let large = || huge_bytes(&raw const table[table.len() / 2] as usize);
        if large() < 16 << 20 {
            // Another try tells whether the kernel could.
            match advise(&table) {
                Ok(()) => panic!("{} of {} bytes on large pages", large(), size_of_val(&*table)),
                Err(e) => eprintln!("skipped: this kernel gives no large pages now: {e}"),
            }
        }
    }

    #[test]
    fn other_threads_may_write_while_a_table_moves() {
        let table: Vec<AtomicU64> = (0..1 << 20).map(AtomicU64::new).collect();
        std::thread::scope(|scope| {
            let add = || table.iter().for_each(|x| _ = x.fetch_add(1, Ordering::Relaxed));
            scope.spawn(add);
            scope.spawn(add);
            for _ in 0..4 {
                move_table(&table);
            }
        });
        assert!(table.iter().enumerate().all(|(i, x)| x.load(Ordering::Relaxed) == i as u64 + 2));
    }

    #[test]
    fn small_and_empty_tables_stay() {
        move_table::<u64>(&[]);
        move_table(&[1_u8, 2, 3]);
        // Nothing to move: whatever the kernel says of it.
        let _ = (advise::<u64>(&[]), advise(&[1_u8, 2, 3]));
    }
}
