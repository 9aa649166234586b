"""Programs for maintainers: benchmark, step study, limits study, tables of the documentation."""
