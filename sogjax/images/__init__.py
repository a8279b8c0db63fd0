"""From pictures to Sums of Gaussians (Section 4.1)."""
