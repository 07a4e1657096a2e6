"""The list of all scenarios. Importing a scenario module registers its scenarios."""

import citizen
import controlling
import faults
import performers
import planning
import reasoning
from scenarios import QUICK, SCENARIOS, Setting

MODULES = (citizen, controlling, faults, performers, planning, reasoning)
__all__ = ["MODULES", "QUICK", "SCENARIOS", "Setting"]
