//! Ctrl-C and SIGTERM as a wish to end with what there is.

use std::sync::Arc;
use std::sync::atomic::{AtomicBool, Ordering};

use signal_hook::consts::{SIGINT, SIGTERM};
use signal_hook::flag;

/// The wish. Listened to only from the first question on: before there is anything to keep, signals end the run as ever.
#[derive(Debug, Default)]
pub(super) struct Interrupt {
    asked: Option<Arc<AtomicBool>>,
    fault: Option<String>,
}

impl Interrupt {
    /// True once the wish was made. A second signal ends the run at once.
    pub fn stop(&mut self) -> bool {
        self.flag().load(Ordering::Relaxed)
    }

    /// Set once the wish was made; for other threads.
    pub fn flag(&mut self) -> &Arc<AtomicBool> {
        self.asked.get_or_insert_with(|| {
            let asked = Arc::new(AtomicBool::new(false));
            for signal in [SIGINT, SIGTERM] {
                let listened = flag::register_conditional_shutdown(signal, 128 + signal, asked.clone())
                    .and_then(|_| flag::register(signal, asked.clone()));
                if let Err(e) = listened {
                    self.fault = Some(format!("Ctrl-C ends the run without keeping anything: {e}"));
                }
            }
            asked
        })
    }

    /// Why it does not work, where it does not.
    pub fn warning(self) -> Option<String> {
        self.fault
    }
}
