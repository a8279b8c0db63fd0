"""The commands: a module for each, and how the words of a command line become settings."""
