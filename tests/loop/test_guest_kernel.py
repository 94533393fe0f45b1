"""The build of the guest kernel, with a small tree of sources and a make of our own."""

from __future__ import annotations

import os
import subprocess

import pytest
from typer.testing import CliRunner

from desim.cli import app
from desim.errors import InputError
from desim.loop import guest_kernel as module
from desim.loop.guest_kernel import EDITS, KERNEL, build, guest_kernel, newest_source

# Writes each call to a file; "linux" fails while there is a file ``broken``.
MAKE = """#!/bin/sh
for word; do case $word in O=*) objects=${word#O=};; esac; done
for last; do :; done
echo "$last" >> "$FAKE_LOG"
case $last in
  x86_64_defconfig) echo "CONFIG_UML=y" > $objects/.config;;
  olddefconfig) [ ! -e "$FAKE_LOG.old" ] || echo "CONFIG_UML=y" > $objects/.config;;
  linux)
    echo "  CC      init/main.o"; echo "  LD      vmlinux.o"; echo "  CC      kernel/fork.o"
    if [ -e "$FAKE_LOG.broken" ]; then
        echo "kernel/fork.c:12:3: error: expected ';'"; echo "make[1]: *** [fork.o] Error 1"; exit 2
    fi
    mkdir -p $objects/include/config
    echo 6.1.0-fake > $objects/include/config/kernel.release
    echo "a kernel" > $objects/linux
esac
"""


@pytest.fixture
def cache(tmp_path, monkeypatch):
    monkeypatch.setenv("XDG_CACHE_HOME", str(tmp_path / "cache"))
    monkeypatch.setattr(module, "SOURCES", tmp_path / "usr_src")
    return tmp_path / "cache"


@pytest.fixture
def make(tmp_path, monkeypatch):
    """The log of the calls of make."""
    folder = tmp_path / "bin"
    folder.mkdir()
    (folder / "make").write_text(MAKE)
    (folder / "make").chmod(0o755)
    monkeypatch.setenv("PATH", f"{folder}:{os.environ['PATH']}")
    monkeypatch.setenv("FAKE_LOG", str(tmp_path / "made"))
    return tmp_path / "made"


@pytest.fixture
def tree(tmp_path):
    """Sources of Linux that have just what desim changes."""
    root = tmp_path / "a tree"
    for edit in EDITS:
        file = root / edit.file
        file.parent.mkdir(parents=True, exist_ok=True)
        before = file.read_text() if file.exists() else ""
        file.write_text(before if edit.before in before else f"{before}{edit.before}\n")
    (root / "arch/um/Kconfig").write_text("config UML\n")
    return root


def progress(seen):
    return lambda *counts: seen.append(counts)


def ignored(*_):
    pass


def test_a_kernel_is_built_once_and_its_sources_go(cache, make, tree):
    seen = []
    kernel = build(tree, 2, progress(seen))
    assert kernel.read_text() == "a kernel\n" and kernel == guest_kernel()
    assert make.read_text().split() == ["x86_64_defconfig", "olddefconfig", "linux"]
    assert seen == [(0, 930), (1, 930), (2, 930)]
    assert sorted(path.name for path in kernel.parent.iterdir()) == [
        "build.log", "built.json", KERNEL]
    assert "6.1.0-fake" in (kernel.parent / "built.json").read_text()
    assert build(tree, 2, progress(seen)) == kernel
    assert len(make.read_text().split()) == 3


def test_the_user_s_tree_stays_as_it_is_and_ours_is_changed_once(cache, make, tree, tmp_path):
    before = {edit.file: (tree / edit.file).read_text() for edit in EDITS}
    (make.parent / "made.broken").touch()
    for _ in range(2):  # the second goes on with what the first has left
        with pytest.raises(InputError):
            build(tree, 1, ignored)
    assert {edit.file: (tree / edit.file).read_text() for edit in EDITS} == before
    own = module.kernel_folder() / "source"
    for edit in EDITS:
        text = (own / edit.file).read_text()
        assert text.count(edit.after) >= bool(edit.after)
        assert not edit.after or text.count(edit.after) == 1
        assert edit.before in edit.after or edit.before not in text
    assert make.read_text().split() == ["x86_64_defconfig", "olddefconfig", "linux", "linux"]
    (make.parent / "made.broken").unlink()
    assert build(tree, 1, ignored) == guest_kernel()


def test_a_build_that_fails_says_its_first_error_and_where_the_rest_is(cache, make, tree):
    (make.parent / "made.broken").touch()
    with pytest.raises(InputError) as raised:
        build(tree, 1, ignored)
    log = module.kernel_folder() / "build.log"
    assert str(raised.value) == (
        "the build of the guest kernel failed: kernel/fork.c:12:3: error: expected ';'; desim loop "
        f"doctor says what is missing, {log} has all of its output")
    assert "make[1]: *** [fork.o] Error 1" in log.read_text()


