//! Time on a processor, which other programs on the machine disturb less than time on the wall.

use std::path::Path;
use std::time::Instant;

/// Nanoseconds on a processor come first in the `schedstat` of a thread (Linux,
/// Documentation/scheduler/sched-stats).
fn on_processor(task: &Path) -> Option<f64> {
    let line = std::fs::read_to_string(task.join("schedstat")).ok()?;
    Some(line.split_whitespace().next()?.parse::<f64>().ok()? * 1e-9)
}

/// Seconds that all threads of this process which still run have spent.
fn of_all_threads() -> Option<f64> {
    let tasks = std::fs::read_dir("/proc/self/task").ok()?;
    tasks.map(|task| on_processor(&task.ok()?.path())).sum()
}

fn timed<T>(spent: impl Fn() -> Option<f64>, work: impl FnOnce() -> T) -> (f64, T) {
    let (start, before) = (Instant::now(), spent());
    let result = work();
    let wall = start.elapsed().as_secs_f64();
    (before.zip(spent()).map_or(wall, |(a, b)| b - a), result)
}

/// CPU-seconds of this thread for a piece of work; of the clock where the system does not tell.
pub fn thread_seconds<T>(work: impl FnOnce() -> T) -> (f64, T) {
    timed(|| on_processor(Path::new("/proc/thread-self")), work)
}

/// CPU-seconds of all threads for a piece of work that ends none of them.
pub fn process_seconds<T>(work: impl FnOnce() -> T) -> (f64, T) {
    timed(of_all_threads, work)
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
