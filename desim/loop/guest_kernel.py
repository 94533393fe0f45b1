"""The guest kernel: User-Mode Linux with simulated time, built from Linux's sources.

It is built on the user's machine and kept in the user's cache. It is never shipped: Linux has a
licence of its own (GPL-2.0).
"""

from __future__ import annotations

import hashlib
import json
import re
import shutil
import subprocess
from collections.abc import Callable, Sequence
from pathlib import Path
from typing import NamedTuple

from desim.compiler.folder import own_folder
from desim.errors import InputError

SOURCES = Path("/usr/src")  # Debian's packages linux-source-6.1 and the like put theirs here
KERNEL = "linux"
_OBJECTS = 930  # that a build of 6.1.192 compiles
_NEEDED = ("UML_TIME_TRAVEL_SUPPORT", "TUN", "NET_NS", "HOSTFS", "MAGIC_SYSRQ")

Counted = Callable[[int, int], object]  # how many of how many files are compiled


class Edit(NamedTuple):
    """A change of the text of a source ``file``. ``needed``: newer kernels have no such text
    otherwise."""

    file: str
    before: str
    after: str
    needed: bool = True


# The kernel's random numbers come from the seed on its command line alone.
_SEEDED = (
    Edit("drivers/char/random.c", "\tblake2s_update(&input_pool.hash, buf, len);\n", ""),
    Edit("drivers/char/random.c", "_mix_pool_bytes(command_line, strlen(command_line));",
         """{
		const char *seed = strstr(command_line, "desim.seed=");

		if (seed)
			blake2s_update(&input_pool.hash, seed, strcspn(seed, " "));
	}"""),
    Edit("drivers/char/random.c", "else if (trust_cpu)\n\t\t_credit_init_bits(arch_bits);",
         "else\n\t\t_credit_init_bits(POOL_READY_BITS);"),
    Edit("drivers/char/random.c", "block.rdseed[i++] = random_get_entropy();",
         "block.rdseed[i++] = 0;"),
    Edit("arch/um/include/asm/archrandom.h", "ret = os_getrandom(v, max_longs * sizeof(*v), 0);",
         "ret = -1;"),
)
# Processors with AMX have more registers than User-Mode Linux 6.1 has room for, and the machine's
# kernel takes them back whole or not at all.
_ROOMY = (
    Edit("arch/x86/um/user-offsets.c", "2696", "12288", needed=False),
    Edit("arch/x86/um/os-Linux/registers.c", "int have_xstate_support;\n",
         "int have_xstate_support;\nstatic unsigned long xstate_size;\n", needed=False),
    Edit("arch/x86/um/os-Linux/registers.c",
         "iov.iov_len = FP_SIZE * sizeof(unsigned long);\n"
         "\t\tif (ptrace(PTRACE_SETREGSET", "iov.iov_len = xstate_size;\n"
         "\t\tif (ptrace(PTRACE_SETREGSET", needed=False),
    Edit("arch/x86/um/os-Linux/registers.c", "\t\thave_xstate_support = 1;\n",
         "\t\thave_xstate_support = 1, xstate_size = iov.iov_len;\n", needed=False),
)
# A new page brings those behind it with it, up to the end of its 64 KB: a page fault costs more
# than a page. Reading pages of files does as much in mm/memory.c, but maps each at its own fault.
_FAR_SIGHTED = (
    Edit("arch/um/kernel/trap.c", "\tflush_tlb_page(vma, address);\nout:", """\
	{
		unsigned long size = 16 * PAGE_SIZE, next = (address & PAGE_MASK) + PAGE_SIZE;
		unsigned long end = min(vma->vm_end, (address | (size - 1)) + 1);

		flags &= ~(FAULT_FLAG_ALLOW_RETRY | FAULT_FLAG_KILLABLE);
		if (vma->vm_flags & VM_SHARED || (!vma->vm_file && !is_write))
			next = end;
		for (; next < end; next += PAGE_SIZE) {
			pte = pte_offset_kernel(pmd_off(mm, next), next);
			if (!pte_none(*pte))
				continue;
			if (handle_mm_fault(vma, next, flags, NULL) & VM_FAULT_ERROR)
				break;
		}
		flush_tlb_range(vma, max(vma->vm_start, address & ~(size - 1)), end);
	}
out:""", needed=False),
)
# The clock counts in 256 ns, and so do timers: else what is left over of one moves the next.
_IN_STEP = (
    Edit("arch/um/kernel/time.c", "time_travel_time + delta);",
         "roundup(time_travel_time + delta, TIMER_MULTIPLIER));"),
)
EDITS = (*_SEEDED, *_ROOMY, *_FAR_SIGHTED, *_IN_STEP)
_OPTIONS = """
CONFIG_UML_TIME_TRAVEL_SUPPORT=y
CONFIG_TUN=y
CONFIG_VETH=y
CONFIG_NET_NS=y
CONFIG_NAMESPACES=y
CONFIG_PACKET=y
CONFIG_UNIX=y
CONFIG_IP_MULTICAST=y
CONFIG_NET_SCHED=y
CONFIG_NET_SCH_NETEM=y
CONFIG_BRIDGE=y
CONFIG_HOSTFS=y
CONFIG_TMPFS=y
CONFIG_DEVTMPFS=y
CONFIG_DEVTMPFS_MOUNT=y
CONFIG_HIGH_RES_TIMERS=y
CONFIG_NO_HZ_IDLE=y
CONFIG_TCP_CONG_CUBIC=y
CONFIG_EVENTFD=y
CONFIG_TIMERFD=y
CONFIG_EPOLL=y
CONFIG_SIGNALFD=y
CONFIG_INOTIFY_USER=y
CONFIG_POSIX_MQUEUE=y
CONFIG_SYSVIPC=y
CONFIG_MAGIC_SYSRQ=y
CONFIG_MCONSOLE=y
CONFIG_WIRELESS=y
CONFIG_CFG80211=y
CONFIG_MAC80211=y
CONFIG_WLAN=y
CONFIG_MAC80211_HWSIM=y
CONFIG_DEBUG_INFO_NONE=y
CONFIG_CGROUPS=n
CONFIG_IPV6=n
CONFIG_MODULES=n
CONFIG_UML_NET=n
CONFIG_SOUND=n
CONFIG_UML_SOUND=n
CONFIG_EXT4_FS=n
CONFIG_REISERFS_FS=n
CONFIG_AUTOFS_FS=n
CONFIG_ISO9660_FS=n
CONFIG_DEBUG_KERNEL=n
CONFIG_RAID6_PQ_BENCHMARK=n
CONFIG_BTRFS_FS=n
CONFIG_CC_OPTIMIZE_FOR_SIZE=n
CONFIG_STATIC_LINK=n
CONFIG_UML_RANDOM=n
CONFIG_NETFILTER=n
CONFIG_KERNEL_STACK_ORDER=3
"""  # the last: room for those registers


