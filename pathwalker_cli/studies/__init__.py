"""Studies of many related solves: perturbation, sensitivity, landscape, trade-off, cohorts."""
