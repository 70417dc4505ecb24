//! How much memory there is, asked before it is taken.
//!
//! Memory that a program asks for and does not get ends it, or the system ends it when the memory is used. So whatever grows
//! with a number in a file (pixels, triangles, elements of a mesh) is asked for first: too much is an error in words, with
//! the sum. What the system says is a hint and no promise, for other programs take memory as well.

use std::fmt;

/// More memory than there is.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Shortage {
    /// Bytes that are needed.
    pub needed: u64,
    /// Bytes that could be had; as many as are needed where only the system's refusal is known.
    pub available: u64,
}

impl fmt::Display for Shortage {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let megabytes = |bytes: u64| bytes.div_ceil(1_000_000);
        write!(
            f,
            "this needs {} MB of memory, and {} MB are to be had",
            megabytes(self.needed),
            self.available / 1_000_000
        )
    }
}

impl std::error::Error for Shortage {}

/// Whether so many bytes can be had: more than what already is, by all limits that the system tells.
///
/// # Errors
/// When they cannot.
pub fn ask(needed: u64) -> Result<(), Shortage> {
    if let Some(available) = available().filter(|available| *available < needed) {
        return Err(Shortage { needed, available });
    }
    let fits = usize::try_from(needed).is_ok_and(|bytes| {
        // Given back at once. The system refuses here what no limit that can be read tells.
        Vec::<u8>::new().try_reserve_exact(bytes).is_ok()
    });
    if fits { Ok(()) } else { Err(Shortage { needed, available: available().unwrap_or(0) }) }
}

/// Bytes that this program could still take; `None` where the system does not tell.
///
/// The least of: memory and swap that are free or can be made free; what the limits of the process (`ulimit -v`, `-d`)
/// leave; what the control groups that it is in leave.
pub fn available() -> Option<u64> {
    let read = |path: &str| std::fs::read_to_string(path).ok();
    let free = read("/proc/meminfo").and_then(|text| {
        Some(field(&text, "MemAvailable:")? + field(&text, "SwapFree:").unwrap_or(0))
    });
    let limits = read("/proc/self/limits").zip(read("/proc/self/status"));
    let limits = limits.map(|(limits, status)| left_by_limits(&limits, &status));
    let groups = read("/proc/self/cgroup").and_then(|text| left_by_groups(&text, read));
    [free, limits.flatten(), groups].into_iter().flatten().min()
}

/// The number after a name, in units of 1024 bytes, as bytes.
fn field(text: &str, name: &str) -> Option<u64> {
    let line = text.lines().find_map(|line| line.strip_prefix(name))?;
    line.split_whitespace().next()?.parse::<u64>().ok()?.checked_mul(1024)
}

/// What `/proc/self/limits` leaves of what `/proc/self/status` says that is taken.
fn left_by_limits(limits: &str, status: &str) -> Option<u64> {
    let limit = |name: &str| -> Option<u64> {
        let line = limits.lines().find_map(|line| line.strip_prefix(name))?;
        line.split_whitespace().next()?.parse().ok()
    };
    let left = |name: &str, taken: &str| {
        Some(limit(name)?.saturating_sub(field(status, taken).unwrap_or(0)))
    };
    let space = left("Max address space", "VmSize:");
    let data = left("Max data size", "VmData:");
    space.into_iter().chain(data).min()
}

/// What the control groups leave, the process's own and those around it: `memory.max` of version 2, or
/// `memory.limit_in_bytes` of version 1. What files hold in memory can be made free.
fn left_by_groups(own: &str, read: impl Fn(&str) -> Option<String>) -> Option<u64> {
    let number = |path: String| read(&path)?.trim().parse::<u64>().ok();
    let files = |folder: &str| {
        let stat = read(&format!("{folder}/memory.stat"))?;
        let line = stat.lines().find_map(|line| line.strip_prefix("inactive_file "))?;
        line.trim().parse::<u64>().ok()
    };
    let left = |folder: &str, limit: &str, taken: &str| {
        let limit = number(format!("{folder}/{limit}"))?;
        let taken = number(format!("{folder}/{taken}"))?;
        Some(limit.saturating_sub(taken.saturating_sub(files(folder).unwrap_or(0))))
    };
    let mut least: Option<u64> = None;
    for line in own.lines() {
        let mut parts = line.splitn(3, ':').skip(1);
        let (Some(kinds), Some(mut group)) = (parts.next(), parts.next()) else { continue };
        let (root, limit, taken) = match kinds {
            "" => ("/sys/fs/cgroup", "memory.max", "memory.current"),
            _ if kinds.split(',').any(|kind| kind == "memory") => {
                ("/sys/fs/cgroup/memory", "memory.limit_in_bytes", "memory.usage_in_bytes")
            }
            _ => continue,
        };
        loop {
            let folder = format!("{root}{}", group.trim_end_matches('/'));
            least = least.into_iter().chain(left(&folder, limit, taken)).min();
            match group.trim_end_matches('/').rfind('/') {
                Some(end) => group = &group[..end],
                None => break,
            }
        }
    }
    least
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn no_machine_has_all_memory_that_there_could_be() {
        assert_eq!(ask(0), Ok(()));
        assert_eq!(ask(1 << 20), Ok(()));
        let shortage = ask(u64::MAX / 2).expect_err("no machine has that");
        assert!(shortage.to_string().contains("9223372036855 MB"), "{shortage}");
    }

    /// Texts as Linux writes them.
    #[test]
    fn the_limits_of_a_process_count_less_what_it_has() {
        let limits = "Limit                     Soft Limit           Hard Limit           Units\n\
                      Max data size             unlimited            unlimited            bytes\n\
                      Max address space         1073741824           unlimited            bytes\n";
        let status = "Name:\tkinora\nVmSize:\t    1024 kB\nVmData:\t      10 kB\n";
        assert_eq!(left_by_limits(limits, status), Some(1_073_741_824 - 1_048_576));
        assert_eq!(left_by_limits("Max address space unlimited unlimited bytes", status), None);
        assert_eq!(
            field("MemFree: 1 kB\nMemAvailable:    2000 kB\n", "MemAvailable:"),
            Some(2_048_000)
        );
    }

    /// The group around is the tighter one; files in memory can be dropped.
    #[test]
    fn the_tightest_control_group_counts() {
        let files = |path: &str| {
            let text = match path {
                "/sys/fs/cgroup/a/b/memory.max" => "max",
                "/sys/fs/cgroup/a/b/memory.current" => "5000",
                "/sys/fs/cgroup/a/memory.max" => "10000",
                "/sys/fs/cgroup/a/memory.current" => "6000",
                "/sys/fs/cgroup/a/memory.stat" => "anon 1\ninactive_file 1500\n",
                "/sys/fs/cgroup/memory/c/memory.limit_in_bytes" => "700",
                "/sys/fs/cgroup/memory/c/memory.usage_in_bytes" => "600",
                _ => return None,
            };
            Some(text.to_owned())
        };
        assert_eq!(left_by_groups("0::/a/b\n", files), Some(5500));
        assert_eq!(left_by_groups("4:cpu,cpuacct:/c\n3:memory:/c\n", files), Some(100));
        assert_eq!(left_by_groups("0::/\n", files), None);
    }
}
