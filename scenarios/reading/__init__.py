"""Files to a scenario: strictly read, once; field units become SI; mistakes are collected."""
