"""Poisson solve: isograd and SciPy's transforms of the same size and type."""

import numpy as np
from scipy.fft import dctn, idctn

from case import Case, peer
from stage import stages, write_input


def case(stack, program, folder, shape: tuple[int, int, int], dtype, threads: int) -> Case:
    """SciPy does its two transforms and the product between them, in place where it can."""
    name = "x".join(map(str, shape))
    folder = folder / f"poisson-{name}-{np.dtype(dtype)}"
    random = np.random.default_rng(1)
    b = random.standard_normal(shape).astype(dtype)
    b -= b.mean(dtype=np.float64).astype(dtype)
    write_input(folder, {"shape": shape, "lower": [0, 0, 0], "spacing": 1.0}, b=b)
    inverse = inverse_eigenvalues(shape, dtype)
    entries = []
    for stage in stages(stack, program, "poisson", folder, threads, dtype):
        entries.append(stage.entry("chi"))
        work = scipy_solve(b, inverse, stage.threads)
        entries.append(peer("SciPy dctn + idctn", str(np.dtype(dtype)), stage.threads, work))

    def check() -> list[str]:
        mine, theirs = entries[0].result().reshape(shape), entries[1].result()
        error = np.abs(mine - theirs).max() / np.abs(theirs).max()
        return [f"solutions differ by at most {error:.1e} of the largest value"]

    title = f"Poisson, {' × '.join(map(str, shape))}, {np.dtype(dtype)}"
    what = "DCT-II, product with the inverse eigenvalues, inverse DCT-II"
    return Case(title, what, ("cell", int(np.prod(shape))), entries, check)


def scipy_solve(b, inverse, workers):
    def work():
        spectrum = dctn(b, type=2, workers=workers)
        spectrum *= inverse
        return idctn(spectrum, type=2, overwrite_x=True, workers=workers)

    return work


def inverse_eigenvalues(shape, dtype) -> np.ndarray:
    """1/λ of the trilinear Laplacian, 0 for the constant mode."""
    stiffness, mass = [], []
    for axis, n in enumerate(shape):
        cosine = np.cos(np.pi * np.arange(n) / n).reshape([-1 if a == axis else 1 for a in range(3)])
        stiffness.append(2 - 2 * cosine)
        mass.append((2 + cosine) / 3)
    (kx, ky, kz), (mx, my, mz) = stiffness, mass
    eigenvalue = kx * my * mz + mx * ky * mz + mx * my * kz
    eigenvalue[0, 0, 0] = np.inf
    return (1 / eigenvalue).astype(dtype)
