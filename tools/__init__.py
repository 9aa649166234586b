"""Programs for maintainers: benchmark, step study, limits study, README tables."""
