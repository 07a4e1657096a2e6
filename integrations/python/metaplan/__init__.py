"""Task plans and robot architectures, adapted together, with proofs that they are optimal.

>>> import metaplan
>>> mission = metaplan.Mission.load("missions/ugv.toml").fail("c_kinect")
>>> plan = mission.plan(time_limit=60)
>>> plan.optimal
True
"""

from metaplan._answers import Answer, Comparison, Front, LoopAnswer, Number, Plan, Step, Verdict, Verification
from metaplan._errors import Error, Message
from metaplan._mission import File, Loop, Mission, check, explain_code, reason, validate, verify
from metaplan._native import __version__

__all__ = [
    "Answer",
    "Comparison",
    "Error",
    "File",
    "Front",
    "Loop",
    "LoopAnswer",
    "Message",
    "Mission",
    "Number",
    "Plan",
    "Step",
    "Verdict",
    "Verification",
    "__version__",
    "check",
    "explain_code",
    "reason",
    "validate",
    "verify",
]
