"""
Figures; the only place that knows matplotlib.

It promises the same bytes every time, and that a controller has the same colour and line in all
figures of a study. It relies on tables alone. It is imported when the first figure is drawn.
"""

import os

from kankaku.railway.places import plotting_folder

# Matplotlib looks for it once, when it is imported, and complains where home cannot be written.
os.environ["MPLCONFIGDIR"] = plotting_folder()
