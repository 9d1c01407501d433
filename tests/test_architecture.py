"""The architecture: imports run one way, the spec becomes objects once, and contracts are complete."""

import ast
from collections.abc import Callable, Iterable, Iterator
from functools import cache
from pathlib import Path

import inputdesign_cli

ROOT = Path(inputdesign_cli.__file__).parent

# From the lowest level to the highest. A room, a top-level module, may import from earlier lines and its own.
FOUNDATION = "arrays errors finding expressions version regular_file compute plugins"
ORDER = [
    set(FOUNDATION.split()),
    {"diagnostics", "levels"},
    {"specification", "plant"},
    {"spectrum", "information", "accuracy"},
    {"design", "signal", "identification"},
    {"explore"},
    {"outcome"},
    {"monte_carlo"},
    {"findings"},
    {"records"},
    {"questions"},
    {"sweeps", "figures", "wizard"},
    {"report"},
    {"live"},
    {"cli", "__main__"},
]
LEVEL = {room: level for level, rooms in enumerate(ORDER) for room in rooms}
MATHEMATICS = LEVEL.keys() & {"plant", "explore", *ORDER[3], *ORDER[4]}
FORBIDDEN = {(room, other) for room in MATHEMATICS for other in ("specification", "outcome")} | {
    ("specification", "plant"),
    ("monte_carlo", "specification"),
}

FILES = sorted(path for path in ROOT.rglob("*.py") if path != ROOT / "__init__.py")


@cache
def tree_of(path: Path) -> ast.Module:
    return ast.parse(path.read_text(encoding="utf-8"))


@cache
def nodes(path: Path) -> list[ast.AST]:
    return list(ast.walk(tree_of(path)))


def calls(path: Path, *functions: str) -> Iterator[ast.Call]:
    """The calls of functions by these plain names."""
    for node in nodes(path):
        if isinstance(node, ast.Call) and isinstance(node.func, ast.Name) and node.func.id in functions:
            yield node


def room_of(path: Path) -> str:
    return path.relative_to(ROOT).parts[0].removesuffix(".py")


@cache
def imports(path: Path) -> list[tuple[str, str]]:
    """The modules that a file imports, at its top or inside a function, and the names taken from them."""
    package = ["inputdesign_cli", *path.relative_to(ROOT).parts[:-1]]
    found = []
    for node in nodes(path):
        if isinstance(node, ast.Import):
            found += [(alias.name, "") for alias in node.names]
        elif isinstance(node, ast.ImportFrom):
            base = package[: len(package) + 1 - node.level] if node.level else []
            module = ".".join([*base, *([node.module] if node.module else [])])
            found += [(module, alias.name) for alias in node.names]
    return found


def imported_modules(path: Path) -> set[str]:
    """Every module that a file may import: `from package import name` may mean a module of that name."""
    return {name for module, taken in imports(path) for name in (module, f"{module}.{taken}".rstrip("."))}


def imported_rooms(path: Path) -> set[str]:
    parts = (module.split(".") for module in imported_modules(path))
    rooms = {p[1] for p in parts if p[0] == "inputdesign_cli" and len(p) > 1}
    return {room for room in rooms if (ROOT / room).is_dir() or (ROOT / f"{room}.py").is_file()}


def offenders(breaks: Callable[[Path], object]) -> dict[str, object]:
    """Files that break a law, and how."""
    found = {path.relative_to(ROOT).as_posix(): breaks(path) for path in FILES}
    return {name: how for name, how in found.items() if how}


def test_every_room_has_a_place_in_the_order():
    assert {room_of(path) for path in FILES} <= LEVEL.keys()


def test_a_file_imports_only_from_below():
    def above_or_forbidden(path: Path) -> set[str]:
        room = room_of(path)
        others = imported_rooms(path) - {room}
        return {other for other in others if LEVEL[other] > LEVEL[room] or (room, other) in FORBIDDEN}

    assert offenders(above_or_forbidden) == {}


