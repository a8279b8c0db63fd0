"""Small steps that XLA on a CPU compiles badly as they are usually written."""
