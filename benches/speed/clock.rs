//! Time on a processor, which other programs on the machine disturb less than time on the wall.

/// Whose time is asked for.
#[derive(Clone, Copy)]
enum Whose {
    Thread,
    Process,
}

/// Seconds on a processor, by POSIX's `clock_gettime`.
#[cfg(target_os = "linux")]
fn spent(whose: Whose) -> f64 {
    use rustix::time::{ClockId, clock_gettime};
    let time = clock_gettime(match whose {
        Whose::Thread => ClockId::ThreadCPUTime,
        Whose::Process => ClockId::ProcessCPUTime,
    });
    time.tv_sec as f64 + time.tv_nsec as f64 * 1e-9
}

/// Seconds on the wall, where the processor is not asked.
#[cfg(not(target_os = "linux"))]
fn spent(_: Whose) -> f64 {
    static START: std::sync::OnceLock<std::time::Instant> = std::sync::OnceLock::new();
    START.get_or_init(std::time::Instant::now).elapsed().as_secs_f64()
}

fn timed<T>(whose: Whose, work: impl FnOnce() -> T) -> (f64, T) {
    let before = spent(whose);
    let result = work();
    (spent(whose) - before, result)
}

/// CPU-seconds of this thread for a piece of work; of the clock where the system does not tell.
pub fn thread_seconds<T>(work: impl FnOnce() -> T) -> (f64, T) {
    timed(Whose::Thread, work)
}

/// CPU-seconds of all threads for a piece of work.
pub fn process_seconds<T>(work: impl FnOnce() -> T) -> (f64, T) {
    timed(Whose::Process, work)
}

/// CPU-seconds of the finished child processes of this one, to a hundredth: fields 16 and 17 of
/// `stat`, in ticks of which Linux promises a hundred a second; see proc(5).
pub fn children_seconds() -> Option<f64> {
    let stat = std::fs::read_to_string("/proc/self/stat").ok()?;
    // The name of the program, in parentheses, may hold spaces. Field 3 follows it.
    let fields: Vec<&str> = stat.rsplit_once(')')?.1.split_whitespace().collect();
    let ticks = fields.get(13..15)?.iter().map(|field| field.parse::<u64>().ok());
    Some(ticks.sum::<Option<u64>>()? as f64 * 0.01)
}

/// The median; 0 of nothing.
pub fn median(mut values: Vec<f64>) -> f64 {
    values.sort_by(f64::total_cmp);
    values.get(values.len() / 2).copied().unwrap_or(0.0)
}

/// A pool of so many threads.
pub fn pool(threads: usize) -> rayon::ThreadPool {
    rayon::ThreadPoolBuilder::new().num_threads(threads).build().expect("a pool of threads")
}