def kernel_folder() -> Path:
    """The folder of the guest kernel, in the user's cache; it is the user's alone."""
    recipe = hashlib.sha256(json.dumps([_OPTIONS, EDITS]).encode()).hexdigest()[:12]
    return own_folder(f"guest-{recipe}")


def guest_kernel() -> Path:
    """The guest kernel. Raises ``InputError`` where it has not been built, or was changed since."""
    folder = kernel_folder()
    kernel = folder / KERNEL
    if not (folder / "built.json").is_file():
        raise InputError("there is no guest kernel yet, which lets real programs run in simulated "
                         "time; desim loop build makes it (about 10 minutes, once)")
    built = json.loads((folder / "built.json").read_bytes())
    if _digest(kernel) != built["sha256"]:
        raise InputError(f"{kernel}: not what desim loop build has made; remove {folder} and build "
                         "it again")
    return kernel


def newest_source() -> Path | None:
    """The newest of Debian's packed sources of Linux on this machine."""
    found = [(tuple(map(int, re.findall(r"\d+", path.name))), path)
             for path in SOURCES.glob("linux-source-*.tar.*")]
    return max(found)[1] if found else None


def build(source: Path | None, jobs: int, on_progress: Counted) -> Path:
    """Build the guest kernel from ``source``, an archive or a folder (default: Debian's), with so
    many processes. Goes on where an earlier build ended. Returns its path. Raises ``InputError``
    where something is missing or the build fails."""
    folder = kernel_folder()
    if (folder / "built.json").is_file():
        return guest_kernel()
    chosen = source or newest_source()
    if chosen is None:
        raise InputError(f"no sources of Linux in {SOURCES}; on Debian: apt-get install "
                         "linux-source; elsewhere name an archive or a folder of Linux 6.1 or "
                         "later with --source")
    log = folder / "build.log"
    log.unlink(missing_ok=True)
    tree = _unpacked(chosen.resolve(), folder, on_progress)
    for edit in EDITS:
        _apply(tree, edit)
    objects = folder / "objects"
    objects.mkdir(exist_ok=True)
    make = ["make", "-C", str(tree), "ARCH=um", "SUBARCH=x86_64", f"O={objects}"]
    _configure(make, objects, log)
    _make([*make, f"-j{jobs}", KERNEL], log, on_progress)
    shutil.copy2(objects / KERNEL, folder / KERNEL)
    (folder / "built.json").write_text(json.dumps({
        "sha256": _digest(folder / KERNEL), "source": str(chosen),
        "release": (objects / "include/config/kernel.release").read_text("utf-8").strip()}),
        "utf-8")
    for left in (objects, folder / "source"):
        shutil.rmtree(left, ignore_errors=True)
    return folder / KERNEL


