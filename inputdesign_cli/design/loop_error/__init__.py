"""Inputs for the model that a controller is designed on: asymptotic theory, limits, exact covariance."""
