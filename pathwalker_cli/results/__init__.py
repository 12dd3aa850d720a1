"""What a solve leaves behind: typed, written once, read back with suspicion."""
