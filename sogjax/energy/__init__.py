"""How well a posed body explains the pictures (Section 4.4, 4.5, 5.1)."""
