"""Prints the digests of runs, for a process of its own: python digests.py FILE [OVERRIDE ...]."""

import json
import sys

from runs import built

if __name__ == "__main__":
    file, *overrides = sys.argv[1:]
    outcome = built(file, *overrides).run()
    json.dump([outcome.digest, outcome.digest_by_entity, outcome.events], sys.stdout)
