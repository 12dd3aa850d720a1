"""The article's study as a whole, from the shipped data to one page of results."""
