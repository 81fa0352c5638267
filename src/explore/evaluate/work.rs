//! What boards share: a workload's rays as records or commands, with the patch memory, for one canonical board.

use rtl_model::board::Board;
use rtl_model::memory_image::MemoryImage;
use rtl_model::record::RecordedCommand;
use rtl_model::spec::BoardSpec;
use rtl_model::statistics::BoardStatistics;
use serde::Serialize;

use super::estimate::CommandWork;
use crate::explore::space::{SpaceWorkload, WorkloadRays};
use crate::frame::{self, FrameError, SimulateOptions, Simulation, Workload};
use crate::radiosity::SolveOptions;
use crate::raycast::Purpose;
use crate::raycast::commands::CastCommand;
use crate::recorded::Setting;
use crate::render::RenderOptions;

/// How much of a workload.
#[derive(Clone, Copy, Debug, PartialEq, Serialize)]
#[serde(rename_all = "snake_case")]
pub enum Extent {
    /// All of it.
    Whole,
    /// Shortened to about 4^-n of its rays: a smaller picture, or the first commands of pass 1.
    Rung(u32),
    /// A sample of its commands.
    Sample {
        /// Share of them.
        share: f64,
        /// Seed of the choice.
        seed: u64,
    },
}

/// Sides of the smallest picture of a shortened workload.
const MIN_SIDE: u32 = 8;

/// A workload, ready to run on any board.
#[derive(Clone, Debug)]
pub struct WorkloadSetup {
    /// As the space has it.
    pub workload: SpaceWorkload,
    rays: Workload,
    solve: SolveOptions,
    picture: RenderOptions,
}

impl WorkloadSetup {
    /// Of a space's workload.
    pub fn new(workload: &SpaceWorkload) -> WorkloadSetup {
        let &SpaceWorkload { width, height, seed, .. } = workload;
        WorkloadSetup {
            rays: match workload.rays {
                WorkloadRays::Primary => Workload::Primary,
                WorkloadRays::Radiosity => Workload::Radiosity,
                WorkloadRays::Shadow => Workload::Shadow,
                WorkloadRays::All => Workload::All,
            },
            solve: SolveOptions { seed, ..SolveOptions::default() },
            picture: RenderOptions { width, height, samples: 1, seed, ..RenderOptions::default() },
            workload: workload.clone(),
        }
    }

    /// The name of its rays, as on the command line.
    pub fn rays_name(&self) -> &'static str {
        self.rays.name()
    }

    /// Options of pass 1.
    pub(super) fn solve(&self) -> &SolveOptions {
        &self.solve
    }

    /// Options of the picture.
    pub(super) fn picture(&self) -> &RenderOptions {
        &self.picture
    }

    /// The picture of an extent.
    fn picture_of(&self, extent: Extent) -> RenderOptions {
        let shorter = |side: u32| match extent {
            Extent::Rung(n) => (side >> n).max(MIN_SIDE.min(side)),
            Extent::Whole | Extent::Sample { .. } => side,
        };
        RenderOptions {
            width: shorter(self.picture.width),
            height: shorter(self.picture.height),
            ..self.picture.clone()
        }
    }

    /// Everything that the rays depend on, in words.
    ///
    /// # Errors
    /// A fault of the scene.
    pub fn settings(&self) -> Result<Vec<Setting>, FrameError> {
        let board = BoardSpec::default();
        frame::workload_settings(&self.simulation(&board, &self.picture))
    }

    fn simulation<'a>(&'a self, board: &'a BoardSpec, picture: &'a RenderOptions) -> Simulation<'a> {
        Simulation {
            scene: &self.workload.scene,
            elements: self.workload.elements,
            board,
            workload: &self.rays,
            solve: &self.solve,
            picture,
        }
    }

    /// The same work without any record: the board traces every ray itself.
    ///
    /// # Errors
    /// When the board fails.
    pub fn simulate(&self, spec: &BoardSpec, extent: Extent) -> Result<BoardStatistics, String> {
        let options = SimulateOptions {
            elements: self.workload.elements,
            board: spec.clone(),
            workload: self.rays.clone(),
            warm_up_cycles: 0,
            solve: self.solve,
            picture: self.picture_of(extent),
        };
        let run = frame::simulate_scene(&self.workload.scene, &options, None, &mut |_| {});
        let run = run.map_err(|e| e.to_string())?;
        Ok(run.board.into_iter().fold(BoardStatistics::default(), |sum, (_, s)| sum.plus(&s)))
    }

    /// Commands of this workload that an extent leaves out can be told by their purpose.
    fn is_pass_1_work(&self) -> bool {
        matches!(self.workload.rays, WorkloadRays::Radiosity | WorkloadRays::All)
    }
}

/// What boards with one canonical board share.
#[derive(Clone, Debug)]
pub struct Shared {
    /// The patch memory.
    pub image: MemoryImage,
    /// The work, recorded; none where it is sampled.
    pub record: Vec<RecordedCommand>,
    /// The rays; none where they are recorded.
    pub commands: Vec<CastCommand>,
    /// Canonical work of each recorded command.
    pub work: Vec<CommandWork>,
}

impl Shared {
    /// Records or lists the rays of `setup` on the canonical board `spec`.
    ///
    /// # Errors
    /// A fault of scene or board.
    pub(super) fn prepare(setup: &WorkloadSetup, spec: &BoardSpec, extent: Extent) -> Result<Shared, String> {
        let picture = setup.picture_of(extent);
        let simulation = setup.simulation(spec, &picture);
        if let Extent::Sample { .. } = extent {
            let (image, commands) = frame::share_commands(&simulation).map_err(|e| e.to_string())?;
            return Ok(Shared { image, record: Vec::new(), commands, work: Vec::new() });
        }
        let shared = frame::share_work(&simulation).map_err(|e| e.to_string())?;
        let mut commands = shared.record.commands;
        if let (Extent::Rung(n), true) = (extent, setup.is_pass_1_work()) {
            shorten(&mut commands, n);
        }
        let record: Vec<RecordedCommand> = commands.into_iter().map(|(_, command)| command).collect();
        let work = CommandWork::of(spec, &shared.image, &record)?;
        Ok(Shared { image: shared.image, record, commands: Vec::new(), work })
    }
}

/// Keeps the first commands of pass 1 until they have 4^-n of its rays; those of a picture are few already.
fn shorten(commands: &mut Vec<(Purpose, RecordedCommand)>, n: u32) {
    let of_pass_1 = |purpose: Purpose| purpose == Purpose::FormFactor;
    let rays = |(_, command): &(Purpose, RecordedCommand)| command.n_rays();
    let all: u64 = commands.iter().filter(|c| of_pass_1(c.0)).map(rays).sum();
    let mut before = 0;
    commands.retain(|command| {
        if !of_pass_1(command.0) {
            return true;
        }
        let is_kept = before < all >> (2 * n).min(63) || before == 0;
        before += command.1.n_rays();
        is_kept
    });
}

impl CommandWork {
    /// What each of these commands comes to, by a run on the canonical board.
    fn of(
        spec: &BoardSpec,
        image: &MemoryImage,
        record: &[RecordedCommand],
    ) -> Result<Vec<CommandWork>, String> {
        let mut board = Board::new(spec, image.clone()).map_err(|e| e.to_string())?;
        let mut before = board.statistics();
        let mut work = Vec::with_capacity(record.len());
        for command in record {
            board.replay(command).map_err(|e| e.to_string())?;
            let now = board.statistics();
            work.push(CommandWork::counted(&now.since(&before)));
            before = now;
        }
        Ok(work)
    }
}
