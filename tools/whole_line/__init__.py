"""The files of the scenario ``whole_line``, made from the public timetable."""
