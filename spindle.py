"""The command line from a checkout: `python spindle.py VERB SCENE [options]`, the same as the installed `spindle`."""

import sys

from thermospindle.__main__ import main

if __name__ == "__main__":
    sys.exit(main())
