"""The commands of the command line, one module per family; heavy imports stay inside them."""
