//! What memory the system leaves to this process: as much as nobody uses, and within the limits of its
//! control groups (batch systems and containers set them) and of its address space.

use std::fs;
use std::path::Path;

/// Bytes; `None` where nothing is said.
#[derive(Debug, Clone, Copy)]
pub struct FreeMemory {
    /// Of the machine, shared by the ranks on it.
    pub machine: Option<f64>,
    /// Of the tightest control group, shared by the ranks in it.
    pub group: Option<f64>,
    /// Of this rank's address space.
    pub process: Option<f64>,
}

/// Where the hierarchies of control groups are, with the controller that `/proc/self/cgroup` names
/// them by: version 2 alone, beside version 1, and version 1.
const HIERARCHIES: [(&str, &str); 3] = [("", ""), ("unified", ""), ("memory", "memory")];
/// Limit, use, and the part of the use that is given back when needed, by version 2 and 1.
const FILES: [[&str; 3]; 2] = [
    ["memory.max", "memory.current", "inactive_file "],
    ["memory.limit_in_bytes", "memory.usage_in_bytes", "total_inactive_file "],
];

impl FreeMemory {
    pub fn read() -> Self {
        let read = |path: &str| fs::read_to_string(path).unwrap_or_default();
        let used = kilobytes(&read("/proc/self/status"), "VmSize:").unwrap_or(0.0);
        FreeMemory {
            machine: kilobytes(&read("/proc/meminfo"), "MemAvailable:"),
            group: of_groups(Path::new("/sys/fs/cgroup"), &read("/proc/self/cgroup")),
            process: address_space(&read("/proc/self/limits")).map(|limit| limit - used),
        }
    }
}

/// The least that is left to a control group on the way from this process's to the root; `table`: lines
/// `number:controllers:path`.
fn of_groups(root: &Path, table: &str) -> Option<f64> {
    let lines = table.lines().filter_map(|line| {
        let mut parts = line.splitn(3, ':').skip(1);
        Some((parts.next()?, parts.next()?.trim_start_matches('/')))
    });
    let groups = lines.flat_map(|(controllers, path)| {
        let named = move |name: &str| controllers.split(',').any(|controller| controller == name);
        let known = HIERARCHIES.iter().filter(move |(_, name)| named(name));
        // The group, its parents, and the hierarchy's root: the own group inside a container.
        let ways = known.map(|(folder, _)| root.join(folder));
        ways.flat_map(move |top| Path::new(path).ancestors().map(move |group| top.join(group)))
    });
    groups.filter_map(|group| of_group(&group)).reduce(f64::min)
}

fn of_group(group: &Path) -> Option<f64> {
    FILES.iter().find_map(|[limit, used, idle]| {
        let number = |file: &str| -> Option<f64> {
            fs::read_to_string(group.join(file)).ok()?.trim().parse().ok()
        };
        // "max" where there is none.
        let (limit, used) = (number(limit)?, number(used)?);
        let table = fs::read_to_string(group.join("memory.stat")).unwrap_or_default();
        let idle = table.lines().find_map(|line| line.strip_prefix(idle)?.parse::<f64>().ok());
        Some(limit - used + idle.unwrap_or(0.0))
    })
}

/// Bytes of a line `NAME 123 kB`.
fn kilobytes(table: &str, name: &str) -> Option<f64> {
    let line = table.lines().find(|line| line.starts_with(name))?;
    line.split_whitespace().nth(1)?.parse::<f64>().ok().map(|size| 1024.0 * size)
}

/// Bytes of the soft limit on the address space; `None` if there is none.
fn address_space(limits: &str) -> Option<f64> {
    let line = limits.lines().find(|line| line.starts_with("Max address space"))?;
    line.split_whitespace().nth(3)?.parse().ok()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn tables_of_the_system_are_read() {
        assert_eq!(kilobytes("A: 1 kB\nMemAvailable:    2 kB\n", "MemAvailable:"), Some(2048.0));
        assert_eq!(kilobytes("", "MemAvailable:"), None);
        let limits = |soft: &str| format!("Max address space         {soft}   unlimited  bytes\n");
        assert_eq!(address_space(&limits("3072")), Some(3072.0));
        assert_eq!(address_space(&limits("unlimited")), None);
    }

    /// Files and their contents below a root.
    fn left(files: &[(&str, &str)], table: &str) -> Option<f64> {
        let root = tempfile::tempdir().expect("a scratch folder");
        for (file, text) in files {
            let path = root.path().join(file);
            fs::create_dir_all(path.parent().expect("a folder")).expect("writable");
            fs::write(path, text).expect("writable");
        }
        of_groups(root.path(), table)
    }

    #[test]
    fn the_tightest_group_on_the_way_up_counts() {
        let files = [
            ("job/memory.max", "1000\n"),
            ("job/memory.current", "400\n"),
            ("job/memory.stat", "anon 100\ninactive_file 50\n"),
            ("job/step/memory.max", "max\n"),
            ("job/step/memory.current", "300\n"),
        ];
        assert_eq!(left(&files, "0::/job/step\n"), Some(650.0));
        assert_eq!(left(&files[..3], "0::/job/step\n"), Some(650.0));
        assert_eq!(left(&files[3..], "0::/job/step\n"), None);
        assert_eq!(left(&files, "0::/other\n"), None);
    }

    #[test]
    fn the_root_is_the_own_group_inside_a_container() {
        let files = [("memory.max", "1000"), ("memory.current", "400")];
        assert_eq!(left(&files, "0::/\n"), Some(600.0));
        assert_eq!(left(&files, "0::/a/path/of/the/host\n"), Some(600.0));
    }

    #[test]
    fn older_hierarchies_have_a_folder_of_their_own() {
        let files = [
            ("memory/slurm/job/memory.limit_in_bytes", "5000"),
            ("memory/slurm/job/memory.usage_in_bytes", "4000"),
            ("memory/slurm/job/memory.stat", "inactive_file 1\ntotal_inactive_file 500\n"),
        ];
        assert_eq!(left(&files, "3:cpu:/slurm/job\n4:memory:/slurm/job\n"), Some(1500.0));
        assert_eq!(left(&files, "4:cpuset,memory:/slurm/job/step_0\n"), Some(1500.0));
        assert_eq!(left(&files, "3:cpu:/slurm/job\n"), None);
    }
}
