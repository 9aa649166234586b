"""
Operations: how a train uses its permission.

They promise:

- advice only lowers a speed, and says why, in a word that is declared;
- the same state, authority and memory give the same advice.

They rely on what a protection says beforehand, whichever it is, and infer nothing from what it
permits; delays to come they do not know.
"""
