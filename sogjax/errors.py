"""What a user did wrong, as one sentence with the place, the value and the remedy."""


class InputError(ValueError):
    """Wrong input of a user; the command line prints it as one sentence and exits with status 2."""
