//! Cotangents of refined normals to those of the normals before and of the points.

use pulp::Arch;

use super::GAIN;
use super::forward::{Scratch, sort, sums};
use crate::element::quadric::{self, CENTER, Center, PairBar};
use crate::element::vector3::Vector3;
use crate::neighbors::{Candidates, LANES, Neighborhoods, RadiiCotangent, Radius, rule};
use crate::normals::EPSILON;
use crate::parallel::{self, CHUNK};
use crate::{Real, simd, vector};

/// Buffers of the pullback.
#[derive(Clone, Debug, Default)]
pub struct PullbackScratch<T> {
    forward: Scratch<T>,
    /// Every center, and the cotangent of its normal that does not come through its neighbors, in the order of the cells.
    centers: Vec<[T; CENTER + 3]>,
    /// The numbers of the centers, an array for each; 0 but for the normal where the radius has grown.
    values: [Vec<T>; CENTER],
    sorted: Vec<[T; GATHERED]>,
}

/// Cotangents of a point and of its normal, and `Σ ⟨d̄_j, d_j⟩` of it as a center.
const GATHERED: usize = 7;

/// Turns the `(N, 3)` cotangents of refined normals, `normals_bar`, into those of the `normals` before, and adds to
/// `points_bar`, `(N, 3)`, and `radii_bar` what they mean for the points. `normals` are those that
/// [`forward`](super::forward) was given; all in input order.
pub fn pullback<T: Real>(
    neighborhoods: &Neighborhoods<T>,
    normals: &[[T; 3]],
    normals_bar: &mut [[T; 3]],
    scratch: &mut PullbackScratch<T>,
    points_bar: &mut [[T; 3]],
    radii_bar: &mut RadiiCotangent,
) {
    if neighborhoods.rule != Radius::Auto {
        return;
    }
    find_centers(neighborhoods, normals, normals_bar, scratch);
    let PullbackScratch {
        centers,
        values,
        sorted,
        ..
    } = scratch;
    let (arch, radius) = (Arch::new(), neighborhoods.common_radius);
    let values = values.each_ref().map(|v| &v[..]);
    neighborhoods.gather(values, sorted, &|position, point, candidates| {
        let own = values.map(|v| v[position]);
        simd::vectorized!(arch, gather(point, &own, radius, candidates))
    });
    let (sorted, position) = (&*sorted, neighborhoods.position());
    let direct = |i: usize| {
        let [.., x, y, z] = centers[position[i] as usize];
        [x, y, z]
    };
    parallel::for_each(points_bar, |i, bar| {
        let [x, y, z, ..] = sorted[position[i] as usize];
        *bar = vector::add(*bar, [x, y, z]);
    });
    parallel::for_each(normals_bar, |i, bar| {
        let [.., x, y, z, _] = sorted[position[i] as usize];
        *bar = vector::add(direct(i), [x, y, z]);
    });
    let [common] = parallel::sum_array(sorted.len(), |k| [sorted[k][GATHERED - 1].f64()]);
    // A normal has no unit: it stays if the offsets and the radius are scaled alike.
    radii_bar.add_common(-common);
    add_from_grown(neighborhoods, centers, [points_bar, normals_bar], radii_bar);
}

/// Centers in the order of the cells.
fn find_centers<T: Real>(
    neighborhoods: &Neighborhoods<T>,
    normals: &[[T; 3]],
    normals_bar: &[[T; 3]],
    scratch: &mut PullbackScratch<T>,
) {
    let PullbackScratch {
        forward,
        centers,
        values,
        ..
    } = scratch;
    sort(neighborhoods, normals, &mut forward.normals);
    let before = forward.normals.each_ref().map(|x| &x[..]);
    let arch = Arch::new();
    parallel::resize_large(centers, normals.len(), [T::zero(); CENTER + 3]);
    neighborhoods.for_each_neighborhood(before, centers, &|i, point, radius, candidates| {
        let sums = sums(arch, [point, normals[i]], radius, candidates);
        let [n, bar] = [normals[i], normals_bar[i]].map(|v| Vector3::from(vector::to_f64(v)));
        let pulled = quadric::pull(n, sums, bar, GAIN[0], GAIN[1]);
        let direct: [f64; 3] = pulled.normal_bar.into();
        let mut numbers = [T::zero(); CENTER + 3];
        let both = pulled.center.to_array().into_iter().chain(direct);
        for (out, number) in numbers.iter_mut().zip(both) {
            *out = T::of(number);
        }
        numbers
    });
    let (centers, order) = (&*centers, neighborhoods.index.order());
    for (k, values) in values.iter_mut().enumerate() {
        parallel::fill(values, order.len(), |position| {
            match k >= 3 && neighborhoods.has_grown(order[position] as usize) {
                true => T::zero(),
                false => centers[position][k],
            }
        });
    }
}

