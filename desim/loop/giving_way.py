"""A library for programs in the guest: a thread that finds a lock taken gives way to others.

The guest has one processor, and nothing takes it from a thread while the clock stands. The thread
of Fast DDS that sends later (FlowControllerImpl.hpp, ``run``) tries a writer's lock again and again
until another thread has freed it, which it does not let run.
"""

from __future__ import annotations

import shutil
import subprocess
from pathlib import Path

_SOURCE = """
#define _GNU_SOURCE
#include <dlfcn.h>
#include <pthread.h>
#include <time.h>

int pthread_mutex_trylock(pthread_mutex_t *mutex)
{
    static int (*original)(pthread_mutex_t *);
    int failed;

    if (!original)
        original = dlsym(RTLD_NEXT, "pthread_mutex_trylock");
    failed = original(mutex);
    if (failed)
        nanosleep(&(struct timespec){0, 1}, 0);
    return failed;
}
"""


def build(folder: Path) -> Path | None:
    """Compile the library into ``folder``. Returns its path for LD_PRELOAD, or None where there is
    no compiler: most programs run without it."""
    library = folder / "giving_way.so"
    if shutil.which("gcc") is None:
        return None
    done = subprocess.run(["gcc", "-O1", "-shared", "-fPIC", "-x", "c", "-", "-o", str(library),
                           "-ldl"], input=_SOURCE, text=True, capture_output=True, check=False)
    return None if done.returncode else library
