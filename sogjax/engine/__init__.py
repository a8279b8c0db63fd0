"""A track as a program runs it: from settings to files, in stages beside each other, stopped and resumed."""
