/* What bindgen reads: the SNES header brings in Vec, Mat, PC and KSP. */
#include <petscsnes.h>

/* In the library, but declared by a private header only. */
PETSC_EXTERN PetscErrorCode PetscObjectStateGet(PetscObject, PetscObjectState *);
