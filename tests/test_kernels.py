"""Which vectors the compiled kernels use, and who decides."""

from __future__ import annotations

from collections.abc import Iterator

import pytest
from click.testing import CliRunner

from pathwalker_cli.cli import cli
from pathwalker_cli.errors import ConfigError
from pathwalker_cli.nlp.kernels import kernels_level, kernels_path

LEVELS = ("generic", "x86-64-v3", "x86-64-v4")


@pytest.fixture(autouse=True)
def fresh() -> Iterator[None]:
    """Forget what was chosen."""
    kernels_level.cache_clear()
    yield
    kernels_level.cache_clear()


def test_the_widest_vectors_are_used_unless_narrower_ones_are_asked_for(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    monkeypatch.delenv("PATHWALKER_KERNELS", raising=False)
    widest = kernels_level()
    assert widest in LEVELS
    for level in LEVELS[: LEVELS.index(widest) + 1]:
        monkeypatch.setenv("PATHWALKER_KERNELS", level)
        kernels_level.cache_clear()
        path = kernels_path()
        assert path is not None
        assert path.name == f"libkernels-{level}.so"


def test_vectors_that_do_not_exist_are_refused(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setenv("PATHWALKER_KERNELS", "avx")
    with pytest.raises(ConfigError, match=r"^PATHWALKER_KERNELS: is 'avx'; allowed: generic"):
        kernels_level()
    done = CliRunner().invoke(cli, ["solve", "mapd-barefoot", "mapd-barefoot", "--smoke"])
    assert done.exit_code == 2
    assert done.stderr.startswith("Error: PATHWALKER_KERNELS: is 'avx'")
    assert not done.stderr.count("Traceback")
