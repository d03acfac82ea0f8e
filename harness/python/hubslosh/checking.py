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
    """A place where an FMU breaks a rule.

    Attributes
    ----------
    rule : str
        Identifier of the rule, such as ``zip.names``.
    severity : {"error", "warning"}
        "error": the standard forbids the fault, or hosts fail. "warning": some importers fail
        because of the fault.
    place : str
        Location of the fault: a file, a line, a variable or a call.
    text : str
        The fault, and what is allowed.

    Examples
    --------
    >>> from hubslosh import Finding
    >>> Finding("xml.units", "error", "line 12", "unit kg.m3 of I (allowed: kg.m2)")
    error xml.units: line 12: unit kg.m3 of I (allowed: kg.m2)
    """

    rule: str
    severity: Literal["error", "warning"]
    place: str
    text: str

    def __repr__(self) -> str:
        line = f"{self.severity} {self.rule}: {self.place}: {self.text}"
        return textwrap.shorten(line, 200, placeholder=" …")


@dataclass(frozen=True)
class CheckedRule:
    """The result of one rule of `check`.

    Attributes
    ----------
    rule : str
        Identifier of the rule, such as ``zip.names``.
    title : str
        The requirement in words.
    source : str
        Section of the standard that states the requirement, or the hosts that need it.
    findings : tuple of Finding
        The findings, at most 1000.
    skipped : str or None
        Reason why the rule was not checked; None if it was.
    seconds : float
        Time that the check of this rule took, s.

    Examples
    --------
    >>> import hubslosh
    >>> checked = hubslosh.check("HubSlosh", only=["zip.names"])
    >>> rule = checked.rules[0]
    >>> rule.rule, len(rule.findings), rule.skipped is None
    ('zip.names', 0, True)
    """

    rule: str
    title: str
    source: str
    findings: tuple[Finding, ...]
    skipped: str | None
    seconds: float

    def __repr__(self) -> str:
        count = f"{len(self.findings)} findings" if self.skipped is None else "skipped"
        return f"{self.rule}: {self.title} [{self.source}]: {count}"


@dataclass(frozen=True)
class Checked:
    """The result of `check`.

    Attributes
    ----------
    fmu : Path
        File of the FMU.
    errors : int
        Number of errors.
    warnings : int
        Number of warnings.
    rules : tuple of CheckedRule
        All selected rules, including skipped rules.

    Examples
    --------
    >>> import hubslosh
    >>> checked = hubslosh.check("HubSlosh", only=["zip"])
    >>> checked.errors, checked.findings
    (0, ())
    """

    fmu: Path
    errors: int
    warnings: int
    rules: tuple[CheckedRule, ...]

    @property
    def findings(self) -> tuple[Finding, ...]:
        """Findings of all rules in one tuple, in the order of the rules."""
        return tuple(finding for rule in self.rules for finding in rule.findings)

    def __repr__(self) -> str:
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
    """Check an FMU against the FMI standard and the constraints of importers.

    Each rule that calls the binary runs in a process of its own. Therefore an FMU that crashes is
    reported as a finding, and does not end Python. The FMU's binary runs with your privileges.

    Parameters
    ----------
    fmu : str or Path
        File of any FMU 2.0 or 3.0, from any tool, or the name of an FMU of this package.
    *arguments : str
        Further flags of ``hubslosh check``, such as ``"--junit", "check.xml"``.
    only : sequence of str
        Rules (``"zip.names"``) or groups of rules (``"zip"``); by default all.
    limit : float
        Time that the calls of one rule may take, s.
    progress : bool or callable, optional
        True shows a line on stderr, which is the default on a terminal and in a notebook; a
        function receives the line as text.
    program : str or Path, optional
        The program ``hubslosh``; by default the program of this package.

    Returns
    -------
    Checked
        The findings, and the rules that were skipped; ``print`` shows the first findings.

    Raises
    ------
    FmuError
        If no selected rule could be checked, for example because the file is no FMU.

    Examples
    --------
    >>> import hubslosh
    >>> hubslosh.check("SloshTank", only=["zip", "values.start"]).errors
    0
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
