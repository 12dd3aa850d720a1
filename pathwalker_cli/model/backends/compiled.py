"""Pinocchio's own algorithms on casadi::SX, from the extension in native/pinocchio_casadi.cpp."""

from __future__ import annotations

import ctypes
from functools import cache
from importlib import resources

import casadi as ca
import pinocchio as pin

from pathwalker_cli.errors import BackendError
from pathwalker_cli.model.backends.functions import JOINT_TYPES, SIGNATURES, Topology

_LIBRARY = "libpinocchio_casadi.so"
_REINSTALL = "install pathwalker-cli again, with a C++ compiler at hand"


def build(topology: Topology) -> dict[str, ca.Function]:
    """Return the functions of `SIGNATURES` for the bodies and fixed points of a topology."""
    n_joints, n_points = len(topology.joints), len(topology.points)
    rotations = [entry for rotation in topology.rotations for entry in rotation]
    text = ctypes.c_char_p()
    failed = library().pathwalker_build(
        n_joints,
        (ctypes.c_int * n_joints)(*topology.parents),
        (ctypes.c_int * n_joints)(*map(JOINT_TYPES.index, topology.types)),
        (ctypes.c_double * len(rotations))(*rotations),
        n_points,
        (ctypes.c_int * n_points)(*topology.point_joints),
        (ctypes.c_double * 3)(*topology.gravity),
        ctypes.byref(text),
    )
    answer = (text.value or b"").decode()
    if failed:
        raise BackendError(f"the compiled back end refused the model: {answer}")
    functions = map(ca.Function.deserialize, answer.splitlines())
    return dict(zip(SIGNATURES, functions, strict=True))


def describe() -> str:
    """Say what would run, or raise a `BackendError`."""
    versions = library().pathwalker_versions().decode().split()
    return "extension compiled for pin {} and casadi {}".format(*versions)


@cache
def library() -> ctypes.CDLL:
    """Load the extension, or raise a `BackendError` that says why not and how to mend it."""
    # In an editable install it stands apart from this file; `resources` looks in both places.
    path = resources.files(__package__) / _LIBRARY
    if not path.is_file():
        raise BackendError(f"the extension was not compiled; {_REINSTALL}")
    try:
        extension = ctypes.CDLL(str(path))
    except OSError as error:
        raise BackendError(f"the extension does not load ({error}); {_REINSTALL}") from error
    extension.pathwalker_versions.restype = ctypes.c_char_p
    check_versions(extension.pathwalker_versions().decode())
    return extension


def check_versions(compiled_against: str) -> None:
    """Raise a `BackendError` unless Pinocchio and CasADi are of these versions, e.g. "3.4 3.7"."""
    installed = f"{pin.__version__} {ca.CasadiMeta.version()}"
    if installed != compiled_against:
        raise BackendError(
            "the extension was compiled for pin {} and casadi {}, ".format(
                *compiled_against.split()
            )
            + "installed are pin {} and casadi {}; ".format(*installed.split())
            + _REINSTALL
        )