def test_no_two_rooms_import_each_other():
    known = {}
    for path in FILES:
        known.setdefault(room_of(path), set()).update(imported_rooms(path) - {room_of(path)})
    both_ways = {(a, b) for a in known for b in known[a] if a < b and a in known.get(b, ())}
    assert both_ways == set()


def module_of(path: Path) -> str:
    parts = path.relative_to(ROOT.parent).with_suffix("").parts
    return ".".join(parts[:-1] if parts[-1] == "__init__" else parts)


@cache
def import_graph() -> dict[str, set[str]]:
    """Every module of the package -> those it imports, inside functions and for types alone included."""
    paths = {module_of(path): path for path in ROOT.rglob("*.py")}
    graph = {}
    for module, path in paths.items():
        # The name itself where it is a module, and otherwise the module that it is taken from.
        needed = {f"{m}.{name}" if f"{m}.{name}" in paths else m for m, name in imports(path)}
        graph[module] = (needed & paths.keys()) - {module}
    return graph


def circles(graph: dict[str, set[str]]) -> list[set[str]]:
    """The groups of modules that reach each other."""
    reached = {}
    for start in graph:
        seen, stack = set(), [start]
        while stack:
            new = graph[stack.pop()] - seen
            seen |= new
            stack += new
        reached[start] = seen
    groups = {
        frozenset(other for other in graph if other in reached[m] and m in reached[other]) for m in graph
    }
    return [set(group) for group in groups if group]


def test_circles_are_found():
    assert circles({"a": {"b"}, "b": {"c"}, "c": {"a"}, "d": {"a"}}) == [{"a", "b", "c"}]
    assert circles({"a": {"b", "c"}, "b": {"c"}, "c": set()}) == []


def test_no_two_files_need_each_other():
    assert circles(import_graph()) == []


def test_folders_import_one_way():
    def folder(module: str) -> str:
        parts = module.split(".")
        inside = (ROOT.parent / Path(*parts)).is_dir()
        return "/".join(parts[1:3] if inside else parts[1:-1][:2])

    pairs = {(folder(a), folder(b)) for a, others in import_graph().items() for b in others}
    assert {(a, b) for a, b in pairs if "" < a < b and (b, a) in pairs} == set()


# Code that may know the spec: it reads or writes the spec, turns it into objects, or calls code that does.
# The page of a report restates it in words.
SPEC_ROOMS = {"specification", "sweeps", "wizard", "cli"}
SPEC_FILES = {"questions/__init__.py", "report/question.py"}


def knows_the_spec(path: Path) -> bool:
    inside = path.relative_to(ROOT).as_posix()
    return room_of(path) in SPEC_ROOMS or inside in SPEC_FILES or builds(path)


def builds(path: Path) -> bool:
    """Return whether a file makes objects of a spec: `building/`, and `build*.py` of a question."""
    inside = path.relative_to(ROOT).as_posix()
    of_question = inside.startswith("questions/") and path.name.startswith("build")
    return of_question or inside.startswith("questions/building/")


def named_in(annotation: ast.expr | None) -> set[str]:
    """Every name in an annotation, also in one that is written as a string."""
    if annotation is None:
        return set()
    found = set()
    for node in ast.walk(annotation):
        if isinstance(node, ast.Name | ast.Attribute):
            found.add(node.id if isinstance(node, ast.Name) else node.attr)
        elif isinstance(node, ast.Constant) and isinstance(node.value, str):
            found |= named_in(ast.parse(node.value, mode="eval").body)
    return found


def uses_of_the_spec(nodes: Iterable[ast.AST]) -> list[str]:
    """Functions with a parameter that is a `Spec`, fields that are one, imports of it and of its module."""
    found = []
    for node in nodes:
        if isinstance(node, ast.FunctionDef | ast.AsyncFunctionDef):
            given = node.args
            every = [*given.posonlyargs, *given.args, *given.kwonlyargs, given.vararg, given.kwarg]
            if any(one is not None and "Spec" in named_in(one.annotation) for one in every):
                found.append(node.name)
        elif isinstance(node, ast.AnnAssign) and "Spec" in named_in(node.annotation):
            found.append(ast.unparse(node.target))
        elif isinstance(node, ast.ImportFrom) and any(alias.name == "Spec" for alias in node.names):
            found.append("import")
    return found


