"""tourgen: raw laser scans of rooms in, a virtual tour for the browser out."""

__version__ = "0.1.0"
