"""From example poses to an actor (Section 5.2)."""
