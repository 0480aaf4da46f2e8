"""The same examples at every run; ``HYPOTHESIS_PROFILE=long`` draws 25,000 new ones a test."""

import os

from hypothesis import settings

settings.register_profile("fixed", derandomize=True, deadline=None, max_examples=300)
settings.register_profile("long", deadline=None, max_examples=25_000)
settings.load_profile(os.environ.get("HYPOTHESIS_PROFILE", "fixed"))
