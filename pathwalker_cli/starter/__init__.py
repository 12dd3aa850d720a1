"""A folder to begin with: a patient, an orthosis and configs that explain themselves."""
