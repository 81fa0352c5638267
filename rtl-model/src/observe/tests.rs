//! Consumers against the board's own statistics, over random boards.

use std::collections::BTreeMap;

use proptest::prelude::*;

use super::*;
use crate::board::tests::{Random, any_spec, image_of, random_bundles, random_patches, rays_of};
use crate::board::{Board, Work};
use crate::sim::{Cause, CommandMark, Cycle, Event, Phase};
use crate::spec::{BoardSpec, Partition};
use crate::statistics::BoardStatistics;

/// A run of four commands, its events and what the board counted.
struct Run {
    places: Places,
    seen: Vec<(Cycle, Seen)>,
    /// Rays of each command.
    n_rays: Vec<u32>,
    statistics: BoardStatistics,
    clocked_cycles: u64,
}

fn run(spec: &BoardSpec, seed: u64) -> Run {
    let mut random = Random(seed);
    let n_patches = 1 + random.below(60) as u32;
    let patches = random_patches(&mut random, &spec.formats, n_patches);
    let image = image_of(spec, &patches, 1 + random.below(4) as u32);
    let (n_bundles, most_rays) = [(6, 20), (2, 64)][random.below(2) as usize];
    let bundles = random_bundles(&mut random, &spec.formats, n_bundles, most_rays);
    let rays = rays_of(&spec.formats, &bundles);
    let mut board = Board::new(spec, image).unwrap();
    let places = Places::new(&board.directory()).unwrap();
    let mut events: Vec<Event> = Vec::new();
    let sink = &mut |chunk: &[Event]| events.extend_from_slice(chunk);
    board.trace_nearest_observed(Work::Bundles(&bundles), sink).unwrap();
    board.trace_any_observed(Work::Rays(&rays), sink).unwrap();
    board.trace_any_observed(Work::Bundles(&bundles), sink).unwrap();
    board.trace_nearest_observed(Work::Rays(&rays), sink).unwrap();
    let mut decoder = Decoder::new(&places);
    let seen = events.iter().filter_map(|event| decoder.read(*event).unwrap()).collect();
    let statistics = board.statistics();
    let after = 4 * (spec.bus.interrupt_cycles + spec.dispatch.host_cycles_per_command);
    let clocked_cycles = statistics.cycles - after;
    Run { places, seen, n_rays: vec![rays.len() as u32; 4], statistics, clocked_cycles }
}

/// Every ray of every command lives once; its phases sum to its life, its spans are its phases, no token is left.
fn assert_lives_are_whole(run: &Run) -> Result<(), TestCaseError> {
    let mut lives = Lives::new(&run.places);
    for (command, n) in (0..).zip(&run.n_rays) {
        (0..*n).for_each(|ray| lives.ask(command, ray));
    }
    for (now, seen) in &run.seen {
        lives.see(*now, seen).map_err(|e| TestCaseError::fail(e.to_string()))?;
    }
    let n_rays: u32 = run.n_rays.iter().sum();
    prop_assert_eq!(lives.kept().len(), n_rays as usize, "each ray is born once");
    let mut sums = [0; 7];
    let mut lengths = Vec::new();
    for life in lives.kept() {
        let died = life.died.ok_or_else(|| TestCaseError::fail("a ray outlives the run"))?;
        prop_assert_eq!(life.cycles.iter().sum::<u64>(), died - life.born, "phases sum to the life");
        let ends = life.spans.iter().skip(1).map(|(cycle, _)| *cycle).chain([died]);
        let mut by_spans = [0; 7];
        for ((since, phase), end) in life.spans.iter().zip(ends) {
            by_spans[*phase as usize] += end - since;
        }
        prop_assert_eq!(by_spans, life.cycles);
        sums.iter_mut().zip(life.cycles).for_each(|(sum, n)| *sum += n);
        lengths.push(died - life.born);
        // Every ray is stepped into its first cell, and delivered.
        for phase in [Phase::Stepping, Phase::Returning] {
            prop_assert!(life.cycles[phase as usize] > 0, "{} takes no time", phase.name());
        }
    }
    lengths.sort_unstable();
    prop_assert_eq!((lives.rays().rays, lives.rays().cycles), (u64::from(n_rays), sums));
    prop_assert_eq!(lives.rays().median(), Some(lengths[(lengths.len() - 1) / 2]));
    prop_assert_eq!(
        lives.low_resolution().rays + lives.rays().rays,
        run.statistics.canonical.rays + run.statistics.canonical.low_resolution.rays
    );
    Ok(())
}

/// Causes that events name as the account does.
const EXACT: [Cause; 6] =
    [Cause::Work, Cause::OutputFull, Cause::Resource, Cause::CacheMiss, Cause::Memory, Cause::Bus];

