"""The excitation whose model gives the controller with the least error."""
