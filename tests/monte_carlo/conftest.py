from conftest_study import spec, stub

__all__ = ["spec", "stub"]
