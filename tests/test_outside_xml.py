"""XML of strangers."""

import pytest

from desim import outside_xml
from desim.errors import InputError


def read(folder, text, **limits):
    file = folder / "a.xml"
    file.write_text(text)
    return outside_xml.read(file, **limits)


def test_elements_know_their_line_and_text(tmp_path):
    root = read(tmp_path, "<?xml version='1.0'?>\n<!DOCTYPE svg PUBLIC '-//W3C//DTD SVG 1.1//EN'\n"
                          "'http://nowhere.invalid/svg11.dtd'>\n<s:svg><g id='1'>a<b/>c</g>\n"
                          "<g/><h/></s:svg>")
    assert (root.tag, [child.line for child in root.all("g")]) == ("svg", [4, 5])
    first = root.first("g")
    assert (first.attributes, first.text, first.children[0].tag) == ({"id": "1"}, "ac", "b")
    assert root.first("k") is None and [c.tag for c in root.all("g", "h")] == ["g", "g", "h"]


@pytest.mark.parametrize("text, complaint", [
    ("<a>\n<b></a>", r"a.xml:2: cannot be read as XML: mismatched tag"),
    ("", "a.xml:1: cannot be read as XML: no element found"),
    ("<a>" * 101, "a.xml:1: nested too deeply; at most 100 elements"),
    ("<a>" + "<b/>" * 500_000 + "</a>", "a.xml:1: too many elements; at most 500000"),
    ("<!DOCTYPE a [\n<!ENTITY x 'xxxx'>\n<!ENTITY y '&x;&x;'>]>\n<a>&y;</a>",
     "a.xml:2: declares the entity 'x'; entities of a file's own are not allowed"),
    ("<!DOCTYPE a [<!ENTITY x SYSTEM '/etc/passwd'>]><a>&x;</a>", "a.xml:1: declares the entity"),
    ("<!DOCTYPE a [<!ENTITY % x SYSTEM '/etc/passwd'> %x;]><a/>", "a.xml:1: declares the entity"),
    ("<a>&x;</a>", "a.xml:1: cannot be read as XML: undefined entity"),
])
def test_what_is_refused(tmp_path, text, complaint):
    with pytest.raises(InputError, match=complaint):
        read(tmp_path, text)


def test_nothing_is_fetched_for_a_document_type(tmp_path):
    (tmp_path / "a.dtd").write_text("<!ENTITY x 'secret'>")
    root = read(tmp_path, "<!DOCTYPE a SYSTEM 'a.dtd'>\n<a>&x;</a>")
    assert root.text == ""


def test_a_file_that_is_too_large(tmp_path):
    with pytest.raises(OSError, match="at most 0 MB"):
        read(tmp_path, "<a/>", most_bytes=3)