def test_the_error_is_that_of_the_last_build(cache, make, tree):
    log = module.kernel_folder() / "build.log"
    log.write_text("gcc: error: of an earlier build\n")
    (make.parent / "made.broken").touch()
    with pytest.raises(InputError, match=r"failed: kernel/fork\.c:12"):
        build(tree, 1, ignored)


@pytest.mark.parametrize("edit", [edit for edit in EDITS if edit.needed and edit.after],
                         ids=lambda edit: edit.before[:20])
def test_sources_without_the_text_that_is_changed_are_refused(cache, make, tree, edit):
    file = tree / edit.file
    file.write_text(file.read_text().replace(edit.before, "/* of another version */"))
    with pytest.raises(InputError) as raised:
        build(tree, 1, ignored)
    own = module.kernel_folder() / "source" / edit.file
    assert str(raised.value) == (f"{own}: the text that desim changes is not there; its changes "
                                 "are made for Linux 6.1")
    assert not make.exists()


def test_edits_that_newer_kernels_need_not_are_left_out(cache, make, tree):
    for edit in EDITS:
        if not edit.needed:
            (tree / edit.file).write_text("of a newer version\n")
    assert build(tree, 1, ignored) == guest_kernel()


def test_sources_that_lack_an_option_are_refused(cache, make, tree):
    (make.parent / "made.old").touch()
    with pytest.raises(InputError) as raised:
        build(tree, 1, ignored)
    assert str(raised.value) == (
        "these sources of Linux have not UML_TIME_TRAVEL_SUPPORT, TUN, NET_NS, HOSTFS, "
        "MAGIC_SYSRQ; allowed: Linux 6.1 or later")


def test_without_sources_it_says_where_they_come_from(cache):
    assert newest_source() is None
    with pytest.raises(InputError) as raised:
        build(None, 1, ignored)
    assert str(raised.value) == (
        f"no sources of Linux in {module.SOURCES}; on Debian: apt-get install linux-source; "
        "elsewhere name an archive or a folder of Linux 6.1 or later with --source")


def test_sources_that_are_none_are_refused(cache, tmp_path):
    with pytest.raises(InputError, match="nowhere: no such archive or folder$"):
        build(tmp_path / "nowhere", 1, ignored)
    empty = tmp_path / "empty"
    empty.mkdir()
    with pytest.raises(InputError, match="empty: no sources of Linux: it has no arch/um$"):
        build(empty, 1, ignored)
    text = tmp_path / "text.tar"
    text.write_text("no archive")
    with pytest.raises(InputError, match=r"text\.tar: tar: This does not look like a tar archive"):
        build(text, 1, ignored)


def test_an_archive_is_unpacked_again_if_it_is_another_one(cache, make, tree, tmp_path):
    archives = []
    for name in ("linux-source-6.1.tar.gz", "linux-source-6.12.tar.gz"):
        (tree / "which").write_text(name)
        archives.append(tmp_path / "usr_src" / name)
        archives[-1].parent.mkdir(exist_ok=True)
        subprocess.run(["tar", "-czf", archives[-1], "-C", tree.parent, tree.name], check=True)
    assert newest_source() == archives[1]
    (make.parent / "made.broken").touch()
    which = module.kernel_folder() / "source" / "which"
    for chosen, found in ((archives[0], archives[0]), (None, archives[1])):
        with pytest.raises(InputError):
            build(chosen, 1, ignored)
        assert which.read_text() == found.name
    assert make.read_text().split() == ["x86_64_defconfig", "olddefconfig", "linux"] * 2


def test_a_kernel_that_was_changed_is_not_used(cache, make, tree):
    kernel = build(tree, 1, ignored)
    kernel.write_text("another kernel\n")
    for use in (guest_kernel, lambda: build(tree, 1, ignored)):
        with pytest.raises(InputError) as raised:
            use()
        assert str(raised.value) == (f"{kernel}: not what desim loop build has made; remove "
                                     f"{kernel.parent} and build it again")


def test_without_a_kernel_the_command_says_how_to_get_one(cache, tmp_path):
    scenario = tmp_path / "s.yaml"
    scenario.write_text("{name: s, fleet: {size: 0}, deployment: field, hosts: {a: {at: [0 m, 0 m]}"
                        "}, loop: {programs: [{host: a, run: 'true'}]}, stop: {elapsed: 1 s}}")
    said = CliRunner().invoke(app, ["loop", str(scenario)])
    assert (said.exit_code, said.stderr.strip()) == (2, (
        "there is no guest kernel yet, which lets real programs run in simulated time; desim loop "
        "build makes it (about 10 minutes, once)"))


def test_the_command_says_where_the_kernel_is(cache, make, tree):
    said = CliRunner().invoke(app, ["loop", "build", "--source", str(tree), "--jobs", "1"])
    assert said.exit_code == 0, said.output
    assert said.stdout.strip() == f"guest kernel in {guest_kernel()}"
