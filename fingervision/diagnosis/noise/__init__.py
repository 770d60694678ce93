"""Random noise of the measurement: noise model, estimation from replicates and spectra, whitening."""
