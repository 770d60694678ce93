"""Counts with their binomial intervals (Clopper & Pearson 1934)."""

from dataclasses import dataclass

from scipy.stats import beta


@dataclass(frozen=True, slots=True)
class Rate:
    """A count of successes out of a number of cases."""

    hits: int
    of: int

    @property
    def percent(self) -> float:
        """Rate in per cent; 0 if there are no cases."""
        return 100.0 * self.hits / self.of if self.of else 0.0

    def interval(self) -> tuple[float, float]:
        """Interval (95 %) of the rate in per cent."""
        if self.of == 0:
            return 0.0, 100.0
        low = 0.0 if self.hits == 0 else float(beta.ppf(0.025, self.hits, self.of - self.hits + 1))
        high = 1.0 if self.hits == self.of else float(beta.ppf(0.975, self.hits + 1, self.of - self.hits))
        return 100 * low, 100 * high

    def __str__(self) -> str:
        low, high = self.interval()
        return f"{self.percent:5.1f} % ({self.hits}/{self.of}; {low:.1f}-{high:.1f})"
