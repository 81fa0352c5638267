use std::path::Path;
use std::sync::Mutex;

use rtl_model::cost::{Cost, Technology};
use rtl_model::spec::{MemoryLevels, Partition, Scheduling};

use super::*;
use crate::explore::metric::{METRICS, Metric};
use crate::explore::space::{Candidate, Objective, SpaceWorkload, WorkloadRays};
use crate::sampling::mix;

fn workload(rays: WorkloadRays, side: u32) -> SpaceWorkload {
    SpaceWorkload {
        name: "test".to_owned(),
        scene: Path::new(env!("CARGO_MANIFEST_DIR")).join("scenes/lit-cube/scene.toml"),
        rays,
        elements: Some(96),
        width: side,
        height: side,
        seed: 1,
    }
}

fn evaluator(rays: WorkloadRays, side: u32) -> Evaluator {
    Evaluator::new(vec![WorkloadSetup::new(&workload(rays, side))])
}

fn evaluate(evaluator: &mut Evaluator, jobs: &[Job]) -> Vec<Result<Counted, String>> {
    let results: Mutex<Vec<Option<Result<Counted, String>>>> = Mutex::new(vec![None; jobs.len()]);
    evaluator.evaluate(jobs, &|| false, &|i, counted| results.lock().unwrap()[i] = Some(counted));
    results.into_inner().unwrap().into_iter().map(Option::unwrap).collect()
}

/// A board of many differences from the default; no two seeds give the same.
fn board(seed: u64) -> BoardSpec {
    let pick = |n: u64, from: &[u32]| from[(mix(mix(seed).wrapping_add(n)) % from.len() as u64) as usize];
    let mut spec = BoardSpec {
        partition: [Partition::Grid, Partition::Shells, Partition::ShellsStatic]
            [pick(0, &[0, 1, 2]) as usize],
        scheduling: [Scheduling::Static, Scheduling::PseudoDynamic, Scheduling::Ideal]
            [pick(1, &[0, 1, 2]) as usize],
        memory: [MemoryLevels::None, MemoryLevels::OneLevel, MemoryLevels::Hierarchical]
            [pick(2, &[0, 1, 2]) as usize],
        ..BoardSpec::default()
    };
    spec.clusters.count = pick(3, &[1, 2, 4, 16]);
    spec.clusters.modules = pick(4, &[1, 2, 4]);
    spec.clusters.ctus_per_icu = pick(5, &[1, 4, 16]);
    spec.ctu.contexts = pick(6, &[1, 4, 64]);
    spec.ctu.initiation_interval = pick(7, &[1, 3]);
    spec.ctu.depth = pick(8, &[1, 4, 30]);
    spec.icu.initiation_interval = pick(9, &[1, 2, 30]);
    spec.icu.depth = pick(10, &[1, 22, 60]);
    spec.fifos.ctu_icu = pick(11, &[1, 16]);
    spec.fifos.results = pick(12, &[4, 256]);
    spec.bus.width_bits = pick(13, &[8, 32, 128]);
    spec.bus.burst_bytes = pick(14, &[16, 64, 1024]);
    spec.bus.arbitration_cycles = pick(15, &[0, 4, 40]);
    spec.bus.clock_mhz = f64::from(pick(16, &[5, 25, 100]));
    spec.dispatch.low_resolution_min_bundles = pick(17, &[2, 64]);
    spec.dispatch.host_cycles_per_command = u64::from(pick(18, &[0, 700]));
    spec.formats.coord_frac_bits = pick(19, &[16, 24]);
    spec.patch_cache.bytes = pick(20, &[0, 4096]);
    spec.validate().unwrap();
    spec
}

fn jobs(n: u64) -> Vec<Job> {
    (0..n).map(|seed| Job { spec: board(seed), workload: 0, extent: Extent::Whole }).collect()
}

#[test]
fn evaluate_from_records_counts_what_boards_count_that_trace_every_ray() {
    for (rays, side, n) in [(WorkloadRays::Primary, 16, 12), (WorkloadRays::All, 4, 3)] {
        let setup = WorkloadSetup::new(&workload(rays, side));
        let jobs = jobs(n);
        let counted = evaluate(&mut evaluator(rays, side), &jobs);
        for (job, counted) in jobs.iter().zip(counted) {
            let full = setup.simulate(&job.spec, Extent::Whole).unwrap();
            assert_eq!(counted.unwrap().statistics, full, "{:?}", job.spec);
        }
    }
}

