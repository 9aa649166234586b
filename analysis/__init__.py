"""From the record of a run to tables, sentences, figures and a folder of results."""
