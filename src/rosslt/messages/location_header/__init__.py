"""Provenance as the paper's C++ library has it: conversion to and from `rosslt_msgs/LocationHeader`, for a bridge."""

from rosslt.messages.location_header.decoder import from_paper_header
from rosslt.messages.location_header.encoder import to_paper_header
from rosslt.messages.location_header.header import Location, LocationHeader, PaperIds

__all__ = ['Location', 'LocationHeader', 'PaperIds', 'from_paper_header', 'to_paper_header']
