"""The nouns: Sums of Gaussians, colours, cameras, skeletons, bodies."""
