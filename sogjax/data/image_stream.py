"""Images that are read one after the other, whatever file they come from."""

from typing import Protocol, runtime_checkable

import numpy as np
from jaxtyping import UInt8


@runtime_checkable
class ImageStream(Protocol):
    """The images of one camera, in their order."""

    def read(self) -> UInt8[np.ndarray, "height width 3"] | None:
        """The next image (BGR), or None after the last."""
        ...

    def skip(self) -> None:
        """Pass over the next image."""
        ...

    def close(self) -> None:
        """Release the file."""
        ...
