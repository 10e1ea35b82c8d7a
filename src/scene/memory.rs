//! Memory: what the machine can still give, and the refusal of what needs more.
//!
//! Whatever can be large is estimated before it is allocated. Memory that is promised and not there would end the
//! process without a word, and with it a window that holds unsaved work.

use std::path::Path;

/// What is assumed where the system does not say, bytes.
pub const ASSUMED: u64 = 8 << 30;

/// Bytes that are taken without asking.
pub const ALWAYS: u64 = 64 << 20;

/// More memory than can be had; one line without a place.
#[derive(Clone, Debug, PartialEq, Eq, thiserror::Error)]
#[error("{asked} would need {} of memory, of which {} can be had; {advice}", text(*needed), text(*available))]
pub struct Shortage {
    /// What was asked for.
    pub asked: String,
    /// What it would need, bytes.
    pub needed: u64,
    /// What can be had, bytes.
    pub available: u64,
    /// What to lower.
    pub advice: String,
}

/// Holds what `asked` needs (bytes) against what the machine can give now.
///
/// # Errors
/// If it is more.
pub fn check(asked: impl Into<String>, needed: u64, advice: impl Into<String>) -> Result<(), Shortage> {
    // To ask the system takes longer than to take a little.
    if needed <= ALWAYS {
        return Ok(());
    }
    check_against(available(), asked, needed, advice)
}

/// As [`check`], against an amount that was looked up before part of it was taken.
///
/// # Errors
/// If it is more.
pub fn check_against(
    available: u64,
    asked: impl Into<String>,
    needed: u64,
    advice: impl Into<String>,
) -> Result<(), Shortage> {
    if needed <= available {
        return Ok(());
    }
    Err(Shortage { asked: asked.into(), needed, available, advice: advice.into() })
}

/// Bytes of `count` values of `size` bytes each; the largest number if they are more than can be counted.
pub fn bytes(count: u64, size: usize) -> u64 {
    count.saturating_mul(size as u64)
}

/// A number of bytes for people: three digits, in powers of 1000.
pub fn text(bytes: u64) -> String {
    let units = ["B", "kB", "MB", "GB", "TB", "PB", "EB"];
    let mut value = bytes as f64;
    let mut unit = 0;
    // 999.5 and above would be rounded to four digits.
    while value >= 999.5 && unit + 1 < units.len() {
        value /= 1000.0;
        unit += 1;
    }
    let decimals = if unit == 0 || value >= 99.95 {
        0
    } else if value >= 9.995 {
        1
    } else {
        2
    };
    format!("{value:.decimals$} {}", units[unit])
}

/// Bytes that this process can still get: what the system calls available, or less if its control groups or its limit
/// of address space allow less; [`ASSUMED`] where the system does not say.
pub fn available() -> u64 {
    let read = |path: &Path| std::fs::read_to_string(path).ok();
    let of_machine = read(Path::new("/proc/meminfo")).and_then(|t| kibibytes(&t, "MemAvailable:")).unwrap_or(ASSUMED);
    let groups = read(Path::new("/proc/self/cgroup")).map_or_else(Vec::new, |t| group_folders(&t));
    let of_groups = groups.iter().filter_map(|folder| {
        let file = |name: &str| read(&Path::new("/sys/fs/cgroup").join(folder).join(name));
        left(file("memory.max")?.trim(), file("memory.current")?.trim())
    });
    let of_limit = read(Path::new("/proc/self/limits")).and_then(|limits| {
        let used = kibibytes(&read(Path::new("/proc/self/status"))?, "VmSize:")?;
        Some(address_space(&limits)?.saturating_sub(used))
    });
    of_groups.chain(of_limit).fold(of_machine, u64::min)
}

/// The number of a line `name: n kB`, in bytes.
fn kibibytes(text: &str, name: &str) -> Option<u64> {
    let line = text.lines().find(|l| l.starts_with(name))?;
    let number: u64 = line.split_whitespace().nth(1)?.parse().ok()?;
    number.checked_mul(1024)
}

/// The folders of this process's control group (version 2) and of those that it is in, below the root.
fn group_folders(cgroup: &str) -> Vec<String> {
    let Some(path) = cgroup.lines().find_map(|l| l.strip_prefix("0::")) else {
        return Vec::new();
    };
    let parts: Vec<&str> = path.split('/').filter(|p| !p.is_empty() && *p != "..").collect();
    (0..=parts.len()).map(|n| parts[..n].join("/")).collect()
}

/// What a control group leaves; None if it has no limit.
fn left(max: &str, current: &str) -> Option<u64> {
    let max: u64 = max.parse().ok()?;
    Some(max.saturating_sub(current.parse().ok()?))
}

/// The soft limit of address space; None if there is none.
fn address_space(limits: &str) -> Option<u64> {
    let line = limits.lines().find_map(|l| l.strip_prefix("Max address space"))?;
    line.split_whitespace().next()?.parse().ok()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn what_cannot_be_had_is_refused_in_one_line() {
        assert_eq!(check("nothing", 0, ""), Ok(()));
        let error = check("a film of 10 pixels", u64::MAX, "lower --size").expect_err("not on any machine").to_string();
        assert!(error.starts_with("a film of 10 pixels would need 18.4 EB of memory, of which "), "{error}");
        assert!(error.ends_with(" can be had; lower --size") && !error.contains('\n'), "{error}");
        assert_eq!(check_against(100, "all", 100, ""), Ok(()));
        assert!(check_against(99, "all", 100, "").is_err());
    }

    #[test]
    fn counts_do_not_wrap() {
        assert_eq!(bytes(3, 8), 24);
        assert_eq!(bytes(u64::MAX / 2, 8), u64::MAX);
    }

    #[test]
    fn bytes_are_written_with_three_digits() {
        let cases = [
            (0, "0 B"),
            (999, "999 B"),
            (1000, "1.00 kB"),
            (12_345, "12.3 kB"),
            (999_499, "999 kB"),
            (999_500, "1.00 MB"),
            (23_400_000_000, "23.4 GB"),
            (u64::MAX, "18.4 EB"),
        ];
        for (bytes, expected) in cases {
            assert_eq!(text(bytes), expected);
        }
    }

    #[test]
    fn the_system_is_understood() {
        assert_eq!(kibibytes("MemTotal: 5 kB\nMemAvailable:   12 kB\n", "MemAvailable:"), Some(12 * 1024));
        assert_eq!(kibibytes("MemTotal: 5 kB\n", "MemAvailable:"), None);
        assert_eq!(group_folders("1:name=x:/y\n0::/a/b\n"), ["", "a", "a/b"]);
        assert!(group_folders("4:memory:/x\n").is_empty());
        assert_eq!((left("max", "5"), left("12", "5"), left("3", "5")), (None, Some(7), Some(0)));
        let limits = "Limit Soft Hard\nMax address space         4096      unlimited  bytes\n";
        assert_eq!(address_space(limits), Some(4096));
        assert_eq!(address_space("Max address space  unlimited unlimited bytes"), None);
        assert!(available() > 1 << 20);
    }
}
