"""Play with a run: sliders for its numbers, each move solved again from where it was."""
