"""Do the commands survive what is damaged, or what an attacker has made?

    python tools/fuzz.py damaged [--count 200] [--first 0] [--only KIND] [--seed 1]
    python tools/fuzz.py hostile [--count 200] [--first 0] [--only KIND]

``damaged.py`` and ``hostile.py`` say what must hold. Where it does not the exit code is 1, and the
case is printed.
"""

from __future__ import annotations

import argparse
import resource
import sys
from functools import partial

_MOST_BYTES = 6 * 2**30  # so that the machine survives


def main() -> int:
    parser = argparse.ArgumentParser(description=__doc__.partition("\n")[0])
    parser.add_argument("what", choices=["damaged", "hostile"])
    parser.add_argument("--count", type=int, default=200)
    parser.add_argument("--first", type=int, default=0, help="number of the first case")
    parser.add_argument("--only", metavar="KIND")
    parser.add_argument("--seed", type=int, default=1, help="of damaged cases")
    arguments = parser.parse_args()
    if arguments.what == "hostile":
        from hostile import KINDS, play  # which must not import desim: its memory is measured
    else:
        import damaged

        resource.setrlimit(resource.RLIMIT_AS, (_MOST_BYTES, _MOST_BYTES))
        KINDS, play = damaged.KINDS, partial(damaged.play, seed=arguments.seed)
    kinds = [kind for kind in KINDS if arguments.only in (None, kind)]
    if not kinds:
        parser.error(f"--only: one of {', '.join(KINDS)}")
    wrong = play(kinds, range(arguments.first, arguments.first + arguments.count))
    print(f"{arguments.count} cases, {wrong} wrong")
    return 1 if wrong else 0


if __name__ == "__main__":
    sys.exit(main())
