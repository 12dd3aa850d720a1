"""Is a run folder what it says, and does it solve what its config asks?"""
