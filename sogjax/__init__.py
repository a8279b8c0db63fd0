"""Markerless motion capture by Sums of Gaussians (Stoll et al., ICCV 2011) in JAX."""

__version__ = "0.1.0"
