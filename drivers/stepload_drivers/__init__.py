"""Drivers that come with stepload; found through entry points, none is imported by it."""

import logging

logging.getLogger(__name__).addHandler(logging.NullHandler())
