"""Ways in which the seeds of a study share their draws; imports nothing."""

INDEPENDENT = "independent"
"""Every seed draws for itself."""
ANTITHETIC = "antithetic"
"""In pairs: where the first seed draws u, the second draws 1 - u."""
LATIN_HYPERCUBE = "latin_hypercube"
"""In tens: each draw falls once into each tenth of its distribution."""
REPLICATE_SIZES = {INDEPENDENT: 1, ANTITHETIC: 2, LATIN_HYPERCUBE: 10}
"""Seeds of a replicate. What seeds of different replicates draw is independent. [-]"""
DESIGNS = tuple(REPLICATE_SIZES)
