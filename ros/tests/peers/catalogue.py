"""All scenarios: importing a module registers those that are in it."""

import citizen
import faults
import performers
import planning
import reasoning
from scenarios import QUICK, SCENARIOS, Setting

MODULES = (citizen, faults, performers, planning, reasoning)
__all__ = ["MODULES", "QUICK", "SCENARIOS", "Setting"]
