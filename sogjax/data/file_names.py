"""Names in files that become file names: none of them may lead out of its folder."""

MAX_BYTES = 100
"""Of a name; file systems allow 255, and prefixes and extensions are added."""


def objection(name: str) -> str | None:
    """Why a name cannot be the name of a file in any folder; None where it can.

    Names that Windows alone keeps for itself (CON, or with a colon) pass: writing fails there, and harms nothing.
    """
    if "/" in name or "\\" in name:
        return "a name without slashes"
    if not name.isprintable():
        return "a name of printable characters"
    if name.startswith(".") or name != name.strip():
        return "a name that does not begin with a dot and has no space at either end"
    if len(name.encode(errors="replace")) > MAX_BYTES:
        return f"a name of at most {MAX_BYTES} bytes"
    return None
