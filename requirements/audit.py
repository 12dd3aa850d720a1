"""Known vulnerabilities of what a lock file names; `python requirements/audit.py LOCK`.

Exit code 1 if there are any. Where the index that knows them is not reached, or keeps no record,
that is said, and nothing is found: a test run without a network shall not fail for it.
"""

from __future__ import annotations

import json
import subprocess
import sys

_AUDIT = ("pip_audit", "--require-hashes", "--disable-pip", "--progress-spinner", "off")


def main(lock: str) -> int:
    """Print what is known of the packages of a lock; 1 if one is vulnerable."""
    words = [sys.executable, "-m", *_AUDIT, "--format", "json", "--requirement", lock]
    done = subprocess.run(words, capture_output=True, text=True, check=False)
    try:
        packages = json.loads(done.stdout)["dependencies"]
    except (ValueError, KeyError):
        reason = (done.stderr.strip() or "it said nothing").splitlines()[-1]
        print(f"{lock}: not audited, pip-audit did not come to an end: {reason}")
        return 0
    found = [(package, known) for package in packages for known in package.get("vulns", ())]
    for package, known in found:
        mended = ", ".join(known["fix_versions"]) or "no version yet"
        print(f"{package['name']} {package['version']}: {known['id']}, mended in {mended}")
    audited = sum("skip_reason" not in package for package in packages)
    print(f"{lock}: {audited} of {len(packages)} packages audited, {len(found)} vulnerabilities")
    if audited < len(packages):
        print("of the others the index that was asked keeps no record")
    return 1 if found else 0


if __name__ == "__main__":
    sys.exit(main(*sys.argv[1:]))
