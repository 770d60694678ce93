"""User-defined gauges: named quantities that are measured in every frame; each kind is a module in `kinds`."""
