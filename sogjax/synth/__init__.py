"""Rendered recordings of people with ground truth: for the demo, the tests and the benchmarks."""
