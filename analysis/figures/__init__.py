"""Figures; the only place that knows matplotlib."""

import os

from kankaku.railway.places import plotting_folder

# Matplotlib looks for it once, when it is imported, and complains where home cannot be written.
os.environ["MPLCONFIGDIR"] = plotting_folder()
