# SPDX-License-Identifier: Apache-2.0
"""Results of fbvins.doctor."""
from __future__ import annotations

import dataclasses
import html

from ._fbvins import Rig


@dataclasses.dataclass(frozen=True)
class Finding:
    """Something that is wrong with a setup."""

    kind: str
    size: float
    sigma: float  #: standard deviation of size
    unit: str
    measured: str
    expected: str
    advice: str  #: what to do
    corrected: str  #: the line of the calibration
    text: str  #: all of it, as `fbvins doctor` prints it

    def __str__(self) -> str:
        return self.text


@dataclasses.dataclass(frozen=True)
class Diagnosis:
    """What `fbvins doctor` finds in a recording. str() is what it prints."""

    findings: list[Finding]
    measured: list[str]  #: a sentence for each measurement, right or wrong
    not_judged: list[str]  #: what the recording does not show
    text: str  #: all of it, as `fbvins doctor` prints it
    rig: Rig  #: the calibration with all findings corrected

    @property
    def ok(self) -> bool:
        """Whether nothing is wrong in what was judged."""
        return not self.findings

    def __str__(self) -> str:
        return self.text

    def _repr_html_(self) -> str:
        return f"<pre>{html.escape(str(self))}</pre>"
