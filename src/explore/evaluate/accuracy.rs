//! What a board's number formats do to its answers: rays that meet another patch than in software, and the picture.
//!
//! ```text
//! workload, canonical board --frame::verify_scene--> misclassified / rays, RMSE of the two pictures
//! ```
//! Both depend on the canonical board alone, so candidates that differ in timing share one measurement.

use rtl_model::spec::BoardSpec;
use serde::{Deserialize, Serialize};

use super::WorkloadSetup;
use crate::frame;
use crate::verify::VerifyOptions;

/// Rays of a workload that are verified at most.
const MAX_RAYS: u64 = 50_000;

/// How far a board's answers are from those of software.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
pub struct Accuracy {
    /// Share of rays for which board and software name other patches.
    pub misclassified: f64,
    /// RMSE of the picture over the mean of the software one; `None` without a camera, or where it was not asked for.
    pub image_rmse: Option<f64>,
}

impl Accuracy {
    /// The worse of both.
    pub fn worse(self, other: Accuracy) -> Accuracy {
        Accuracy {
            misclassified: self.misclassified.max(other.misclassified),
            image_rmse: match (self.image_rmse, other.image_rmse) {
                (Some(a), Some(b)) => Some(a.max(b)),
                (a, b) => a.or(b),
            },
        }
    }
}

/// Measures a canonical board in the scene of a workload: rays of both passes, and with `pictures` the picture as well.
///
/// # Errors
/// A fault of scene or board; an answer of the board that its oracle does not share.
pub fn measure(setup: &WorkloadSetup, spec: &BoardSpec, pictures: bool) -> Result<Accuracy, String> {
    let options = VerifyOptions {
        n_rays: MAX_RAYS,
        n_clocked: 0,
        first_test_bits: Vec::new(),
        solve: *setup.solve(),
        picture: setup.picture().clone(),
        compare_image: pictures,
    };
    let workload = &setup.workload;
    let verified = frame::verify_scene(&workload.scene, workload.elements, spec, &options, &mut |_| {})
        .map_err(|e| e.to_string())?;
    let found = &verified.verification;
    if !found.passed() {
        return Err("board and oracle differ: `radeng verify` shows where".to_owned());
    }
    Ok(Accuracy {
        misclassified: found.misclassified.total() as f64 / found.n_rays().max(1) as f64,
        image_rmse: found.image.as_ref().map(|difference| difference.rmse_relative),
    })
}
