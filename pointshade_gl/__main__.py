"""`pointshade`, and `python -m pointshade_gl`: Ctrl+C ends it quietly, also while it is being imported."""

import sys


def main() -> None:
    """Run the command line. Exit codes: see docs/stability.md."""
    try:
        from .cli.main import main as command_line

        command_line()
    except KeyboardInterrupt:
        sys.exit(130)


if __name__ == "__main__":
    main()
