"""Results folders: tables, figures, reports and what they were made from."""
