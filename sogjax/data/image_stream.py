"""Images that are read one after the other, whatever file they come from."""

from typing import Protocol, TypeVar, runtime_checkable

import numpy as np
from jaxtyping import UInt8

Bgr = UInt8[np.ndarray, "height width 3"]
Image = TypeVar("Image", covariant=True)


@runtime_checkable
class ImageStream(Protocol[Image]):
    """The images of one camera, in their order."""

    def read(self) -> Image | None:
        """The next image, or None after the last."""
        ...

    def skip(self) -> None:
        """Pass over the next image."""
        ...

    def close(self) -> None:
        """Release the file."""
        ...
