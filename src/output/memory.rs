//! How much memory the program has used.

/// The greatest amount of memory that this process has held so far, in bytes, or `None` where the
/// system does not say.
///
/// On Linux it is the line `VmHWM` ("high water mark" of the resident set) of `/proc/self/status`,
/// in units of 1024 bytes; see proc(5).
pub fn peak_memory_bytes() -> Option<u64> {
    parse_high_water_mark(&std::fs::read_to_string("/proc/self/status").ok()?)
}

fn parse_high_water_mark(status: &str) -> Option<u64> {
    let line = status.lines().find_map(|line| line.strip_prefix("VmHWM:"))?;
    let kibibytes: u64 = line.trim().strip_suffix("kB")?.trim().parse().ok()?;
    kibibytes.checked_mul(1024)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn high_water_mark_is_read_in_bytes() {
        assert_eq!(
            parse_high_water_mark("Name:\tx\nVmHWM:\t  12 kB\nVmRSS:\t 9 kB\n"),
            Some(12 * 1024)
        );
        assert_eq!(parse_high_water_mark("VmHWM:\tmuch\n"), None);
    }

    #[cfg(target_os = "linux")]
    #[test]
    fn this_process_uses_between_a_megabyte_and_a_terabyte() {
        let bytes = peak_memory_bytes().expect("Linux says it");
        assert!((1 << 20..1 << 40).contains(&bytes), "{bytes}");
    }
}
