/* Solve a x = b in place by Gaussian elimination with partial pivoting: a (n, n), b (n, m), which is replaced by x; returns
   0 if a is singular or not finite. Used for systems of a few unknowns inside a loop; larger systems are solved by NumPy. */
static int solve(double *a, int n, double *b, int m) {
    for (int k = 0; k < n; k++) {
        int pivot = k;
        for (int i = k + 1; i < n; i++)
            if (fabs(a[i * n + k]) > fabs(a[pivot * n + k])) pivot = i;
        if (!(fabs(a[pivot * n + k]) > 0.0) || !isfinite(a[pivot * n + k])) return 0;
        if (pivot != k) {
            for (int j = 0; j < n; j++) {
                double kept = a[k * n + j];
                a[k * n + j] = a[pivot * n + j];
                a[pivot * n + j] = kept;
            }
            for (int j = 0; j < m; j++) {
                double kept = b[k * m + j];
                b[k * m + j] = b[pivot * m + j];
                b[pivot * m + j] = kept;
            }
        }
        for (int i = k + 1; i < n; i++) {
            double factor = a[i * n + k] / a[k * n + k];
            for (int j = k + 1; j < n; j++) a[i * n + j] -= factor * a[k * n + j];
            for (int j = 0; j < m; j++) b[i * m + j] -= factor * b[k * m + j];
        }
    }
    for (int k = n - 1; k >= 0; k--)
        for (int j = 0; j < m; j++) {
            double total = b[k * m + j];
            for (int i = k + 1; i < n; i++) total -= a[k * n + i] * b[i * m + j];
            b[k * m + j] = total / a[k * n + k];
        }
    return 1;
}
