"""Functions of a nonlinear program that the compiled interpreter evaluates."""

from __future__ import annotations

import ctypes
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from functools import cache, cached_property
from typing import Any

import casadi as ca
import numpy as np

from pathwalker_cli.nlp.assembly import FUNCTIONS, KINDS, Assembly
from pathwalker_cli.nlp.kernels import kernels
from pathwalker_cli.nlp.tape import INPUT, LANES, Tape

__all__ = ["Columns", "taped_functions"]


def taped_functions(
    assembly: Assembly, tapes: Sequence[Mapping[str, Tape]]
) -> Mapping[str, ca.Function]:
    """Return the functions of a program.  CasADi does not keep them alive: the caller must.

    Args:
        assembly: The program.
        tapes: Tapes of all kinds by block.
    """
    runs = {
        kind: [_run(assembly, i, kind, tape[kind]) for i, tape in enumerate(tapes)]
        for kind in KINDS
    }
    functions = {}
    for name, (arguments, results) in FUNCTIONS.items():
        order = list(results.values())
        terms = []
        for kind, outputs in KINDS.items():
            wanted = [(kind, k) for k in range(len(outputs))]
            targets = [order.index(output) if output in order else None for output in wanted]
            if set(targets) != {None}:
                terms.append(_Term(runs[kind], targets))
        functions[name] = _TapedFunction(
            name,
            {argument: assembly.arguments[argument] for argument in arguments},
            {key: assembly.placements[kind][k].sparsity for key, (kind, k) in results.items()},
            terms,
        )
    return functions


def _run(assembly: Assembly, i: int, kind: str, tape: Tape) -> _Run:
    """Return the tape of one kind of block i with its places."""
    part, arguments = assembly.parts[i], list(assembly.arguments)
    sources = part.inputs(kind)
    return _Run(
        tape,
        [arguments.index(source.argument) for source in sources],
        [source.elements for source in sources],
        [placement.positions[i] for placement in assembly.placements[kind]],
        part.count,
    )


class _NativeRun(ctypes.Structure):
    """`Run` in `native/tape.cpp`."""

    _fields_ = (
        ("code", ctypes.c_void_p),
        ("gather", ctypes.c_void_p),
        ("scatter", ctypes.c_void_p),
        ("size", ctypes.c_int64),
        ("count", ctypes.c_int64),
        ("inputs", ctypes.c_int64),
        ("outputs", ctypes.c_int64),
        ("registers", ctypes.c_int64),
        ("wanted", ctypes.c_int64),
    )


