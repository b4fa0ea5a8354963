"""System identification: ARX and output-error fits of G1 and G2, and their transfer functions."""
