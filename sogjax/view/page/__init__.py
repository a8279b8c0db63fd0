"""Pages for a browser, each one file that needs nothing beside it: what they are put together of, and a run's."""
