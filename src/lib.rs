//! Host of the radiosity engine: from a scene file to an image, with every ray cast through one port.
//!
//! Modules stand in the order in which data flows through them; [`frame`] is the flow itself.

pub mod frame;

pub mod cli;

pub mod units;

pub mod geom;

mod sampling;

mod framed_file;

mod huge_pages;

pub use framed_file::FramedFileError;

pub mod generate;

pub mod scene;

pub mod mesh;

pub mod raycast;

pub mod recorded;

pub mod radiosity;

pub mod photometry;

pub mod direct;

pub mod reconstruct;

pub mod render;

pub mod image;

pub mod verify;

pub mod vectors;

pub mod trace;

pub mod report;

pub mod plot;

pub mod experiments;

#[cfg(feature = "explore")]
pub mod explore;
