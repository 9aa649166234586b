"""Tables in words: reports in Markdown and lines for a terminal."""
