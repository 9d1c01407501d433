"""Design and measure frequency responses without a model."""
