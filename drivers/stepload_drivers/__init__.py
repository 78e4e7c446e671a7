"""Drivers that come with stepload; found through entry points, none is imported by it."""

import logging

import stepload as stepload  # says first which of their modules are compiled

logging.getLogger(__name__).addHandler(logging.NullHandler())
