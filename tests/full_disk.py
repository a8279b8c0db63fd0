"""A disk that is full, made by the system itself: files cannot grow beyond some bytes."""

import resource
from contextlib import contextmanager


@contextmanager
def files_of_at_most(size):
    """Writing behind `size` bytes of any file fails within the block."""
    before = resource.getrlimit(resource.RLIMIT_FSIZE)
    resource.setrlimit(resource.RLIMIT_FSIZE, (size, before[1]))
    try:
        yield
    finally:
        resource.setrlimit(resource.RLIMIT_FSIZE, before)
