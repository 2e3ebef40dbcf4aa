//! Resident memory of the process, where the system tells.

/// Figures in bytes; 0 where they are not known.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub(crate) struct Resident {
    /// Largest so far, mapped files included.
    pub(crate) peak: u64,
    /// Now, without mapped files.
    pub(crate) anonymous: u64,
}

/// The figures now.
pub(crate) fn resident() -> Resident {
    let status = std::fs::read_to_string("/proc/self/status").unwrap_or_default();
    let field = |name: &str| {
        let line = status.lines().find_map(|line| line.strip_prefix(name));
        let kib = line.and_then(|l| l.trim().trim_end_matches(" kB").parse::<u64>().ok());
        kib.unwrap_or(0) * 1024
    };
    Resident { peak: field("VmHWM:"), anonymous: field("RssAnon:") }
}

#[cfg(all(test, target_os = "linux"))]
mod tests {
    use super::*;

    #[test]
    fn the_peak_holds_the_memory_in_use() {
        let block = vec![1_u8; 8 << 20];
        let now = resident();
        assert!(now.anonymous > block.len() as u64, "{now:?}");
        assert!(now.peak >= now.anonymous, "{now:?}");
    }
}
