"""Call one function below `parts` and write its result: `worker.py MODULE:FUNCTION JSON FILE`."""

from __future__ import annotations

import json
import sys
from importlib import import_module
from pathlib import Path


def main() -> None:
    """Call the function that the command line names."""
    part, arguments, path = sys.argv[1:]
    module, function = part.split(":")
    result = getattr(import_module(f"parts.{module}"), function)(**json.loads(arguments))
    Path(path).write_text(json.dumps(result), encoding="utf-8")


if __name__ == "__main__":
    main()