#[test]
fn fewest_cycles_never_exceed_those_of_random_boards_and_come_near_for_some() {
    let mut nearest: f64 = 0.0;
    for (rays, n) in [(WorkloadRays::Primary, 60), (WorkloadRays::Radiosity, 8)] {
        let mut evaluator = evaluator(rays, 40);
        let jobs = jobs(n);
        let counted = evaluate(&mut evaluator, &jobs);
        for (job, counted) in jobs.iter().zip(counted) {
            let cycles = counted.unwrap().statistics.cycles;
            let bound = fewest_cycles(&job.spec, evaluator.work(job).unwrap());
            assert!(bound <= cycles, "{bound} > {cycles}: {:?}", job.spec);
            nearest = nearest.max(bound as f64 / cycles as f64);
        }
    }
    assert!(nearest > 0.9, "{nearest}");
}

#[test]
fn evaluate_on_one_thread_and_two_gives_the_same() {
    let jobs = jobs(6);
    let on = |threads: usize| {
        let pool = rayon::ThreadPoolBuilder::new().num_threads(threads).build().unwrap();
        pool.install(|| evaluate(&mut evaluator(WorkloadRays::Primary, 16), &jobs))
    };
    assert_eq!(on(1), on(2));
}

#[test]
fn evaluate_of_a_board_whose_memory_is_too_small_fails_alone() {
    let mut small = BoardSpec::default();
    small.dram.bytes = 4096;
    small.grid_log2 = Some(4);
    let specs = [BoardSpec::default(), small, BoardSpec::preset("minimal").unwrap()];
    let jobs: Vec<Job> =
        specs.into_iter().map(|spec| Job { spec, workload: 0, extent: Extent::Whole }).collect();
    let counted = evaluate(&mut evaluator(WorkloadRays::Primary, 16), &jobs);
    assert!(counted[0].is_ok() && counted[2].is_ok());
    let error = counted[1].as_ref().unwrap_err();
    assert!(error.contains("dram.bytes") && error.contains("4096"), "{error}");
}

#[test]
fn evaluate_of_a_board_with_its_own_coarser_grid_counts_what_it_counts_alone() {
    let mut spec = BoardSpec::default();
    let shared = evaluator(WorkloadRays::Primary, 16);
    let image = Shared::prepare(&shared.setups[0], &spec.canonical(), Extent::Whole).unwrap().image;
    // The wanted grid just does not fit beside the masks.
    let needed = image.size_bytes() as u64 + spec.mask_bytes(image.n_patches);
    spec.dram.bytes = needed - 64;
    let job = Job { spec: spec.clone(), workload: 0, extent: Extent::Whole };
    let counted = evaluate(&mut evaluator(WorkloadRays::Primary, 16), &[job]).remove(0).unwrap();
    let wide = Job { spec: BoardSpec::default(), workload: 0, extent: Extent::Whole };
    let wide = evaluate(&mut evaluator(WorkloadRays::Primary, 16), &[wide]).remove(0).unwrap();
    assert_ne!(counted.statistics.canonical, wide.statistics.canonical, "another grid, other cells");
    let full = shared.setups[0].simulate(&spec, Extent::Whole).unwrap();
    assert_eq!(counted.statistics, full);
}

#[test]
fn guarded_panic_is_an_error_with_its_message() {
    let hook = std::panic::take_hook();
    std::panic::set_hook(Box::new(|_| {}));
    let caught = guarded(|| -> Result<(), String> { panic!("cell {} is full", 7) });
    std::panic::set_hook(hook);
    assert_eq!(caught, Err("internal error: cell 7 is full".to_owned()));
}

#[test]
fn evaluate_of_a_rung_casts_about_4_to_the_minus_n_of_the_rays() {
    for rays in [WorkloadRays::Primary, WorkloadRays::Radiosity] {
        let mut evaluator = evaluator(rays, 64);
        let mut n_rays = |extent| {
            let job = Job { spec: BoardSpec::default(), workload: 0, extent };
            evaluate(&mut evaluator, &[job]).remove(0).unwrap().statistics.canonical.rays
        };
        let whole = n_rays(Extent::Whole) as f64;
        let rung = n_rays(Extent::Rung(1)) as f64;
        assert!(rung < 0.6 * whole && rung > 0.1 * whole, "{rung} of {whole}");
        assert!(n_rays(Extent::Rung(2)) as f64 <= rung);
    }
}

#[test]
fn evaluate_of_a_sample_of_everything_is_the_whole_without_an_error() {
    let mut evaluator = evaluator(WorkloadRays::Primary, 32);
    let mut run = |extent| {
        evaluate(&mut evaluator, &[Job { spec: BoardSpec::default(), workload: 0, extent }])
            .remove(0)
            .unwrap()
    };
    let whole = run(Extent::Whole);
    let sample = run(Extent::Sample { share: 1.0, seed: 3 });
    assert_eq!(sample.half_width_cycles, Some(0.0));
    assert_eq!(sample.statistics, whole.statistics);
}

