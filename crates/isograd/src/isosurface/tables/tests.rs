use super::*;

/// The two corners of an edge, from the definition in words.
fn corners(e: u8) -> [u8; 2] {
    let m = middle(e);
    let at = |along: u32| {
        (0..3)
            .map(|d| {
                if m[d] == 1 {
                    along as u8 * BIT[d]
                } else {
                    m[d] as u8 / 2 * BIT[d]
                }
            })
            .sum()
    };
    [at(0), at(1)]
}

fn crossed(case: u8) -> Vec<u8> {
    (0..12)
        .filter(|&e| corners(e).iter().filter(|&&c| case >> c & 1 == 1).count() == 1)
        .collect()
}

#[test]
fn edges_are_numbered_as_documented() {
    for e in 0..12 {
        let [a, b] = corners(e);
        assert_eq!((edge(a, b), edge(b, a)), (e, e));
    }
}

#[test]
fn loops_pass_every_crossed_edge_once_and_no_other() {
    for case in 0..=255 {
        let mut passed: Vec<u8> = loops(case).concat();
        passed.sort();
        assert_eq!(passed, crossed(case), "case {case:08b}");
    }
}

#[test]
fn every_loop_has_a_triangulation_without_diagonals_in_faces() {
    let mut longest = 0;
    for case in 0..=255 {
        for cycle in loops(case) {
            longest = longest.max(cycle.len());
            let choices = triangulations(&cycle);
            assert!(!choices.is_empty(), "case {case:08b}: none for {cycle:?}");
            let mut sorted = choices.clone();
            sorted.dedup();
            assert_eq!(sorted.len(), choices.len());
            let neighbors =
                |a, b| (0..cycle.len()).any(|i| [cycle[i], cycle[(i + 1) % cycle.len()]] == [a, b]);
            assert!(choices.iter().all(|of| of.len() == cycle.len() - 2));
            for t in choices.concat() {
                for (a, b) in [(t[0], t[1]), (t[1], t[2]), (t[2], t[0])] {
                    let diagonal = !neighbors(a, b) && !neighbors(b, a);
                    assert!(
                        !diagonal || !share_face(a, b),
                        "case {case:08b}: {a}-{b} in {cycle:?}"
                    );
                }
            }
        }
    }
    assert_eq!(longest, 7);
}

/// Directed edges of the triangles of a case that no other triangle of the case uses the other way: the same for every
/// triangulation of its loops.
fn rim(case: u8) -> Vec<(u8, u8)> {
    let mut whole = Vec::new();
    for of in loops_of(case) {
        let mut rims = of.triangulations().map(|triangles| {
            let sides = |t: &[u8; 3]| [(t[0], t[1]), (t[1], t[2]), (t[2], t[0])];
            let directed: Vec<_> = triangles.iter().flat_map(sides).collect();
            let mut rim = directed.clone();
            rim.retain(|&(a, b)| !directed.contains(&(b, a)));
            rim.sort();
            rim
        });
        let rim = rims.next().expect("a triangulation");
        assert!(rims.all(|other| other == rim), "case {case:08b}");
        whole.extend(rim);
    }
    whole.sort();
    let count = whole.len();
    whole.dedup();
    assert_eq!(
        whole.len(),
        count,
        "case {case:08b}: an edge used twice in one direction"
    );
    whole
}

#[test]
fn neighboring_cubes_meet_along_the_same_segments_in_opposite_directions() {
    let faces = faces();
    for axis in 0..3 {
        let on_face = |e: u8, high: bool| {
            let m = middle(e);
            m[axis] == if high { 2 } else { 0 }
        };
        // The edge on the low face that lies opposite an edge on the high one.
        let across = |e: u8| {
            (0..12)
                .find(|&f| {
                    on_face(f, false) && (0..3).all(|d| d == axis || middle(f)[d] == middle(e)[d])
                })
                .expect("there is one")
        };
        for a in 0..=255u8 {
            for b in 0..=255u8 {
                let meets = faces[2 * axis + 1]
                    .iter()
                    .all(|&c| a >> c & 1 == b >> (c & !BIT[axis]) & 1);
                if !meets {
                    continue;
                }
                let mut high: Vec<_> = rim(a)
                    .into_iter()
                    .filter(|&(p, q)| on_face(p, true) && on_face(q, true))
                    .map(|(p, q)| (across(q), across(p)))
                    .collect();
                let low: Vec<_> = rim(b)
                    .into_iter()
                    .filter(|&(p, q)| on_face(p, false) && on_face(q, false))
                    .collect();
                high.sort();
                assert_eq!(high, low, "axis {axis}: {a:08b} beside {b:08b}");
            }
        }
    }
}

#[test]
fn one_inside_corner_is_cut_off_by_one_triangle_that_faces_away_from_it() {
    for c in 0..8u8 {
        let triangles: Vec<_> = loops_of(1 << c)
            .iter()
            .flat_map(Loop::triangulations)
            .flatten()
            .collect();
        assert_eq!(triangles.len(), 1);
        let p = triangles[0].map(|e| middle(e).map(f64::from));
        let normal = crate::vector::cross(
            crate::vector::sub(p[1], p[0]),
            crate::vector::sub(p[2], p[0]),
        );
        let corner = [c >> 2 & 1, c >> 1 & 1, c & 1].map(|x| 2.0 * f64::from(x));
        assert!(
            crate::vector::dot(normal, crate::vector::sub(corner, p[0])) < 0.0,
            "corner {c}"
        );
    }
}
