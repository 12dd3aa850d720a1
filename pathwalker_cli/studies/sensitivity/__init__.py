"""What every number of patient and orthosis does to an optimum."""
