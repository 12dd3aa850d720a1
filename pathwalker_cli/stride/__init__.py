"""One stride, predicted or recorded: its curves, its measures, its proof and its figures."""