def _unpacked(source: Path, folder: Path, on_progress: Counted) -> Path:
    """A tree of our own of the sources."""
    own = folder / "source"
    done = own / ".unpacked"
    if not done.is_file() or done.read_text("utf-8") != str(source):
        on_progress(0, _OBJECTS)
        for other in own, folder / "objects":  # of other sources
            shutil.rmtree(other, ignore_errors=True)
        own.mkdir()
        if source.is_dir():
            command = ["cp", "-r", "--", f"{source}/.", str(own)]
        elif source.is_file():
            command = ["tar", "-xf", str(source), "-C", str(own), "--strip-components=1",
                       "--no-same-owner"]
        else:
            raise InputError(f"{source}: no such archive or folder")
        result = subprocess.run(command, capture_output=True, text=True, check=False)
        if result.returncode:
            raise InputError(f"{source}: {result.stderr.strip()}")
        if not (own / "arch/um/Kconfig").is_file():
            raise InputError(f"{source}: no sources of Linux: it has no arch/um")
        done.write_text(str(source), "utf-8")
    return own


def _apply(tree: Path, edit: Edit) -> None:
    """Change a source once. Raises ``InputError`` if its text is not as expected."""
    file = tree / edit.file
    text = file.read_text("utf-8") if file.is_file() else ""
    if edit.after and edit.after in text:
        return
    if text.count(edit.before) == 1:
        file.write_text(text.replace(edit.before, edit.after), "utf-8")
    elif edit.needed and edit.after:
        raise InputError(f"{file}: the text that desim changes is not there; its changes are "
                         "made for Linux 6.1")


def _configure(make: Sequence[str], objects: Path, log: Path) -> None:
    if (objects / ".config").is_file():
        return
    _quiet([*make, "x86_64_defconfig"], log)
    with (objects / ".config").open("a") as config:
        config.write(_OPTIONS)
    _quiet([*make, "olddefconfig"], log)
    chosen = (objects / ".config").read_text("utf-8")
    missing = [name for name in _NEEDED if f"CONFIG_{name}=y" not in chosen]
    if missing:
        (objects / ".config").unlink()
        raise InputError(f"these sources of Linux have not {', '.join(missing)}; allowed: Linux "
                         "6.1 or later")


def _quiet(command: Sequence[str], log: Path) -> None:
    with log.open("a") as output:
        done = subprocess.run(command, stdout=output, stderr=subprocess.STDOUT, check=False)
    if done.returncode:
        raise _failed(log)


def _make(command: Sequence[str], log: Path, on_progress: Counted) -> None:
    """Compile, and tell how far it is."""
    compiled = 0
    with log.open("a") as output, subprocess.Popen(
            command, stdout=subprocess.PIPE, stderr=subprocess.STDOUT, text=True) as process:
        assert process.stdout is not None
        for line in process.stdout:
            output.write(line)
            if line.startswith("  CC "):
                compiled += 1
                on_progress(min(compiled, _OBJECTS), _OBJECTS)
    if process.returncode:
        raise _failed(log)


def _failed(log: Path) -> InputError:
    lines = log.read_text(errors="replace").splitlines()
    wrong = next((line for line in lines if "error" in line.lower()), lines[-1] if lines else "")
    return InputError(f"the build of the guest kernel failed: {wrong.strip()}; desim loop doctor "
                      f"says what is missing, {log} has all of its output")


def _digest(file: Path) -> str:
    return hashlib.sha256(file.read_bytes()).hexdigest() if file.is_file() else ""
