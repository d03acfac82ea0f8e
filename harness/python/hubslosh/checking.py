"""Checks an FMU by the rules of ``hubslosh check``."""

import textwrap
from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any, Literal

from .command import call, find_program
from .fmu import fmu_path
from .progress import Progress


@dataclass(frozen=True)
class Finding:
    """A place where an FMU breaks a rule."""

    rule: str
    """Identifier of the rule, such as ``zip.names``."""
    severity: Literal["error", "warning"]
    """error: the standard forbids it, or hosts fail. warning: some importers fail on it."""
    place: str
    """Location: a file, a line, a variable, a call."""
    text: str
    """The fault, and what is allowed."""

    def __repr__(self) -> str:
        """Return the line of the command's report, shortened."""
        line = f"{self.severity} {self.rule}: {self.place}: {self.text}"
        return textwrap.shorten(line, 200, placeholder=" …")


@dataclass(frozen=True)
class CheckedRule:
    """Result of one rule."""

    rule: str
    """Identifier."""
    title: str
    """The demand."""
    source: str
    """Section of the standard, or the hosts that demand it."""
    findings: tuple[Finding, ...]
    """The findings, at most 1000."""
    skipped: str | None
    """Reason why the rule was not checked; None if it was."""
    seconds: float
    """Elapsed time, s."""

    def __repr__(self) -> str:
        """Return the demand and the number of findings."""
        count = f"{len(self.findings)} findings" if self.skipped is None else "skipped"
        return f"{self.rule}: {self.title} [{self.source}]: {count}"


@dataclass(frozen=True)
class Checked:
    """Result of `check`."""

    fmu: Path
    """The FMU."""
    errors: int
    """Number of errors."""
    warnings: int
    """Number of warnings."""
    rules: tuple[CheckedRule, ...]
    """All selected rules, those that were skipped too."""

    @property
    def findings(self) -> tuple[Finding, ...]:
        """Findings of all rules."""
        return tuple(finding for rule in self.rules for finding in rule.findings)

    def __repr__(self) -> str:
        """Return the first findings and a summary."""
        most = 12
        findings = self.findings
        lines = [repr(finding) for finding in findings[:most]]
        more = [f"and {len(findings) - most} more"] if len(findings) > most else []
        skipped = sum(rule.skipped is not None for rule in self.rules)
        counts = f"{self.errors} errors, {self.warnings} warnings"
        rules = f"{len(self.rules) - skipped} rules checked, {skipped} skipped"
        return "\n".join([*lines, *more, f"{self.fmu}: {counts}; {rules}"])


def check(
    fmu: str | Path,
    *arguments: str,
    only: Sequence[str] = (),
    limit: float = 60.0,
    progress: Progress = None,
    program: str | Path | None = None,
) -> Checked:
    """Check an FMU against the FMI standard and constraints of importers.

    * ``fmu``: File of an FMU 2.0 or 3.0, of other makers too, or the name of one of this package.
    * ``arguments``: Further flags of ``hubslosh check``, such as ``"--junit", "check.xml"``.
    * ``only``: Rules (``"zip.names"``) or groups of rules (``"zip"``); by default all.
    * ``limit``: Time that the calls of one rule may take, s.
    * ``progress``: Shows a line on stderr, by default on a terminal and in a notebook; or a
      function that takes the line.

    Each rule of calls runs in a process of its own, so an FMU that crashes is a finding. A binary
    runs with your privileges.

    Raises FmuError if no selected rule could be checked.
    """
    flags = [*(["--only", ",".join(only)] if only else []), "--limit", repr(float(limit))]
    report: dict[str, Any] = call(
        find_program(program), "check", [fmu_path(fmu), *flags, *arguments], progress, (0, 1)
    )
    rules = []
    for rule in report["rules"]:
        findings = tuple(Finding(rule["rule"], **finding) for finding in rule.pop("findings"))
        rules.append(CheckedRule(**rule, findings=findings))
    return Checked(Path(report["fmu"]), report["errors"], report["warnings"], tuple(rules))
