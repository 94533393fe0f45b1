"""The runs of a campaign by vector, and what is computed of them: means, contrasts, knees."""

from desim.report.campaign.numbers.estimates import Estimate, Estimates, Means
from desim.report.campaign.numbers.lines import Panel, PlotLine
from desim.report.campaign.numbers.study import TIMES, Axis, Study, VectorRuns

__all__ = ["TIMES", "Axis", "Estimate", "Estimates", "Means", "Panel", "PlotLine", "Study",
           "VectorRuns"]
