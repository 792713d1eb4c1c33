// Debian's Ceres 2.1 names solvers that cdprcal never asks for: CHOLMOD and CXSparse for sparse
// systems, LAPACK beside Eigen for dense ones. A pose is a dense block of six
// (estimation/minimise_ceres.cpp). What Ceres would call there is defined here, so that ATLAS,
// SuiteSparse and the Fortran runtime, 18 MB, are neither linked nor loaded.

#include <cstdlib>
#include <iostream>

namespace {

[[noreturn]] void refuse(const char* name) {
  std::cerr << "cdprcal: Ceres asked for " << name
            << ", of a solver that is left out (unused_solvers.cpp)\n";
  std::abort();
}

}  // namespace

// Hidden: a program that has these libraries keeps their functions.
#define CDPRCAL_UNUSED(name) \
  extern "C" [[noreturn, gnu::visibility("hidden")]] void name() { refuse(#name); }

CDPRCAL_UNUSED(cholmod_amd)
CDPRCAL_UNUSED(cholmod_analyze)
CDPRCAL_UNUSED(cholmod_analyze_p)
CDPRCAL_UNUSED(cholmod_camd)
CDPRCAL_UNUSED(cholmod_factorize)
CDPRCAL_UNUSED(cholmod_finish)
CDPRCAL_UNUSED(cholmod_free_dense)
CDPRCAL_UNUSED(cholmod_free_factor)
CDPRCAL_UNUSED(cholmod_free_sparse)
CDPRCAL_UNUSED(cholmod_print_common)
CDPRCAL_UNUSED(cholmod_solve)
CDPRCAL_UNUSED(cholmod_start)
CDPRCAL_UNUSED(cholmod_triplet_to_sparse)
CDPRCAL_UNUSED(cholmod_zeros)

CDPRCAL_UNUSED(cs_di_amd)
CDPRCAL_UNUSED(cs_di_calloc)
CDPRCAL_UNUSED(cs_di_chol)
CDPRCAL_UNUSED(cs_di_cholsol)
CDPRCAL_UNUSED(cs_di_compress)
CDPRCAL_UNUSED(cs_di_counts)
CDPRCAL_UNUSED(cs_di_cumsum)
CDPRCAL_UNUSED(cs_di_etree)
CDPRCAL_UNUSED(cs_di_free)
CDPRCAL_UNUSED(cs_di_ipvec)
CDPRCAL_UNUSED(cs_di_lsolve)
CDPRCAL_UNUSED(cs_di_ltsolve)
CDPRCAL_UNUSED(cs_di_malloc)
CDPRCAL_UNUSED(cs_di_multiply)
CDPRCAL_UNUSED(cs_di_nfree)
CDPRCAL_UNUSED(cs_di_pinv)
CDPRCAL_UNUSED(cs_di_post)
CDPRCAL_UNUSED(cs_di_pvec)
CDPRCAL_UNUSED(cs_di_schol)
CDPRCAL_UNUSED(cs_di_sfree)
CDPRCAL_UNUSED(cs_di_spfree)
CDPRCAL_UNUSED(cs_di_symperm)
CDPRCAL_UNUSED(cs_di_transpose)

CDPRCAL_UNUSED(dgeqrf_)
CDPRCAL_UNUSED(dormqr_)
CDPRCAL_UNUSED(dpotrf_)
CDPRCAL_UNUSED(dpotrs_)
CDPRCAL_UNUSED(dtrtrs_)

#undef CDPRCAL_UNUSED
