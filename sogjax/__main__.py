"""`python -m sogjax`, the same as the console script."""

import sys

from sogjax.cli.main import run_process

if __name__ == "__main__":
    sys.exit(run_process())
