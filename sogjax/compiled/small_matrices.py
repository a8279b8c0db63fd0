"""Products of many small matrices, written as sums.

XLA on a CPU calls a matrix routine for every pair of a batch, which costs more than the numbers of a 4x4 matrix: the
frames of 61 joints took 124 microseconds so, and take 6 as sums, which become one loop.
"""

from functools import reduce
from operator import add

from jaxtyping import Array, Float


def product(a: Float[Array, "*#batch i k"], b: Float[Array, "*#batch k j"]) -> Float[Array, "*batch i j"]:
    """Matrix products of a batch; `k` is small."""
    return reduce(add, [a[..., :, k, None] * b[..., k, None, :] for k in range(a.shape[-1])])


def applied(matrix: Float[Array, "*#batch i k"], vector: Float[Array, "*#batch k"]) -> Float[Array, "*batch i"]:
    """Matrices times vectors; `k` is small."""
    return reduce(add, [matrix[..., :, k] * vector[..., k, None] for k in range(matrix.shape[-1])])
