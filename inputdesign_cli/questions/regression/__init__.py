"""The regressors with the least mean squared error of a reduced-order regression."""
