"""What was learned of an opaque function: its dependencies, as records that can become JSON."""

from dataclasses import asdict, dataclass
from typing import Any, Dict, Tuple

import numpy as np

Array = Any  # numpy.ndarray: NumPy 1.17 of Noetic has no types


@dataclass(frozen=True)
class Dependency:
    """One output depends on one input.

    Attributes:
        output: the number of the output
        input: the number of the input
        kind: `smooth` (it has a slope at the start), `kinked` (another slope on each side), `saturated` (at the start
            one side or both do not move it), `stepped` (quantized), `discontinuous` (it jumps), `coupled` (it moves
            only if other inputs are changed, too), `unsettled` (the trials did not suffice to tell)
        slope: output per input at the start; NaN unless it is smooth or coupled
        uncertainty: of the slope, as a standard deviation or the bend over the step, whichever is larger
        left: the slope towards smaller inputs if that was tried, else NaN; 0 if nothing moves
        right: the same towards larger inputs
        low: to this change of the input (negative or 0) first order holds within the tolerance
        high: up to this change it does
    """

    output: int
    input: int
    kind: str
    slope: float
    uncertainty: float
    left: float
    right: float
    low: float
    high: float


@dataclass(frozen=True)
class Learned:
    """What was learned of a function.

    Attributes:
        dependencies: in order of outputs, then inputs
        noise: the standard deviation of each output at the start; NaN if there was no answer
        unrepeatable: outputs whose noise hides all changes, that drift, or had no answer; nothing is said of them
        unanswered: inputs that were changed alone, without an answer
        untried: inputs of which the trials did not suffice to say anything: neither dependent nor independent
        tolerance: relative error within which first order holds between `low` and `high`
        trials: how many were made
    """

    dependencies: Tuple[Dependency, ...]
    noise: Tuple[float, ...]
    unrepeatable: Tuple[int, ...]
    unanswered: Tuple[int, ...]
    untried: Tuple[int, ...]
    tolerance: float
    trials: int

    def slopes(self, inputs: int) -> Array:
        """The Jacobian.

        Args:
            inputs: how many the function has

        Returns:
            an array (outputs, inputs): 0 where there is no dependency, NaN where there is no slope
        """
        result = np.zeros((len(self.noise), inputs))
        for found in self.dependencies:
            result[found.output, found.input] = found.slope
        result[:, list(self.untried + self.unanswered)] = np.nan
        result[list(self.unrepeatable)] = np.nan
        return result

    def as_json(self) -> Dict[str, Any]:
        """Lists, dicts, texts and numbers alone, with None in place of NaN."""
        result = asdict(self)
        result['dependencies'] = [{k: _or_none(v) for k, v in found.items()} for found in result['dependencies']]
        return {k: [_or_none(v) for v in value] if isinstance(value, tuple) else value for k, value in result.items()}


def _or_none(value: Any) -> Any:
    return None if isinstance(value, float) and value != value else value
