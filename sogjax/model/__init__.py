"""The nouns of the method: Sums of Gaussians, colours, cameras, skeletons, bodies, limbs."""
