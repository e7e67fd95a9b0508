"""The public interface (harness/api.py) under the name of the distribution: `import rivetbench`."""

from typing import TYPE_CHECKING

from harness import __dir__ as __dir__
from harness import __getattr__ as __getattr__
from problems import __version__ as __version__

if TYPE_CHECKING:
    from harness.api import *  # noqa: F403
