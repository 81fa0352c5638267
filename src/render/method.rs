//! Methods of pass 2: which light is stored, which is sampled.

use serde::{Deserialize, Serialize};

/// A method of rendering.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "kebab-case")]
pub enum RenderMethod {
    /// Sources that matter by shadow rays, all other light stored (Jansen, Kok 1992).
    #[default]
    TwoPass,
    /// All light stored by pass 1.
    FullRadiosity,
    /// Direct light by shadow rays, a constant ambient term for the rest (Whitted 1980); needs no pass 1.
    Whitted,
    /// Unbiased path tracing (Kajiya 1986); needs no pass 1.
    Path,
}

/// Which paths of light `path` lets into the picture.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "kebab-case")]
pub enum Transport {
    /// All.
    #[default]
    Full,
    /// Those that the two-pass method models: after a diffuse bounce mirrors and closed glass take what they meet, thin glass
    /// lets light straight through; the specular limits hold.
    TwoPass,
}

impl Transport {
    /// Its name, as on the command line.
    pub fn name(self) -> &'static str {
        match self {
            Transport::Full => "full",
            Transport::TwoPass => "two-pass",
        }
    }
}

impl RenderMethod {
    /// Its name, as on the command line.
    pub fn name(self) -> &'static str {
        match self {
            RenderMethod::TwoPass => "two-pass",
            RenderMethod::FullRadiosity => "full-radiosity",
            RenderMethod::Whitted => "whitted",
            RenderMethod::Path => "path",
        }
    }

    /// It shows what pass 1 found.
    pub fn needs_pass_1(self) -> bool {
        match self {
            RenderMethod::TwoPass | RenderMethod::FullRadiosity => true,
            RenderMethod::Whitted | RenderMethod::Path => false,
        }
    }
}
