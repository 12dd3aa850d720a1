"""One page about runs, recorded gait or a cohort: content first, HTML last."""
