//! What a command does when it is told to end: it removes what is half written.

/// Ctrl-C, the request to end, and a terminal that is closed remove what is half written. A hang-up that is ignored from the beginning
/// stays ignored: so `nohup` asks for it.
#[cfg(unix)]
pub fn leave_nothing_unfinished() {
    use signal_hook::consts::{SIGHUP, SIGINT, SIGTERM};
    let mut handled = vec![SIGINT, SIGTERM];
    handled.extend((!is_ignored(SIGHUP)).then_some(SIGHUP));
    let Ok(mut signals) = signal_hook::iterator::Signals::new(handled) else { return };
    std::thread::spawn(move || {
        if let Some(signal) = signals.forever().next() {
            drift_sim::output::remove_unfinished();
            std::process::exit(128 + signal);
        }
    });
}

/// Whether a signal is ignored, as Linux tells of every process; true where no one tells, so that `nohup` holds everywhere.
#[cfg(unix)]
fn is_ignored(signal: i32) -> bool {
    let status = std::fs::read_to_string("/proc/self/status").unwrap_or_default();
    let ignored = status.lines().find_map(|line| line.strip_prefix("SigIgn:"));
    let ignored = ignored.and_then(|mask| u64::from_str_radix(mask.trim(), 16).ok());
    ignored.is_none_or(|mask| mask >> (signal - 1) & 1 == 1)
}

/// Ctrl-C removes what is half written.
#[cfg(windows)]
pub fn leave_nothing_unfinished() {
    let _ = ctrlc::set_handler(|| {
        drift_sim::output::remove_unfinished();
        std::process::exit(130);
    });
}

#[cfg(not(any(unix, windows)))]
pub fn leave_nothing_unfinished() {}
