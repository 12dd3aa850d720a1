"""Animations of the walking model: files for people, and a view in 3D."""
