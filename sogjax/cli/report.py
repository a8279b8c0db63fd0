"""`sogjax report`: the experiments of the paper's Section 6, and more, as tables and charts beside its figures."""

from pathlib import Path

from sogjax.study.report import write_report
from sogjax.study.settings import ReportConfig


def run(config: ReportConfig) -> list[Path]:
    """Do the missing runs, write the report, and print its files.

    Raises:
        InputError: as `write_report`.
    """
    files = write_report(config)
    print(*files, sep="\n")
    return files
