"""Who may import whom, and how little `import sogjax` loads."""

import subprocess
import sys
from pathlib import Path

import pytest

ROOT = Path(__file__).parents[1]
HEAVY = ("cv2", "rerun", "hydra", "omegaconf")


def test_imports_flow_one_way():
    """The contracts of pyproject.toml, checked by import-linter in a process of its own."""
    pytest.importorskip("importlinter", reason="import-linter is not installed (extra `lint`)")
    code = "from importlinter.cli import lint_imports; raise SystemExit(lint_imports(no_cache=True))"
    done = subprocess.run([sys.executable, "-c", code], cwd=ROOT, capture_output=True, text=True, check=False)
    assert done.returncode == 0, done.stdout + done.stderr


def test_importing_the_package_loads_nothing_heavy():
    code = f"import sys, sogjax; print([name for name in {HEAVY!r} if name in sys.modules])"
    done = subprocess.run([sys.executable, "-c", code], cwd=ROOT, capture_output=True, text=True, check=True)
    assert done.stdout.strip() == "[]"
