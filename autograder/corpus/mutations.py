"""Mutations: small changes to a right solution, such as a student makes by mistake.

Each operator is a mistake of the field: a policy the other way round, a depth, a call that cleans
up left out, a reply that is not returned, a sleep in a callback, a callback group dropped, a bound
moved. A mutation that an exam does not notice is a check that is missing, or changes nothing.

Example:
    >>> [str(m) for m in find_mutations("self.rate = 5\\nself.timer.cancel()\\n")]
    ['line 1, number: `self.rate = 5` becomes `self.rate = 6`', 'line 2, call left out: \
`self.timer.cancel()` becomes `pass`']
"""

from __future__ import annotations

import ast
from collections.abc import Iterator, Mapping
from dataclasses import dataclass

_OTHER_NAME = {
    "RELIABLE": "BEST_EFFORT", "BEST_EFFORT": "RELIABLE", "VOLATILE": "TRANSIENT_LOCAL",
    "TRANSIENT_LOCAL": "VOLATILE", "KEEP_ALL": "KEEP_LAST", "KEEP_LAST": "KEEP_ALL",
    "ReentrantCallbackGroup": "MutuallyExclusiveCallbackGroup",
    "MutuallyExclusiveCallbackGroup": "ReentrantCallbackGroup",
    "succeed": "abort", "abort": "succeed", "canceled": "succeed", "ACCEPT": "REJECT",
    "REJECT": "ACCEPT",
}  # fmt: skip
_OTHER_COMPARISON = {
    ast.Lt: "<=", ast.LtE: "<", ast.Gt: ">=", ast.GtE: ">", ast.Eq: "!=", ast.NotEq: "==",
    ast.Is: "is not", ast.IsNot: "is", ast.In: "not in", ast.NotIn: "in",
}  # fmt: skip
_SHALLOW, _DEEP = 1, 100
"""Depths of a queue that hold one message, and more than any is worth keeping of."""
_OF_ENDPOINTS: dict[str, dict[int, tuple[int, ...]]] = {
    "create_publisher": {2: ()},
    "create_lifecycle_publisher": {2: ()},
    "create_subscription": {3: (_SHALLOW,)},
}
"""Where the depth stands among the arguments, and what it may wrongly be."""
_SLEEP_S = 2.0
"""Seconds that a callback sleeps: longer than a node may be held up in any task."""


@dataclass(frozen=True)
class Mutation:
    """One change of one place.

    Attributes:
        operator: the kind of mistake.
        line: where it is, from 1 on.
        scope: the function in which it is, or what is assigned outside of any, or an empty text.
        before: the line as it was, and ``after``: as it is now, both without indentation.
        text: all of the solution with the mistake.
    """

    operator: str
    line: int
    scope: str
    before: str
    after: str
    text: str

    @property
    def key(self) -> str:
        """What names it where a corpus says that it changes nothing: no number of a line."""
        where = f" in {self.scope}" if self.scope else ""
        return f"{self.operator}{where}: {self.before} -> {self.after}"

    def __str__(self) -> str:
        """Return it as a phrase."""
        return f"line {self.line}, {self.operator}: `{self.before}` becomes `{self.after}`"


_Edit = tuple[str, ast.AST, str]
"""The operator, what is replaced, and by what."""


def find_mutations(text: str) -> list[Mutation]:
    """Return all mutations of a solution, in the order of its lines, each of which compiles.

    Raises:
        SyntaxError: the solution does not compile.
    """
    tree = ast.parse(text)
    unused = {node for body in _bodies(tree) for node in _overwritten(body)}
    scopes = _scopes(tree)
    found: dict[str, Mutation] = {}
    for operator in (_names, _depths, _numbers, _booleans, _comparisons, _conditions, _calls,
                     _returns, _groups, _sleeps):  # fmt: skip
        for edit in operator(tree):
            mutation = None if edit[1] in unused else _apply(text, scopes, *edit)
            if mutation is not None:
                found.setdefault(mutation.text, mutation)
    return sorted(found.values(), key=lambda mutation: (mutation.line, mutation.operator))


def _apply(
    text: str, scopes: Mapping[ast.AST, str], operator: str, node: ast.AST, new: str
) -> Mutation | None:
    assert isinstance(node, ast.expr | ast.stmt | ast.keyword)
    lines = text.splitlines(keepends=True)
    begin = _offset(lines, node.lineno, node.col_offset)
    end = _offset(lines, node.end_lineno or node.lineno, node.end_col_offset or 0)
    mutated = text[:begin] + new + text[end:]
    try:
        ast.parse(mutated)
    except SyntaxError:
        return None
    if mutated == text:
        return None
    after = mutated[text.rfind("\n", 0, begin) + 1 :].split("\n", 1)[0].strip()
    if "\n" in new:  # a line of its own before the one that was there
        after += f"; {lines[node.lineno - 1].strip()}"
    before, scope = lines[node.lineno - 1].strip(), scopes.get(node, "")
    return Mutation(operator, node.lineno, scope, before, after, mutated)


def _offset(lines: list[str], line: int, column: int) -> int:
    """Return the place in the text of a column that Python counts in bytes of UTF-8."""
    before = sum(map(len, lines[: line - 1]))
    return before + len(lines[line - 1].encode()[:column].decode())


def _scopes(tree: ast.Module) -> dict[ast.AST, str]:
    named: list[tuple[str, ast.AST]] = [
        (name, statement) for statement in tree.body if (name := _defined_name(statement))
    ]
    named += [(function.name, function) for function in _functions(tree)]
    return {inner: name for name, whole in named for inner in ast.walk(whole)}  # inmost last


def _bodies(tree: ast.Module) -> Iterator[list[ast.stmt]]:
    yield tree.body
    yield from (function.body for function in _functions(tree))


