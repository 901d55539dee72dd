//! Free memory of this process on Linux: the least of what the machine and each limit leave.
//!
//! All figures are text files below `/proc` and `/sys/fs/cgroup`. The functions take the root of the file system, so that
//! tests can use a folder of their own.

use std::fs;
use std::path::{Component, Path, PathBuf};

use super::{AvailableMemory, MemoryLimit};

/// The least of all limits on the file system below `root`, which is `/` but in tests; `None` if no file is there.
pub fn free(root: &Path) -> Option<AvailableMemory> {
    let limits = [
        (MemoryLimit::Machine, machine(root)),
        (MemoryLimit::ControlGroup, control_groups(root)),
        (
            MemoryLimit::AddressSpace,
            of_process(root, "Max address space", "VmSize:"),
        ),
        (
            MemoryLimit::Data,
            of_process(root, "Max data size", "VmData:"),
        ),
    ];
    let known = limits.into_iter().filter_map(|(limit, bytes)| {
        Some(AvailableMemory {
            bytes: bytes?,
            limit,
        })
    });
    known.min_by(|a, b| a.bytes.total_cmp(&b.bytes))
}

/// Memory that programs can get without swapping.
fn machine(root: &Path) -> Option<f64> {
    kibibytes(&read(root.join("proc/meminfo"))?, "MemAvailable:")
}

/// Difference of a resource limit of this process and its present use, `None` if it is unlimited.
fn of_process(root: &Path, limit: &str, used: &str) -> Option<f64> {
    let limits = read(root.join("proc/self/limits"))?;
    let line = limits.lines().find_map(|line| line.strip_prefix(limit))?;
    // The soft limit, the hard one, the unit; `unlimited` is no number.
    let limit: f64 = line.split_whitespace().next()?.parse().ok()?;
    let used = kibibytes(&read(root.join("proc/self/status"))?, used)?;
    Some((limit - used).max(0.0))
}

/// Least of what the memory control groups of this process leave, from its own up to the root of the hierarchy.
fn control_groups(root: &Path) -> Option<f64> {
    let groups = read(root.join("proc/self/cgroup"))?;
    let mounts = read(root.join("proc/self/mountinfo"))?;
    let left = groups.lines().filter_map(|line| {
        // hierarchy:controllers:path, where version 2 has no controllers.
        let mut parts = line.splitn(3, ':').skip(1);
        let (controllers, path) = (parts.next()?, Path::new(parts.next()?));
        let version = match controllers {
            "" => &VERSION_2,
            list if list.split(',').any(|name| name == "memory") => &VERSION_1,
            _ => return None,
        };
        let mount = mounts.lines().find_map(|line| version.mount(line))?;
        version.least_left(root, &mount, path)
    });
    left.min_by(f64::total_cmp)
}

/// Names of the files of one version of control groups.
struct Version {
    file_system: &'static str,
    /// Option of the mount that carries memory; empty if every mount does.
    option: &'static str,
    limit: &'static str,
    usage: &'static str,
    /// Lines of `memory.stat` with the file cache, which is dropped where memory is needed.
    cache: [&'static str; 2],
}

const VERSION_1: Version = Version {
    file_system: "cgroup",
    option: "memory",
    limit: "memory.limit_in_bytes",
    usage: "memory.usage_in_bytes",
    cache: ["total_inactive_file ", "total_active_file "],
};

const VERSION_2: Version = Version {
    file_system: "cgroup2",
    option: "",
    limit: "memory.max",
    usage: "memory.current",
    cache: ["inactive_file ", "active_file "],
};

/// Where a hierarchy of control groups is mounted, and which of its groups is the root there.
struct Mount {
    place: PathBuf,
    group: PathBuf,
}

impl Version {
    /// The mount of a line of `/proc/self/mountinfo`, if it is of this version and carries memory.
    fn mount(&self, line: &str) -> Option<Mount> {
        let (mount, kind) = line.split_once(" - ")?;
        let mut kind = kind.split(' ');
        let options = (kind.next()? == self.file_system).then(|| kind.nth(1))??;
        let carries = self.option.is_empty() || options.split(',').any(|o| o == self.option);
        let mut mount = mount.split(' ').skip(3);
        let (group, place) = (mount.next()?.into(), mount.next()?.into());
        carries.then_some(Mount { place, group })
    }

    /// Least of limit − usage of the group `path` and those above it.
    fn least_left(&self, root: &Path, mount: &Mount, path: &Path) -> Option<f64> {
        // In a container the path may be that of the host, of which nothing but its own part is mounted.
        let below = path.strip_prefix(&mount.group).unwrap_or(Path::new(""));
        let top = root.join(mount.place.strip_prefix("/").ok()?);
        // A path with .. is that of a group outside of the container.
        let inside = below
            .components()
            .all(|part| matches!(part, Component::Normal(_)));
        let own = match inside {
            true => top.join(below),
            false => top.clone(),
        };
        let groups = own.ancestors().take_while(|group| group.starts_with(&top));
        groups
            .filter_map(|group| self.left(group))
            .min_by(f64::total_cmp)
    }

    /// Difference of limit and usage of one group, `None` if it is unlimited.
    fn left(&self, group: &Path) -> Option<f64> {
        let number = |name: &str| read(group.join(name))?.trim().parse::<f64>().ok();
        // `max` is no number; version 1 has the largest multiple of a page instead.
        let limit = number(self.limit).filter(|&limit| limit < 9e18)?;
        let usage = number(self.usage)?;
        let stat = read(group.join("memory.stat")).unwrap_or_default();
        let cache: f64 = stat
            .lines()
            .filter_map(|line| {
                let rest = self.cache.iter().find_map(|name| line.strip_prefix(name));
                rest?.trim().parse::<f64>().ok()
            })
            .sum();
        Some((limit - (usage - cache).max(0.0)).max(0.0))
    }
}

fn read(path: PathBuf) -> Option<String> {
    fs::read_to_string(path).ok()
}

/// Bytes in the line of `text` that begins with `name`, which gives kibibytes.
fn kibibytes(text: &str, name: &str) -> Option<f64> {
    let line = text.lines().find_map(|line| line.strip_prefix(name))?;
    let kib: f64 = line.split_whitespace().next()?.parse().ok()?;
    Some(kib * 1024.0)
}

#[cfg(test)]
#[path = "linux_tests.rs"]
mod tests;
