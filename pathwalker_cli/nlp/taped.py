"""Functions of a nonlinear program that the compiled interpreter evaluates."""

from __future__ import annotations

import ctypes
from collections.abc import Mapping, Sequence
from functools import cache
from typing import Any

import casadi as ca
import numpy as np

from pathwalker_cli.nlp.assembly import FUNCTIONS, KINDS, Assembly
from pathwalker_cli.nlp.kernels import kernels
from pathwalker_cli.nlp.tape import INPUT, LANES, Tape


def taped_functions(
    assembly: Assembly, tapes: Sequence[Mapping[str, Tape]]
) -> Mapping[str, ca.Function]:
    """Return the functions of a program.  CasADi does not keep them alive: the caller must."""
    runs = {
        kind: _Runs([_run(assembly, i, kind, tape[kind]) for i, tape in enumerate(tapes)])
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
                terms.append((runs[kind], targets))
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
    return _Run.of(
        tape,
        [arguments.index(source.argument) for source in sources],
        [source.elements for source in sources],
        [placement.positions[i] for placement in assembly.placements[kind]],
        part.count,
    )


class _Run(ctypes.Structure):
    """A tape at all occurrences of its block: `Run` in `native/tape.cpp`."""

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

    @classmethod
    def of(
        cls,
        tape: Tape,
        sources: Sequence[int],
        elements: Sequence[np.ndarray],
        positions: Sequence[np.ndarray],
        count: int,
    ) -> _Run:
        """Return the run of a tape.

        Args:
            tape: The tape.
            sources: Which vector each input is read from.
            elements: Elements of the source, shape (nnz, count) or (nnz, 1), by input.
            positions: Nonzeros of the results that outputs are added to, shape (nnz, count), by
                output.
            count: Number of occurrences.
        """
        code = tape.code.copy()
        reads = code[:, 0] == INPUT
        code[reads, 2] = np.array(sources)[code[reads, 2]]
        tables = (_table(elements, tape.inputs, count), _table(positions, tape.outputs, count))
        run = cls(
            *(array.ctypes.data for array in (code, *tables)),
            len(code),
            count,
            len(tape.inputs),
            len(tape.outputs),
            tape.registers,
            sum(1 << k for k, places in enumerate(positions) if places.size),
        )
        run.arrays = (code, *tables)  # kept alive: the fields only point at them
        return run


def _table(places: Sequence[np.ndarray], rows: np.ndarray, count: int) -> np.ndarray:
    """Return elements or positions in the order of reading, int32 of shape (groups, k, lanes)."""
    groups = -(-count // LANES)
    table = np.empty((len(rows), groups * LANES), np.int32)
    for k, place in enumerate(places):
        mine = rows[:, 0] == k
        # the last lanes, and those of shared numbers, repeat the last occurrence
        columns = np.minimum(np.arange(groups * LANES), place.shape[1] - 1)
        table[mine] = place[rows[mine, 1]][:, columns]
    return np.ascontiguousarray(table.reshape(len(rows), groups, LANES).swapaxes(0, 1))


class _Runs:
    """Tapes that add to the same results."""

    def __init__(self, runs: Sequence[_Run]) -> None:
        self._runs = runs  # they keep what the copies in the array point at
        self._array = (_Run * len(runs))(*runs)

    def __call__(
        self, sources: ctypes.Array[ctypes.c_void_p], results: Sequence[np.ndarray | None]
    ) -> None:
        """Add every output to its result, but for those without one."""
        _interpreter()(self._array, len(self._runs), sources, _pointers(results), len(results))


class _TapedFunction(ca.Callback):
    """A CasADi function that sums what tapes say; it must outlive every solver that uses it.

    Relied on, of CasADi 3.8: `eval_buffer` gets dense numbers, None for an argument of zeros and
    for a result that is not wanted; and `nlpsol` asks for no derivative of what says it has none.

    Args:
        arguments: Lengths of the arguments by name; sources are counted in this order.
        results: Patterns of the results by name.
        terms: What is summed: tapes, and which result each of their outputs is added to.
    """

    def __init__(
        self,
        name: str,
        arguments: Mapping[str, int],
        results: Mapping[str, ca.Sparsity],
        terms: Sequence[tuple[_Runs, Sequence[int | None]]],
    ) -> None:
        ca.Callback.__init__(self)
        self._arguments = list(arguments.items())
        self._results = list(results.items())
        self._terms = terms
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
        for runs, targets in self._terms:
            runs(sources, [None if k is None else sums[k] for k in targets])
        return 0


class Columns:
    """An SX function at many points side by side, like the function itself but faster.

    Args:
        function: The function; without the compiled interpreter it answers itself.
    """

    def __init__(self, function: ca.Function) -> None:
        self._function = function
        self._tape = Tape.of(function)
        self._prepared: dict[int, _Runs] = {}

    def __call__(self, *points: np.ndarray) -> list[np.ndarray]:
        """Return the outputs at m points (n, m), shape (rows, columns * m) each."""
        count = points[0].shape[1]
        if self._tape is None:
            return [np.asarray(output) for output in self._function.call(list(points))]
        if count not in self._prepared:
            self._prepared[count] = self._at(self._tape, count)
        given = [np.ascontiguousarray(point, float) for point in points]
        shapes = [self._function.size_out(k) for k in range(self._function.n_out())]
        outputs = [np.zeros((rows, columns * count)) for rows, columns in shapes]
        self._prepared[count](_pointers(given), outputs)
        return outputs

    def _at(self, tape: Tape, count: int) -> _Runs:
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
        return _Runs([_Run.of(tape, range(len(elements)), elements, positions, count)])


@cache
def _interpreter() -> Any:
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
