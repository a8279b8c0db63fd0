"""One command for many settings, or for many recordings."""
