"""A thread for each camera: it takes pictures as they come, averages them to cells, and passes them on."""

from collections.abc import Sequence
from threading import Lock, Thread

from sogjax.io.image_file import ColorGains, evened
from sogjax.model.yuv_picture import YuvPicture
from sogjax.realtime.pictures import Camera, Picture, Seen
from sogjax.realtime.slot import Slot
from sogjax.realtime.urgency import CAMERA, yield_to_others
from sogjax.scene.cells import CellGrid, padded_cells, stack_shape


class CameraThreads:
    """A `with` block in which the cameras' pictures go into a slot; at its end the cameras are closed.

    Args:
        cameras: in the order of the rig.
        grids: how the pictures of each are cut into cells.
        slot: where they go.
        gains: by which the colours of some cameras are evened out; None: they stay.
        keeps: whether the pictures themselves are passed on, too, as they came.
    """

    def __init__(
        self,
        cameras: Sequence[Camera],
        grids: Sequence[CellGrid],
        slot: Slot,
        gains: Sequence[ColorGains | None] | None = None,
        keeps: bool = False,
    ) -> None:
        self._cameras, self._grids, self._slot, self._keeps = cameras, grids, slot, keeps
        self._gains = gains or [None] * len(cameras)
        self._left, self._lock = len(cameras), Lock()
        self._threads = [
            Thread(target=self._run, args=(number,), name=f"camera {camera.name}", daemon=True)
            for number, camera in enumerate(cameras)
        ]

    def __enter__(self) -> "CameraThreads":
        for thread in self._threads:
            thread.start()
        return self

    def __exit__(self, *error: object) -> None:
        for camera in self._cameras:
            camera.close()
        for thread in self._threads:
            thread.join(2.0)

    def _run(self, number: int) -> None:
        camera, grid, shape = self._cameras[number], self._grids[number], stack_shape(tuple(self._grids))
        problem: BaseException | None = None
        yield_to_others(CAMERA)
        try:
            while (taken := camera.read()) is not None:
                picture = self._evened(number, taken.picture)
                cells = padded_cells(picture, grid, shape)
                kept = taken.picture if self._keeps else None
                self._slot.put(Seen(number, cells, taken.exposed, taken.arrived, taken.number, kept))
        except BaseException as error:  # told to whoever takes sets
            problem = error
        finally:
            if (release := getattr(camera, "release", None)) is not None:
                release()
            with self._lock:
                self._left -= 1
                if problem is not None or not self._left:
                    self._slot.end(problem)

    def _evened(self, number: int, picture: Picture) -> Picture:
        gains = self._gains[number]
        if gains is None:
            return picture
        return evened(picture.bgr() if isinstance(picture, YuvPicture) else picture, gains)
