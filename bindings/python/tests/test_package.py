"""The package as it is installed."""

from importlib import metadata, resources

import isograd


def test_the_version_is_that_of_the_crates():
    assert isograd.__version__ == metadata.version("isograd")


def test_types_are_part_of_the_package():
    assert resources.files(isograd).joinpath("py.typed").is_file()
