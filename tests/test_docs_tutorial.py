"""The commands of docs/tutorial.md print what stands there."""

import shutil

import regolden  # a tool
from doc_pages import assert_as_shown, commands, printed, written


def test_the_first_hour(repository, tmp_path):
    page = repository / "docs" / "tutorial.md"
    shutil.copy(repository / "scenarios" / "hello.yaml", tmp_path)
    written(page, tmp_path)
    played = []
    for command, shown in commands(page):
        output = printed(command, tmp_path)
        played.append(command)
        if not regolden.elsewhere():
            assert_as_shown(shown, output)
    assert len(played) >= 11
    report = (tmp_path / "results" / "strategies" / "report" / "report.html").read_text()
    if not regolden.elsewhere():
        assert "strategy nearest minus random at robots = 3, 15.32 [9.937, 20.7]" in report
