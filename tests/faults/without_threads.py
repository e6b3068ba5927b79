"""Run the command line in a process that can start no thread, or so many only."""

import sys
import threading

LEFT = [int(sys.argv.pop(1))]
_start = threading.Thread.start


def start(thread):
    if not LEFT[0]:
        raise RuntimeError("can't start new thread")
    LEFT[0] -= 1
    _start(thread)


threading.Thread.start = start

if __name__ == "__main__":
    from dmc_cli.cli import main

    main()
