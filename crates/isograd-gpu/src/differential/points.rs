//! The quantities at arbitrary points, and their pullback.

use cubecl::prelude::*;

use super::gradient::{add_gradient, unit, unit_pullback};
use super::spot::{Corner, CornerLaunch, Corners, NUMBERS, Spot, slope, spot};
use super::{BLOCK, Differential, mean_curvature_pullback};
use crate::device::check_length;
use crate::grid::{self, Lattice, check_field};
use crate::splat::{Refused, SampleOrder};
use crate::spread::{Before, spread};
use crate::vector::{Vector3, is_finite};
use crate::{Buffer, Device, Error, Scalar};

/// Cells between the lowest of the eight round a point and the others.
const REACH: u32 = 1;

/// What is known of `φ` at `(N, 3)` points.
#[derive(Clone, Debug)]
pub struct Local<T> {
    /// `(N, 3)`: `∇φ`, per unit length.
    pub gradient: Buffer<T>,
    /// `(N, 3)`: `∇φ/|∇φ|`, outward; zero where the gradient is.
    pub normal: Buffer<T>,
    /// `(N,)`: `div(∇φ/|∇φ|)`, per unit length.
    pub curvature: Buffer<T>,
}

/// Cotangents of [`Local`]; what is left out counts as zero.
#[derive(Clone, Copy, Debug)]
pub struct LocalCotangent<'a, T> {
    /// `(N, 3)`.
    pub gradient: Option<&'a Buffer<T>>,
    /// `(N, 3)`.
    pub normal: Option<&'a Buffer<T>>,
    /// `(N,)`.
    pub curvature: Option<&'a Buffer<T>>,
}

impl<T> Default for LocalCotangent<'_, T> {
    fn default() -> Self {
        Self {
            gradient: None,
            normal: None,
            curvature: None,
        }
    }
}

impl<T: Scalar> Differential<T> {
    /// At `(N, 3)` points, in their order: trilinear between cell centers, and on linearly in the half cell along the
    /// walls. The CPU refuses points outside the grid. To know costs a wait for the device: here all is zero
    /// there, and [`Self::outside`] tells of them when it is asked.
    ///
    /// # Errors
    /// [`Error::Length`], [`Error::TooLarge`].
    pub fn at_points<R: Runtime>(
        &self,
        device: &Device<R>,
        points: &Buffer<T>,
    ) -> Result<Local<T>, Error> {
        let count = points.len() / 3;
        check_length("the array of points", points, 3 * count)?;
        let local = Local {
            gradient: device.empty(3 * count)?,
            normal: device.empty(3 * count)?,
            curvature: device.empty(count)?,
        };
        let [x, y, z] = self.grid.upper();
        interpolate_at_points::launch::<T, R>(
            device.client(),
            device.groups(count, BLOCK),
            CubeDim::new_1d(BLOCK),
            points.arg(),
            self.gradient.arg(),
            self.curvature.arg(),
            local.gradient.arg(),
            local.normal.arg(),
            local.curvature.arg(),
            grid::arg(&self.grid),
            CornerLaunch::new(x, y, z),
            count as u32,
        );
        Ok(local)
    }

    /// The points that are not in the grid, NaN included, if any. Waits for the device.
    ///
    /// # Errors
    /// [`Error::Length`], [`Error::TooLarge`], [`Error::Failed`].
    pub fn outside<R: Runtime>(
        &self,
        device: &Device<R>,
        points: &Buffer<T>,
    ) -> Result<Option<Refused>, Error> {
        self.order(device, points)?.refused(device)
    }

    /// Points by the lowest of the eight cells round them.
    fn order<R: Runtime>(
        &self,
        device: &Device<R>,
        points: &Buffer<T>,
    ) -> Result<SampleOrder, Error> {
        let count = points.len() / 3;
        check_length("the array of points", points, 3 * count)?;
        let keys = device.empty(count)?;
        let [x, y, z] = self.grid.upper();
        find_lowest::launch::<T, R>(
            device.client(),
            device.groups(count, BLOCK),
            CubeDim::new_1d(BLOCK),
            points.arg(),
            keys.arg(),
            grid::arg(&self.grid),
            CornerLaunch::new(x, y, z),
            count as u32,
        );
        SampleOrder::from_keys(device, &keys, self.grid.shape())
    }

