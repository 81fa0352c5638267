//! The board of the radiosity engine, cycle by cycle.
//!
//! Data flow: host bus words -> [`packet`] records -> [`board`] (blocks and FIFOs) -> hit records; the arithmetic
//! is in [`datapath`], bit-exact and without time, and [`functional`] runs it without the clock.
//! Nothing here knows a scene, a file or a renderer.

pub mod spec;

pub mod fixed;

pub mod packet;

pub mod datapath;

pub mod oracle;

pub mod memory_image;

pub mod functional;

pub mod answers;

pub mod record;

pub mod sim;

pub mod blocks;

pub mod memory;

pub mod board;

pub mod occupancy;

pub mod statistics;

pub mod observe;

pub mod cost;

/// Raised by every change after which a board may count other cycles, or a workload cast other rays: results that were
/// kept before are not taken for those of now.
pub const MODEL_VERSION: u32 = 2;