@dataclass(frozen=True)
class _Run:
    """A tape at all occurrences of its block.

    Args:
        tape: The tape.
        sources: Which vector each input is read from.
        elements: Elements of the source, shape (nnz, count) or (nnz, 1), by input.
        positions: Nonzeros of the results that outputs are added to, shape (nnz, count), by output.
        count: Number of occurrences.
    """

    tape: Tape
    sources: Sequence[int]
    elements: Sequence[np.ndarray]
    positions: Sequence[np.ndarray]
    count: int

    @cached_property
    def code(self) -> np.ndarray:
        """Instructions whose INPUT names the source."""
        code = self.tape.code.copy()
        reads = code[:, 0] == INPUT
        code[reads, 2] = np.array(self.sources)[code[reads, 2]]
        return code

    @cached_property
    def gather(self) -> np.ndarray:
        """Elements of the sources, int32 of shape (groups, k, lanes)."""
        return self._table(self.elements, self.tape.inputs)

    @cached_property
    def scatter(self) -> np.ndarray:
        """Positions in the results, int32 of shape (groups, l, lanes)."""
        return self._table(self.positions, self.tape.outputs)

    def _table(self, places: Sequence[np.ndarray], rows: np.ndarray) -> np.ndarray:
        groups = -(-self.count // LANES)
        table = np.empty((len(rows), groups * LANES), np.int32)
        for k, place in enumerate(places):
            mine = rows[:, 0] == k
            # the last lanes, and those of shared numbers, repeat the last occurrence
            columns = np.minimum(np.arange(groups * LANES), place.shape[1] - 1)
            table[mine] = place[rows[mine, 1]][:, columns]
        return np.ascontiguousarray(table.reshape(len(rows), groups, LANES).swapaxes(0, 1))

    @cached_property
    def native(self) -> _NativeRun:
        """The same for the interpreter, which reads the arrays of this object."""
        wanted = sum(1 << k for k, positions in enumerate(self.positions) if positions.size)
        return _NativeRun(
            *(array.ctypes.data for array in (self.code, self.gather, self.scatter)),
            len(self.code),
            self.count,
            len(self.tape.inputs),
            len(self.tape.outputs),
            self.tape.registers,
            wanted,
        )


@dataclass(frozen=True)
class _Term:
    """What tapes of one kind add to the results of a function.

    Args:
        runs: The tapes.
        targets: Which result each output of the tapes is added to; None where to none.
    """

    runs: Sequence[_Run]
    targets: Sequence[int | None]

    @cached_property
    def native(self) -> ctypes.Array[_NativeRun]:
        """The runs for the interpreter."""
        return (_NativeRun * len(self.runs))(*(run.native for run in self.runs))


class _TapedFunction(ca.Callback):
    """A CasADi function that sums what tapes say; it must outlive every solver that uses it.

    Args:
        name: Its name.
        arguments: Lengths of the arguments by name; sources are counted in this order.
        results: Patterns of the results by name.
        terms: What is summed.
    """

    def __init__(
        self,
        name: str,
        arguments: Mapping[str, int],
        results: Mapping[str, ca.Sparsity],
        terms: Sequence[_Term],
    ) -> None:
        ca.Callback.__init__(self)
        self._arguments = list(arguments.items())
        self._results = list(results.items())
        self._terms = [(term, term.native) for term in terms]
        self._zeros = [np.zeros(max(size, 1)) for size in arguments.values()]
        # `nlpsol` prepares the gradient of the Lagrangian, which nobody evaluates: derivatives
        # have functions of their own
        self.construct(name, {"is_diff_in": [False] * len(arguments)})

    def get_n_in(self) -> int:
        return len(self._arguments)

    def get_n_out(self) -> int:
        return len(self._results)

    def get_name_in(self, i: int) -> str:
        return self._arguments[i][0]

    def get_name_out(self, i: int) -> str:
        return self._results[i][0]

    def get_sparsity_in(self, i: int) -> ca.Sparsity:
        return ca.Sparsity.dense(self._arguments[i][1])

    def get_sparsity_out(self, i: int) -> ca.Sparsity:
        return self._results[i][1]

    def has_eval_buffer(self) -> bool:
        return True

    def eval_buffer(
        self, arguments: Sequence[memoryview | None], results: Sequence[memoryview | None]
    ) -> int:
        """Evaluate; a missing argument stands for zeros, a missing result is not wanted."""
        given = [_array(buffer) for buffer in arguments]
        given = [z if a is None else a for a, z in zip(given, self._zeros, strict=True)]
        sums = [_array(buffer) for buffer in results]
        for total in sums:
            if total is not None:
                total.fill(0.0)
        sources = _pointers(given)
        for term, runs in self._terms:
            wanted = [None if k is None else sums[k] for k in term.targets]
            _run_tapes()(runs, len(runs), sources, _pointers(wanted), len(wanted))
        return 0


class Columns:
    """An SX function at many points side by side, like the function itself but faster.

    Args:
        function: The function; without the compiled interpreter it answers itself.
    """

    def __init__(self, function: ca.Function) -> None:
        self._function = function
        self._tape = Tape.of(function)
        self._prepared: dict[int, _Term] = {}

    def __call__(self, *points: np.ndarray) -> list[np.ndarray]:
        """Return the outputs at m points, shape (rows, columns * m) each.

        Args:
            points: Inputs, shape (n, m) each.
        """
        count = points[0].shape[1]
        if self._tape is None:
            return [np.asarray(output) for output in self._function.call(list(points))]
        if count not in self._prepared:
            self._prepared[count] = self._at(self._tape, count)
        given = [np.ascontiguousarray(point, float) for point in points]
        shapes = [self._function.size_out(k) for k in range(self._function.n_out())]
        outputs = [np.zeros((rows, columns * count)) for rows, columns in shapes]
        runs = self._prepared[count].native
        _run_tapes()(runs, len(runs), _pointers(given), _pointers(outputs), len(outputs))
        return outputs

    def _at(self, tape: Tape, count: int) -> _Term:
        """Return the tape with the places of m points."""
        function, point = self._function, np.arange(count)
        elements = [
            np.arange(function.nnz_in(k))[:, None] * count + point for k in range(function.n_in())
        ]
        positions = []
        for k in range(function.n_out()):
            rows, columns = (
                np.array(i, int)[:, None] for i in function.sparsity_out(k).get_triplet()
            )
            width = function.size2_out(k)
            positions.append(rows * width * count + point * width + columns)
        run = _Run(tape, range(len(elements)), elements, positions, count)
        return _Term([run], list(range(len(positions))))


@cache
def _run_tapes() -> Any:
    """Return the interpreter."""
    library = kernels()
    if library is None:
        raise RuntimeError("tapes need the compiled kernels")
    run = library.pathwalker_run_tapes
    run.argtypes = (
        *(ctypes.c_void_p, ctypes.c_int64),
        *(ctypes.c_void_p, ctypes.c_void_p, ctypes.c_int64),
    )
    run.restype = None
    return run


def _array(buffer: memoryview | None) -> np.ndarray | None:
    """Return the numbers in a buffer, not copied."""
    return None if buffer is None or not buffer.nbytes else np.frombuffer(buffer)


def _pointers(arrays: Sequence[np.ndarray | None]) -> ctypes.Array[ctypes.c_void_p]:
    addresses = (None if array is None else array.ctypes.data for array in arrays)
    return (ctypes.c_void_p * len(arrays))(*addresses)
