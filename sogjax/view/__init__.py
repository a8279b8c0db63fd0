"""Pictures and Rerun files that show whether a motion can be trusted."""
