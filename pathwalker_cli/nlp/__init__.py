"""Nonlinear programs of many small blocks: built, evaluated, solved; no walking in it."""
