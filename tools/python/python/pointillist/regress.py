"""Regression renders: compares the renders of a folder with their references, as ``pointillist regress`` does."""

from __future__ import annotations

import json
import os
import tempfile
from collections.abc import Mapping
from dataclasses import dataclass
from pathlib import Path
from typing import Any, Optional, Union

from ._native import RenderError
from ._scene import _words
from ._tools import run as _run

__all__ = ["Regression", "run", "update"]


@dataclass(frozen=True)
class Regression:
    """The outcome of a run."""

    code: int
    """0 where every case is the same or equal within noise, 1 where one has changed, 2 where one is broken."""
    report: Mapping[str, Any]
    """The report, as ``--json`` writes it."""

    @property
    def is_green(self) -> bool:
        """Whether every case is the same or equal within noise."""
        return self.code == 0


def run(folder: Union[str, os.PathLike[str]], *cases: str, **options: Any) -> Regression:
    """Renders every case of a folder, or those with one of these words in their names, and compares each with its reference.

    Every other option of ``pointillist regress run`` is a keyword with underscores: ``html="report.html"``, ``device="cpu"``.
    """
    with tempfile.TemporaryDirectory() as temporary:
        given = options.pop("json", None)
        file = Path(given) if given is not None else Path(temporary) / "report.json"
        words = [f"--case={case}" for case in cases] + _words({**options, "json": file})
        code = _run(["regress", "run", *words, "--", os.fspath(folder)])
        if not file.exists():
            raise RenderError(f"the run of {os.fspath(folder)} has ended with exit code {code} and no report; what it said is on standard error")
        return Regression(code, json.loads(file.read_text(encoding="utf-8")))


def update(
    folder: Union[str, os.PathLike[str]], *cases: str, reason: Optional[str] = None, **options: Any
) -> None:
    """Writes new references of a folder, or of these cases, with the reason for it; ``dry_run=True`` only shows what would change."""
    words = _words({**options, "reason": reason})
    code = _run(["regress", "update", *words, "--", os.fspath(folder), *cases])
    if code != 0:
        raise RenderError(f"the update of {os.fspath(folder)} has ended with exit code {code}; what it said is on standard error")
