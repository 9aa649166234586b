"""The files of the scenario ``yizhuang``, made from public data of the Beijing Yizhuang line."""
