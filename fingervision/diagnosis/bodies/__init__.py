"""Which body and which hinge: poses of a mechanism's bodies beside its drawing."""
