"""The commands of docs/tutorial.md print what stands there."""

import regolden  # a tool
from doc_pages import assert_as_shown, commands, printed, written


def test_the_commands_print_what_the_page_shows(repository, tmp_path):
    page = repository / "docs" / "tutorial.md"
    written(page, tmp_path)
    played = []
    for command, shown in commands(page):
        output = printed(command, tmp_path)
        played.append(command)
        if not regolden.elsewhere():
            assert_as_shown(shown, output)
    assert len(played) >= 14
    assert all((tmp_path / name).stat().st_size > 50_000 for name in ("hello.html", "both.html"))
    report = (tmp_path / "results" / "strategies" / "report" / "report.html").read_text()
    if not regolden.elsewhere():
        assert "strategy nearest minus apart at robots = 2, 8.743 [4.308, 13.18]" in report
