"""The modules that serve the algorithm: checks of input, errors, files, and the compiler."""
