"""Instruction lists of SX functions in the form that the compiled interpreter runs.

CasADi's virtual machine decodes every instruction once per occurrence of a block.  The interpreter
in `native/tape.cpp` decodes it once for eight occurrences.
"""

from __future__ import annotations

import ctypes
from dataclasses import dataclass
from typing import Final

import casadi as ca
import numpy as np

from pathwalker_cli.nlp.kernels import kernels

LANES: Final = 8
"""Occurrences that the interpreter works on at a time."""

OPERATIONS: Final = (
    "CONST", "INPUT", "OUTPUT", "ASSIGN", "ADD", "SUB", "MUL", "DIV", "NEG", "SQ", "TWICE", "INV",
    "LT", "LE", "EQ", "NE", "NOT", "AND", "OR", "IF_ELSE_ZERO", "FABS", "SQRT", "EXP", "LOG", "POW",
    "CONSTPOW", "SIN", "COS", "TAN", "ASIN", "ACOS", "ATAN", "ATAN2", "SINH", "COSH", "TANH",
    "ASINH", "ACOSH", "ATANH", "FMIN", "FMAX", "FLOOR", "CEIL", "FMOD", "COPYSIGN", "ERF", "LOG1P",
    "EXPM1", "HYPOT", "SIGN",
)  # fmt: skip
"""CasADi's names of the operations that the interpreter knows, in its order."""

_CASADI_IDS: Final = np.array([getattr(ca, f"OP_{name}") for name in OPERATIONS])
_CODES: Final = np.full(256, -1, np.int32)
_CODES[_CASADI_IDS] = np.arange(len(OPERATIONS))
CONST, INPUT, OUTPUT = range(3)
"""Codes of the operations that are not arithmetic."""

_PROBES: Final = 10
"""Instructions that are compared with what CasADi says about them."""


@dataclass(frozen=True)
class Tape:
    """The instructions of an SX function.

    Args:
        code: Operation, target and two operands of every instruction, int32 of shape (n, 4).
        registers: Number of registers.
        inputs: Input and nonzero of it that every row of a gather table reads, shape (k, 2).
        outputs: Output and nonzero of it that every row of a scatter table adds to, shape (l, 2).
        patterns: Row and column of every nonzero of every output, shape (nnz, 2) each.
    """

    code: np.ndarray
    registers: int
    inputs: np.ndarray
    outputs: np.ndarray
    patterns: tuple[np.ndarray, ...]

    @classmethod
    def of(cls, function: ca.Function) -> Tape | None:
        """Return the tape of an SX function.

        It is None if the function has an unknown operation, or if no interpreter was compiled.
        """
        library, code = kernels(), _instructions(function)
        if library is None or code is None:
            return None
        ids = code[:, 0]
        if ids.size and (ids.min() < 0 or ids.max() >= _CODES.size):
            return None
        code[:, 0] = _CODES[ids]
        if (code[:, 0] < 0).any():
            return None
        reads, writes = code[:, 0] == INPUT, code[:, 0] == OUTPUT
        inputs, outputs = code[reads][:, [2, 3]], code[writes][:, [1, 3]]
        code[reads, 3] = np.arange(len(inputs))
        code[writes, 3] = np.arange(len(outputs))
        return cls(*_scheduled(library, code), inputs, outputs, patterns_of(function))


def patterns_of(function: ca.Function) -> tuple[np.ndarray, ...]:
    """Return row and column of every nonzero of every output, shape (nnz, 2) each."""
    return tuple(
        np.array(function.sparsity_out(k).get_triplet(), np.int32).T.reshape(-1, 2)
        for k in range(function.n_out())
    )


def _scheduled(library: ctypes.CDLL, code: np.ndarray) -> tuple[np.ndarray, int]:
    """Return the instructions in the order of running, and the number of registers."""
    schedule, result = library.pathwalker_schedule_tape, np.empty_like(code)
    schedule.argtypes = (ctypes.c_void_p, ctypes.c_int64, ctypes.c_void_p)
    schedule.restype = ctypes.c_int64
    return result, schedule(code.ctypes.data, len(code), result.ctypes.data)


def _instructions(function: ca.Function) -> np.ndarray | None:
    """Return identity, target and two operands of all instructions, int32 of shape (n, 4).

    They are read from the serialised function, where they stand in a row: asking CasADi for one
    after the other takes three times as long.  None if they are not found there.
    """
    count = function.n_instructions()
    letters = np.frombuffer(function.serialize().encode(), np.uint8) - ord("a")
    content = (letters[::2] | letters[1::2] << 4).tobytes()
    wanted = b"".join(_record(function, i) for i in range(min(count, _PROBES)))
    start = content.find(wanted)
    if start < 0 or start + 16 * count > len(content):
        return None
    code = np.frombuffer(content, np.int32, 4 * count, start).reshape(count, 4).copy()
    probes = np.linspace(0, count - 1, min(count, _PROBES)).astype(int)
    same = all(_record(function, i) == code[i].tobytes() for i in probes.tolist())
    return code if same else None


def _record(function: ca.Function, i: int) -> bytes:
    """Return an instruction as it stands in the serialised function."""
    identity, operands = function.instruction_id(i), function.instruction_input(i)
    target = function.instruction_output(i)
    if identity == ca.OP_CONST:
        constant = np.float64(function.instruction_constant(i))
        return np.array([identity, *target], np.int32).tobytes() + constant.tobytes()
    if identity == ca.OP_OUTPUT:
        return np.array([identity, target[0], operands[0], target[1]], np.int32).tobytes()
    return np.array([identity, *target, *operands[:1], *operands[-1:]], np.int32).tobytes()
