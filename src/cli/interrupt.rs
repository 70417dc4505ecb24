//! Ctrl-C and SIGTERM: end cleanly, keep what is finished.

use super::failure::INTERRUPTED;
use super::progress::say;
use kinora::frame::RenderControl;
use std::sync::atomic::Ordering;

/// From now on Ctrl-C, SIGTERM and SIGHUP set [`RenderControl::cancel`]: the frame being rendered is
/// given up, a file being written is finished. A second signal ends the program at once; even then
/// no file is torn, for files get their names only when they are whole.
pub fn cancel_on_signal(control: &RenderControl) {
    let cancel = control.cancel.clone();
    let handler = move || {
        if cancel.swap(true, Ordering::SeqCst) {
            std::process::exit(i32::from(INTERRUPTED));
        }
        say("\nstopping; once more to stop at once");
    };
    if let Err(error) = ctrlc::set_handler(handler) {
        // Rendering works without it, only less gracefully stopped.
        say(&format!("warning: cannot catch Ctrl-C: {error}"));
    }
}
