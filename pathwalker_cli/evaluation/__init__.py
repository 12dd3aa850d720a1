"""How well a gait agrees with the recordings, and with what the article printed."""
