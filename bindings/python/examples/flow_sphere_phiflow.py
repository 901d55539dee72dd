"""The sphere of flow_sphere.py in another solver, with its velocities at other places.

    pip install "isograd[jax]" phiflow==3.4.0 && python flow_sphere_phiflow.py [CELLS_PER_DIAMETER [POINTS [DURATION]]]
"""

import json
import sys

from flow_host.phiflow_tunnel import Tunnel
from flow_sphere import main

if __name__ == "__main__":
    main(Tunnel, *(json.loads(x) for x in sys.argv[1:]))