fn assert_intervals_and_roots_close(run: &Run, length: u64) -> Result<(), TestCaseError> {
    let mut intervals = Intervals::new(&run.places, length, usize::MAX);
    let mut roots = Roots::new(&run.places);
    for (now, seen) in &run.seen {
        intervals.see(*now, seen).map_err(|e| TestCaseError::fail(e.to_string()))?;
        roots.see(*now, seen).map_err(|e| TestCaseError::fail(e.to_string()))?;
    }
    prop_assert_eq!(intervals.intervals().len() as u64, run.clocked_cycles.div_ceil(length));
    let blocks = || run.places.blocks.iter().zip(&run.statistics.blocks);
    prop_assert_eq!(run.places.blocks.len(), run.statistics.blocks.len());
    for ((place, counted), account) in blocks().zip(intervals.account()) {
        prop_assert_eq!(&place.name, &counted.block);
        for cause in EXACT {
            prop_assert_eq!(account[cause as usize], counted.of(cause), "{}: {}", &place.name, cause.name());
        }
        prop_assert_eq!(account.iter().sum::<u64>(), run.clocked_cycles, "{}", &place.name);
    }
    for kind in Kind::ALL {
        for cause in EXACT {
            let over_time: u64 = intervals.intervals().iter().map(|i| i.of(kind, cause)).sum();
            let of_kind = blocks().filter(|(place, _)| place.kind == kind);
            let counted: u64 = of_kind.map(|(_, b)| b.of(cause)).sum();
            prop_assert_eq!(over_time, counted, "{}: {}", kind.name(), cause.name());
        }
        let n = blocks().filter(|(place, _)| place.kind == kind).count() as u64;
        if let Some((last, whole)) = intervals.intervals().split_last() {
            prop_assert!(whole.iter().all(|i| i.total(kind) == n * length));
            prop_assert_eq!(last.total(kind), n * (run.clocked_cycles - whole.len() as u64 * length));
        }
    }
    let mut by_block: BTreeMap<u16, u64> = BTreeMap::new();
    for (block, _, cycles) in roots.cycles() {
        *by_block.entry(block).or_default() += cycles;
    }
    for (number, (place, counted)) in (0..).zip(blocks()) {
        let full = counted.of(Cause::OutputFull);
        prop_assert_eq!(by_block.get(&number).copied().unwrap_or(0), full, "{}", &place.name);
    }
    Ok(())
}

/// The table of roots, counted cycle by cycle from the definition alone.
fn roots_by_hand(run: &Run) -> BTreeMap<(u16, u16, Cause), u64> {
    let (blocks, links) = (&run.places.blocks, &run.places.links);
    let (mut causes, mut inside) = (vec![Cause::Idle; blocks.len()], vec![0_u32; links.len()]);
    let mut table = BTreeMap::new();
    let mut seen = run.seen.iter().peekable();
    for now in 0..run.clocked_cycles {
        let mut after = inside.clone();
        while let Some((_, seen)) = seen.next_if(|(at, _)| *at == now) {
            match *seen {
                Seen::Activity { block, cause } => causes[usize::from(block)] = cause,
                Seen::Push { link, .. } => after[usize::from(link)] += 1,
                Seen::Pop { link, .. } => after[usize::from(link)] -= 1,
                _ => {}
            }
        }
        for block in (0..blocks.len()).filter(|b| causes[*b] == Cause::OutputFull) {
            let (mut at, mut visited) = (block, 0);
            while causes[at] == Cause::OutputFull && visited < blocks.len() {
                let full = (0..links.len())
                    .find(|l| usize::from(links[*l].from) == at && inside[*l] == links[*l].depth)
                    .unwrap_or_else(|| panic!("{} is stalled by no full link", blocks[at].name));
                at = usize::from(links[full].to);
                visited += 1;
            }
            *table.entry((block as u16, at as u16, causes[at])).or_default() += 1;
        }
        inside = after;
    }
    table
}

proptest! {
    #![proptest_config(ProptestConfig { cases: 30, ..ProptestConfig::default() })]

    /// A block with a full output always has a full link, and the counted roots are those of the definition.
    #[test]
    fn roots_of_any_board_are_those_counted_cycle_by_cycle(spec in any_spec(), seed: u64) {
        let run = run(&spec, seed);
        let mut roots = Roots::new(&run.places);
        for (now, seen) in &run.seen {
            roots.see(*now, seen).map_err(|e| TestCaseError::fail(e.to_string()))?;
        }
        let mut counted = BTreeMap::new();
        for (block, root, cycles) in roots.cycles() {
            counted.insert((block, root.block, root.cause), cycles);
        }
        prop_assert_eq!(counted, roots_by_hand(&run));
    }
}

