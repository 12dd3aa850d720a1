"""Effort against walking speed."""