def _overwritten(body: list[ast.stmt]) -> set[ast.AST]:
    """Return all that stands in definitions which another one in the same row replaces unused."""
    unused: set[ast.AST] = set()
    pending: dict[str, ast.stmt] = {}
    for statement in body:
        for node in ast.walk(statement):
            if isinstance(node, ast.Name) and isinstance(node.ctx, ast.Load):
                pending.pop(node.id, None)
        if name := _defined_name(statement):
            unused.update(ast.walk(pending[name]) if name in pending else ())
            pending[name] = statement
    return unused


def _defined_name(statement: ast.stmt) -> str | None:
    if isinstance(statement, ast.ClassDef | ast.FunctionDef | ast.AsyncFunctionDef):
        return statement.name
    if isinstance(statement, ast.Assign) and isinstance(statement.targets[0], ast.Name):
        return statement.targets[0].id
    return None


def _names(tree: ast.AST) -> Iterator[_Edit]:
    for node in ast.walk(tree):
        if isinstance(node, ast.Attribute) and node.attr in _OTHER_NAME:
            whole = ast.unparse(node).removesuffix(node.attr)
            yield "other policy or end", node, whole + _OTHER_NAME[node.attr]
        elif isinstance(node, ast.Name) and node.id in _OTHER_NAME:
            yield "other callback group", node, _OTHER_NAME[node.id]


def _depths(tree: ast.AST) -> Iterator[_Edit]:
    for number, depths in _find_depths(tree).items():
        for depth in depths:
            yield "depth of a queue", number, str(depth)


def _find_depths(tree: ast.AST) -> dict[ast.Constant, tuple[int, ...]]:
    """Return what a depth of a queue may wrongly be: that of a profile, or of an endpoint.

    An endpoint that just says 10 means no more than that its queue is not short.
    """
    found: dict[ast.Constant, tuple[int, ...]] = {}
    for node in ast.walk(tree):
        if not isinstance(node, ast.Call):
            continue
        for word in node.keywords:
            if word.arg == "depth" and isinstance(word.value, ast.Constant):
                found[word.value] = (_SHALLOW, _DEEP)
        called = ast.unparse(node.func).rpartition(".")[2]
        for place, depths in _OF_ENDPOINTS.get(called, {}).items():
            for value in node.args[place : place + 1]:
                if isinstance(value, ast.Constant):
                    found[value] = depths
    return found


def _numbers(tree: ast.AST) -> Iterator[_Edit]:
    depths = _find_depths(tree)
    for node in ast.walk(tree):
        if node in depths:
            continue
        if isinstance(node, ast.Constant) and type(node.value) is int:
            yield "number", node, str(node.value + 1)
        elif isinstance(node, ast.Constant) and type(node.value) is float:
            yield "number", node, repr(node.value * 2 if node.value else 1.0)


def _booleans(tree: ast.AST) -> Iterator[_Edit]:
    for node in ast.walk(tree):
        if isinstance(node, ast.Constant) and type(node.value) is bool:
            yield "true or false", node, str(not node.value)


def _comparisons(tree: ast.AST) -> Iterator[_Edit]:
    for node in ast.walk(tree):
        if isinstance(node, ast.Compare):
            for index, op in enumerate(node.ops):
                yield "bound", node, _comparison(node, index, _OTHER_COMPARISON[type(op)])


def _comparison(node: ast.Compare, changed: int, new: str) -> str:
    words = [ast.unparse(node.left)]
    for index, (op, right) in enumerate(zip(node.ops, node.comparators, strict=True)):
        sign = ast.unparse(ast.Compare(ast.Name("a"), [op], [ast.Name("b")]))[2:-2]
        words += [new if index == changed else sign, ast.unparse(right)]
    return " ".join(words)


def _conditions(tree: ast.AST) -> Iterator[_Edit]:
    for node in ast.walk(tree):
        if isinstance(node, ast.If | ast.IfExp | ast.While):
            test = ast.unparse(node.test)
            if not isinstance(node.test, ast.Compare) and test != "True":
                yield "condition", node.test, f"not ({test})"


def _calls(tree: ast.AST) -> Iterator[_Edit]:
    for node in ast.walk(tree):
        call = node.value if isinstance(node, ast.Expr) else None
        call = call.value if isinstance(call, ast.Await) else call
        if not (isinstance(node, ast.Expr) and isinstance(call, ast.Call)):
            continue
        if ast.unparse(call.func) != "super().__init__":
            yield "call left out", node, "pass"


def _returns(tree: ast.AST) -> Iterator[_Edit]:
    for node in ast.walk(tree):
        if isinstance(node, ast.Return) and isinstance(node.value, ast.Name):
            yield "reply not returned", node, "return None"


def _groups(tree: ast.AST) -> Iterator[_Edit]:
    for node in ast.walk(tree):
        if isinstance(node, ast.keyword) and node.arg == "callback_group":
            yield "callback group dropped", node, "callback_group=None"


def _sleeps(tree: ast.AST) -> Iterator[_Edit]:
    sleep = f"__import__('time').sleep({_SLEEP_S:g})"
    for node in _functions(tree):
        if node.name.startswith("__"):
            continue
        first = node.body[0]
        indent = " " * first.col_offset
        whole = "\n".join(
            line if number == 0 else indent + line
            for number, line in enumerate(ast.unparse(first).splitlines())
        )
        yield "sleep in a callback", first, f"{sleep}\n{indent}{whole}"


def _functions(tree: ast.AST) -> Iterator[ast.FunctionDef | ast.AsyncFunctionDef]:
    for node in ast.walk(tree):
        if isinstance(node, ast.FunctionDef | ast.AsyncFunctionDef):
            yield node
