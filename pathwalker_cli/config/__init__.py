"""Study configs: what they hold, how they are read, and how single values are overridden."""

from pathwalker_cli.config.files import config_content as config_content
from pathwalker_cli.config.files import find_config as find_config
from pathwalker_cli.config.files import load_config as load_config
from pathwalker_cli.config.files import patient_path as patient_path
from pathwalker_cli.config.files import place_of as place_of
from pathwalker_cli.config.files import read_config as read_config
from pathwalker_cli.config.schema import BoundsConfig as BoundsConfig
from pathwalker_cli.config.schema import MeshConfig as MeshConfig
from pathwalker_cli.config.schema import StartConfig as StartConfig
from pathwalker_cli.config.schema import StudyConfig as StudyConfig
from pathwalker_cli.config.values import smoke_version as smoke_version
from pathwalker_cli.config.values import with_values as with_values
