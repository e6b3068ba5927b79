"""The text of a module: where its nodes stand, and which of its symbols holds a line."""

import ast
import bisect


class Source:
    """A module's text with the places of its lines."""

    def __init__(self, file, text):
        self.file, self.text = file, text
        self.lines = text.splitlines(keepends=True)
        self.starts = [0]
        for line in self.lines:
            self.starts.append(self.starts[-1] + len(line))
        self.symbols = list(symbols_of(ast.parse(text)))

    def span(self, node):
        """Return where a node starts and ends; the tree counts bytes of a line, the text characters."""
        return (
            self._place(node.lineno, node.col_offset),
            self._place(node.end_lineno, node.end_col_offset),
        )

    def _place(self, line, column):
        before = self.lines[line - 1].encode()[:column].decode() if line <= len(self.lines) else ""
        return self.starts[line - 1] + len(before)

    def of(self, node):
        """Return the text of a node."""
        start, end = self.span(node)
        return self.text[start:end]

    def line_at(self, place):
        """Return the line, from 1, of a place."""
        return bisect.bisect_right(self.starts, place)

    def symbol_at(self, line):
        """Return the name of what holds a line: `function`, `Class.method`, `CONSTANT`, or nothing."""
        held = [name for name, node in self.symbols if first_line(node) <= line <= node.end_lineno]
        return held[-1] if held else ""

    def body_at(self, line):
        """Return the function whose body holds a line, or nothing."""
        functions = [(name, node) for name, node in self.symbols if isinstance(node, ast.FunctionDef)]
        held = [name for name, node in functions if first_body_line(node) <= line <= node.end_lineno]
        return held[-1] if held else ""


def first_body_line(node):
    """Return the first line of a function that runs when it is called, not when it is defined."""
    has_text = isinstance(node.body[0], ast.Expr) and isinstance(node.body[0].value, ast.Constant)
    return node.body[1 if has_text and len(node.body) > 1 else 0].lineno


def symbols_of(tree):
    """Yield names and nodes of what a module defines; a class comes before its methods."""
    for node in tree.body:
        if isinstance(node, ast.FunctionDef | ast.AsyncFunctionDef):
            yield node.name, node
        elif isinstance(node, ast.ClassDef):
            yield node.name, node
            for inner in node.body:
                if isinstance(inner, ast.FunctionDef):
                    yield f"{node.name}.{inner.name}", inner
        elif isinstance(node, ast.Assign | ast.AnnAssign):
            targets = node.targets if isinstance(node, ast.Assign) else [node.target]
            for target in targets:
                for name in ast.walk(target):
                    if isinstance(name, ast.Name):
                        yield name.id, node


def first_line(node):
    """Return the line of a definition's first decorator, or its own."""
    return min([node.lineno, *(d.lineno for d in getattr(node, "decorator_list", []))])
