"""Markerless motion capture by Sums of Gaussians (Stoll et al., ICCV 2011) in JAX.

From videos to a motion::

    import sogjax

    recording = sogjax.open_recording("walk")
    actor = sogjax.make_actor(recording)
    motion = sogjax.track(recording, actor)
    motion.save("walk.bvh")

Importing the package loads nothing else: the names in `__init__.pyi` are loaded when they are first used.
"""

import lazy_loader

__getattr__, __dir__, __all__ = lazy_loader.attach_stub(__name__, __file__)
__version__ = "0.1.0"