fn candidate(spec: BoardSpec) -> Candidate {
    let cost = Cost::of(&spec, Technology::named("osu-0.35um").unwrap());
    Candidate { ordinal: 0, choice: vec![0], spec, cost }
}

fn objectives(goals: &[(&str, crate::explore::metric::Goal)]) -> Vec<Objective> {
    goals.iter().map(|(name, goal)| Objective { metric: Metric::named(name).unwrap(), goal: *goal }).collect()
}

#[test]
fn values_of_a_counted_candidate_are_those_reckoned_by_hand() {
    let spec = BoardSpec { clock_mhz: 50.0, ..BoardSpec::default() };
    let mut statistics = BoardStatistics { cycles: 1_000_000, ..BoardStatistics::default() };
    statistics.canonical.rays = 20_000;
    let candidate = candidate(spec);
    // Two workloads: sums.
    let counted = [Counted::whole(statistics.clone()), Counted::whole(statistics)];
    let accuracy = Accuracy { misclassified: 0.01, image_rmse: Some(0.02) };
    let values = values(&candidate, &counted, Some(&accuracy));
    let of = |name: &str| values[METRICS.iter().position(|m| m.name == name).unwrap()];
    assert_eq!(of("cycles"), Some(2e6));
    assert_eq!(of("seconds"), Some(0.04));
    assert_eq!(of("cycles_per_ray"), Some(50.0));
    assert_eq!(of("rays_per_second"), Some(1e6));
    assert_eq!(of("rays_per_second_per_mm2"), Some(1e6 / candidate.cost.area_mm2.unwrap()));
    assert_eq!(of("clock_mhz"), Some(50.0));
    assert_eq!(of("misclassified"), Some(0.01));
    assert_eq!(of("image_rmse"), Some(0.02));
    let energy = of("energy_j").unwrap();
    assert!(energy > 0.0);
    assert_eq!(of("power_w"), Some(energy / 0.04));
    assert_eq!(of("nj_per_ray"), Some(energy * 1e9 / 40_000.0));
    assert_eq!(of("rays_per_joule"), Some(40_000.0 / energy));
    // Every name has a formula; those of an FPGA in its technology.
    let fpga = Cost::of(&candidate.spec, Technology::named("ecp5").unwrap());
    let on_fpga = super::values(&Candidate { cost: fpga, ..candidate }, &counted, Some(&accuracy));
    for (i, metric) in METRICS.iter().enumerate() {
        assert!(values[i].or(on_fpga[i]).is_some(), "{}", metric.name);
    }
}

#[test]
fn minimised_turns_round_what_is_to_be_maximised_and_needs_all() {
    use crate::explore::metric::Goal::{Maximise, Minimise};
    let objectives = objectives(&[("cycles", Minimise), ("rays_per_second", Maximise)]);
    let mut values = vec![None; METRICS.len()];
    values[0] = Some(7.0);
    assert_eq!(minimised(&objectives, &values), None);
    values[3] = Some(9.0);
    assert_eq!(METRICS[3].name, "rays_per_second");
    assert_eq!(minimised(&objectives, &values), Some(vec![7.0, -9.0]));
}

#[test]
fn optimistic_objectives_are_never_worse_than_those_of_the_run() {
    use crate::explore::metric::Goal::{Maximise, Minimise};
    let all: Vec<Objective> = METRICS
        .iter()
        .flat_map(|metric| [Minimise, Maximise].map(|goal| Objective { metric, goal }))
        .collect();
    let mut evaluator = evaluator(WorkloadRays::Primary, 24);
    let jobs = jobs(10);
    let counted = evaluate(&mut evaluator, &jobs);
    let accuracy = Accuracy { misclassified: 0.01, image_rmse: None };
    for (job, counted) in jobs.iter().zip(counted) {
        let candidate = candidate(job.spec.clone());
        let counted = counted.unwrap();
        let rays = counted.statistics.canonical.rays;
        let known = values(&candidate, std::slice::from_ref(&counted), Some(&accuracy));
        let work = evaluator.work(job).unwrap();
        let best = optimistic(&all, &candidate, fewest_cycles(&job.spec, work), rays, Some(&accuracy));
        let mut finite = 0;
        for (objective, best) in all.iter().zip(best) {
            let Some(value) = minimised(std::slice::from_ref(objective), &known) else { continue };
            assert!(best <= value[0], "{} {best} {value:?}", objective.metric.name);
            finite += usize::from(best.is_finite());
        }
        assert!(finite > 15, "{finite}");
    }
}
