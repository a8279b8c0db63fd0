"""A motion held against that of another system: names and clocks matched, worlds placed, angles and joints compared."""
