"""Ways in which the seeds of a study share their draws; imports nothing."""

INDEPENDENT = "independent"
"""Every seed draws for itself."""
ANTITHETIC = "antithetic"
"""In pairs: where the first seed draws u, the second draws 1 - u."""
LATIN_HYPERCUBE = "latin_hypercube"
"""In blocks: each draw falls once into each of as many equal strata as the block has seeds."""
BLOCK_SIZES = {INDEPENDENT: 1, ANTITHETIC: 2, LATIN_HYPERCUBE: 10}
"""Seeds of a block. What different blocks draw is independent. [-]"""
DESIGNS = tuple(BLOCK_SIZES)
