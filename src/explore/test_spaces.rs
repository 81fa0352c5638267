//! Spaces for tests: axes and a search on a small scene.

use std::path::Path;

use super::space::Space;

/// The scene that they trace.
pub fn scene() -> String {
    Path::new(env!("CARGO_MANIFEST_DIR")).join("scenes/lit-cube/scene.toml").display().to_string()
}

/// A space of 16 x 16 camera rays with these axes and further sections, which come after its top-level keys.
pub fn space(axes: &str, sections: &str) -> Space {
    let dir = tempfile::tempdir().unwrap_or_else(|e| panic!("a temporary folder: {e}"));
    let file = dir.path().join("test.toml");
    let scene = scene();
    let text = format!(
        "version = 1\nquestion = \"What is best?\"\nbase = \"delft-1992\"\ntechnology = \"osu-0.35um\"\n\n[axes]\n{axes}\n\n\
         [[workload]]\nscene = \"{scene}\"\nrays = \"primary\"\nwidth = 16\nheight = 16\nelements = 96\n\n\
         [objectives]\nminimise = [\"seconds\", \"area_mm2\"]\n\n{sections}\n"
    );
    std::fs::write(&file, text).unwrap_or_else(|e| panic!("{e}"));
    Space::load(&file).unwrap_or_else(|e| panic!("{e}"))
}
