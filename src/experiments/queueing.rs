//! Queues of the board against their formulas: Geo/D/1, tandems, Little's identity.
//!
//! ```text
//! Bernoulli arrivals, rho / D a cycle --> sim::Fifo --> server: sim::Pipe of D cycles, one token inside --> waits
//! source that never waits --> Fifo --> server --> Fifo --> server ... --> tokens a cycle
//! a board's run --> every Fifo: sum of sojourn, sum of occupancy
//! ```
//! Mean wait of Geo/D/1, in whole cycles: rho (D - 1) / (2 (1 - rho)); 0 at D = 1, since a clocked source sends one token a
//! cycle at most. A token is seen the cycle after its push; the wait is what is beyond that cycle.
//! Source: Takagi 1993, "Queueing Analysis" III (discrete time); Little 1961.

use rayon::prelude::*;
use rtl_model::sim::{Fifo, FifoStatistics, Pipe, Token};

use super::load::Stage;
use super::plot::{Mark, Panel, Point, Scale, Series};
use super::table::{Table, digits, row};
use super::{Check, ExperimentError, Extent, Findings, board};
use crate::sampling::hash;

/// A token that knows when it came.
#[derive(Clone, Copy, Default)]
struct Customer {
    since: u64,
}

impl Token for Customer {}

/// Takes a token when it has none, and lets it go after exactly so many cycles.
struct Server {
    pipe: Pipe<Customer>,
}

impl Server {
    fn new(service_cycles: u32) -> Server {
        Server { pipe: Pipe::new(service_cycles) }
    }

    /// Lets a served token go into `out`, then takes the next from `queue`; the token taken.
    fn tick(
        &mut self,
        now: u64,
        queue: &mut Fifo<Customer>,
        out: Option<&mut Fifo<Customer>>,
    ) -> Option<Customer> {
        if let (Some(head), Some(out)) = (self.pipe.head().copied(), out) {
            if !out.can_push(now) {
                return None;
            }
            out.push(now, head);
        }
        let is_free = self.pipe.is_empty() || self.pipe.head().is_some();
        let taken = if is_free { queue.pop(now) } else { None };
        self.pipe.step(taken);
        taken
    }
}

/// A queue beside its formula.
pub(super) struct Wait {
    pub(super) rho: f64,
    pub(super) service_cycles: u32,
    pub(super) customers: u64,
    /// Mean wait (cycles).
    pub(super) mean: f64,
    /// Standard error of the mean, from batches.
    pub(super) error: f64,
    pub(super) formula: f64,
    /// Longest wait (cycles).
    pub(super) longest: u64,
}

/// Batches of a run, after one that is thrown away.
const BATCHES: u64 = 40;

/// Depth of the queue: no load tried fills it.
const DEPTH: u32 = 4096;

/// Simulates a queue for `cycles`.
pub(super) fn wait(rho: f64, service_cycles: u32, cycles: u64) -> Wait {
    let mut queue = Fifo::new(DEPTH);
    let mut server = Server::new(service_cycles);
    let d = f64::from(service_cycles);
    // A cycle brings a customer when its hash is under this.
    let threshold = (rho / d * 2_f64.powi(64)) as u64;
    let stream = u64::from(service_cycles) << 32 | (rho * 1e6) as u64;
    let batch_cycles = cycles / (BATCHES + 1);
    let mut batches = vec![(0_u64, 0_u64); BATCHES as usize + 1];
    let mut longest = 0;
    for now in 0..batch_cycles * (BATCHES + 1) {
        if let Some(customer) = server.tick(now, &mut queue, None) {
            let waited = now - customer.since - 1;
            longest = longest.max(waited);
            let batch = &mut batches[(now / batch_cycles) as usize];
            *batch = (batch.0 + waited, batch.1 + 1);
        }
        if hash(1, stream, now) < threshold && queue.can_push(now) {
            queue.push(now, Customer { since: now });
        }
    }
    let batches = &batches[1..];
    let (sum, customers) = batches.iter().fold((0, 0), |s, b| (s.0 + b.0, s.1 + b.1));
    let mean = sum as f64 / customers as f64;
    // Of the ratio of two sums: each batch's excess over the mean, over the mean number of customers.
    let excess = |b: &(u64, u64)| (b.0 as f64 - mean * b.1 as f64).powi(2);
    let variance = batches.iter().map(excess).sum::<f64>() / (BATCHES - 1) as f64;
    let error = (variance / BATCHES as f64).sqrt() / (customers as f64 / BATCHES as f64);
    let formula = rho * (d - 1.0) / (2.0 * (1.0 - rho));
    Wait { rho, service_cycles, customers, mean, error, formula, longest }
}

