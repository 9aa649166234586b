"""
What is measured in every run: energy, and standing or crawling between stations.

It promises:

- a meter looks at blocks of steps, each step once, and changes nothing;
- what it has measured goes into the record under the names that it gives itself;
- the work of traction, brakes, resistance and gravity of a train adds up.

It relies on blocks that follow one another without a gap.
"""
