"""The command of `benchmarks.prose`."""

from benchmarks import prose

if __name__ == "__main__":
    for name in prose.PAGES:
        print(f"{name}\n  " + "\n  ".join(prose.rest(name)))
