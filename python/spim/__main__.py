"""``python -m spim``."""

from spim.cli import main

if __name__ == "__main__":
    main()
