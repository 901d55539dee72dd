"""The velocity of a swimming fish, carried from its samples to the grid around it, and a gradient back.

An immersed boundary method needs it there: the velocity of the closest surface point, for every cell near the body.
"""

import numpy as np

import isograd


def main():
    fish = isograd.Shape("fish", amplitude=0.1, time=0.3)
    samples = fish.sample(8000)
    assert samples.velocity is not None
    grid = isograd.Grid.fit(samples.points, 96)
    result = isograd.reconstruct(
        samples.points, grid, attributes={"velocity": samples.velocity}
    )

    velocity = result.extend("velocity", band=3 * grid.spacing)
    field = velocity.dense()
    fastest = np.abs(samples.velocity).max()
    print(f"{len(velocity.cells)} cells of {grid.shape}; the fastest sample moves at {fastest:.3f}")
    assert np.abs(field).max() < 1.1 * fastest

    # A loss in the field on the grid, here its energy, and its slope in the velocity of each sample.
    energy = 0.5 * (velocity.values**2).sum() * grid.spacing**3
    slope = velocity.values * grid.spacing**3
    gradient = result.pullback(extensions=[(velocity, None, slope)])
    of_velocity = gradient.attributes["velocity"]
    # The energy is quadratic in the velocity: half its slope along itself is the energy.
    along = 0.5 * (of_velocity * samples.velocity).sum()
    print(f"energy {energy:.3e}, by its gradient {along:.3e}")
    assert abs(along / energy - 1) < 1e-6
    assert np.isfinite(gradient.points).all()


if __name__ == "__main__":
    main()
