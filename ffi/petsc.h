/* What bindgen reads: the SNES header brings in Vec, Mat, PC and KSP. */
#include <petscsnes.h>
