"""Faults in Python: host code and Warp's kernels alike, found in the syntax tree and put into the text."""

import ast
from itertools import pairwise

from tests.mutants.header_faults import header_faults_of
from tests.mutants.mutant import CONSTANTS, Mutant
from tests.mutants.native_faults import native_faults
from tests.mutants.source import Source

COMPARISONS = {
    ast.Lt: ("<", ["<=", ">="]),
    ast.LtE: ("<=", ["<", ">"]),
    ast.Gt: (">", [">=", "<="]),
    ast.GtE: (">=", [">", "<"]),
    ast.Eq: ("==", ["!="]),
    ast.NotEq: ("!=", ["=="]),
    ast.Is: ("is", ["is not"]),
    ast.IsNot: ("is not", ["is"]),
    ast.In: ("in", ["not in"]),
    ast.NotIn: ("not in", ["in"]),
}
ARITHMETIC = {
    ast.Add: ("+", ["-"]),
    ast.Sub: ("-", ["+"]),
    ast.Mult: ("*", ["/"]),
    ast.Div: ("/", ["*"]),
    ast.FloorDiv: ("//", ["*"]),
    ast.Mod: ("%", ["*"]),
    ast.Pow: ("**", ["*"]),
    ast.LShift: ("<<", [">>"]),
    ast.RShift: (">>", ["<<"]),
    ast.BitAnd: ("&", ["|"]),
    ast.BitOr: ("|", ["&"]),
    ast.BitXor: ("^", ["&"]),
}
LOGIC = {ast.And: ("and", "or"), ast.Or: ("or", "and")}
SWAPPED = {"min": "max", "max": "min", "minimum": "maximum", "maximum": "minimum", "any": "all", "all": "any"}
GRAIN, AHEAD = "_A_CHUNK", "prefetch_"
"""How the names end of what says how large a share of a launch is, and how those start of functions that ask
for memory ahead: a fault there shows in nothing but time."""
ORDERLESS = {"isinstance", "min", "max", "dot"}
"""Calls whose arguments are not exchanged: to no effect, or to none but an error at once."""
LEAVES = (ast.Raise, ast.Return, ast.Continue, ast.Break)


def faults_of(file, text):
    """Return all faults that we know to put into a file of the package, a module or a header."""
    if file.endswith(".h"):
        return header_faults_of(file, text)
    finder = Finder(file, text)
    finder.visit(ast.parse(text))
    return finder.found


