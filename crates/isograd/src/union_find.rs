//! Sets of items that are joined to each other. The root of a set is its lowest item, whatever the order of the joins.

use crate::parallel;

/// Items in a piece, whose joins to each other are made in parallel to those of other pieces.
const PIECE: usize = if cfg!(test) { 50 } else { 1 << 15 };

/// Makes `parent` hold the root of each of `n` items. `joined(item)` names items that it is joined to; of each pair at least one
/// names the other.
pub(crate) fn find<I: IntoIterator<Item = u32>>(
    parent: &mut Vec<u32>,
    n: usize,
    joined: impl Fn(usize) -> I + Sync,
) {
    parallel::fill(parent, n, |item| (item % PIECE) as u32);
    let crossing = parallel::map_each(parent.chunks_mut(PIECE), |piece, parent| {
        let (first, mut crossing) = (piece * PIECE, Vec::new());
        for k in 0..parent.len() {
            for other in joined(first + k) {
                match (other as usize).checked_sub(first) {
                    Some(other) if other < parent.len() => join(parent, k as u32, other as u32),
                    _ => crossing.push(((first + k) as u32, other)),
                }
            }
        }
        settle(parent);
        parent.iter_mut().for_each(|root| *root += first as u32);
        crossing
    });
    for (a, b) in crossing.into_iter().flatten() {
        join(parent, a, b);
    }
    settle(parent);
}

/// Joins the sets of `a` and `b`.
pub(crate) fn join(parent: &mut [u32], a: u32, b: u32) {
    // Most pairs share a parent: they are joined already.
    if parent[a as usize] != parent[b as usize] {
        let (a, b) = (root(parent, a), root(parent, b));
        parent[a.max(b) as usize] = a.min(b);
    }
}

/// The root of `a`, with the path to it halved.
pub(crate) fn root(parent: &mut [u32], mut a: u32) -> u32 {
    while parent[a as usize] != a {
        parent[a as usize] = parent[parent[a as usize] as usize];
        a = parent[a as usize];
    }
    a
}

/// Puts the root of each item in the place of its parent, which is never above it.
pub(crate) fn settle(parent: &mut [u32]) {
    for item in 0..parent.len() {
        parent[item] = parent[parent[item] as usize];
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::neighbors::tests::Random;

    /// The lowest item that can be reached from each.
    fn oracle(n: usize, joins: &[(u32, u32)]) -> Vec<u32> {
        let mut lowest: Vec<u32> = (0..n as u32).collect();
        for _ in 0..n {
            for &(a, b) in joins {
                let low = lowest[a as usize].min(lowest[b as usize]);
                (lowest[a as usize], lowest[b as usize]) = (low, low);
            }
        }
        lowest
    }

    #[test]
    fn the_root_is_the_lowest_item_that_can_be_reached() {
        let mut random = Random::new(3);
        for (n, count) in [(0, 0), (1, 1), (170, 60), (170, 120), (500, 400)] {
            let mut item = || ((n as f64 * random.uniform()) as u32).min(n as u32 - 1);
            let joins: Vec<(u32, u32)> = (0..count).map(|_| (item(), item())).collect();
            let mut parent = Vec::new();
            find(&mut parent, n, |a| {
                let of_a = joins.iter().filter(move |join| join.0 as usize == a);
                of_a.map(|join| join.1)
            });
            assert_eq!(parent, oracle(n, &joins), "{n} {count}");
        }
    }
}
