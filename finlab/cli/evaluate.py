"""`finlab eval ...`: every verb that measures methods against the analytic fin model."""

from tyro.extras import SubcommandApp

from finlab.cli import eval_allocation, eval_closed_loop, eval_report

verbs = SubcommandApp()

for verb in (
    eval_allocation.wrench,
    eval_allocation.seeds,
    eval_allocation.ablation,
    eval_allocation.temperature,
    eval_allocation.latency,
    eval_allocation.steadiness,
    eval_allocation.modes,
    eval_allocation.unreachable,
    eval_allocation.fuzz,
    eval_closed_loop.trajectory,
    eval_closed_loop.faults,
    eval_closed_loop.velocity,
    eval_report.training,
    eval_report.report,
):
    verbs.command(verb)