class Finder(ast.NodeVisitor):
    """Goes through a module, leaving out what is no code: docstrings, annotations, messages, decorators."""

    def __init__(self, file, text):
        self.source = Source(file, text)
        self.found = []
        self.known = set()
        self.types = {}

    def put(self, kind, start, end, new):
        old = self.source.text[start:end]
        line = self.source.line_at(start)
        if old != new:
            symbol = self.source.symbol_at(line)
            self.found.append(Mutant(self.source.file, start, end, new, kind, line, old, symbol))

    def replace(self, kind, node, new):
        self.put(kind, *self.source.span(node), new)

    def between(self, kind, left, right, old, new):
        """Replace the operator between two nodes, or nothing where it does not stand there plainly."""
        start, end = self.source.span(left)[1], self.source.span(right)[0]
        place = self.source.text.find(old, start, end)
        if place >= 0:
            self.put(kind, place, place + len(old), new)

    def visit_FunctionDef(self, node):
        for decorator in node.decorator_list:
            if "func_native" in ast.unparse(decorator):
                self.native(decorator)
        for default in [*node.args.defaults, *node.args.kw_defaults]:
            if default is not None:
                self.visit(default)
        before, self.known = self.known, {a.arg for a in [*node.args.args, *node.args.kwonlyargs]}
        self.types = {a.arg: ast.unparse(a.annotation) for a in node.args.args if a.annotation}
        self.body(node.body)
        self.known = before

    def visit_ClassDef(self, node):
        self.body(node.body)

    def visit_Module(self, node):
        self.body(node.body)

    def body(self, statements):
        for statement in statements:
            if not (isinstance(statement, ast.Expr) and isinstance(statement.value, ast.Constant)):
                self.visit(statement)

    def visit_Expr(self, node):
        called = ast.unparse(node.value.func) if isinstance(node.value, ast.Call) else ""
        if called.startswith(AHEAD) or called.endswith("set_module_options"):
            return
        if isinstance(node.value, ast.Call):
            self.replace("statement", node, "pass")
        self.generic_visit(node)

    def visit_Assign(self, node):
        names = {t.id for t in node.targets if isinstance(t, ast.Name)}
        if "__all__" in names or any(name.endswith(GRAIN) for name in names):
            return
        stored = any(isinstance(t, ast.Attribute | ast.Subscript) for t in node.targets)
        if stored or (names and names <= self.known):
            self.replace("statement", node, "pass")
        self.known |= names
        self.visit(node.value)

    def visit_AnnAssign(self, node):
        if node.value is not None:
            self.visit(node.value)

    def visit_AugAssign(self, node):
        self.replace("statement", node, "pass")
        if type(node.op) in ARITHMETIC:
            old, news = ARITHMETIC[type(node.op)]
            for new in news:
                self.between("arithmetic", node.target, node.value, f"{old}=", f"{new}=")
        self.visit(node.value)

    def visit_Raise(self, node):
        self.replace("refusal", node, "pass")

    def visit_Assert(self, node):
        pass

    def visit_Continue(self, node):
        self.replace("statement", node, "pass")

    def visit_Break(self, node):
        self.replace("statement", node, "pass")

    def visit_If(self, node):
        if "TYPE_CHECKING" in ast.unparse(node.test):
            return
        if not node.orelse and isinstance(node.body[-1], LEAVES):
            self.replace("refusal", node, "pass")
        self.condition(node.test)
        self.generic_visit(node)

    def visit_IfExp(self, node):
        self.condition(node.test)
        self.generic_visit(node)

    def visit_While(self, node):
        self.condition(node.test, constants=("False",))
        self.generic_visit(node)

    def condition(self, test, constants=("True", "False")):
        for constant in constants:
            self.replace("condition", test, constant)
        self.replace("condition", test, f"not ({self.source.of(test)})")

    def visit_Compare(self, node):
        sides = [node.left, *node.comparators]
        for n, operator in enumerate(node.ops):
            old, news = COMPARISONS[type(operator)]
            for new in news:
                self.between("comparison", sides[n], sides[n + 1], old, new)
        self.generic_visit(node)

    def visit_BoolOp(self, node):
        old, new = LOGIC[type(node.op)]
        for left, right in pairwise(node.values):
            self.between("logic", left, right, old, new)
        for dropped in node.values:
            kept = [f"({self.source.of(v)})" for v in node.values if v is not dropped]
            self.replace("logic", node, kept[0] if len(kept) == 1 else f"({f' {old} '.join(kept)})")
        self.generic_visit(node)

    def visit_BinOp(self, node):
        if any(isinstance(n, ast.Name) and n.id.endswith(GRAIN) for n in ast.walk(node)):
            return
        if type(node.op) in ARITHMETIC and not any(_is_text(side) for side in (node.left, node.right)):
            old, news = ARITHMETIC[type(node.op)]
            for new in news:
                self.between("arithmetic", node.left, node.right, old, new)
        self.generic_visit(node)

    def visit_UnaryOp(self, node):
        if isinstance(node.op, ast.Not | ast.USub) and not isinstance(node.operand, ast.Constant):
            self.replace("sign", node, f"({self.source.of(node.operand)})")
        elif isinstance(node.op, ast.USub):
            self.replace(CONSTANTS, node, self.source.of(node.operand))
        self.generic_visit(node)

    def visit_Constant(self, node):
        for new in other_constants(node.value):
            self.replace(CONSTANTS, node, new)

    def visit_Call(self, node):
        name = node.func.attr if isinstance(node.func, ast.Attribute) else getattr(node.func, "id", "")
        if name in SWAPPED:
            end = self.source.span(node.func)[1]
            self.put("call", end - len(name), end, SWAPPED[name])
        arguments = node.args
        for one, two in pairwise(arguments):
            if name not in ORDERLESS and self.is_alike(one, two):
                self.swap(one, two)
        self.generic_visit(node)

    def visit_keyword(self, node):
        if node.arg != "strict":  # of zip: what it would refuse is a fault already
            self.generic_visit(node)

    def is_alike(self, one, two):
        """Return whether two arguments may be of one type, as far as the annotations of parameters tell."""
        if type(one) is not type(two) or not isinstance(one, ast.Name | ast.Attribute):
            return False
        types = [self.types.get(getattr(a, "id", "")) for a in (one, two)]
        return None in types or types[0] == types[1]

    def swap(self, one, two):
        (start, middle), (rest, end) = self.source.span(one), self.source.span(two)
        comma = self.source.text[middle:rest]
        self.put("call", start, end, self.source.of(two) + comma + self.source.of(one))

    def visit_JoinedStr(self, node):
        if ";\n" in self.source.of(node):
            self.native(node)

    def generic_visit(self, node):
        for child in ast.iter_child_nodes(node):
            if isinstance(child, ast.Constant) and isinstance(child.value, str):
                if ";\n" in self.source.of(child):
                    self.native(child)
            else:
                self.visit(child)

    def native(self, node):
        start, end = self.source.span(node)
        for place, length, new, kind in native_faults(self.source.text[start:end]):
            self.put(f"C++ {kind}", start + place, start + place + length, new)


def other_constants(value):
    """Return what may stand for a number or a truth value."""
    if isinstance(value, bool):
        return [str(not value)]
    if isinstance(value, int):
        return [
            str(value + 1),
            *([str(value - 1)] if value > 1 else []),
            *([str(value // 2)] if value > 7 else []),
        ]
    if isinstance(value, float):
        return [repr(value * 0.5), repr(value + 1.0)] if value else ["1.0"]
    return []


def _is_text(node):
    return isinstance(node, ast.JoinedStr) or (isinstance(node, ast.Constant) and isinstance(node.value, str))
