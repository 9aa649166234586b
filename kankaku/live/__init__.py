"""
The live link: runs that somebody outside takes part in, step by step.

:class:`kankaku.Simulation` shows the line at chosen intervals and takes speed ceilings, target
speeds and holds, which only ever lower what protection permits. The environments for Gymnasium
and PettingZoo stand on it.
"""