    /// Adds what the cotangents `bar` of [`Self::at_points`] mean for `phi`, the field that this was made of, and
    /// for the `(N, 3)` points to `phi_bar` `(nx, ny, nz)` and `points_bar` `(N, 3)`. The grid is held constant. At a
    /// point that passes from one cell-center cube to the next the derivative is that of the cube on the high
    /// side. Points outside the grid get and give nothing.
    ///
    /// # Errors
    /// [`Error::Length`], [`Error::TooLarge`].
    pub fn pullback_at_points<R: Runtime>(
        &self,
        device: &Device<R>,
        phi: &Buffer<T>,
        points: &Buffer<T>,
        bar: LocalCotangent<'_, T>,
        phi_bar: &Buffer<T>,
        points_bar: &Buffer<T>,
    ) -> Result<(), Error> {
        check_length("the cotangent of the points", points_bar, points.len())?;
        check_field("the field", phi, &self.grid)?;
        check_field("the cotangent of the field", phi_bar, &self.grid)?;
        let order = self.order(device, points)?;
        let shares = self.pull_points(device, points, bar, points_bar)?;
        let column = |column| self.spread_column(device, points, &shares, &order, column);
        if bar.gradient.is_some() || bar.normal.is_some() {
            let (x, y, z) = (column(0)?, column(1)?, column(2)?);
            add_gradient(device, &self.grid, [&x, &y, &z], false, phi_bar)?;
        }
        if bar.curvature.is_some() {
            let of_curvature = column(3)?;
            let (grid, options) = (&self.grid, &self.options);
            mean_curvature_pullback(device, phi, grid, options, &of_curvature, phi_bar)?;
        }
        Ok(())
    }

    /// One column of the `(N, 4)` shares of the points, spread over the cells.
    fn spread_column<R: Runtime>(
        &self,
        device: &Device<R>,
        points: &Buffer<T>,
        shares: &Buffer<T>,
        order: &SampleOrder,
        column: u32,
    ) -> Result<Buffer<T>, Error> {
        let count = points.len() / 3;
        let sorted: Buffer<T> = device.empty(NUMBERS * count)?;
        let [x, y, z] = self.grid.upper();
        sort_column::launch::<T, R>(
            device.client(),
            device.groups(count, BLOCK),
            CubeDim::new_1d(BLOCK),
            points.arg(),
            shares.arg(),
            order.keys.arg(),
            order.places.arg(),
            sorted.arg(),
            grid::arg(&self.grid),
            CornerLaunch::new(x, y, z),
            count as u32,
            column,
        );
        let out = device.empty(self.grid.cells())?;
        spread::<R, T, Corners>(device, &sorted, order, REACH, Before::Replaced, &out)?;
        Ok(out)
    }

    /// Cotangents of the interpolated gradient and curvature at each point, `(N, 4)`; adds those of the points.
    fn pull_points<R: Runtime>(
        &self,
        device: &Device<R>,
        points: &Buffer<T>,
        bar: LocalCotangent<'_, T>,
        points_bar: &Buffer<T>,
    ) -> Result<Buffer<T>, Error> {
        let count = points.len() / 3;
        let nothing = device.empty(0)?;
        for (what, given, length) in [
            ("the cotangent of the gradients", bar.gradient, 3 * count),
            ("the cotangent of the normals", bar.normal, 3 * count),
            ("the cotangent of the curvatures", bar.curvature, count),
        ] {
            given.map_or(Ok(()), |given| check_length(what, given, length))?;
        }
        let shares = device.empty(NUMBERS * count)?;
        let [x, y, z] = self.grid.upper();
        pull_to_shares::launch::<T, R>(
            device.client(),
            device.groups(count, BLOCK),
            CubeDim::new_1d(BLOCK),
            points.arg(),
            self.gradient.arg(),
            self.curvature.arg(),
            bar.gradient.unwrap_or(&nothing).arg(),
            bar.normal.unwrap_or(&nothing).arg(),
            bar.curvature.unwrap_or(&nothing).arg(),
            shares.arg(),
            points_bar.arg(),
            grid::arg(&self.grid),
            CornerLaunch::new(x, y, z),
            count as u32,
            bar.gradient.is_some(),
            bar.normal.is_some(),
            bar.curvature.is_some(),
        );
        Ok(shares)
    }
}

/// The interpolated gradient.
#[cube]
fn gradient_of<F: Float + CubeElement>(
    gradient: &Array<F>,
    spot: Spot<F>,
    grid: &Lattice<F>,
) -> Vector3<F> {
    let mut x = F::new(0.0);
    let mut y = F::new(0.0);
    let mut z = F::new(0.0);
    for corner in 0u32..8u32 {
        let w = spot.weights(corner);
        let g = Vector3::<F>::at(gradient, spot.cell(corner, grid.ny, grid.nz));
        let part = g.scale(w.x * w.y * w.z);
        x += part.x;
        y += part.y;
        z += part.z;
    }
    Vector3::<F> { x, y, z }
}

