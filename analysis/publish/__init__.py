"""
Results folders: tables, figures, reports and what they were made from.

It promises that a folder has its main table only once everything else is written, that each file is
written whole or not at all, and that ``columns.csv`` explains every column of every table. A kind
of results is one :class:`~kankaku.analysis.publish.results_folder.Kind`.
"""
