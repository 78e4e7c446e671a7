from stepload.calls import Identified as Identified
from stepload.calls import identify as identify
from stepload.calls import preflight as preflight
from stepload.calls import run as run
from stepload.data.catalog import catalog as catalog
from stepload.data.run import Run as Run
from stepload.data.run import open_run as open
from stepload.data.table import Table as Table
from stepload.plan.load import load_plan as load_plan

__version__: str