/// Tokens a cycle through servers in a row, fed as fast as they take; the cycles of filling are left out.
pub(super) fn tandem(services: &[u32], depth: u32, cycles: u64) -> f64 {
    let mut queues: Vec<Fifo<Customer>> = (0..=services.len()).map(|_| Fifo::new(depth)).collect();
    let mut servers: Vec<Server> = services.iter().map(|d| Server::new(*d)).collect();
    let mut out = 0_u64;
    let start = cycles / 4;
    for now in 0..cycles {
        if queues[0].can_push(now) {
            queues[0].push(now, Customer { since: now });
        }
        for (i, server) in servers.iter_mut().enumerate() {
            let (before, after) = queues.split_at_mut(i + 1);
            server.tick(now, &mut before[i], Some(&mut after[0]));
        }
        if queues[services.len()].pop(now).is_some() && now >= start {
            out += 1;
        }
    }
    out as f64 / (cycles - start) as f64
}

/// Servers in a row that are tried: their cycles, and the depth of the queues between them.
const TANDEMS: [(&[u32], u32); 8] = [
    (&[1, 1, 1], 2),
    (&[1, 1, 1], 1),
    (&[3, 1, 2], 2),
    (&[1, 2, 3], 2),
    (&[2, 5, 3], 1),
    (&[2, 5, 3], 16),
    (&[4, 22, 1], 16),
    (&[1, 375, 4], 16),
];

/// Every FIFO of a board after a run of camera rays; queues of results are short enough that a bin counts one occupancy.
pub(super) fn board_links(extent: Extent) -> Result<Vec<FifoStatistics>, ExperimentError> {
    let side = extent.pick(128, 64);
    let load = Stage::cornell_box(600)?.primary(side, side)?;
    let spec = board(|b| b.fifos.results = 64);
    Ok(load.run(&spec)?.links)
}

/// Sum of occupancy over the cycles, from the cycles by occupancy.
pub(super) fn occupancy(link: &FifoStatistics) -> u64 {
    (0..).zip(&link.cycles_by_occupancy).map(|(n, cycles): (u64, &u64)| n * cycles).sum()
}

