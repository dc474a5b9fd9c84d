"""A generator over stub scenes in a process of its own, to be killed.

OUT SCENES WORKERS, and for a Ray cluster its address.
"""

import sys
from pathlib import Path

sys.path.insert(0, str(Path(__file__).parents[1]))
sys.path.insert(0, str(Path(__file__).parent))

from scene_stubs import CATALOGUE, stub

from internav_data.core.interrupts import InterruptedRunError
from internav_data.generation.config import load_config
from internav_data.generation.run import generate

out, scenes, workers = Path(sys.argv[1]), int(sys.argv[2]), int(sys.argv[3])
address = sys.argv[4] if len(sys.argv) > 4 else None
executor = "ray" if address else "processes"
config = load_config(overrides=["episodes_per_scene=3"])
try:
    generate(
        *(out, config, scenes, workers),
        assets=CATALOGUE,
        executor=executor,
        setup=stub,
        ray_address=address,
    )
except InterruptedRunError as error:
    sys.exit(128 + error.signum)
