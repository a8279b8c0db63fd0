"""How well a posed body explains the pictures (Sections 4.4, 4.5 and 5.1): a sum of terms, and their curvature."""
