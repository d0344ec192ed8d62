"""`pointshade bench`: measures speed, accuracy and robustness."""

from __future__ import annotations

from ...notes.words import option
from ..options import BenchOptions, Device, Quiet, spread


@spread
def bench(options: BenchOptions, device: Device = 0, quiet: Quiet = False) -> None:
    """Measure the speed, accuracy and robustness of every estimator: charts and results.json."""
    from ...bench import command

    quick, output = options.quick, options.output
    if options.against is not None and not options.speed:
        raise ValueError(f"{option('against')} compares speeds: add {option('speed', True)}")
    if options.against is not None:
        said = command.bench_against(options.against, quick, device)
    elif options.speed:
        said = command.bench_speed(output, quick, device)
    elif options.views:
        said = command.bench_views(output, quick, options.seed, device)
    else:
        said = command.bench(output, quick, options.only or [], options.images, options.seed, device)
    print(said)
