"""
The reference of every file, column and key that a scenario may have.

It is made of the schema that reads the files, and of one sentence and one example for each column
and key, which lie beside the schema. It promises that nothing is left out, and that every example
is allowed.
"""
