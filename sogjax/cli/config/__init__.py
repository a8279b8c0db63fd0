"""From the words of a command line to the settings of a command."""
