"""How far the answers spread if the numbers of the patient are uncertain."""
