"""The published site: what it says, its pages, and how it takes the place of the one before."""

from tourgen.site.built import BuiltRoom, Made
from tourgen.site.swap import is_site, restore_site, write_site

__all__ = ["BuiltRoom", "Made", "is_site", "restore_site", "write_site"]
