from glob import glob

from setuptools import setup

NAME = "seaplant_plant"

setup(
    name=NAME,
    version="@VERSION@",
    packages=[NAME],
    data_files=[
        ("share/ament_index/resource_index/packages", [f"resource/{NAME}"]),
        (f"share/{NAME}", ["package.xml"]),
        (f"share/{NAME}/config", glob("config/*.yaml")),
        (f"share/{NAME}/launch", glob("launch/*.py")),
    ],
    install_requires=["setuptools"],
    zip_safe=True,
    description="Plant model of a marine vehicle, written by Seaplant",
    entry_points={"console_scripts": [f"plant = {NAME}.node:main"]},
)