def test_uses_of_the_spec_are_found():
    for source, found in (
        ("def f(x: int, *, s: 'Spec | None' = None): ...", ["f"]),
        ("class A:\n    spec: models.Spec", ["spec"]),
        ("from specification import Spec", ["import"]),
        ("def f(specific: Specific) -> Spec: ...", []),
    ):
        assert uses_of_the_spec(ast.walk(ast.parse(source))) == found


def test_the_spec_becomes_objects_once():
    """After the builders no function takes a spec: it takes the objects that they made."""
    assert offenders(lambda path: not knows_the_spec(path) and uses_of_the_spec(nodes(path))) == {}


# Signs of incomplete contracts, counted over the package. The numbers may fall, never rise.
MOST_QUESTIONS = 41
MOST_IGNORED = 1


@cache
def own_kinds() -> set[str]:
    """The names of all classes of the package."""
    return {node.name for path in FILES for node in nodes(path) if isinstance(node, ast.ClassDef)}


def test_the_number_of_type_checks_of_own_classes_does_not_rise():
    """Calls of `isinstance` and `issubclass` with classes of the package are counted."""
    found = [
        f"{path.relative_to(ROOT)}: {ast.unparse(call)}"
        for path in FILES
        for call in calls(path, "isinstance", "issubclass")
        if named_in(call.args[1]) & own_kinds()
    ]
    assert len(found) <= MOST_QUESTIONS, "\n".join(found)


def test_only_builders_match_classes_of_the_package():
    """`case Kind():` belongs where a section of the spec becomes an object, and nowhere after."""

    def matched(path: Path) -> list[str]:
        patterns = (n for n in nodes(path) if isinstance(n, ast.MatchClass))
        return [ast.unparse(pattern) for pattern in patterns if named_in(pattern.cls) & own_kinds()]

    assert [name for name in offenders(matched) if not builds(ROOT / name)] == []


def test_no_attribute_is_accessed_by_a_computed_name():
    """Exceptions are the command line, the models of the spec, and the package itself (lazy imports)."""

    def computed(path: Path) -> list[str]:
        by_name = calls(path, "getattr", "setattr", "hasattr")
        return [ast.unparse(call) for call in by_name if not isinstance(call.args[1], ast.Constant)]

    assert [
        name for name in offenders(computed) if not name.startswith(("cli/", "specification/models/"))
    ] == []


def test_the_number_of_ignored_types_does_not_rise():
    found = [
        f"{path.relative_to(ROOT)}:{number}"
        for path in FILES
        for number, line in enumerate(path.read_text(encoding="utf-8").splitlines(), start=1)
        if "type: ignore" in line
    ]
    assert len(found) <= MOST_IGNORED, "\n".join(found)


def test_results_are_plain_data():
    assert imported_rooms(ROOT / "outcome" / "curves.py") == set()
    taken = {module for module, _ in imports(ROOT / "outcome" / "results.py")}
    own = {module.split(".")[1] for module in taken if module.startswith("inputdesign_cli.")}
    assert own == {"outcome", "finding"}


def test_only_one_file_calls_the_solver():
    found = offenders(lambda path: any(m.split(".")[0] == "clarabel" for m in imported_modules(path)))
    assert found.keys() == {"design/conic.py"}


def test_only_the_command_line_prints():
    found = offenders(lambda path: list(calls(path, "print")))
    assert [name for name in found if not name.startswith("cli/")] == []


def test_nobody_uses_pyplot():
    assert offenders(lambda path: any("pyplot" in module for module in imported_modules(path))) == {}
