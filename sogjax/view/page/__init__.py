"""Pages for a browser, each one file that needs nothing beside it: of a run, a check, an actor."""
