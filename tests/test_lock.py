"""The locks of all packages: they fit pyproject.toml, and every file has its hash."""

from __future__ import annotations

import json
import re
import subprocess
import sys
import tomllib
from pathlib import Path
from typing import Any, Final

import pytest
from packaging.requirements import Requirement
from packaging.utils import canonicalize_name

ROOT: Final = Path(__file__).parents[1]
PROJECT: Final = tomllib.loads((ROOT / "pyproject.toml").read_text(encoding="utf-8"))
EXTRAS: Final = PROJECT["project"]["optional-dependencies"]
WANTED: Final = {
    "install.txt": PROJECT["project"]["dependencies"] + PROJECT["build-system"]["requires"],
    "dev.txt": [
        *PROJECT["project"]["dependencies"],
        *PROJECT["build-system"]["requires"],
        *EXTRAS["dev"],
        *EXTRAS["docs"],
    ],
}
AUDIT: Final = ROOT / "requirements" / "audit.py"


def pins(name: str) -> dict[str, list[tuple[Requirement, list[str]]]]:
    """Return pinned requirements and hashes by package; several where machines differ."""
    text = (ROOT / "requirements" / name).read_text(encoding="utf-8")
    found: dict[str, list[tuple[Requirement, list[str]]]] = {}
    for line in re.sub(r"\\\n", " ", text).splitlines():
        words, *hashes = re.split(r"\s+--hash=", line.strip())
        if words and not words.startswith("#"):
            pin = Requirement(words)
            found.setdefault(canonicalize_name(pin.name), []).append((pin, hashes))
    return found


@pytest.mark.parametrize("lock", WANTED)
def test_every_package_is_pinned_to_files(lock: str) -> None:
    for entries in pins(lock).values():
        for pin, hashes in entries:
            assert re.fullmatch(r"==[^,*]+", str(pin.specifier)), pin
            assert hashes, pin
            assert all(re.fullmatch(r"sha256:[0-9a-f]{64}", each) for each in hashes), pin


@pytest.mark.parametrize("lock", WANTED)
def test_locks_hold_what_the_project_asks_for(lock: str) -> None:
    """`make lock` writes them again."""
    locked = pins(lock)
    for wanted in map(Requirement, WANTED[lock]):
        name = canonicalize_name(wanted.name)
        assert name in locked, f"{wanted} is not in {lock}"
        for pin, _ in locked[name]:
            version = str(pin.specifier).removeprefix("==")
            assert wanted.specifier.contains(version), f"{wanted}: {lock} has {version}"


def test_both_locks_agree() -> None:
    everything = pins("dev.txt")
    for name, entries in pins("install.txt").items():
        assert [str(pin) for pin, _ in entries] == [str(pin) for pin, _ in everything[name]]


@pytest.mark.parametrize("lock", WANTED)
def test_locks_name_no_index(lock: str) -> None:
    text = (ROOT / "requirements" / lock).read_text(encoding="utf-8")
    assert not re.search(r"https?:|file:|--(extra-)?index|--find-links", text)


VULNERABLE: Final = {
    "dependencies": [
        {"name": "good", "version": "1", "vulns": []},
        {"name": "bad", "version": "2", "vulns": [{"id": "PYSEC-1", "fix_versions": ["3"]}]},
        {"name": "unknown", "skip_reason": "not found"},
    ]
}


@pytest.mark.parametrize(
    ("says", "code", "told"),
    [
        (VULNERABLE, 1, "bad 2: PYSEC-1, mended in 3"),
        (VULNERABLE, 1, "2 of 3 packages audited, 1 vulnerabilities"),
        ({"dependencies": VULNERABLE["dependencies"][:1]}, 0, "1 of 1 packages audited, 0"),
        (None, 0, "not audited, pip-audit did not come to an end: no route"),
    ],
)
def test_audit_fails_for_vulnerabilities_alone(
    tmp_path: Path, says: dict[str, Any] | None, code: int, told: str
) -> None:
    body = 'raise SystemExit("no route")' if says is None else f"print({json.dumps(says)!r})"
    (tmp_path / "pip_audit.py").write_text(body, encoding="utf-8")
    done = subprocess.run(
        [sys.executable, AUDIT, "lock.txt"],
        env={"PYTHONPATH": str(tmp_path)},
        capture_output=True,
        text=True,
        check=False,
    )
    assert (done.returncode, done.stderr) == (code, "")
    assert told in done.stdout
