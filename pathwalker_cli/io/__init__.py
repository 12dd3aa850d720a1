"""Files in and out: YAML, C3D, CSV; readers and writers exchange dataclasses only."""
