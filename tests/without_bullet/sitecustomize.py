"""Makes MuJoCo the default engine of a process that tests start where Bullet is absent."""

import sys
from importlib.machinery import PathFinder

ENGINES = "internav_data.physics.engines"


class DefaultEngine:
    """Finder of one module, whose constant is another one."""

    def find_spec(self, name, path=None, target=None):
        if name != ENGINES:
            return None
        spec = PathFinder.find_spec(name, path, target)
        load = spec.loader.exec_module

        def exec_module(module):
            load(module)
            module.DEFAULT_ENGINE = "mujoco"

        spec.loader.exec_module = exec_module
        return spec


sys.meta_path.insert(0, DefaultEngine())
