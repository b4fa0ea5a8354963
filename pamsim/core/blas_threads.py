"""Keep BLAS to one thread while simulations or fits use the processors.

Its threads wait for work by spinning. Beside simulations that takes a third of the processors'
time, and fits of many small matrices become several times slower.
"""

# threadpoolctl carries no types.
# pyright: reportMissingTypeStubs=false

from __future__ import annotations

from collections.abc import Generator
from contextlib import contextmanager
from typing import Any

import threadpoolctl

_limits: Any = threadpoolctl.threadpool_limits


@contextmanager
def one_blas_thread() -> Generator[None, None, None]:
    """Inside, or in a function that it decorates, every loaded BLAS has one thread."""
    with _limits(limits=1, user_api="blas"):
        yield
