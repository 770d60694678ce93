"""The middle of a few values, found without putting the others in order (C. A. R. Hoare, CACM 4, 1961, 321)."""

import numpy as np
from numpy.typing import NDArray

from fingervision.domain.compiled import compiled


@compiled
def middle(values: NDArray[np.float64]) -> float:
    """The value with half of the others (of an even number, one more) below it; 0 of none."""
    a = values.copy()
    low, high, wanted = 0, a.size - 1, a.size // 2
    while low < high:
        pivot = a[(low + high) // 2]
        i, j = low, high
        while i <= j:
            while a[i] < pivot:
                i += 1
            while a[j] > pivot:
                j -= 1
            if i <= j:
                a[i], a[j] = a[j], a[i]
                i += 1
                j -= 1
        if wanted <= j:
            high = j
        elif wanted >= i:
            low = i
        else:
            break
    return float(a[wanted]) if a.size else 0.0
