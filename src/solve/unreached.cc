// SPDX-License-Identifier: Apache-2.0
#define UNW_LOCAL_ONLY
#include <glog/logging.h>
#include <libunwind.h>

// Functions that linked libraries refer to but this program never calls: defining them here saves
// finding, loading and relocating their libraries at each start.

// Ceres refers to CHOLMOD, SuiteSparseQR and CXSparse for sparse solvers and to LAPACK for dense
// ones. This program only asks for Eigen's DENSE_QR (eliminated.cc) and EIGEN_SPARSE
// (ceres_problem.cc).
#define TRUETRIAD_UNREACHED(name)                              \
  extern "C" [[noreturn]] void name() {                        \
    LOG(FATAL) << #name                                        \
        " is not linked: choose another solver, or link with " \
        "-DTRUETRIAD_STATIC=OFF";                              \
    __builtin_unreachable();                                   \
  }

TRUETRIAD_UNREACHED(_Z13SuiteSparseQRIdElidlP21cholmod_sparse_structPS1_PPlP21cholmod_common_struct)
TRUETRIAD_UNREACHED(cholmod_amd)
TRUETRIAD_UNREACHED(cholmod_analyze)
TRUETRIAD_UNREACHED(cholmod_analyze_p)
TRUETRIAD_UNREACHED(cholmod_camd)
TRUETRIAD_UNREACHED(cholmod_factorize)
TRUETRIAD_UNREACHED(cholmod_finish)
TRUETRIAD_UNREACHED(cholmod_free_dense)
TRUETRIAD_UNREACHED(cholmod_free_factor)
TRUETRIAD_UNREACHED(cholmod_free_sparse)
TRUETRIAD_UNREACHED(cholmod_l_finish)
TRUETRIAD_UNREACHED(cholmod_l_free_sparse)
TRUETRIAD_UNREACHED(cholmod_l_start)
TRUETRIAD_UNREACHED(cholmod_print_common)
TRUETRIAD_UNREACHED(cholmod_solve)
TRUETRIAD_UNREACHED(cholmod_start)
TRUETRIAD_UNREACHED(cholmod_triplet_to_sparse)
TRUETRIAD_UNREACHED(cholmod_zeros)
TRUETRIAD_UNREACHED(cs_di_amd)
TRUETRIAD_UNREACHED(cs_di_calloc)
TRUETRIAD_UNREACHED(cs_di_chol)
TRUETRIAD_UNREACHED(cs_di_cholsol)
TRUETRIAD_UNREACHED(cs_di_compress)
TRUETRIAD_UNREACHED(cs_di_counts)
TRUETRIAD_UNREACHED(cs_di_cumsum)
TRUETRIAD_UNREACHED(cs_di_etree)
TRUETRIAD_UNREACHED(cs_di_free)
TRUETRIAD_UNREACHED(cs_di_ipvec)
TRUETRIAD_UNREACHED(cs_di_lsolve)
TRUETRIAD_UNREACHED(cs_di_ltsolve)
TRUETRIAD_UNREACHED(cs_di_malloc)
TRUETRIAD_UNREACHED(cs_di_multiply)
TRUETRIAD_UNREACHED(cs_di_nfree)
TRUETRIAD_UNREACHED(cs_di_pinv)
TRUETRIAD_UNREACHED(cs_di_post)
TRUETRIAD_UNREACHED(cs_di_pvec)
TRUETRIAD_UNREACHED(cs_di_schol)
TRUETRIAD_UNREACHED(cs_di_sfree)
TRUETRIAD_UNREACHED(cs_di_spfree)
TRUETRIAD_UNREACHED(cs_di_symperm)
TRUETRIAD_UNREACHED(cs_di_transpose)
TRUETRIAD_UNREACHED(dgeqrf_)
TRUETRIAD_UNREACHED(dormqr_)
TRUETRIAD_UNREACHED(dpotrf_)
TRUETRIAD_UNREACHED(dpotrs_)
TRUETRIAD_UNREACHED(dtrtrs_)

// If a CHECK fails, glog calls these functions for a stack trace. As they do nothing, no stack
// trace is printed.
#ifdef __x86_64__
extern "C" {
int unw_tdep_getcontext(unw_tdep_context_t* /*context*/) { return -1; }
int unw_init_local(unw_cursor_t* /*cursor*/, unw_context_t* /*context*/) { return -1; }
int unw_step(unw_cursor_t* /*cursor*/) { return -1; }
int unw_get_reg(unw_cursor_t* /*cursor*/, int /*number*/, unw_word_t* /*value*/) { return -1; }
}
#endif
