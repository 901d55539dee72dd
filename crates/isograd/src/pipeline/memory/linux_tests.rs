//! Limits of made-up machines.

use super::*;

const MIB: f64 = (1u64 << 20) as f64;

/// A file system with the given files.
struct Machine(tempfile::TempDir);

impl Machine {
    fn new(files: &[(&str, &str)]) -> Self {
        let root = tempfile::tempdir().expect("temporary folder");
        for (path, text) in files {
            let path = root.path().join(path);
            fs::create_dir_all(path.parent().expect("a folder")).expect("creates");
            fs::write(path, text).expect("writes");
        }
        Self(root)
    }

    /// Free MiB, and the limit.
    fn free(&self) -> Option<(f64, MemoryLimit)> {
        free(self.0.path()).map(|free| (free.bytes / MIB, free.limit))
    }
}

const MEMINFO: (&str, &str) = (
    "proc/meminfo",
    "MemTotal: 4194304 kB\nMemAvailable:    1048576 kB\n",
);
const MOUNTS_2: (&str, &str) = (
    "proc/self/mountinfo",
    "23 1 0:21 / /proc rw - proc proc rw\n31 23 0:28 / /sys/fs/cgroup rw,relatime shared:9 - cgroup2 cgroup2 rw,nsdelegate\n",
);
const MOUNTS_1: (&str, &str) = (
    "proc/self/mountinfo",
    "32 31 0:29 / /sys/fs/cgroup/cpu rw - cgroup cgroup rw,cpu\n35 31 0:32 /docker/ab /sys/fs/cgroup/memory rw - cgroup cgroup rw,memory\n41 31 0:38 / /sys/fs/cgroup/unified rw - cgroup2 cgroup2 rw\n",
);

#[test]
fn an_empty_file_system_tells_nothing() {
    assert_eq!(Machine::new(&[]).free(), None);
}

#[test]
fn the_machine_counts_where_nothing_is_limited() {
    let machine = Machine::new(&[
        MEMINFO,
        MOUNTS_2,
        ("proc/self/cgroup", "0::/user.slice\n"),
        ("sys/fs/cgroup/user.slice/memory.max", "max\n"),
        ("sys/fs/cgroup/user.slice/memory.current", "5000000000\n"),
        (
            "proc/self/limits",
            "Limit   Soft Limit   Hard Limit   Units\nMax data size             unlimited            unlimited            bytes\nMax address space         unlimited            unlimited            bytes\n",
        ),
        (
            "proc/self/status",
            "VmSize:\t    3060 kB\nVmData:\t     360 kB\n",
        ),
    ]);
    assert_eq!(machine.free(), Some((1024.0, MemoryLimit::Machine)));
}

#[test]
fn the_least_of_nested_groups_counts_without_the_file_cache() {
    let files = [
        MEMINFO,
        MOUNTS_2,
        ("proc/self/cgroup", "0::/a/b/c\n"),
        // The group of the process: 600 MiB left.
        ("sys/fs/cgroup/a/b/c/memory.max", "734003200"),
        ("sys/fs/cgroup/a/b/c/memory.current", "104857600"),
        // The one above has no limit, and that above it 512 − (412 − 50 − 150) = 300 MiB left.
        ("sys/fs/cgroup/a/b/memory.max", "max"),
        ("sys/fs/cgroup/a/b/memory.current", "104857600"),
        ("sys/fs/cgroup/a/memory.max", "536870912"),
        ("sys/fs/cgroup/a/memory.current", "432013312"),
        (
            "sys/fs/cgroup/a/memory.stat",
            "anon 9\ninactive_anon 3\ninactive_file 52428800\nactive_file 157286400\n",
        ),
        // Not above the process.
        ("sys/fs/cgroup/z/memory.max", "1"),
        ("sys/fs/cgroup/z/memory.current", "1"),
    ];
    let machine = Machine::new(&files);
    assert_eq!(machine.free(), Some((300.0, MemoryLimit::ControlGroup)));
}

#[test]
fn groups_of_version_1_are_found_below_the_mount_of_a_container() {
    let group = "sys/fs/cgroup/memory";
    let [limit, usage, stat] =
        ["limit_in_bytes", "usage_in_bytes", "stat"].map(|name| format!("{group}/memory.{name}"));
    let inner_limit = format!("{group}/inner/memory.limit_in_bytes");
    let inner_usage = format!("{group}/inner/memory.usage_in_bytes");
    let files = [
        MEMINFO,
        MOUNTS_1,
        (
            "proc/self/cgroup",
            "9:name=systemd:/\n4:cpu:/docker/ab\n3:hugetlb,memory:/docker/ab/inner\n0::/\n",
        ),
        (&limit, "268435456\n"),
        (&usage, "209715200\n"),
        (
            &stat,
            "inactive_file 1\ntotal_inactive_file 104857600\ntotal_active_file 0\n",
        ),
        (&inner_limit, "9223372036854771712\n"),
        (&inner_usage, "209715200\n"),
    ];
    let machine = Machine::new(&files);
    assert_eq!(machine.free(), Some((156.0, MemoryLimit::ControlGroup)));
}

#[test]
fn the_path_of_the_host_means_the_root_of_the_mount() {
    for path in ["/docker/ab", "/../other", "/"] {
        let groups = format!("0::{path}\n");
        let files = [
            MEMINFO,
            MOUNTS_2,
            ("proc/self/cgroup", &*groups),
            ("sys/fs/cgroup/memory.max", "104857600"),
            ("sys/fs/cgroup/memory.current", "0"),
        ];
        let machine = Machine::new(&files);
        assert_eq!(
            machine.free(),
            Some((100.0, MemoryLimit::ControlGroup)),
            "{path}"
        );
    }
}

#[test]
fn a_group_above_its_limit_leaves_nothing() {
    let files = [
        MOUNTS_2,
        ("proc/self/cgroup", "0::/\n"),
        ("sys/fs/cgroup/memory.max", "100"),
        ("sys/fs/cgroup/memory.current", "200"),
    ];
    let machine = Machine::new(&files);
    assert_eq!(machine.free(), Some((0.0, MemoryLimit::ControlGroup)));
}

#[test]
fn limits_of_the_process_count_less_what_it_uses() {
    let limits = "Limit                     Soft Limit           Hard Limit           Units     \nMax data size             83886080             unlimited            bytes     \nMax address space         209715200            unlimited            bytes     \n";
    let mut files = vec![
        MEMINFO,
        ("proc/self/limits", limits),
        (
            "proc/self/status",
            "Name:\tisograd\nVmSize:\t  153600 kB\nVmData:\t   20480 kB\n",
        ),
    ];
    let machine = Machine::new(&files);
    assert_eq!(machine.free(), Some((50.0, MemoryLimit::AddressSpace)));
    files[2].1 = "VmSize:\t  102400 kB\nVmData:\t   51200 kB\n";
    let machine = Machine::new(&files);
    assert_eq!(machine.free(), Some((30.0, MemoryLimit::Data)));
}
