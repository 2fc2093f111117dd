//! Command line (design: options with two dashes are ours, words with one dash go to PETSc).
