"""Lines that end the help of every command: each is run as it stands, by somebody in a hurry."""

from __future__ import annotations

from itertools import groupby
from typing import Final

_LINES: Final = """
pathwalker solve mapd-orthosis mapd-orthosis
pathwalker solve mapd-barefoot mapd-barefoot.yaml --out runs/barefoot
pathwalker solve mapd-orthosis mapd-orthosis --set starts=8 --json
pathwalker perturb perturbation
pathwalker perturb perturbation --set 'factors=[0.9, 1.1]'
pathwalker perturb perturbation --run runs/mapd-orthosis --json
pathwalker sensitivity sensitivity --run runs/mapd-orthosis
pathwalker sensitivity sensitivity --set 'check=[]'
pathwalker uncertainty uncertainty --run runs/mapd-orthosis
pathwalker uncertainty uncertainty --set draws=20 --workers 2
pathwalker evaluate runs/mapd-orthosis
pathwalker evaluate runs/mapd-barefoot runs/mapd-orthosis
pathwalker report runs/mapd-barefoot runs/mapd-orthosis -o report.html
pathwalker report runs/cohort -o cohort.html
pathwalker animate runs/mapd-barefoot runs/mapd-orthosis -o gait.html
pathwalker animate runs/mapd-orthosis -o gait.mp4 --strides 3 --slow 2
pathwalker explore runs/mapd-orthosis
pathwalker explore runs/mapd-orthosis -o explore.html
pathwalker view runs/mapd-orthosis
pathwalker compare runs/mapd-barefoot runs/mapd-orthosis
pathwalker compare runs/first runs/second runs/third -o compared --json
pathwalker verify runs/mapd-orthosis
pathwalker verify runs/mapd-barefoot runs/mapd-orthosis --json
pathwalker rerun runs/mapd-orthosis --out runs/again
pathwalker reproduce -o article
pathwalker reproduce -o article-quick --quick
pathwalker batch cohort
pathwalker batch cohort.yaml --workers 4 --time-limit 600
pathwalker batch cohort --scheduler tcp://10.0.0.1:8786
pathwalker landscape landscape --run runs/mapd-orthosis
pathwalker landscape landscape --set side=left --set 'dorsiflexion=[20, 40]'
pathwalker tradeoff tradeoff --run runs/mapd-orthosis
pathwalker tradeoff tradeoff --set base=mapd-barefoot
pathwalker model sreenivasa2017-patient --condition orthosis -o walker.urdf
pathwalker model my-child --condition barefoot
pathwalker export runs/mapd-orthosis -o exported
pathwalker export runs/mapd-orthosis -o opensim --opensim
pathwalker import c3d/ --patient my-child --condition barefoot -o angles
pathwalker import walk-1.c3d --patient my-child --condition orthosis -o out
pathwalker ik inverse-kinematics --set 'c3d.barefoot=[c3d/]'
pathwalker ik inverse-kinematics.yaml
pathwalker id inverse-dynamics --out runs/torques
pathwalker id inverse-dynamics.yaml --update-patient
pathwalker init my-child
pathwalker init my-child --age 8 --mass 26.5 --height 1.27
pathwalker learn learn --out runs/learn
pathwalker learn learn --set steps=4 --set "without=[T1, T2]"
pathwalker init try-it --example
pathwalker check my-child/patient.yaml my-child/mapd-orthosis.yaml
pathwalker check mapd-orthosis landscape --json
pathwalker completion bash >> ~/.bashrc
pathwalker completion zsh >> ~/.zshrc
pathwalker completion fish > ~/.config/fish/completions/pathwalker.fish
pathwalker doctor
pathwalker doctor --json
"""

EXAMPLES: Final = {
    name: tuple(lines)
    for name, lines in groupby(_LINES.strip().splitlines(), lambda line: line.split()[1])
}
"""One to three lines per command, by its name."""


def examples_epilog(name: str) -> str:
    """Return the examples of a command as the end of its help; "" if there are none."""
    lines = EXAMPLES.get(name, ())
    return "\b\nExamples:\n" + "\n".join(f"  {line}" for line in lines) if lines else ""
