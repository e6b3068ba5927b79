"""C++ of native functions lies in headers beside the kernels, all of it in use."""

import ast
import re
from pathlib import Path

import pytest

import dmc_cli
from dmc_cli.runtime.native_code import _DEFINE, native

PACKAGE = Path(dmc_cli.__file__).parent
HEADERS = sorted(PACKAGE.rglob("*.h"))
MOST_LINES = 6
"""Lines of C++ that may stand in Python, where a kernel's few words about it are beside them."""


def native_functions(path):
    """The native functions of a module that a header has: names in it, and of their arguments."""
    for node in ast.parse(path.read_text("utf-8")).body:
        for call in getattr(node, "decorator_list", ()):
            found = [c for c in ast.walk(call) if isinstance(c, ast.Call) and ast.unparse(c.func) == "native"]
            if found:
                yield found[0].args[1].value, [argument.arg for argument in node.args.args]


def native_calls(path):
    """The calls of `native` in a module, as their names and constants."""
    for node in ast.walk(ast.parse(path.read_text("utf-8"))):
        if isinstance(node, ast.Call) and ast.unparse(node.func) == "native":
            yield node.args[1].value, sorted(keyword.arg for keyword in node.keywords)


@pytest.fixture
def header(tmp_path):
    def write(text, name="words"):
        (tmp_path / f"{name}.h").write_text(text)
        return str(tmp_path / f"{name}.py")

    return write


@pytest.mark.parametrize("path", HEADERS, ids=lambda path: path.stem)
def test_a_header_holds_what_its_module_takes_and_nothing_else(path):
    text = re.sub(r"POINTER\(([^)]*)\)", r"\1*", _DEFINE.sub("", path.read_text("utf-8")))
    functions = set(re.findall(r"^(?! )(?:inline )?[\w:<>*, ]+ (\w+)\([^{;]*\) \{$", text, re.MULTILINE))
    shared = set(re.findall(r"^static CUDA_CALLABLE .*?(\w+)\(", text, re.MULTILINE))
    taken = {name for name, _ in native_calls(path.with_suffix(".py"))} if functions - shared else set()
    assert functions - shared == taken
    users = "".join(other.read_text("utf-8") for other in HEADERS)
    calls = re.sub(r"^static CUDA_CALLABLE .*?\w+\(", "", users, flags=re.MULTILINE)
    assert {name for name in shared if not re.search(rf"\b{name}\(", calls)} == set()
    macros = set(re.findall(r"^#define (\w+)", path.read_text("utf-8"), re.MULTILINE))
    used = _DEFINE.sub("", users)
    assert {name for name in macros if f"{name}(" not in used} == set()
    assert functions | macros


@pytest.mark.parametrize("path", HEADERS, ids=lambda path: path.stem)
def test_parameters_are_called_alike_in_both_languages(path):
    text, module = path.read_text("utf-8"), path.with_suffix(".py")
    for name, arguments in native_functions(module) if module.exists() else ():
        parameters = re.search(rf"\b{name}\(([^{{;]*)\) \{{$", text, re.MULTILINE)[1]
        while "<" in parameters:
            parameters = re.sub(r"<[^<>]*>", "", parameters)
        assert [parameter.split()[-1] for parameter in parameters.split(",")] == arguments


@pytest.mark.parametrize("path", HEADERS, ids=lambda path: path.stem)
def test_templates_get_their_constants(path):
    text, module = path.read_text("utf-8"), path.with_suffix(".py")
    for name, constants in native_calls(module) if module.exists() else ():
        found = re.search(rf"^template <([^\n]*)>\n[^\n]*\b{name}\(", text, re.MULTILINE)
        assert constants == sorted(re.findall(r"(\w+)(?:,|$)", found[1]) if found else [])


def test_cpp_in_python_is_short_and_reaches_no_array():
    """What reaches an array has to be in a header, for the pointers that can be checked."""
    found = {}
    for path in PACKAGE.rglob("*.py"):
        for node in ast.walk(ast.parse(path.read_text("utf-8"))):
            for decorator in getattr(node, "decorator_list", ()):
                if "func_native" in ast.unparse(decorator):
                    texts = [n.value for n in ast.walk(decorator) if isinstance(n, ast.Constant)]
                    text = "\n".join(text.strip() for text in texts if isinstance(text, str))
                    if len(text.splitlines()) > MOST_LINES or ".data" in text:
                        found[f"{path.name}:{node.name}"] = text
    assert found == {}


HEADER = """
#pragma once
#define TWICE(x) \\
    (2 * x)

namespace words {

static int one() {
    return 1;
}

}  // namespace words

inline int first(int a) {
    return words::one();
}

template <int N>
int second(int a,
           int b) {
    if (a) {
        b = N;
    }
    return b;
}
"""


def test_a_body_has_what_its_header_shares(header):
    module = header(HEADER)
    first = native(module, "first")
    assert first.split("\n")[1:3] == ["#define TWICE(x) \\", "    (2 * x)"]
    assert "struct words {\n\nstatic int one() {" in first
    assert first.endswith("};\n    return words::one();\n")
    second = native(module, "second", N=3)
    assert second.endswith("constexpr auto N = 3;\n    if (a) {\n        b = N;\n    }\n    return b;\n")
    assert "N = 4294967295u;" in native(module, "second", N=2**32 - 1)


@pytest.mark.parametrize("path", HEADERS, ids=lambda path: path.stem)
def test_memory_is_reached_through_pointers_that_can_be_checked(path):
    """Sums of counts come as addresses, whose arrays are not known."""
    text = _DEFINE.sub("", path.read_text("utf-8"))
    assert ".data" not in text
    if path.stem != "prefix_sums":
        assert re.findall(r"= \(\w[\w: ]*\*+\)", text) == []


def test_a_function_that_is_not_there_is_named(header):
    with pytest.raises(ValueError, match=r"words\.h has no function other"):
        native(header("inline int first(int a) {\n    return 1;\n}\n"), "other")


def test_another_header_of_the_package_is_shared():
    module = str(PACKAGE / "field" / "cell_lists.py")
    assert "struct bit_lists {" in native(module, "store_cells")