#[inline(always)]
fn pair_bar<T: Real>(center: Center<T>, d: [T; 3], normal: [T; 3]) -> PairBar<T> {
    let steepness = T::of(rule::steepness(Radius::Auto));
    center.pair_bar(
        Vector3::from(d),
        Vector3::from(normal),
        T::of(EPSILON),
        steepness,
    )
}

/// Cotangents of a point and of its normal, as a neighbor of others and as a center; the first also as what is left of those
/// of its neighbors.
#[inline(always)]
fn gather<T: Real>(
    point: [T; 3],
    own: &[T; CENTER],
    radius: T,
    candidates: &Candidates<T, CENTER>,
) -> [T; GATHERED] {
    let inverse = T::one() / radius;
    let own = Center::from_array(own);
    let mut sums = [[T::zero(); LANES]; GATHERED];
    candidates.for_each_lanes(
        radius,
        #[inline(always)]
        |lanes| {
            if !lanes.any_counts(point) {
                return;
            }
            for l in 0..LANES {
                let at = [lanes.point[0][l], lanes.point[1][l], lanes.point[2][l]];
                let offset = vector::sub(at, point);
                let counts = vector::norm_squared(offset) <= lanes.limit[l];
                let d = vector::scale(offset, inverse);
                let other = Center::from_array(&std::array::from_fn(
                    #[inline(always)]
                    |m| lanes.values[m][l],
                ));
                let out = pair_bar(own, d, other.n.into());
                let into = pair_bar(other, d.map(|x| -x), own.n.into());
                let from_offset = into.offset.sub(out.offset).scale(inverse);
                let of_normal = out.center.add(into.neighbor);
                let along = out.offset.dot(Vector3::from(d));
                let terms = [
                    from_offset.x,
                    from_offset.y,
                    from_offset.z,
                    of_normal.x,
                    of_normal.y,
                    of_normal.z,
                    along,
                ];
                for (sum, term) in sums.iter_mut().zip(terms) {
                    sum[l] += if counts { term } else { T::zero() };
                }
            }
        },
    );
    sums.map(|lanes| lanes.into_iter().sum::<T>())
}

/// Cotangents of points and normals through one center.
struct Through<T> {
    neighbors: Vec<(u32, [[T; 3]; 2])>,
    radius: f64,
}

/// Adds to the cotangents of points and normals what goes through centers whose radius has grown.
fn add_from_grown<T: Real>(
    neighborhoods: &Neighborhoods<T>,
    centers: &[[T; CENTER + 3]],
    [points_bar, normals_bar]: [&mut [[T; 3]]; 2],
    radii_bar: &mut RadiiCotangent,
) {
    let grown = (0..centers.len()).filter(|&i| neighborhoods.has_grown(i));
    let grown: Vec<usize> = grown.collect();
    // Rounds of a fixed number of centers, so that the lists stay short.
    for round in grown.chunks(4 * CHUNK) {
        let lists = parallel::map_each(round.chunks(CHUNK / 8), |_, task| {
            let through = |&i: &usize| through(neighborhoods, centers, i);
            task.iter().map(through).collect::<Vec<_>>()
        });
        for (&i, through) in round.iter().zip(lists.iter().flatten()) {
            for &(j, [point, normal]) in &through.neighbors {
                let sums = [&mut points_bar[j as usize], &mut normals_bar[j as usize]];
                for (sum, more) in sums.into_iter().zip([point, normal]) {
                    *sum = vector::add(*sum, more);
                }
            }
            radii_bar.add(neighborhoods, i, through.radius);
        }
    }
}

/// Cotangents through the center `i`.
fn through<T: Real>(
    neighborhoods: &Neighborhoods<T>,
    centers: &[[T; CENTER + 3]],
    i: usize,
) -> Through<T> {
    let position = neighborhoods.position();
    let numbers = |i: usize| &centers[position[i] as usize];
    let own = Center::from_array(&std::array::from_fn(|k| numbers(i)[k]));
    let radius = neighborhoods.radius[i];
    let inverse = T::one() / radius;
    let mut neighbors = Vec::new();
    // A center is a neighbor of its own, at a fixed place.
    let of_itself = pair_bar(own, [T::zero(); 3], own.n.into());
    let mut normals: [T; 3] = of_itself.center.add(of_itself.neighbor).into();
    let (mut points, mut along) = ([T::zero(); 3], 0.0);
    neighborhoods.for_each_offset(i, radius, |j, offset| {
        let &[nx, ny, nz, ..] = numbers(j);
        let d = vector::scale(offset, inverse);
        let bar = pair_bar(own, d, [nx, ny, nz]);
        let offset_bar: [T; 3] = bar.offset.scale(inverse).into();
        along += vector::dot(offset_bar, offset).f64();
        points = vector::sub(points, offset_bar);
        normals = vector::add(normals, bar.center.into());
        neighbors.push((j as u32, [offset_bar, bar.neighbor.into()]));
    });
    neighbors.push((i as u32, [points, normals]));
    Through {
        neighbors,
        radius: -along,
    }
}
