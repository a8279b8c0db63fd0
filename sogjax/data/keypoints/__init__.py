"""Keypoints that other programs' detectors left beside a recording: OpenPose, RTMPose, MediaPipe, AlphaPose."""

from typing import TYPE_CHECKING

from sogjax.lazy import lazy_names

if TYPE_CHECKING:
    from sogjax.data.keypoints.files import find_keypoints
    from sogjax.data.keypoints.keypoints import Keypoints
    from sogjax.data.keypoints.load import load_keypoints
    from sogjax.data.keypoints.scheme import KeypointScheme, named_scheme, shipped_schemes

__all__ = ["KeypointScheme", "Keypoints", "find_keypoints", "load_keypoints", "named_scheme", "shipped_schemes"]

_MODULES = {
    "files": ["find_keypoints"],
    "keypoints": ["Keypoints"],
    "load": ["load_keypoints"],
    "scheme": ["KeypointScheme", "named_scheme", "shipped_schemes"],
}
# Loading keypoints needs recordings, which look for the files of a project's keypoints themselves.
__getattr__, __dir__ = lazy_names(
    __name__, {name: f"{__name__}.{module}" for module, names in _MODULES.items() for name in names}
)
