"""Mean-squared-error design for reduced-order regression: closed form, Toeplitz search, proofs."""
