"""Random noise of the measurement: its model, its estimation from replicates and spectra, whitening."""