pub(super) fn run(extent: Extent) -> Result<Findings, ExperimentError> {
    let rhos: &[f64] = extent.pick(&[0.1, 0.3, 0.5, 0.7, 0.8, 0.9], &[0.3, 0.8]);
    let services = [1, 2, 4, 22];
    let cases: Vec<(u32, f64)> =
        services.into_iter().flat_map(|d| rhos.iter().map(move |r| (d, *r))).collect();
    let cycles = extent.pick(2_000_000, 200_000);
    // About as many customers for every D.
    let long = |d: u32| cycles * u64::from(d);
    let waits: Vec<Wait> = cases.into_par_iter().map(|(d, rho)| wait(rho, d, long(d))).collect();

    let columns =
        ["D (cycles)", "rho", "customers", "mean wait (cycles)", "95 % +-", "formula", "off by (sigma)"];
    let mut table = Table::new("Geo/D/1", &columns);
    let mut panel = Panel::new(
        "Mean wait of Geo/D/1: simulated, with 95 % intervals, and rho (D - 1) / (2 (1 - rho))",
        ("load rho", Scale::Linear { from_zero: true }),
        ("wait (cycles)", Scale::Log),
    );
    let sigma = |w: &Wait| if w.error > 0.0 { (w.mean - w.formula) / w.error } else { 0.0 };
    for w in &waits {
        table.push(row![w.service_cycles, w.rho, w.customers, w.mean, 1.96 * w.error, w.formula, sigma(w)]);
    }
    // At D = 1 there is nothing to draw.
    for (colour, d) in services.into_iter().enumerate().skip(1) {
        let formula = (5..=92).map(|i| f64::from(i) / 100.0);
        let formula = formula.map(|rho| (rho, rho * f64::from(d - 1) / (2.0 * (1.0 - rho))));
        panel.series.push(Series::new(format!("D = {d}: formula"), Mark::Dashed, colour, formula));
        let own = waits.iter().filter(|w| w.service_cycles == d);
        let points = own.map(|w| Point { x: w.rho, y: w.mean, error: 1.96 * w.error }).collect();
        panel.series.push(Series { name: format!("D = {d}: simulated"), mark: Mark::Dots, colour, points });
    }

    let columns = ["servers (cycles)", "FIFO depth", "tokens/cycle", "slowest stage"];
    let mut rows = Table::new("Tandems", &columns);
    let mut saturates = true;
    for (services, depth) in TANDEMS {
        let rate = tandem(services, depth, extent.pick(400_000, 40_000));
        // A queue of one entry passes a token every other cycle.
        let slowest = services.iter().copied().max().unwrap_or(1).max(if depth == 1 { 2 } else { 1 });
        let names: Vec<String> = services.iter().map(u32::to_string).collect();
        rows.push(row![names.join(", "), depth, rate, 1.0 / f64::from(slowest)]);
        saturates &= (rate * f64::from(slowest) - 1.0).abs() < 0.005;
    }

    let links = board_links(extent)?;
    let little = links.iter().all(|l| l.bin_tokens == 1 && l.sojourn_cycles == occupancy(l));
    let busy: Vec<&FifoStatistics> = links.iter().filter(|l| l.tokens > 0).collect();
    let tokens: u64 = links.iter().map(|l| l.tokens).sum();
    let mut board_table = Table::new(
        "FIFOs of the board that hold the most",
        &["FIFO", "depth", "tokens", "sojourn (cycles)", "occupancy sum (cycles)", "mean stay (cycles)"],
    );
    let mut fullest = busy.clone();
    fullest.sort_by_key(|l| std::cmp::Reverse((l.sojourn_cycles, l.link.clone())));
    for l in fullest.iter().take(6) {
        let stay = l.sojourn_cycles as f64 / l.tokens as f64;
        board_table.push(row![l.link.as_str(), l.depth, l.tokens, l.sojourn_cycles, occupancy(l), stay]);
    }

    let worst = waits.iter().map(|w| sigma(w).abs()).fold(0.0, f64::max);
    let longest = waits.iter().filter(|w| w.service_cycles == 1).map(|w| w.longest).max().unwrap_or(0);
    let says = vec![
        format!(
            "Of {} queues the one furthest from the formula is {} standard errors off; at D = 1 the longest wait of all is \
             {longest} cycles.",
            waits.len(),
            digits(worst)
        ),
        "A clocked queue is no M/D/1: at D = 1 M/D/1 would wait rho / (2 (1 - rho)) cycles, a clocked queue does not wait."
            .to_owned(),
        "Servers in a row pass what the slowest of them passes, wherever it stands, behind queues of two entries and more; \
         queues of one entry pass at most a token every other cycle."
            .to_owned(),
        format!(
            "Little's identity on a board: {} of {} FIFOs were used, {tokens} tokens went through them, and in each the sum of \
             sojourn is the sum of occupancy.",
            busy.len(),
            links.len()
        ),
    ];
    let checks = vec![
        Check::new(worst < 4.0, "every mean wait is within 4 standard errors of the formula"),
        Check::new(longest == 0, "at D = 1 nobody waits"),
        Check::new(saturates, "every tandem's rate is that of its slowest stage, within 0.5 %"),
        Check::new(little && !busy.is_empty(), "Little's identity holds exactly on every FIFO of the board"),
    ];
    Ok(Findings {
        question: "Do the queues that the board is made of behave as queueing theory says: waits of Geo/D/1, saturation of \
                   a tandem, Little's law?"
            .to_owned(),
        method: format!(
            "The simulator's own FIFO and pipeline, arrivals by a coin tossed every cycle, {cycles} times D cycles a queue; 95 % \
             intervals from {BATCHES} batches. Tandems are fed as fast as they take. Little's identity: camera rays of the \
             Cornell box on the default board, its result queues cut to 64 entries so that every occupancy is counted by itself."
        ),
        tables: vec![table, rows, board_table],
        panels: vec![panel],
        pictures: Vec::new(),
        says,
        checks,
    })
}
