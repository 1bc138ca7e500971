"""The plant's node with its parameters."""

from pathlib import Path

from ament_index_python.packages import get_package_share_directory
from launch import LaunchDescription
from launch_ros.actions import Node


def generate_launch_description():
    config = Path(get_package_share_directory("seaplant_plant")) / "config" / "seaplant_plant.yaml"
    return LaunchDescription(
        [Node(package="seaplant_plant", executable="plant", parameters=[str(config)])]
    )