proptest! {
    #![proptest_config(ProptestConfig { cases: 100, ..ProptestConfig::default() })]

    /// Lives, roots and intervals of any board close, against its own statistics.
    #[test]
    fn observation_of_any_board_is_whole_and_equals_its_account(
        spec in any_spec(), seed: u64, length in prop_oneof![1u64..50, 1000u64..100_000, Just(u64::MAX)]
    ) {
        let run = run(&spec, seed);
        assert_lives_are_whole(&run)?;
        assert_intervals_and_roots_close(&run, length)?;
    }
}

#[test]
#[ignore = "long: 10,000 random boards"]
fn observation_of_ten_thousand_random_boards_is_whole() {
    let mut runner =
        proptest::test_runner::TestRunner::new(ProptestConfig { cases: 10_000, ..Default::default() });
    let cases = (any_spec(), any::<u64>(), 1u64..5000);
    runner
        .run(&cases, |(spec, seed, length)| {
            let run = run(&spec, seed);
            assert_lives_are_whole(&run)?;
            assert_intervals_and_roots_close(&run, length)
        })
        .unwrap();
}

/// With an ICU that takes 40 cycles a test, whatever is full upstream is so because the ICU works.
#[test]
fn roots_of_a_board_with_a_slow_icu_lie_in_its_work() {
    for partition in [Partition::Grid, Partition::Shells] {
        let mut spec = BoardSpec { partition, ..BoardSpec::default() };
        spec.icu.initiation_interval = 40;
        spec.clusters.count = 1;
        let run = run(&spec, 5);
        let mut roots = Roots::new(&run.places);
        run.seen.iter().for_each(|(now, seen)| roots.see(*now, seen).unwrap());
        let (mut icu, mut all) = (0, 0);
        for (block, root, cycles) in roots.cycles() {
            let kind = |b: u16| run.places.blocks[usize::from(b)].kind;
            if matches!(kind(block), Kind::PatchLoader | Kind::Ctu) {
                all += cycles;
                let is_icu = kind(root.block) == Kind::Icu && root.cause == Cause::Work;
                icu += if is_icu { cycles } else { 0 };
            }
        }
        assert!(all > 1000 && icu * 10 >= all * 9, "{icu} of {all} cycles");
    }
}

#[test]
fn board_observed_answers_and_counts_as_unobserved() {
    let spec = BoardSpec { partition: Partition::ShellsStatic, ..BoardSpec::default() };
    let mut random = Random(3);
    let patches = random_patches(&mut random, &spec.formats, 40);
    let bundles = random_bundles(&mut random, &spec.formats, 12, 20);
    let mut silent = Board::new(&spec, image_of(&spec, &patches, 3)).unwrap();
    let mut observed = silent.clone();
    let mut n_events = 0;
    let hits = observed.trace_nearest_observed(Work::Bundles(&bundles), &mut |chunk| n_events += chunk.len());
    assert_eq!(hits.unwrap(), silent.trace_nearest(Work::Bundles(&bundles)).unwrap());
    assert_eq!(observed.statistics(), silent.statistics());
    assert!(n_events > 1000);
}

#[test]
fn decoder_of_events_that_no_board_tells_names_the_event() {
    use crate::sim::EventKind as K;
    let run = run(&BoardSpec::default(), 1);
    let read = |events: &[Event]| {
        let mut decoder = Decoder::new(&run.places);
        let all: Result<Vec<_>, _> = events.iter().map(|e| decoder.read(*e)).collect();
        all.unwrap_err().to_string()
    };
    let clock = Event::new(0, K::Clock, 0, 0);
    assert_eq!(read(&[Event(u64::MAX)]), "event 0: 0xffffffffffffffff is no event");
    assert_eq!(read(&[Event::new(0, K::Push, 1, 0)]), "event 0: before the first clock event");
    let n = run.places.links.len();
    assert_eq!(
        read(&[clock, Event::new(0, K::Push, 4000, 0)]),
        format!("event 1: link 4000, but the directory has {n}")
    );
    let back = [clock, Event::new(9, K::Push, 0, 0), Event::new(8, K::Pop, 0, 0)];
    assert_eq!(read(&back), "event 2: earlier than the one before it");
    assert_eq!(read(&[clock, Event::new(0, K::Mask, 0, 0)]), "event 1: follows nothing that it ends");
    let cut = [clock, Event::new(0, K::Moves, 3, 0), Event::new(0, K::Push, 0, 0)];
    assert_eq!(read(&cut), "event 2: another event was to come");
    assert!(read(&[clock, Event::new(0, K::Command, 0, 99)]).ends_with("is no event"));
    assert!(run.seen.contains(&(run.clocked_cycles, Seen::Command(CommandMark::End))));
}
