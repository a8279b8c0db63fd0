"""Pictures and Rerun files that show whether to trust a motion."""
