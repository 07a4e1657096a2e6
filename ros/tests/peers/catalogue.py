"""All scenarios: importing a module registers those that are in it."""

import citizen
import faults
import performers
import planning
from scenarios import QUICK, SCENARIOS, Setting

MODULES = (citizen, faults, performers, planning)
__all__ = ["MODULES", "QUICK", "SCENARIOS", "Setting"]
