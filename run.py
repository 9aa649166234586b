"""Kankaku from a checkout: ``python run.py scenarios/rush_hour``."""

from kankaku.__main__ import main

if __name__ == "__main__":
    main()
