"""What pyproject.toml cannot say: an editable install of a checkout puts one folder on the path,
`editable/`, which holds nothing but `thermospindle`.

Type checkers follow a path and no import hook, which is what setuptools makes of folders named one
by one. Where git has made no links (Windows without developer mode, the source package) it makes
that hook: all runs, and type checkers see the package from the checkout's own folder.
"""

from pathlib import Path

from setuptools import setup
from setuptools.command.editable_wheel import editable_wheel


class Editable(editable_wheel):
    def finalize_options(self) -> None:
        if Path("editable/thermospindle/model").is_dir():
            self.distribution.package_dir = {"": "editable"}
        super().finalize_options()


setup(cmdclass={"editable_wheel": Editable})
