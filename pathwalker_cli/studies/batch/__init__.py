"""Any list or grid of patients, problems and overrides, on all cores or on a cluster."""