#[cube(launch)]
fn interpolate_at_points<F: Float + CubeElement>(
    points: &Array<F>,
    gradient: &Array<F>,
    curvature: &Array<F>,
    gradient_out: &mut Array<F>,
    normal_out: &mut Array<F>,
    curvature_out: &mut Array<F>,
    grid: Lattice<F>,
    upper: Corner<F>,
    count: u32,
) {
    if ABSOLUTE_POS < count as usize {
        let at = spot::<F>(Vector3::<F>::at(points, ABSOLUTE_POS), &grid, &upper);
        let zero = Vector3::<F>::zero();
        let g = gradient_of::<F>(gradient, at, &grid).choose(at.inside, zero);
        let mut kappa = F::new(0.0);
        for corner in 0u32..8u32 {
            let w = at.weights(corner);
            kappa += w.x * w.y * w.z * curvature[at.cell(corner, grid.ny, grid.nz)];
        }
        g.write(gradient_out, ABSOLUTE_POS);
        unit::<F>(g).write(normal_out, ABSOLUTE_POS);
        curvature_out[ABSOLUTE_POS] = select(at.inside, kappa, F::new(0.0));
    }
}

/// The lowest of the eight cells round each point, as its place in memory; the number of cells for one outside.
#[cube(launch)]
fn find_lowest<F: Float + CubeElement>(
    points: &Array<F>,
    keys: &mut Array<u32>,
    grid: Lattice<F>,
    upper: Corner<F>,
    count: u32,
) {
    if ABSOLUTE_POS < count as usize {
        let at = spot::<F>(Vector3::<F>::at(points, ABSOLUTE_POS), &grid, &upper);
        let key = at.cell(0u32, grid.ny, grid.nz) as u32;
        keys[ABSOLUTE_POS] = select(at.inside, key, grid.nx * grid.ny * grid.nz);
    }
}

/// The cotangents of the interpolated values: that of the normal goes to the gradient. And what they mean for the
/// point, through the weights of the eight cells.
#[cube(launch)]
fn pull_to_shares<F: Float + CubeElement>(
    points: &Array<F>,
    gradient: &Array<F>,
    curvature: &Array<F>,
    gradient_bar: &Array<F>,
    normal_bar: &Array<F>,
    curvature_bar: &Array<F>,
    shares: &mut Array<F>,
    points_bar: &mut Array<F>,
    grid: Lattice<F>,
    upper: Corner<F>,
    count: u32,
    #[comptime] of_gradient: bool,
    #[comptime] of_normal: bool,
    #[comptime] of_curvature: bool,
) {
    let i = ABSOLUTE_POS;
    if i < count as usize {
        let at = spot::<F>(Vector3::<F>::at(points, i), &grid, &upper);
        let zero = Vector3::<F>::zero();
        let given = if comptime!(of_gradient) {
            Vector3::<F>::at(gradient_bar, i)
        } else {
            zero
        };
        let through_normal = if comptime!(of_normal) {
            let g = gradient_of::<F>(gradient, at, &grid);
            unit_pullback::<F>(g, Vector3::<F>::at(normal_bar, i))
        } else {
            zero
        };
        let bar = given.add(through_normal).choose(at.inside, zero);
        let mut kappa_bar = F::new(0.0);
        if comptime!(of_curvature) {
            kappa_bar = select(at.inside, curvature_bar[i], kappa_bar);
        }
        bar.store(shares, NUMBERS * i);
        shares[NUMBERS * i + 3] = kappa_bar;
        for axis in 0..3usize {
            let mut sum = F::new(0.0);
            for corner in 0u32..8u32 {
                let cell = at.cell(corner, grid.ny, grid.nz);
                let of_weight =
                    Vector3::<F>::at(gradient, cell).dot(bar) + curvature[cell] * kappa_bar;
                sum += slope::<F>(corner, axis, at.weights(corner)) * of_weight;
            }
            let slope = sum / grid.spacing;
            points_bar[3 * i + axis] += select(is_finite::<F>(slope), slope, F::new(0.0));
        }
    }
}

/// Fractions, and one column of the shares, of each point in sorted order.
#[cube(launch)]
fn sort_column<F: Float + CubeElement>(
    points: &Array<F>,
    shares: &Array<F>,
    keys: &Array<u32>,
    places: &Array<u32>,
    sorted: &mut Array<F>,
    grid: Lattice<F>,
    upper: Corner<F>,
    count: u32,
    column: u32,
) {
    let s = ABSOLUTE_POS;
    if s < count as usize && keys[s] < grid.nx * grid.ny * grid.nz {
        let i = places[s] as usize;
        let at = spot::<F>(Vector3::<F>::at(points, i), &grid, &upper);
        at.fraction.store(sorted, NUMBERS * s);
        sorted[NUMBERS * s + 3] = shares[NUMBERS * i + column as usize];
    }
}
