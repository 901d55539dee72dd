"""OpenVDB's narrow band from a mesh, one run at a time: the protocol of `stage-times` (see stage.py).

A process of its own, and for Debian's Python: Debian's `python3-openvdb`, the one that can be had, is built for
Debian's NumPy. `vdb.py STAGE FOLDER TYPE THREADS`; it takes all threads of the machine.
"""

import json
import sys
import time
from pathlib import Path

import numpy as np
import pyopenvdb as vdb

HALF_WIDTH = 3.0


def main() -> None:
    folder = Path(sys.argv[2])
    settings = json.loads((folder / "settings.json").read_text())
    vertices = np.fromfile(folder / "vertices.f32", np.float32).reshape(-1, 3)
    faces = np.fromfile(folder / "faces.u32", np.uint32).reshape(-1, 3)
    spacing, lower, shape = settings["spacing"], settings["lower"], settings["shape"]
    transform = vdb.createLinearTransform(voxelSize=spacing)
    transform.translate([low + 0.5 * spacing for low in lower])
    grid = None
    print("ready", flush=True)
    for request in sys.stdin:
        if request.strip() == "run":
            grid = None
            start = time.perf_counter()
            grid = vdb.FloatGrid.createLevelSetFromPolygons(
                vertices, triangles=faces, transform=transform, halfWidth=HALF_WIDTH
            )
            print(time.perf_counter() - start, flush=True)
        else:
            dense = np.empty(shape, np.float32)
            grid.copyToArray(dense)
            dense.tofile(folder / "phi.f32")
            print("saved", flush=True)


main()
