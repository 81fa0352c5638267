//! Which rays' lives are told: by their number, or as those of a pixel.
//!
//! ```text
//! --ray N, --pixel x,y --resolve--> Chosen (number among all or among camera rays) --commands--> (command, ray)
//! ```

use rtl_model::observe::RayLife;

use super::{CommandFact, Picture, TraceError};
use crate::raycast::Purpose;
use crate::render::camera_ray_numbers;

/// What was asked for.
#[derive(Clone, Debug, Default, PartialEq, Eq)]
pub struct Choice {
    /// Numbers among all rays, in the order in which they are cast.
    pub rays: Vec<u64>,
    /// Pixels: column and row from the top left.
    pub pixels: Vec<[u32; 2]>,
}

/// A chosen ray.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Chosen {
    /// The pixel and the sample in it, where a pixel was asked for.
    pub pixel: Option<([u32; 2], u32)>,
    /// Its number among the rays that it was chosen from: camera rays for a pixel, else all.
    pub number: u64,
    /// Of those the ones before the present command.
    before: u64,
    /// Its command and its number there, once it was cast.
    pub cast: Option<(u32, u32)>,
    /// Its life, once the run is over.
    pub life: Option<RayLife>,
}

impl Choice {
    /// True when nothing was asked for.
    pub fn is_empty(&self) -> bool {
        self.rays.is_empty() && self.pixels.is_empty()
    }

    /// The rays, in the order in which they were asked for.
    ///
    /// # Errors
    /// [`TraceError::Window`]: a pixel without or outside of the picture.
    pub(super) fn resolve(&self, picture: Option<Picture>) -> Result<Vec<Chosen>, TraceError> {
        let chosen = |pixel, number| Chosen { pixel, number, before: 0, cast: None, life: None };
        let mut all: Vec<Chosen> = self.rays.iter().map(|number| chosen(None, *number)).collect();
        for [x, y] in &self.pixels {
            let Some(Picture { width, height, samples }) = picture else {
                return Err(TraceError::Window(format!(
                    "--pixel {x},{y}: expected a workload with camera rays"
                )));
            };
            if *x >= width || *y >= height {
                return Err(TraceError::Window(format!(
                    "--pixel {x},{y}: expected a column in 0..={} and a row in 0..={}",
                    width - 1,
                    height - 1
                )));
            }
            let numbers = (0..).zip(camera_ray_numbers(width, height, samples, *x, *y));
            all.extend(numbers.map(|(sample, number)| chosen(Some(([*x, *y], sample)), number)));
        }
        Ok(all)
    }
}

impl Chosen {
    /// Looks for the ray in a command of `n_rays` rays: its number there.
    pub(super) fn look_in(&mut self, command: u32, purpose: Purpose, n_rays: u64) -> Option<u32> {
        if self.cast.is_some() || (self.pixel.is_some() && purpose != Purpose::Primary) {
            return None;
        }
        let place = self.number - self.before;
        if place >= n_rays {
            self.before += n_rays;
            return None;
        }
        let place = u32::try_from(place).ok()?;
        self.cast = Some((command, place));
        Some(place)
    }

    /// Takes its life from those that were kept.
    pub(super) fn find_life(&mut self, kept: &[RayLife]) {
        let found = kept.iter().find(|life| self.cast == Some((life.command, life.ray)));
        self.life = found.cloned();
    }
}

/// Checks that every chosen ray was cast.
///
/// # Errors
/// [`TraceError::Window`] with how many rays there were.
pub(super) fn check_all_cast(chosen: &[Chosen], commands: &[CommandFact]) -> Result<(), TraceError> {
    let Some(missing) = chosen.iter().find(|ray| ray.cast.is_none()) else { return Ok(()) };
    let n: u64 = commands.iter().map(|c| c.rays).sum();
    Err(TraceError::Window(match missing.pixel {
        None => format!(
            "--ray {}: the board cast {n} rays, expected a number in 0..={}",
            missing.number,
            n.saturating_sub(1)
        ),
        Some(([x, y], _)) => format!("--pixel {x},{y}: its camera rays were not cast on the board"),
    }))
}
